//! Splits of a job's objects: a function of the job and of the groups of twins, keyed by content.
//!
//! Every choice is made by a digest of (job seed, purpose, object id), never by a shuffle, so that adding, removing or
//! renaming a mesh changes the split of no other object with shares, and of at most one object at the border with exact
//! counts. Clusters (twins, and groups where the job splits by group) move as one; a cluster's key is the smallest key
//! of its members.

use std::collections::{BTreeMap, BTreeSet};

use crate::sections::{ObjectChoice, SplitInput, SplitSettings, SubsetSize};
use kernel::{
    ids::Digest,
    words::{ObjectSplit, Split, SplitTable},
};

/// Splits of a job's objects, with remarks and leaks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JobSplits {
    /// Splits of every object, as the dataset stores them.
    pub table: SplitTable,
    /// Wishes that could not be met, in words.
    pub notes: Vec<String>,
    /// Overlap between training and the other splits.
    pub leaks: LeakReport,
}

impl JobSplits {
    /// Splits the objects of a job with this seed. `twins` are groups of objects whose shapes coincide, as indices into the
    /// job's objects.
    pub fn new(job: &SplitInput<'_>, seed: u64, twins: &[Vec<usize>]) -> Self {
        let mut notes = Vec::new();
        let models = model_splits(job, seed, &clusters(job, twins), &mut notes);
        let subsets = training_subsets(job, seed, &models, &mut notes);
        let classes = view_classes(job);
        let rows = models.iter().zip(job.objects).enumerate().map(|(index, (models, object))| ObjectSplit {
            object: object.id(),
            split: *models,
            holdout_items: match models {
                Split::Training => holdout_views(seed, job.split, &object.id().0, &classes),
                _ => Vec::new(),
            },
            subset: subsets.iter().position(|subset| subset.contains(&index)).map(|subset| subset as u32),
        });
        let rows: Vec<ObjectSplit> = rows.collect();
        let leaks = leaks(job, twins, &rows);
        let training_subsets = subsets.iter().map(|subset| subset.len() as u32).collect();
        let table = SplitTable { training_subsets, objects: rows };
        Self { table: table.checked().expect("objects of a job differ in content"), notes, leaks }
    }
}

/// Leaks from the training side to the others, and the extent of the comparison.
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
    /// Object ids in more than one split.
    pub objects_straddling: u32,
    /// Geometries (regardless of the order of their triangles) in more than one split.
    pub geometries_straddling: u32,
    /// Groups of objects whose shapes coincide.
    pub twin_groups: u32,
    /// Groups of twins with members on more than one side.
    pub twin_groups_straddling: u32,
    /// Whether the job intends such twins.
    pub twins_intended: bool,
    /// Groups named by the job in more than one split.
    pub groups_straddling: u32,
}

impl LeakReport {
    /// Overlaps to report to the user, in words.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let leaks = [
            (self.straddling_views, "holdout views have the rotation of a training view of the same object"),
            (self.objects_straddling.into(), "objects are in more than one split"),
            (self.geometries_straddling.into(), "geometries are in more than one split"),
            (
                if self.twins_intended { 0 } else { self.twin_groups_straddling.into() },
                "groups of objects of the same shape are in more than one split",
            ),
        ];
        leaks.into_iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("leak: {count} {what}"))
    }

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

    /// Names of the counts of overlaps that the job intends.
    pub fn intended(&self) -> Option<&'static str> {
        self.twins_intended.then_some("twin_groups_straddling")
    }

    /// Whether nothing that a network trains on is also tested on (groups may straddle unless the job splits by them).
    pub fn is_clean(&self) -> bool {
        self.straddling_views == 0
            && self.objects_straddling == 0
            && self.geometries_straddling == 0
            && self.twin_groups_straddling == 0
    }
}

