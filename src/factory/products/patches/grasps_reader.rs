//! Reads the grasps of a finished dataset for a job for patches.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use super::settings::{ChosenGrasp, FoundGrasps, GraspTable, GraspTrialEnd, GraspedObject};
use crate::products::input::{InvalidInput, open_input};
use format::{
    Channel, Grasp, GraspLabel, GraspLadder, GraspLadders, GraspRun, GraspTrials, LadderLabel, LadderLevel, Product,
    WRENCH,
    dataset::{DatasetError, DatasetReader, Sample, Selection},
    extras::InvalidResting,
};
use kernel::{
    geom::RestingPose,
    ids::ObjectId,
    words::{GraspTypeCounts, GraspVerdict, NumberClass, Show, Split},
};
use robot::grasp::kind_in_frame;

/// Reason why patches cannot be made from a folder.
#[derive(Debug, thiserror::Error)]
pub enum InvalidGrasps {
    /// The folder holds no finished dataset of grasps.
    #[error(transparent)]
    Input(#[from] InvalidInput),
    /// The dataset cannot be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// Labels are to be those of trials, and the dataset has none.
    #[error("{} has no trials, which the labels require; make it with [physics]", .0.shown())]
    NoTrials(PathBuf),
    /// A row of the dataset's table of assets has resting poses that make no sense.
    #[error(transparent)]
    Resting(#[from] InvalidResting),
    /// The dataset's table of assets names no hand.
    #[error("{} names no hand", .0.shown())]
    NoHand(PathBuf),
}

/// Choice of the grasps of a dataset that become samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WantedGrasps {
    /// Number of grasp types: the most common ones.
    pub max_types: u32,
    /// Whether they are the grasps that were tried, of the most common types among the ones that held, instead of the
    /// kept ones.
    pub by_trials: bool,
    /// Whether the object rests on a table, against whose normal the roll in a type is then measured.
    pub on_table: bool,
}

/// The grasps of the most common types in a dataset; two passes over its runs, one chunk at a time.
///
/// # Errors
/// When the folder holds no finished dataset of grasps of a known hand, or none with trials where they are required.
pub fn read_grasps(folder: &Path, wanted: WantedGrasps) -> Result<FoundGrasps, InvalidGrasps> {
    let (reader, root) = open_input(folder, Product::GRASPS, NumberClass::Exact)?;
    let channels = reader.manifest().channels();
    let trials = match wanted.by_trials {
        true if ![Channel::GRASP_TRIALS, Channel::GRASP_LADDERS].iter().any(|by| channels.contains(by)) => {
            return Err(no_trials(folder));
        }
        true => Some(*reader.manifest().classes.get(&NumberClass::Physics).ok_or_else(|| no_trials(folder))?),
        false => None,
    };
    let tables = if wanted.on_table { resting_poses(&reader)? } else { BTreeMap::new() };
    let TypeCensus { counts, good, without, space } = TypeCensus::of(&reader, &tables, wanted)?;
    let chosen = GraspTypeCounts::choose(good, without, wanted.max_types).chosen;
    let types = GraspTypeCounts { counts, without, chosen };
    let objects = objects(&reader, &types, &tables, wanted)?;
    let assets = reader.assets()?;
    let hand = assets.hands.first().ok_or_else(|| InvalidGrasps::NoHand(folder.to_owned()))?.object;
    let training_subsets = reader.splits().training_subsets.clone();
    Ok(FoundGrasps { root, trials, hand, space, types, objects, training_subsets })
}

/// Grasps that may become samples, counted by type.
#[derive(Default)]
struct TypeCensus {
    /// All of them.
    counts: BTreeMap<u32, u64>,
    /// Grasps whose types are chosen from: kept, or with trials held, and for an object on a table those that a table
    /// allows.
    good: BTreeMap<u32, u64>,
    /// Number of grasps without a type.
    without: u64,
    /// The requested space of epsilon.
    space: String,
}

impl TypeCensus {
    fn of(reader: &DatasetReader, tables: &Tables, wanted: WantedGrasps) -> Result<Self, DatasetError> {
        let mut census = Self { space: WRENCH.to_owned(), ..Self::default() };
        for (number, sample) in reader.iter(Selection::default()).enumerate() {
            let run = CandidateRun::of(&sample?, wanted.by_trials)?;
            for (_, grasp, trial) in run.candidates() {
                let table = table_of(grasp, run.run.sample.subject, tables);
                let Some(kind) = kind_of(grasp, table) else {
                    census.without += 1;
                    continue;
                };
                *census.counts.entry(kind).or_default() += 1;
                let stands = table.is_some() || !wanted.on_table;
                if stands && trial.is_none_or(|trial| trial.outcome == GraspLabel::Held) {
                    *census.good.entry(kind).or_default() += 1;
                }
            }
            if number == 0 {
                census.space = run.run.method.space;
            }
        }
        Ok(census)
    }
}

/// A run, with its trials where labels are those of trials.
struct CandidateRun {
    run: GraspRun,
    trials: Option<Vec<(u32, GraspTrialEnd)>>,
}

impl CandidateRun {
    fn of(sample: &Sample, by_trials: bool) -> Result<Self, DatasetError> {
        // A dataset with a root of physics has trials for every run; without them nothing of the run was tried.
        let trials = if by_trials { Some(ends_of(sample)?) } else { None };
        Ok(Self { run: sample.read::<GraspRun>()?, trials })
    }

