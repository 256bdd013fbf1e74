//! A job for grasps as the factory runs it.

use std::{collections::BTreeMap, path::Path};

use rayon::prelude::*;

use super::{
    hand::GraspHand,
    settings::{GraspJob, GraspSettings, Physics},
    shapes::{hand_shape, object_shape, trial_hand},
    worker::GraspWorker,
};
use crate::{
    ProduceError, RunError,
    job::{JobObject, JobObjects, SplitInput, shards_section},
    plan::{JobSplits, SubjectItems},
    work::{Closing, MeasuredCosts, OpenWork, Producer, Work, WorkCosts, WorkTables},
};
use format::{
    Channel, Product,
    products::grasps::{ShapesWriter, add_resting},
};
use kernel::{
    geom::{RestingPoses, SimdLevel},
    ids::{Digest, ObjectId},
    words::NumberClass,
};
use robot::grasp::{EnergyKind, Sampler, WrenchSpace};
use sim::sim_facts;

/// Processor time of a step of annealing [s]: with the contact energy, with a potential of forces, and of wrenches. A pilot
/// would take as long as a job.
const SECONDS_PER_STEP: [f64; 3] = [8e-6, 12e-6, 90e-6];
/// Processor time of an approach from afar by the uniform sampler [s].
const SECONDS_PER_APPROACH: f64 = 0.005;
/// Processor time of a pair of points by the antipodal sampler [s].
const SECONDS_PER_PAIR: f64 = 2e-4;
/// Processor time of closing and rating a state of the best list [s].
const SECONDS_PER_GRASP: f64 = 0.004;
/// Processor time of preparing an object for its runs [s].
const SECONDS_PER_OBJECT: f64 = 1.0;
/// Bytes of a grasp before compression: two poses, five lists of joints and some eight contacts in double precision.
const BYTES_PER_GRASP: f64 = 900.0;
/// Share of the states of a best list that is kept: a guess, not measured; it varies tenfold between objects.
const KEPT_SHARE: f64 = 0.15;
/// Processor time of a trial, measured on kept grasps of nine scans: 90 ms when the object is held, 40 when it falls [s].
const SECONDS_PER_TRIAL: f64 = 0.08;
/// Bytes of a tried grasp before compression: the closed hand with its contacts.
const BYTES_PER_TRIED_GRASP: f64 = 900.0;
/// Bytes of the outcome of a perturbed trial before compression.
const BYTES_PER_PERTURBED_TRIAL: f64 = 210.0;

impl Work for GraspJob {
    fn product(&self) -> Product {
        Product::GRASPS
    }

    fn subjects(&self) -> Vec<SubjectItems> {
        let items = self.settings.seeds;
        self.objects.ids().map(|id| SubjectItems { id, items, samples_per_item: 1 }).collect()
    }

    fn resolved(&self, folder: &Path, shard_samples: u32) -> toml::Table {
        let mut keys = self.keys(Some(folder));
        keys.extend(self.objects.resolved(folder));
        keys.extend([shards_section("runs", shard_samples)]);
        keys
    }

    fn sample_keys(&self) -> toml::Table {
        self.keys(None)
    }

    fn subject_keys(&self) -> toml::Table {
        self.objects.subject_keys()
    }

    fn objects(&self) -> Option<&JobObjects> {
        Some(&self.objects)
    }

    /// Every run starts elsewhere: no two are equal.
    fn divided(&self) -> Option<SplitInput<'_>> {
        Some(self.objects.divided((0..self.settings.seeds).collect()))
    }

    fn tables(&self, splits: Option<&JobSplits>) -> WorkTables {
        let tried = self.settings.physics.map(|_| (Channel::GRASP_TRIALS, NumberClass::Physics));
        WorkTables {
            class: NumberClass::Exact,
            channel_classes: tried.into_iter().collect(),
            platform: tried.map_or_else(BTreeMap::new, |_| sim_facts().platform(None)),
            assets: self.objects.rows(),
            hands: vec![self.hand.row()],
            splits: Some(splits.map(|splits| splits.table.clone()).unwrap_or_default()),
            warnings: self.objects.warnings().collect(),
        }
    }

    fn open(&self, seed: u64, level: SimdLevel) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        Ok(Box::new(OpenGrasps { job: self, hand: GraspHand::open(&self.hand)?, seed, level }))
    }

    fn costs(&self) -> WorkCosts {
        WorkCosts { measured: Some(costs(&self.settings)), left_out_seconds: 0.0 }
    }

    fn expected_bytes(&self, raw: f64) -> f64 {
        // Numbers in double precision hardly shrink; names do.
        0.8 * raw
    }

    fn remarks(&self) -> Vec<String> {
        let seconds = trial_seconds(&self.settings);
        let trials = (seconds > 0.0).then(|| format!("{:.0} ms per run for physical trials among it", 1e3 * seconds));
        [format!("{} runs per object", self.settings.seeds)].into_iter().chain(trials).collect()
    }
}

