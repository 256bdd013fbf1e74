//! What a job will cost, before it runs.

use serde::{Deserialize, Serialize};

use super::checked::{Completion, DepthFormat, Job, Physics, Work};
use crate::grasp::{EnergyKind, Sampler, WrenchSpace};

/// Counts are exact; bytes and seconds follow from the given rates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Objects, or the one robot.
    pub objects: u64,
    /// Views of each, or positions.
    pub views: u64,
    /// Samples, kept and rejected.
    pub samples: u64,
    /// Shards.
    pub shards: u64,
    /// Bytes on disk.
    pub bytes: f64,
    /// Wall-clock time [s]; infinite at a rate of 0.
    pub seconds: f64,
}

impl Estimate {
    /// From counts, bytes a stored sample and samples a second (over all threads).
    pub fn new(
        objects: usize,
        views: usize,
        shard_samples: u32,
        bytes_per_sample: f64,
        samples_per_second: f64,
    ) -> Self {
        let samples = objects as u64 * views as u64;
        Self {
            objects: objects as u64,
            views: views as u64,
            samples,
            shards: samples.div_ceil(u64::from(shard_samples.max(1))),
            bytes: samples as f64 * bytes_per_sample,
            seconds: if samples == 0 { 0.0 } else { samples as f64 / samples_per_second },
        }
    }
}

/// Processor time of one approach of a hand, or of taking hold once, measured on the YCB scans [s]. A pilot has no hands, so
/// that it stays short.
const SECONDS_AN_APPROACH: f64 = 0.025;
/// The same of preparing an object to be touched [s].
const SECONDS_AN_OBJECT: f64 = 0.4;
/// What an approach takes on disk, measured on the same: a pose and some eight joints in double precision, and three contacts.
const BYTES_AN_APPROACH: f64 = 330.0;

/// About how much processor time hands add to a sample [s]; 0 without touch by hands.
pub fn seconds_of_hands(job: &Job) -> f64 {
    let by_hand = job.completion().and_then(|job| job.settings.touch.by_hand.as_ref());
    let views = job.completion().map_or(1, |job| job.settings.views.len());
    by_hand.map_or(0.0, |touch| SECONDS_AN_APPROACH * f64::from(touch.approaches()) + SECONDS_AN_OBJECT / views as f64)
}

/// Processor time of a step of annealing [s]: with the contact energy, with a potential of forces, and of wrenches. A pilot
/// would take as long as a job.
const SECONDS_A_STEP: [f64; 3] = [8e-6, 12e-6, 90e-6];
/// The same of coming along an approach from afar [s], and of a pair of points.
const SECONDS_A_SAMPLED_APPROACH: f64 = 0.005;
const SECONDS_A_PAIR: f64 = 2e-4;
/// The same of closing and rating a state of the best list [s], and of preparing an object for its runs.
const SECONDS_A_GRASP: f64 = 0.004;
const SECONDS_A_GRASPED_OBJECT: f64 = 1.0;
/// What a grasp takes before compression: two poses, five lists of joints and some eight contacts in double precision.
const BYTES_A_GRASP: f64 = 900.0;

/// Share of the states of a best list that is kept: a guess, not measured; it varies tenfold between objects.
const KEPT_SHARE: f64 = 0.15;
/// Processor time of a trial, measured on kept grasps of nine scans: 90 ms where it holds, 40 where it fails [s].
const SECONDS_A_TRIAL: f64 = 0.08;
/// What a trial takes before compression, by counting numbers: the closed hand with its contacts, and a perturbed outcome.
const BYTES_A_TRIED_GRASP: f64 = 900.0;
const BYTES_A_PERTURBED_TRIAL: f64 = 210.0;

/// What searching for grasps costs, by constants that were measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraspCosts {
    /// Processor time of a run [s].
    pub run_seconds: f64,
    /// The same of preparing an object [s].
    pub object_seconds: f64,
    /// What a run takes before compression.
    pub run_bytes: f64,
    /// Of the run's time what its physical trials take [s]; 0 without them.
    pub trial_seconds: f64,
}