/// Searches for leaks, in time linear in objects times views; `rows` are in the order of the job's objects.
fn leaks(job: &SplitInput<'_>, twins: &[Vec<usize>], rows: &[ObjectSplit]) -> LeakReport {
    let first_equal = &job.first_equal;
    let distinct = (0..).zip(first_equal).filter(|(view, first)| *view == **first).count() as u32;
    let straddling = |keys: &mut dyn Iterator<Item = (Vec<u8>, usize)>| {
        let mut splits: BTreeMap<Vec<u8>, BTreeSet<Split>> = BTreeMap::new();
        for (key, index) in keys {
            splits.entry(key).or_default().insert(rows[index].split);
        }
        splits.values().filter(|splits| splits.len() > 1).count() as u32
    };
    let objects = || job.objects.iter().enumerate();
    LeakReport {
        views: job.items(),
        distinct_rotations: distinct,
        repeated_rotations: job.items() - distinct,
        straddling_views: rows.iter().map(|row| straddling_views(row, first_equal)).sum(),
        objects_straddling: straddling(&mut objects().map(|(index, object)| (object.id().0.0.to_vec(), index))),
        geometries_straddling: straddling(
            &mut objects().map(|(index, object)| (object.asset.geometry.0.to_vec(), index)),
        ),
        twin_groups: twins.len() as u32,
        twin_groups_straddling: straddling(
            &mut twins
                .iter()
                .enumerate()
                .flat_map(|(group, members)| members.iter().map(move |index| (group.to_be_bytes().to_vec(), *index))),
        ),
        twins_intended: job.split.twins_intended,
        groups_straddling: straddling(
            &mut objects().filter_map(|(index, object)| Some((object.source.group.clone()?.into_bytes(), index))),
        ),
    }
}

/// Held-out views of one object whose rotation is also that of a training view.
fn straddling_views(row: &ObjectSplit, first_equal: &[u32]) -> u64 {
    if row.split != Split::Training {
        return 0;
    }
    let mut trained = vec![false; first_equal.len()];
    let held_out = |view: u32| row.split_of(view) == Split::Holdout;
    for (view, first) in (0..).zip(first_equal) {
        trained[*first as usize] |= !held_out(view);
    }
    (0..).zip(first_equal).filter(|(view, first)| held_out(*view) && trained[**first as usize]).count() as u64
}

/// A number that depends on nothing but the seed, the purpose and the subject.
fn key(seed: u64, purpose: &str, subject: &[u8]) -> Digest {
    Digest::hash_parts([b"split".as_slice(), &seed.to_le_bytes(), purpose.as_bytes(), subject])
}

/// The key as a number in [0, 1).
fn unit(key: &Digest) -> f64 {
    let [a, b, c, d, e, f, g, h, ..] = key.0;
    (u64::from_be_bytes([a, b, c, d, e, f, g, h]) >> 11) as f64 / (1u64 << 53) as f64
}

/// Objects that move as one, as lists of indices; every object is in one of them.
fn clusters(job: &SplitInput<'_>, twins: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut parent: Vec<usize> = (0..job.objects.len()).collect();
    fn root(parent: &mut [usize], mut index: usize) -> usize {
        while parent[index] != index {
            parent[index] = parent[parent[index]];
            index = parent[index];
        }
        index
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
        for (index, object) in job.objects.iter().enumerate() {
            if let Some(group) = &object.source.group {
                join(*first_of.entry(group).or_insert(index), index);
            }
        }
    }
    let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for index in 0..job.objects.len() {
        members.entry(root(&mut parent, index)).or_default().push(index);
    }
    members.into_values().collect()
}

fn model_splits(job: &SplitInput<'_>, seed: u64, clusters: &[Vec<usize>], notes: &mut Vec<String>) -> Vec<Split> {
    let mut splits = vec![Split::Training; job.objects.len()];
    let test = chosen(job, seed, clusters, &job.split.test_objects, "test", notes);
    let rest: Vec<Vec<usize>> = clusters.iter().filter(|cluster| !test.contains(&cluster[0])).cloned().collect();
    // The share is one of all models, so it is larger among the remaining ones. If the test models are a share as well,
    // the requested share counts rather than the resulting one: otherwise one more test model would move validation
    // models.
    let choice = match (&job.split.validation_objects, &job.split.test_objects) {
        (ObjectChoice::Share(share), ObjectChoice::Share(tested)) => ObjectChoice::Share(share / (1.0 - tested)),
        (ObjectChoice::Share(share), _) => {
            ObjectChoice::Share(share * splits.len() as f64 / (splits.len() - test.len()) as f64)
        }
        (other, _) => other.clone(),
    };
    let validation = chosen(job, seed, &rest, &choice, "validation", notes);
    test.iter().for_each(|index| splits[*index] = Split::Test);
    validation.iter().for_each(|index| splits[*index] = Split::Validation);
    if !splits.is_empty() && !splits.contains(&Split::Training) {
        notes.push(format!(
            "no object is left for training: validation and test take all {}; give more objects, or lower \
             split.test_objects and split.validation_objects",
            splits.len()
        ));
    }
    splits
}

