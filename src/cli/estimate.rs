//! `graspmill estimate`.

use serde::Serialize;

use super::{
    args::EstimateArgs,
    exit::{Exit, Failure},
    jobs::{self, run_failure},
    machine,
    printer::Printer,
    progress::duration_text,
};
use crate::{
    ids::Product,
    job::{Estimate, Job, Work, expected_bytes, grasp_costs, seconds_of_hands},
    run::{Crew, PilotRate, pilot},
};

/// Samples of the pilot run.
const PILOT_SAMPLES: u64 = 1000;
/// Share of a sample's time that writing it takes on top of making it, by the `write` benches.
const WRITING: f64 = 0.15;

/// What a job would make, for machines.
#[derive(Serialize)]
struct EstimateJson {
    job: String,
    #[serde(flatten)]
    estimate: Estimate,
    core_hours: f64,
    threads: usize,
    /// Of one thread, without hands.
    pilot: PilotRate,
    /// What hands are expected to add to a sample [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    hand_seconds_per_sample: Option<f64>,
    refused_meshes: usize,
    /// Of reachability: the most by which any rotation differs from the nearest orientation of the grid [rad].
    #[serde(skip_serializing_if = "Option::is_none")]
    covering_radius: Option<f64>,
}

/// Says what a job would make and how long it would take here, from a pilot of a thousand samples.
pub fn estimate(arguments: &EstimateArgs, printer: &Printer) -> Result<Exit, Failure> {
    let crew = Crew { threads: machine::threads(arguments.job.threads), level: machine::simd_level()? };
    let cancel = machine::cancel_on_signals()?;
    let open = jobs::open(&arguments.job, &crew, &cancel, &|_| {})?;
    let (job, plan) = (&open.job, &open.plan);
    let rate = match grasp_costs(job) {
        Some(costs) => PilotRate {
            samples: 0,
            seconds_per_subject: costs.object_seconds,
            seconds_per_sample: costs.run_seconds,
            raw_bytes_per_sample: costs.run_bytes,
        },
        None => pilot(&job.without_hands(), plan, PILOT_SAMPLES, crew.level, &cancel).map_err(run_failure)?,
    };
    let subjects = job.subjects() as f64;
    let of_hands = seconds_of_hands(job);
    let per_sample = rate.seconds_per_sample * (1.0 + WRITING) + of_hands;
    let core_seconds = plan.samples as f64 * per_sample + 2.0 * subjects * rate.seconds_per_subject;
    let wall = core_seconds / crew.threads as f64;
    let bytes = expected_bytes(job, rate.raw_bytes_per_sample);
    let rate_per_second = plan.samples as f64 / wall.max(f64::MIN_POSITIVE);
    // Subjects of some products have views of their own count.
    let estimate = Estimate {
        objects: job.subjects() as u64,
        views: u64::from(job.views()),
        ..Estimate::new(1, plan.samples as usize, job.shard_samples, bytes, rate_per_second)
    };
    if arguments.json {
        printer.json(&EstimateJson {
            job: open.digest.to_string(),
            estimate,
            core_hours: core_seconds / 3600.0,
            threads: crew.threads,
            pilot: rate,
            hand_seconds_per_sample: (of_hands > 0.0).then_some(of_hands),
            refused_meshes: job.refused().len(),
            covering_radius: job.reachability().map(|work| work.poses.covering().radius),
        })?;
    } else {
        let Estimate { shards, bytes, seconds, .. } = estimate;
        let (what, more) = in_words(job, &estimate);
        let of_hands = match of_hands > 0.0 {
            true => format!(" and {:.0} ms of hands, which the pilot leaves out", 1e3 * of_hands),
            false => String::new(),
        };
        printer.result(&format!(
            "{what} in {shards} shards\n\
             about {:.1} MB on disk\n\
             about {} on {} threads here ({:.3} core-hours; {:.3} ms a sample{of_hands}, {:.1} ms {}, {})\n\
             {more}job {}",
            bytes / 1e6,
            duration_text(std::time::Duration::from_secs_f64(seconds)),
            crew.threads,
            core_seconds / 3600.0,
            1e3 * rate.seconds_per_sample,
            1e3 * rate.seconds_per_subject,
            if job.product() == Product::Reachability { "the robot" } else { "an object" },
            if rate.samples > 0 { format!("over {} samples", rate.samples) } else { "by constants".to_owned() },
            open.digest
        ));
    }
    Ok(Exit::Complete)
}

/// What a job makes, and what else there is to say of it.
fn in_words(job: &Job, estimate: &Estimate) -> (String, String) {
    let Estimate { objects, views, samples, .. } = estimate;
    match &job.work {
        Work::Completion(_) => (
            format!("{objects} objects x {views} views = {samples} samples"),
            format!("{} meshes refused\n", job.refused().len()),
        ),
        Work::Grasps(_) => {
            let of_trials = grasp_costs(job).map_or(0.0, |costs| costs.trial_seconds);
            let of_trials = match of_trials > 0.0 {
                true => format!("{:.0} ms a run of physical trials among it\n", 1e3 * of_trials),
                false => String::new(),
            };
            (
                format!("{objects} objects x {views} seeds = {samples} runs"),
                format!("{of_trials}{} meshes refused\n", job.refused().len()),
            )
        }
        Work::Patches(work) => (
            format!("{samples} grasps of {objects} objects, of {} types", work.grasps.types.chosen.len()),
            format!("root of the grasps {}\n", work.grasps.root),
        ),
        Work::Reachability(work) => {
            let (poses, orientations) = (work.poses.cells(), work.orientations());
            let what = format!("{views} positions x {orientations} orientations = {poses} poses");
            (what, format!("{}\n", work.poses.covering()))
        }
    }
}