/// About what a job for grasps costs; `None` of any other.
pub fn grasp_costs(job: &Job) -> Option<GraspCosts> {
    let settings = &job.grasps()?.settings;
    let annealing = &settings.annealing;
    let [contact, force, wrench] = SECONDS_A_STEP;
    let step = match (annealing.energy, annealing.space) {
        (EnergyKind::Contact, _) => contact,
        (EnergyKind::ContactAndPotential, WrenchSpace::Force) => force,
        (EnergyKind::ContactAndPotential, WrenchSpace::Wrench) => wrench,
    };
    let step = match &settings.sampler {
        Sampler::Annealing => step,
        Sampler::Uniform(_) => SECONDS_A_SAMPLED_APPROACH,
        Sampler::Antipodal(_) => SECONDS_A_PAIR,
    };
    let best = f64::from(settings.best());
    let kept = KEPT_SHARE * best;
    let trial_seconds = settings.physics.map_or(0.0, |physics| SECONDS_A_TRIAL * kept * physics.trials());
    let of_trials = |physics: Physics| BYTES_A_TRIED_GRASP + BYTES_A_PERTURBED_TRIAL * f64::from(physics.perturbed);
    let trial_bytes = settings.physics.map_or(0.0, |physics| 400.0 + kept * of_trials(physics));
    let run_seconds = step * f64::from(settings.steps()) + SECONDS_A_GRASP * best + trial_seconds;
    Some(GraspCosts {
        run_seconds,
        object_seconds: SECONDS_A_GRASPED_OBJECT,
        run_bytes: 800.0 + BYTES_A_GRASP * best + trial_bytes,
        trial_seconds,
    })
}

/// About how many bytes a stored sample takes, its part of a field included. A guess for planning: when a job has run, its
/// own figure is better. `raw` is the size of a payload before compression, as a pilot measured it [bytes].
pub fn expected_bytes(job: &Job, raw: f64) -> f64 {
    match &job.work {
        Work::Completion(job) => bytes_of_pair(&job.settings),
        // Measured on the Fetch: the two copies of a pose share most joint values.
        Work::Reachability(job) => 0.5 * raw + 0.5 * f64::from(job.orientations()),
        // Numbers in double precision hardly shrink; names do.
        Work::Grasps(_) => 0.8 * raw,
        // Measured on the YCB scans: most pixels are background.
        Work::Patches(_) => 0.2 * raw,
    }
}

/// About how many bytes a stored sample takes with these channels: bit planes and records compress about 24-fold at a
/// resolution of 40 (measured on solids with one-sided views), numbers about 2-fold.
fn bytes_of_pair(completion: &Completion) -> f64 {
    let cells = f64::from(completion.resolution).powi(3);
    let channels = &completion.channels;
    let planes = 2.0 + f64::from(u8::from(channels.visibility));
    // An object at 1 m in the default camera covers about 100 x 100 pixels.
    let pixels = 10_000.0;
    let mut bytes = 300.0 + planes * cells / 8.0 / 24.0;
    bytes += match channels.depth {
        None => 0.0,
        Some(DepthFormat::F32) => pixels * 4.0 / 2.0,
        Some(DepthFormat::U16 { .. }) => pixels * 2.0 / 2.5,
    };
    bytes += if channels.cloud { pixels / 2.0 * 12.0 / 1.5 } else { 0.0 };
    bytes += if channels.tsdf.is_some() { cells * 2.0 / 6.0 } else { 0.0 };
    bytes += if channels.coverage { cells / 15.0 } else { 0.0 };
    bytes += channels
        .implicit
        .map_or(0.0, |points| (f64::from(points.surface) * 24.0 + f64::from(points.space) * 16.0) / 1.1);
    // Coordinates at random hardly shrink: of 40 rays about 24 touch something, 33 bytes each, 12 else.
    bytes += completion.touch.random_rays.map_or(0.0, |rays| 60.0 + 26.0 * f64::from(rays.count));
    let by_hand = completion.touch.by_hand.as_ref();
    bytes += by_hand.map_or(0.0, |touch| {
        let kinds = f64::from(u8::from(touch.exploration.is_some()) + u8::from(touch.grasp));
        100.0 * kinds + BYTES_AN_APPROACH * f64::from(touch.approaches())
    });
    bytes
}
