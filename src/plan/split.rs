//! Who trains and who tests: a function of the job and of the groups of twins, keyed by content.
//!
//! Every choice is made by a digest of (job seed, purpose, object id), never by a shuffle, so that adding, removing or
//! renaming a mesh leaves the other objects where they were: always when shares are asked for, and but for one object
//! at the border when exact counts are. Clusters (twins, and groups where the job splits by group) move as one; a
//! cluster's key is the least key of its members.

use std::collections::{BTreeMap, BTreeSet};

use crate::{
    ids::{Digest, ViewId},
    job::{Divided, ModelChoice, SplitSettings, SubsetSize},
};

/// The side of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ModelRole {
    /// Its training views train, its holdout views test.
    Training,
    /// All its views choose hyper-parameters and checkpoints.
    Validation,
    /// All its views test.
    Test,
}

/// The side of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SampleRole {
    /// A training view of a training model.
    TrainingView,
    /// A view of a training model that is kept from training.
    HoldoutView,
    /// Any view of a validation model.
    ValidationModel,
    /// Any view of a test model.
    TestModel,
}

impl SampleRole {
    /// All roles, in order.
    pub const ALL: [Self; 4] = [Self::TrainingView, Self::HoldoutView, Self::ValidationModel, Self::TestModel];

    /// The name used in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::TrainingView => "training_view",
            Self::HoldoutView => "holdout_view",
            Self::ValidationModel => "validation_model",
            Self::TestModel => "test_model",
        }
    }
}

/// The split of a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SplitTable {
    /// The side of each object, in the job's order.
    pub models: Vec<ModelRole>,
    /// Nested subsets of the training models (places in the job, ascending), smallest first.
    pub subsets: Vec<Vec<usize>>,
    /// What could not be done as asked, in words.
    pub notes: Vec<String>,
    views: u32,
    /// One bit a view of a training model: held out.
    holdout: Vec<Vec<u64>>,
}

/// Who trains and who tests, and what leaks between them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sides {
    /// The split.
    pub splits: SplitTable,
    /// What it leaks.
    pub leaks: LeakReport,
}

impl Sides {
    /// The sides of the objects of a job with this seed; `twins` as for [`SplitTable::new`].
    pub fn new(job: &Divided<'_>, seed: u64, twins: &[Vec<usize>]) -> Self {
        let splits = SplitTable::new(job, seed, twins);
        Self { leaks: splits.leaks(job, twins), splits }
    }
}

/// What leaks from the training side to the others, and what was compared.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct LeakReport {
    /// Views of each object.
    pub views: u32,
    /// Rotations among them that differ.
    pub distinct_rotations: u32,
    /// Views that repeat the rotation of an earlier view.
    pub repeated_rotations: u32,
    /// Holdout views, over all objects, whose rotation is also a training view of the same object.
    pub straddling_views: u64,
    /// Object ids that stand on more than one side.
    pub objects_straddling: u32,
    /// Geometries (whatever the order of their triangles) that stand on more than one side.
    pub geometries_straddling: u32,
    /// Groups of objects whose shapes coincide.
    pub twin_groups: u32,
    /// Those with members on more than one side.
    pub twin_groups_straddling: u32,
    /// Groups named by the job that stand on more than one side.
    pub groups_straddling: u32,
}

impl LeakReport {
    /// Every count by its name, for reports.
    pub fn counts(&self) -> [(&'static str, u64); 9] {
        [
            ("views", self.views.into()),
            ("distinct_rotations", self.distinct_rotations.into()),
            ("repeated_rotations", self.repeated_rotations.into()),
            ("straddling_views", self.straddling_views),
            ("objects_straddling", self.objects_straddling.into()),
            ("geometries_straddling", self.geometries_straddling.into()),
            ("twin_groups", self.twin_groups.into()),
            ("twin_groups_straddling", self.twin_groups_straddling.into()),
            ("groups_straddling", self.groups_straddling.into()),
        ]
    }

    /// Whether nothing that a network trains on is also tested on (groups may straddle unless the job splits by them).
    pub fn is_clean(&self) -> bool {
        self.straddling_views == 0
            && self.objects_straddling == 0
            && self.geometries_straddling == 0
            && self.twin_groups_straddling == 0
    }
}

impl SplitTable {
    /// The split of `job` with this seed; `twins` are groups of objects (places in the job) whose shapes coincide.
    pub fn new(job: &Divided<'_>, seed: u64, twins: &[Vec<usize>]) -> Self {
        let mut notes = Vec::new();
        let models = model_roles(job, seed, &clusters(job, twins), &mut notes);
        let subsets = training_subsets(job, seed, &models, &mut notes);
        let views = job.views();
        let classes = view_classes(job);
        let holdout = models.iter().zip(job.objects).map(|(role, object)| match role {
            ModelRole::Training => holdout_views(seed, job.split, &object.id().0, &classes),
            _ => Vec::new(),
        });
        Self { holdout: holdout.collect(), models, subsets, notes, views }
    }

