//! From a job file on the command line to a job with its plan and its dataset's tables.

use std::{collections::BTreeMap, path::Path};

use super::{
    args::JobArgs,
    exit::{Exit, Failure},
    printer::Printer,
};
use crate::{
    assets,
    dataset::DatasetHeader,
    ids::JobDigest,
    job::{self, Job, JobDraft, JobErrors, JobSet, JobText, Surroundings},
    plan::{Plan, Sides},
    run::{self, Cancel, Crew, Listener, RunError, RunTask, prepare_assets},
    voxel::twins,
};

/// Where `make setup` puts packages of meshes, below the folder the program is started in.
const PACKAGES: &str = ".deps";

/// Intersection over union, after pose and scale are taken out, from which on two objects are twins.
const TWIN_LIKENESS: f64 = 0.85;

/// A job, ready to run.
pub struct OpenJob {
    pub job: Job,
    pub plan: Plan,
    pub digest: JobDigest,
    /// Of a job about objects.
    pub sides: Option<Sides>,
}

impl OpenJob {
    /// What the tables of its dataset in `folder` say beside the samples.
    pub fn header(&self, folder: &Path) -> DatasetHeader {
        run::dataset_header(&self.job, self.sides.as_ref(), folder)
    }

    /// Making its dataset in `folder`.
    pub fn task<'a>(&'a self, header: &'a DatasetHeader, folder: &'a Path) -> RunTask<'a> {
        RunTask { job: &self.job, plan: &self.plan, digest: self.digest, header, folder }
    }
}

/// Prints the JSON Schema of job files.
pub fn schema(printer: &Printer) -> Result<Exit, Failure> {
    printer.json(job::schema())?;
    Ok(Exit::Complete)
}

/// The text of a job file, or of a set.
pub fn text(arguments: &JobArgs) -> Result<JobText, Failure> {
    JobText::open(&arguments.job, &arguments.set)
        .map_err(|error| Failure::message(Exit::BadSpec, format!("{}: {error}", arguments.job.display())))
}

/// Reads a job of one dataset, looks at its meshes, makes the plan.
pub fn open_one(text: &JobText, crew: &Crew, cancel: &Cancel) -> Result<OpenJob, Failure> {
    if JobSet::is_one(text) {
        let told = format!("{}: a set of jobs; only `run` takes sets, give one of its jobs", text.label);
        return Err(Failure::message(Exit::BadSpec, told));
    }
    open_text(text, None, crew, cancel, &|_| {})
}

/// Looks at a job's meshes and makes its plan; `grasps` is the dataset that stands in for `grasps.dataset`.
pub fn open_text(
    text: &JobText,
    grasps: Option<&Path>,
    crew: &Crew,
    cancel: &Cancel,
    listener: &Listener,
) -> Result<OpenJob, Failure> {
    let draft = read(text, grasps)?;
    #[cfg(feature = "sim")]
    if draft.draws_colours() {
        super::machine::set_gl_environment()?;
    }
    let sources: Vec<_> = draft.sources().cloned().collect();
    let prepared = prepare_assets(&sources, crew, cancel, listener).map_err(run_failure)?;
    let mut shapes = BTreeMap::new();
    for (record, shape) in prepared.records.iter().zip(prepared.shapes) {
        if let (Ok(record), Some(shape)) = (record, shape) {
            shapes.entry(record.object).or_insert(shape);
        }
    }
    let job = draft.resolve(prepared.records).map_err(|errors| job_failure(&errors))?;
    let sides = job.divided().map(|divided| {
        // The shapes of the objects that made it into the job, in the job's order.
        let shapes: Vec<_> = divided.objects.iter().filter_map(|object| shapes.remove(&object.id())).collect();
        Sides::new(&divided, job.seed, &twins(&shapes, TWIN_LIKENESS))
    });
    Ok(OpenJob { digest: job.digest(), plan: Plan::new(&job), sides, job })
}

/// Reads and checks a job file without opening its meshes; `grasps` stands in for `grasps.dataset`.
pub fn read(text: &JobText, grasps: Option<&Path>) -> Result<JobDraft, Failure> {
    let surroundings = Surroundings {
        packages: PACKAGES.into(),
        built_in: assets::built_in_names(24).collect(),
        #[cfg(feature = "sim")]
        scenes: &scene_camera,
        #[cfg(not(feature = "sim"))]
        scenes: &job::no_scenes,
        #[cfg(feature = "sim")]
        robots: &super::robot_reader::faults,
        #[cfg(not(feature = "sim"))]
        robots: &job::no_robots,
        #[cfg(feature = "sim")]
        hands: &hand_fault,
        #[cfg(not(feature = "sim"))]
        hands: &job::no_hands,
        #[cfg(feature = "sim")]
        grasping_hands: &grasping_hand_fault,
        #[cfg(not(feature = "sim"))]
        grasping_hands: &job::no_hands,
        grasps: &super::grasps_reader::grasps,
    };
    let read = match grasps {
        Some(grasps) => JobDraft::read_with_grasps(text, grasps, &surroundings),
        None => JobDraft::read(text, &surroundings),
    };
    read.map_err(|errors| job_failure(&errors))
}

#[cfg(feature = "sim")]
fn scene_camera(camera: &job::SceneCamera) -> Result<crate::geom::Intrinsics, String> {
    crate::sim::scene_camera(&camera.scene, &camera.camera)
        .map(|(intrinsics, _)| intrinsics)
        .map_err(|error| error.to_string())
}

/// Whether the simulator takes the hand, and it can touch meshes.
#[cfg(feature = "sim")]
fn hand_fault(hand: &job::JobHand) -> Result<(), String> {
    let model = crate::sim::HandModel::open(&hand.scene).map_err(|error| error.to_string())?;
    model.check_solids().map_err(|error| error.to_string())
}

/// Whether the simulator takes the hand, and grasps can be searched for with it.
#[cfg(feature = "sim")]
fn grasping_hand_fault(hand: &job::JobHand) -> Result<(), String> {
    let model = crate::sim::HandModel::open(&hand.scene).map_err(|error| error.to_string())?;
    model.check_grasping().map_err(|error| error.to_string())
}

/// What is wrong with a job, for people.
pub fn job_failure(errors: &JobErrors) -> Failure {
    Failure::message(Exit::BadSpec, format!("\n{}", errors.render().trim_end()))
}

/// The exit code of a run that ended early.
pub fn run_failure(error: RunError) -> Failure {
    let exit = match &error {
        RunError::Interrupted => Exit::Interrupted,
        RunError::Dataset(error) if error.is_io() => Exit::InputOutput,
        RunError::Dataset(error) if error.is_foreign() => Exit::BadSpec,
        RunError::Dataset(_) | RunError::Produce(_) | RunError::Gap { .. } | RunError::Threads(_) => Exit::Failed,
    };
    Failure::new(exit, error)
}