/// Processor time of the physical trials of a run [s]; 0 without them.
fn trial_seconds(settings: &GraspSettings) -> f64 {
    let kept = KEPT_SHARE * f64::from(settings.best());
    settings.physics.map_or(0.0, |physics| SECONDS_PER_TRIAL * kept * physics.trials())
}

/// Costs of a run, by constants that were measured.
fn costs(settings: &GraspSettings) -> MeasuredCosts {
    let annealing = &settings.annealing;
    let [contact, force, wrench] = SECONDS_PER_STEP;
    let step = match (&settings.sampler, annealing.energy, annealing.space) {
        (Sampler::Uniform(_), ..) => SECONDS_PER_APPROACH,
        (Sampler::Antipodal(_), ..) => SECONDS_PER_PAIR,
        (Sampler::Annealing, EnergyKind::Contact, _) => contact,
        (Sampler::Annealing, EnergyKind::ContactAndPotential, WrenchSpace::Force) => force,
        (Sampler::Annealing, EnergyKind::ContactAndPotential, WrenchSpace::Wrench) => wrench,
    };
    let best = f64::from(settings.best());
    let tried = |physics: Physics| BYTES_PER_TRIED_GRASP + BYTES_PER_PERTURBED_TRIAL * f64::from(physics.perturbed);
    let trial_bytes = settings.physics.map_or(0.0, |physics| 400.0 + KEPT_SHARE * best * tried(physics));
    MeasuredCosts {
        sample_seconds: step * f64::from(settings.steps()) + SECONDS_PER_GRASP * best + trial_seconds(settings),
        subject_seconds: SECONDS_PER_OBJECT,
        sample_bytes: 800.0 + BYTES_PER_GRASP * best + trial_bytes,
    }
}

/// A job for grasps whose hand is open.
struct OpenGrasps<'j> {
    job: &'j GraspJob,
    hand: GraspHand,
    seed: u64,
    level: SimdLevel,
}

impl OpenWork for OpenGrasps<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        Ok(Box::new(GraspWorker::new(self.job, self.seed, &self.hand, self.level)?))
    }

    /// Writes `shapes.mcap`, and the resting poses of every object into its row of the asset table.
    fn finish(&self, closing: &mut Closing<'_>) -> Result<(), RunError> {
        let resting = self.write_shapes(closing)?;
        for row in &mut closing.header.assets {
            let object = row["object"].as_str().and_then(Digest::from_hex).map(ObjectId);
            if let (Some(row), Some(poses)) = (row.as_object_mut(), object.and_then(|object| resting.get(&object))) {
                add_resting(row, poses);
            }
        }
        Ok(())
    }
}

impl OpenGrasps<'_> {
    /// Writes the shapes of the hand and of every object, a few meshes in memory at a time. Returns the resting poses of each
    /// object.
    fn write_shapes(&self, closing: &Closing<'_>) -> Result<BTreeMap<ObjectId, RestingPoses>, RunError> {
        let mut resting = BTreeMap::new();
        let mut objects: Vec<&JobObject> = self.job.objects.list.iter().collect();
        objects.sort_by_key(|object| object.id());
        let hand = hand_shape(&self.hand, self.job.hand.id);
        let mut writer = ShapesWriter::create(closing.folder, &closing.job, &hand)?;
        let pool = closing.parallelism.pool()?;
        for few in objects.chunks(closing.parallelism.threads.max(1)) {
            if closing.cancel.is_cancelled() {
                return Err(RunError::Interrupted);
            }
            let shapes: Vec<_> =
                pool.install(|| few.par_iter().map(|object| object_shape(object)).collect::<Result<_, _>>())?;
            for (shape, poses) in shapes {
                writer.object(&shape)?;
                resting.insert(shape.object, poses);
            }
        }
        writer.finish(trial_hand(self.job)?.as_ref())?;
        Ok(resting)
    }
}