    /// The side of a view of an object (its place in the job).
    pub fn role(&self, object: usize, view: ViewId) -> SampleRole {
        match self.models[object] {
            ModelRole::Training if self.is_held_out(object, view) => SampleRole::HoldoutView,
            ModelRole::Training => SampleRole::TrainingView,
            ModelRole::Validation => SampleRole::ValidationModel,
            ModelRole::Test => SampleRole::TestModel,
        }
    }

    fn is_held_out(&self, object: usize, view: ViewId) -> bool {
        let word = self.holdout[object].get(view.0 as usize / 64).copied().unwrap_or(0);
        word >> (view.0 % 64) & 1 != 0
    }

    /// Count of samples of each role, before any is rejected.
    pub fn counts(&self) -> BTreeMap<SampleRole, u64> {
        let mut counts: BTreeMap<_, _> = SampleRole::ALL.into_iter().map(|role| (role, 0)).collect();
        for (object, role) in self.models.iter().enumerate() {
            let held_out = self.holdout[object].iter().map(|word| u64::from(word.count_ones())).sum::<u64>();
            let views = u64::from(self.views);
            let (first, second) = match role {
                ModelRole::Training => ((SampleRole::TrainingView, views - held_out), held_out),
                ModelRole::Validation => ((SampleRole::ValidationModel, views), 0),
                ModelRole::Test => ((SampleRole::TestModel, views), 0),
            };
            *counts.entry(first.0).or_default() += first.1;
            *counts.entry(SampleRole::HoldoutView).or_default() += second;
        }
        counts
    }

    /// Count of objects on each side: training, validation, test.
    pub fn model_counts(&self) -> [usize; 3] {
        [ModelRole::Training, ModelRole::Validation, ModelRole::Test]
            .map(|role| self.models.iter().filter(|other| **other == role).count())
    }

    /// Looks for leaks, in time linear in objects times views.
    pub fn leaks(&self, job: &Divided<'_>, twins: &[Vec<usize>]) -> LeakReport {
        let first_equal = job.first_equal.clone();
        let distinct = first_equal.iter().enumerate().filter(|(view, first)| *view == **first as usize).count() as u32;
        let straddling = |keys: &mut dyn Iterator<Item = (Vec<u8>, usize)>| {
            let mut sides: BTreeMap<Vec<u8>, BTreeSet<ModelRole>> = BTreeMap::new();
            for (key, object) in keys {
                sides.entry(key).or_default().insert(self.models[object]);
            }
            sides.values().filter(|roles| roles.len() > 1).count() as u32
        };
        let objects = || job.objects.iter().enumerate();
        LeakReport {
            views: self.views,
            distinct_rotations: distinct,
            repeated_rotations: self.views - distinct,
            straddling_views: self.straddling_views(&first_equal),
            objects_straddling: straddling(&mut objects().map(|(place, object)| (object.id().0.0.to_vec(), place))),
            geometries_straddling: straddling(
                &mut objects().map(|(place, object)| (object.asset.geometry.0.to_vec(), place)),
            ),
            twin_groups: twins.len() as u32,
            twin_groups_straddling: straddling(
                &mut twins.iter().enumerate().flat_map(|(group, members)| {
                    members.iter().map(move |place| (group.to_be_bytes().to_vec(), *place))
                }),
            ),
            groups_straddling: straddling(
                &mut objects().filter_map(|(place, object)| Some((object.source.group.clone()?.into_bytes(), place))),
            ),
        }
    }

