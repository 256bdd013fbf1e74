//! `graspmill estimate`.

use serde::Serialize;

use super::{
    args::EstimateArgs,
    exit::{Exit, Failure},
    jobs::{self, OpenJob, run_failure},
    machine,
    printer::Printer,
    progress::duration_text,
};
use crate::{
    cluster::TaskPlan,
    ids::Product,
    job::{Estimate, Job, Work, expected_bytes, grasp_costs, seconds_of_hands},
    run::{Cancel, Crew, PilotRate, pilot},
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
    /// How the work could be cut on a cluster.
    tasks: Vec<TaskSuggestion>,
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

/// Tasks of about half an hour.
#[derive(Serialize)]
struct TaskSuggestion {
    cpus: u16,
    tasks: u32,
    /// Of one task.
    minutes: f64,
}

/// What a job would make and cost.
pub struct Costs {
    /// Counts, bytes, time.
    pub estimate: Estimate,
    /// Processor time of all of it [s].
    pub core_seconds: f64,
    /// Processor time of reading its meshes and making them ready, which every task pays [s].
    pub opening_seconds: f64,
    rate: PilotRate,
    of_hands: f64,
}

/// Says what a job would make and how long it would take here, from a pilot of a thousand samples.
pub fn estimate(arguments: &EstimateArgs, printer: &Printer) -> Result<Exit, Failure> {
    let crew = Crew { threads: machine::threads(arguments.job.threads), level: machine::simd_level()? };
    let cancel = machine::cancel_on_signals()?;
    let text = jobs::text(&arguments.job)?;
    let open = jobs::open_one(&text, &crew, &cancel)?;
    let costs = costs(&open, &crew, &cancel)?;
    if arguments.json {
        printer.json(&report(&open, &crew, &costs))?;
    } else {
        printer.result(&words(&open, &crew, &costs));
    }
    Ok(Exit::Complete)
}

/// What a job costs on a crew's threads.
pub fn costs(open: &OpenJob, crew: &Crew, cancel: &Cancel) -> Result<Costs, Failure> {
    let OpenJob { job, plan, .. } = open;
    let rate = match grasp_costs(job) {
        Some(costs) => PilotRate {
            samples: 0,
            seconds_per_subject: costs.object_seconds,
            seconds_per_sample: costs.run_seconds,
            raw_bytes_per_sample: costs.run_bytes,
        },
        None => pilot(&job.without_hands(), plan, PILOT_SAMPLES, crew.level, cancel).map_err(run_failure)?,
    };
    let of_hands = seconds_of_hands(job);
    let per_sample = rate.seconds_per_sample * (1.0 + WRITING) + of_hands;
    let opening_seconds = job.subjects() as f64 * rate.seconds_per_subject;
    let core_seconds = plan.samples as f64 * per_sample + 2.0 * opening_seconds;
    let wall = core_seconds / crew.threads as f64;
    let bytes = expected_bytes(job, rate.raw_bytes_per_sample);
    let rate_per_second = plan.samples as f64 / wall.max(f64::MIN_POSITIVE);
    // Subjects of some products have views of their own count.
    let estimate = Estimate {
        objects: job.subjects() as u64,
        views: u64::from(job.views()),
        ..Estimate::new(1, plan.samples as usize, job.shard_samples, bytes, rate_per_second)
    };
    Ok(Costs { estimate, core_seconds, opening_seconds, rate, of_hands })
}

impl Costs {
    /// How the work is best cut into tasks of so many processors.
    pub fn tasks(&self, cpus: u16) -> TaskPlan {
        TaskPlan::suggested(self.core_seconds, cpus, self.estimate.shards as u32)
    }

    /// How long one of `tasks` takes [s].
    pub fn task_seconds(&self, plan: &TaskPlan, cpus: u16) -> f64 {
        // The largest share: shards do not divide evenly.
        let shards = f64::from(plan.shards.div_ceil(plan.tasks)) / f64::from(plan.shards.max(1));
        (self.core_seconds * shards + self.opening_seconds) / f64::from(cpus)
    }
}

fn report(open: &OpenJob, crew: &Crew, costs: &Costs) -> impl Serialize {
    let Costs { estimate, core_seconds, rate, of_hands, .. } = *costs;
    let job = &open.job;
    EstimateJson {
        job: open.digest.to_string(),
        estimate,
        core_hours: core_seconds / 3600.0,
        threads: crew.threads,
        tasks: suggestions(costs),
        pilot: rate,
        hand_seconds_per_sample: (of_hands > 0.0).then_some(of_hands),
        refused_meshes: job.refused().len(),
        covering_radius: job.reachability().map(|work| work.poses.covering().radius),
    }
}

/// Tasks of 1, 4 and 16 processors.
fn suggestions(costs: &Costs) -> Vec<TaskSuggestion> {
    let suggestion = |cpus: u16| {
        let plan = costs.tasks(cpus);
        TaskSuggestion { cpus, tasks: plan.tasks, minutes: costs.task_seconds(&plan, cpus) / 60.0 }
    };
    [1, 4, 16].map(suggestion).into()
}

fn words(open: &OpenJob, crew: &Crew, costs: &Costs) -> String {
    let (job, rate) = (&open.job, &costs.rate);
    let Estimate { shards, bytes, seconds, .. } = costs.estimate;
    let (what, more) = in_words(job, &costs.estimate);
    let of_hands = match costs.of_hands > 0.0 {
        true => format!(" and {:.0} ms of hands, which the pilot leaves out", 1e3 * costs.of_hands),
        false => String::new(),
    };
    let tasks = match costs.tasks(1).tasks {
        1 => "one task is enough".to_owned(),
        _ => {
            let words = |TaskSuggestion { cpus, tasks, minutes }| {
                let (tasks_of, processors) =
                    (if tasks == 1 { "task" } else { "tasks" }, if cpus == 1 { "" } else { "s" });
                format!("{tasks} {tasks_of} of {cpus} processor{processors} and {} min", minutes.ceil())
            };
            suggestions(costs).into_iter().map(words).collect::<Vec<_>>().join(", or ")
        }
    };
    format!(
        "{what} in {shards} shards\n\
         about {:.1} MB on disk\n\
         about {} on {} threads here ({:.3} core-hours; {:.3} ms a sample{of_hands}, {:.1} ms {}, {})\n\
         on a cluster {}\n\
         {more}job {}",
        bytes / 1e6,
        duration_text(std::time::Duration::from_secs_f64(seconds)),
        crew.threads,
        costs.core_seconds / 3600.0,
        1e3 * rate.seconds_per_sample,
        1e3 * rate.seconds_per_subject,
        if job.product() == Product::Reachability { "the robot" } else { "an object" },
        if rate.samples > 0 { format!("over {} samples", rate.samples) } else { "by constants".to_owned() },
        tasks,
        open.digest
    )
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