/// The members of the clusters that a choice takes.
fn chosen(
    job: &SplitInput<'_>,
    seed: u64,
    clusters: &[Vec<usize>],
    choice: &ObjectChoice,
    purpose: &str,
    notes: &mut Vec<String>,
) -> BTreeSet<usize> {
    let object_key = |index: &usize| match &job.objects[*index].source.group {
        Some(group) if job.split.by_group => key(seed, purpose, group.as_bytes()),
        _ => key(seed, purpose, &job.objects[*index].id().0.0),
    };
    let mut ranked: Vec<(f64, Digest, &Vec<usize>)> = clusters
        .iter()
        .filter_map(|members| {
            let min = members.iter().map(object_key).min()?;
            Some((cluster_unit(&min, members.len()), min, members))
        })
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let taken: Vec<&Vec<usize>> = match choice {
        ObjectChoice::Share(share) => {
            let below = ranked.iter().filter(|(number, ..)| number < share).count();
            // A requested share is never empty where there are enough objects to choose from.
            let count = if below == 0 && *share > 0.0 && ranked.len() >= 3 { 1 } else { below };
            ranked.iter().take(count).map(|(.., members)| *members).collect()
        }
        ObjectChoice::Count(count) => take_exactly(&ranked, *count as usize, purpose, notes),
        ObjectChoice::Named(names) => {
            let named = |index: &usize| names.contains(&job.objects[*index].source.name);
            ranked.iter().map(|(.., members)| *members).filter(|members| members.iter().any(named)).collect()
        }
    };
    let taken: BTreeSet<usize> = taken.into_iter().flatten().copied().collect();
    if let ObjectChoice::Named(names) = choice
        && taken.len() > names.len()
    {
        notes.push(format!("{} {purpose} objects: {} by name and their twins or groups", taken.len(), names.len()));
    }
    taken
}

/// The cluster's key as a number in [0, 1), uniform although the key is the smallest of `members`: if u is the smallest
/// of n uniform numbers, 1 - (1 - u)^n is uniform.
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
        let objects: usize = ranked.iter().map(|(.., members)| members.len()).sum();
        let why = match objects < count {
            true => format!("no more than {objects} can be chosen"),
            false => "twins and groups move as one".to_owned(),
        };
        notes.push(format!("{} {purpose} objects instead of {count}: {why}", count - left));
    }
    taken
}

fn training_subsets(job: &SplitInput<'_>, seed: u64, models: &[Split], notes: &mut Vec<String>) -> Vec<Vec<usize>> {
    let mut ranked: Vec<(Digest, usize)> = (0..models.len())
        .filter(|index| models[*index] == Split::Training)
        .map(|index| (key(seed, "subset", &job.objects[index].id().0.0), index))
        .collect();
    ranked.sort();
    let sizes = job.split.training_subsets.iter().map(|size| match size {
        SubsetSize::Count(count) => *count as usize,
        SubsetSize::Share(share) => (share * ranked.len() as f64).round() as usize,
    });
    sizes
        .map(|size| {
            if size > ranked.len() {
                notes.push(format!("a training subset of {size} models: only {} are for training", ranked.len()));
            }
            let mut subset: Vec<usize> = ranked.iter().take(size).map(|(_, index)| *index).collect();
            subset.sort_unstable();
            subset
        })
        .collect()
}

/// For each view, the lowest view that must stay on its side.
fn view_classes(job: &SplitInput<'_>) -> Vec<u32> {
    if job.split.keep_equal_views_together { job.first_equal.clone() } else { (0..job.items()).collect() }
}

/// Views of one object to hold out: exactly the requested share, rounded, in the order of the views' keys.
fn holdout_views(seed: u64, split: &SplitSettings, object: &Digest, classes: &[u32]) -> Vec<u32> {
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
    let mut left = (split.holdout_items * classes.len() as f64).round() as usize;
    let mut held_out = Vec::with_capacity(left);
    for (_, views) in ranked {
        if views.len() <= left {
            left -= views.len();
            held_out.extend(views);
        }
    }
    held_out.sort_unstable();
    held_out
}