    fn straddling_views(&self, first_equal: &[u32]) -> u64 {
        let mut straddling = 0;
        let mut trained = vec![false; first_equal.len()];
        for object in (0..self.models.len()).filter(|object| self.models[*object] == ModelRole::Training) {
            trained.fill(false);
            let held_out = |view: usize| self.is_held_out(object, ViewId(view as u32));
            for (view, first) in first_equal.iter().enumerate() {
                trained[*first as usize] |= !held_out(view);
            }
            let leaks = |(view, first): (usize, &u32)| held_out(view) && trained[*first as usize];
            straddling += first_equal.iter().enumerate().filter(|pair| leaks(*pair)).count() as u64;
        }
        straddling
    }
}

/// A number that depends on nothing but the seed, the purpose and the subject.
fn key(seed: u64, purpose: &str, subject: &[u8]) -> Digest {
    Digest::of_parts([b"split".as_slice(), &seed.to_le_bytes(), purpose.as_bytes(), subject])
}

/// The key as a number in [0, 1).
fn unit(key: &Digest) -> f64 {
    let [a, b, c, d, e, f, g, h, ..] = key.0;
    (u64::from_be_bytes([a, b, c, d, e, f, g, h]) >> 11) as f64 / (1u64 << 53) as f64
}

/// Objects that move as one, as lists of places; every object stands in one of them.
fn clusters(job: &Divided<'_>, twins: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut parent: Vec<usize> = (0..job.objects.len()).collect();
    fn root(parent: &mut [usize], mut place: usize) -> usize {
        while parent[place] != place {
            parent[place] = parent[parent[place]];
            place = parent[place];
        }
        place
    }
    let mut join = |a: usize, b: usize| {
        let (a, b) = (root(&mut parent, a), root(&mut parent, b));
        parent[a.max(b)] = a.min(b);
    };
    if job.split.keep_twins_together {
        twins.iter().for_each(|members| members.windows(2).for_each(|pair| join(pair[0], pair[1])));
    }
    if job.split.by_group {
        let mut first_of: BTreeMap<&str, usize> = BTreeMap::new();
        for (place, object) in job.objects.iter().enumerate() {
            if let Some(group) = &object.source.group {
                join(*first_of.entry(group).or_insert(place), place);
            }
        }
    }
    let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for place in 0..job.objects.len() {
        members.entry(root(&mut parent, place)).or_default().push(place);
    }
    members.into_values().collect()
}

fn model_roles(job: &Divided<'_>, seed: u64, clusters: &[Vec<usize>], notes: &mut Vec<String>) -> Vec<ModelRole> {
    let mut roles = vec![ModelRole::Training; job.objects.len()];
    let test = chosen(job, seed, clusters, &job.split.test_models, "test", notes);
    let rest: Vec<Vec<usize>> = clusters.iter().filter(|cluster| !test.contains(&cluster[0])).cloned().collect();
    // The share is of all models, so among those that are left it is larger. Where the test models are a share as well
    // it is the asked share that counts, not what came of it: else one more test model would move validation models.
    let choice = match (&job.split.validation_models, &job.split.test_models) {
        (ModelChoice::Share(share), ModelChoice::Share(tested)) => ModelChoice::Share(share / (1.0 - tested)),
        (ModelChoice::Share(share), _) => {
            ModelChoice::Share(share * roles.len() as f64 / (roles.len() - test.len()) as f64)
        }
        (other, _) => other.clone(),
    };
    let validation = chosen(job, seed, &rest, &choice, "validation", notes);
    test.iter().for_each(|place| roles[*place] = ModelRole::Test);
    validation.iter().for_each(|place| roles[*place] = ModelRole::Validation);
    roles
}

/// The members of the clusters that a choice takes.
fn chosen(
    job: &Divided<'_>,
    seed: u64,
    clusters: &[Vec<usize>],
    choice: &ModelChoice,
    purpose: &str,
    notes: &mut Vec<String>,
) -> BTreeSet<usize> {
    let object_key = |place: &usize| match &job.objects[*place].source.group {
        Some(group) if job.split.by_group => key(seed, purpose, group.as_bytes()),
        _ => key(seed, purpose, &job.objects[*place].id().0.0),
    };
    let mut ranked: Vec<(f64, Digest, &Vec<usize>)> = clusters
        .iter()
        .filter_map(|members| {
            let least = members.iter().map(object_key).min()?;
            Some((cluster_unit(&least, members.len()), least, members))
        })
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let taken: Vec<&Vec<usize>> = match choice {
        ModelChoice::Share(share) => {
            let below = ranked.iter().filter(|(number, ..)| number < share).count();
            // A share that is asked for is never empty where there is enough to choose from.
            let count = if below == 0 && *share > 0.0 && ranked.len() >= 3 { 1 } else { below };
            ranked.iter().take(count).map(|(.., members)| *members).collect()
        }
        ModelChoice::Count(count) => take_exactly(&ranked, *count as usize, purpose, notes),
        ModelChoice::Named(names) => {
            let named = |place: &usize| names.contains(&job.objects[*place].source.name);
            ranked.iter().map(|(.., members)| *members).filter(|members| members.iter().any(named)).collect()
        }
    };
    let taken: BTreeSet<usize> = taken.into_iter().flatten().copied().collect();
    if let ModelChoice::Named(names) = choice
        && taken.len() > names.len()
    {
        notes.push(format!("{} {purpose} models: {} by name and their twins or groups", taken.len(), names.len()));
    }
    taken
}

/// The cluster's key as a number in [0, 1), uniform although the key is the least of `members`: if u is the least of n
/// uniform numbers, 1 - (1 - u)^n is uniform.
fn cluster_unit(key: &Digest, members: usize) -> f64 {
    1.0 - (0..members).fold(1.0, |product, _| product * (1.0 - unit(key)))
}

/// Clusters in the order of their keys, leaving out those that would overshoot.
fn take_exactly<'a>(
    ranked: &[(f64, Digest, &'a Vec<usize>)],
    count: usize,
    purpose: &str,
    notes: &mut Vec<String>,
) -> Vec<&'a Vec<usize>> {
    let mut left = count;
    let mut taken = Vec::new();
    for (.., members) in ranked {
        if members.len() <= left {
            left -= members.len();
            taken.push(*members);
        }
    }
    if left > 0 {
        notes.push(format!("{} {purpose} models instead of {count}: twins and groups move as one", count - left));
    }
    taken
}

fn training_subsets(job: &Divided<'_>, seed: u64, models: &[ModelRole], notes: &mut Vec<String>) -> Vec<Vec<usize>> {
    let mut ranked: Vec<(Digest, usize)> = (0..models.len())
        .filter(|place| models[*place] == ModelRole::Training)
        .map(|place| (key(seed, "subset", &job.objects[place].id().0.0), place))
        .collect();
    ranked.sort();
    let sizes = job.split.training_subsets.iter().map(|size| match size {
        SubsetSize::Models(count) => *count as usize,
        SubsetSize::Share(share) => (share * ranked.len() as f64).round() as usize,
    });
    sizes
        .map(|size| {
            if size > ranked.len() {
                notes.push(format!("a training subset of {size} models: only {} train", ranked.len()));
            }
            let mut subset: Vec<usize> = ranked.iter().take(size).map(|(_, place)| *place).collect();
            subset.sort_unstable();
            subset
        })
        .collect()
}

/// For each view, the lowest view that must stay on its side.
fn view_classes(job: &Divided<'_>) -> Vec<u32> {
    if job.split.keep_equal_views_together { job.first_equal.clone() } else { (0..job.views()).collect() }
}

/// Which views of one object are held out: exactly the asked share, rounded, in the order of the views' keys.
fn holdout_views(seed: u64, split: &SplitSettings, object: &Digest, classes: &[u32]) -> Vec<u64> {
    let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (view, class) in classes.iter().enumerate() {
        members.entry(*class).or_default().push(view as u32);
    }
    let mut ranked: Vec<(Digest, &Vec<u32>)> = members
        .iter()
        .map(|(class, views)| {
            let mut subject = [0; 36];
            subject[..32].copy_from_slice(&object.0);
            subject[32..].copy_from_slice(&class.to_be_bytes());
            (key(seed, "views", &subject), views)
        })
        .collect();
    ranked.sort_unstable();
    let mut left = (split.holdout_views * classes.len() as f64).round() as usize;
    let mut bits = vec![0u64; classes.len().div_ceil(64)];
    for (_, views) in ranked {
        if views.len() <= left {
            left -= views.len();
            views.iter().for_each(|view| bits[*view as usize / 64] |= 1 << (view % 64));
        }
    }
    bits
}