    /// The states that can become samples, with their ranks and trials: the kept ones, or all that were tried.
    fn candidates(&self) -> Box<dyn Iterator<Item = (u32, &Grasp, Option<GraspTrialEnd>)> + '_> {
        let ranked = (0..).zip(&self.run.grasps);
        match &self.trials {
            None => Box::new(
                ranked
                    .filter(|(_, grasp)| grasp.verdict == GraspVerdict::Kept)
                    .map(|(rank, grasp)| (rank, grasp, None)),
            ),
            Some(trials) => Box::new(
                trials.iter().filter_map(|(rank, end)| Some((*rank, self.run.grasps.get(*rank as usize)?, Some(*end)))),
            ),
        }
    }
}

/// Outcomes of the tried states of a run by rank, by either method of labels.
fn ends_of(sample: &Sample) -> Result<Vec<(u32, GraspTrialEnd)>, DatasetError> {
    if let Some(stored) = sample.find::<GraspTrials>()? {
        let end = |outcome, trial| GraspTrialEnd { outcome, trial };
        return Ok(stored.trials.iter().map(|each| (each.grasp, end(each.label(), each.outcome.verdict))).collect());
    }
    let stored = sample.find::<GraspLadders>()?.map_or_else(Vec::new, |stored| stored.ladders);
    Ok(stored.iter().filter_map(|ladder| Some((ladder.grasp, end_of_ladder(ladder)?))).collect())
}

/// The outcome of a graded state, with the end of its trial at the level `nominal`. A state that holds at some level only is
/// `borderline`; a blocked one, of which no trial was made, has no outcome.
fn end_of_ladder(ladder: &GraspLadder) -> Option<GraspTrialEnd> {
    let outcome = match ladder.label() {
        LadderLabel::Untested => GraspLabel::Untested,
        LadderLabel::Held => GraspLabel::Held,
        LadderLabel::Partial => GraspLabel::Borderline,
        LadderLabel::Failed => GraspLabel::Failed,
        LadderLabel::Blocked => return None,
    };
    let trial = ladder.level(LadderLevel::Nominal)?.trial()?.outcome.verdict;
    Some(GraspTrialEnd { outcome, trial })
}

/// Resting poses by object; none without a table.
type Tables = BTreeMap<ObjectId, Vec<RestingPose>>;

fn resting_poses(reader: &DatasetReader) -> Result<Tables, InvalidGrasps> {
    let rows = reader.assets()?.objects.into_iter();
    rows.map(|row| Ok((row.object, row.resting()?.unwrap_or_default().poses))).collect()
}

fn table_of(grasp: &Grasp, object: ObjectId, tables: &Tables) -> Option<GraspTable> {
    let pose = grasp.likeliest_table()?;
    let resting = tables.get(&object)?.get(pose)?;
    Some(GraspTable { pose: pose as u32, world_from_object: resting.world_from_object })
}

/// Type of a grasp, its roll against the camera over the table where there is one.
fn kind_of(grasp: &Grasp, table: Option<GraspTable>) -> Option<u32> {
    let over_table = |kind, table: GraspTable| {
        let world_from_approach = table.world_from_object * grasp.object_from_approach;
        kind_in_frame(kind, world_from_approach.rotation().matrix())
    };
    grasp.kind.map(|kind| table.map_or(kind, |table| over_table(kind, table)))
}

fn no_trials(folder: &Path) -> InvalidGrasps {
    InvalidGrasps::NoTrials(folder.to_owned())
}

fn objects(
    reader: &DatasetReader,
    types: &GraspTypeCounts,
    tables: &Tables,
    wanted: WantedGrasps,
) -> Result<Vec<GraspedObject>, DatasetError> {
    let mut chosen: BTreeMap<ObjectId, Vec<ChosenGrasp>> = BTreeMap::new();
    for sample in reader.iter(Selection::default()) {
        let run = CandidateRun::of(&sample?, wanted.by_trials)?;
        let sample = run.run.sample;
        let grasps = chosen.entry(sample.subject).or_default();
        for (rank, grasp, trial) in run.candidates() {
            let table = table_of(grasp, sample.subject, tables);
            if let Some(kind) = kind_of(grasp, table).filter(|kind| types.index_of(*kind).is_some()) {
                let epsilon = grasp.epsilon(&run.run.method);
                let mut chosen = of_grasp(grasp, [sample.item.0, rank, kind], epsilon);
                chosen.trial = trial;
                chosen.table = table;
                grasps.push(chosen);
            }
        }
    }
    let mut objects: Vec<GraspedObject> = Vec::new();
    for row in reader.assets()?.objects {
        let split = reader.splits().object(&row.object);
        let mut grasps = chosen.remove(&row.object).unwrap_or_default();
        grasps.sort_by_key(|grasp| (grasp.run, grasp.rank));
        objects.push(GraspedObject {
            id: row.object,
            split: split.map_or(Split::Training, |split| split.split),
            holdout_runs: split.map_or_else(BTreeSet::new, |split| split.holdout_items.iter().copied().collect()),
            subset: split.and_then(|split| split.subset),
            asset: row.whole(),
            name: row.name,
            grasps,
        });
    }
    objects.sort_by_key(|object| object.id);
    Ok(objects)
}

fn of_grasp(grasp: &Grasp, [run, rank, kind]: [u32; 3], epsilon: f64) -> ChosenGrasp {
    ChosenGrasp {
        run,
        rank,
        kind,
        object_from_approach: grasp.object_from_approach,
        object_from_base: grasp.object_from_base,
        joints: grasp.joints.clone(),
        energy: grasp.energy,
        epsilon,
        verdict: grasp.verdict,
        trial: None,
        table: None,
    }
}
