//! Producers: from a view of a subject to records. They never call each other and never write.

pub mod completion;
pub mod grasp;
mod objects;
pub mod patches;
pub mod reachability;

pub use objects::{check_hand, inside_test};

use crate::{
    assets::{DescriptionError, MeshRefusal},
    geom::SimdLevel,
    ids::{ObjectId, SampleId, ViewId},
    job::{CompletionJob, GraspJob, Job, PatchJob, ReachabilityJob, Renderer, Work},
    record::{Channel, SampleFacts},
};
use completion::CompletionWorker;
use grasp::{GraspHand, GraspWorker};
use patches::{MeshReader, PatchHand, PatchWorker};
use reachability::{PoseLabeller, ReachabilityWorker};

/// What became of a sample; a reject is data, not an error.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// The sample is in the producer's payloads.
    Kept(SampleFacts),
    /// The sample is left out, and counted.
    Rejected {
        /// Why, as a name that is counted.
        reason: &'static str,
        /// Why, with numbers, for people.
        detail: String,
        /// What was known by then.
        facts: SampleFacts,
    },
}

/// One thread's producer; its memory is reused from sample to sample.
pub trait Producer {
    /// What is stored of every kept sample, in order.
    fn channels(&self) -> Vec<Channel>;

    /// Turns to a subject of the job; one that it has turned to already stays loaded.
    ///
    /// # Errors
    /// When the subject is gone or another one than when the job was resolved.
    fn load(&mut self, subject: usize) -> Result<(), ProduceError>;

    /// Makes one view of the loaded subject; what is kept stands in [`Producer::payloads`] until the next call.
    ///
    /// # Errors
    /// When a tool that it needs fails.
    ///
    /// # Panics
    /// When no subject is loaded.
    fn produce(&mut self, view: ViewId) -> Result<(SampleId, Outcome), ProduceError>;

    /// The payloads of the last sample, in the order of the channels; none when it was rejected.
    fn payloads(&self) -> Vec<(Channel, &[u8])>;
}

/// What the producers of all threads share.
pub enum Workshop<'j> {
    /// Of a completion job.
    Completion {
        /// The job.
        job: &'j CompletionJob,
        /// Its seed.
        seed: u64,
        /// Vector instructions.
        level: SimdLevel,
    },
    /// Of a reachability job.
    Reachability {
        /// The job.
        job: &'j ReachabilityJob,
        /// Made once, used by all.
        labeller: Box<PoseLabeller>,
    },
    /// Of a job for grasps.
    Grasps {
        /// The job.
        job: &'j GraspJob,
        /// Its seed.
        seed: u64,
        /// Read once, used by all.
        hand: Box<GraspHand>,
        /// Vector instructions.
        level: SimdLevel,
    },
    /// Of a job for patches.
    Patches {
        /// The job.
        job: &'j PatchJob,
        /// Its seed.
        seed: u64,
        /// Read once, used by all.
        hand: Box<PatchHand>,
        /// Reads the objects' meshes.
        meshes: Box<MeshReader<'j>>,
        /// Vector instructions.
        level: SimdLevel,
    },
}

impl<'j> Workshop<'j> {
    /// Prepares what the producers of a job for patches share; `meshes` reads those of its objects.
    ///
    /// # Errors
    /// When the job's hand is gone, another one, or lacks a fingertip, or colours are asked for and cannot be drawn.
    pub fn of_patches(
        job: &'j PatchJob,
        seed: u64,
        meshes: Box<MeshReader<'j>>,
        level: SimdLevel,
    ) -> Result<Self, ProduceError> {
        if job.settings.colour.is_some() {
            patches::check_colours()?;
        }
        Ok(Self::Patches { job, seed, hand: Box::new(PatchHand::open(job)?), meshes, level })
    }

    /// Prepares what the producers of any other job share.
    ///
    /// # Panics
    /// Of a job for patches.
    ///
    /// # Errors
    /// When the job's robot or hand is gone, another one than when the job was resolved, or cannot be worked with.
    pub fn new(job: &'j Job, level: SimdLevel) -> Result<Self, ProduceError> {
        Ok(match &job.work {
            Work::Completion(work) => {
                work.settings.touch.by_hand.as_ref().map_or(Ok(()), |touch| check_hand(&touch.hand))?;
                Self::Completion { job: work, seed: job.seed, level }
            }
            Work::Grasps(work) => {
                Self::Grasps { job: work, seed: job.seed, hand: Box::new(GraspHand::open(&work.hand)?), level }
            }
            Work::Patches(_) => panic!("a job for patches needs meshes: Workshop::of_patches"),
            Work::Reachability(work) => {
                Self::Reachability { job: work, labeller: Box::new(PoseLabeller::new(work, job.seed, level)?) }
            }
        })
    }

    /// A producer for one thread.
    ///
    /// # Errors
    /// When the job's renderer is not available, or its hand cannot be read.
    pub fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        Ok(match self {
            Self::Completion { job, seed, level } => Box::new(CompletionWorker::new(job, *seed, *level)?),
            Self::Grasps { job, seed, hand, level } => Box::new(GraspWorker::new(job, *seed, hand, *level)?),
            Self::Patches { job, seed, hand, meshes, level } => {
                Box::new(PatchWorker::new(job, *seed, hand, meshes.as_ref(), *level))
            }
            Self::Reachability { job, labeller } => Box::new(ReachabilityWorker::new(job, labeller)),
        })
    }
}

/// Why a sample could not be made at all; the run stops.
#[derive(Debug, thiserror::Error)]
pub enum ProduceError {
    /// A mesh that was fine when the job was resolved can't be prepared any more.
    #[error("{0}; it could be used when this run began: put it back and run again")]
    MeshGone(#[from] MeshRefusal),
    /// A mesh is another one than when the job was resolved.
    #[error(
        "{name}: changed while the run went on: object {found:?}, expected {expected:?}; put it back, or run into a new folder"
    )]
    MeshChanged {
        /// Its name in the job.
        name: String,
        /// Content now.
        found: ObjectId,
        /// Content when the job was resolved.
        expected: ObjectId,
    },
    /// The job's renderer is not available.
    #[error("renderer {renderer:?}: {why}")]
    NoRenderer {
        /// Which.
        renderer: Renderer,
        /// Why not, and the remedy.
        why: String,
    },
    /// A robot's description that was there when the job was resolved can't be read any more.
    #[error("{0}; it was there when this run began: put it back and run again")]
    RobotGone(#[from] DescriptionError),
    /// A robot is another one than when the job was resolved.
    #[error(
        "{name}: changed while the run went on: content {found:?}, expected {expected:?}; put it back, or run into a new folder"
    )]
    RobotChanged {
        /// Its description.
        name: String,
        /// Content now.
        found: ObjectId,
        /// Content when the job was resolved.
        expected: ObjectId,
    },
    /// A hand's description or table that was there when the job was resolved can't be read any more.
    #[error("{source}; it was there when this run began: put it back and run again")]
    HandGone {
        /// Which file, and why not.
        source: DescriptionError,
    },
    /// A hand is another one than when the job was resolved.
    #[error(
        "{name}: changed while the run went on: content {found:?}, expected {expected:?}; put it back, or run into a new folder"
    )]
    HandChanged {
        /// Its description.
        name: String,
        /// Content now.
        found: ObjectId,
        /// Content when the job was resolved.
        expected: ObjectId,
    },
    /// The hand cannot touch as the job says.
    #[error("{name}: {why}")]
    NoTouch {
        /// The hand's description.
        name: String,
        /// Why not, and the remedy.
        why: String,
    },
    /// Grasps cannot be searched for as the job says.
    #[error("{name}: {why}")]
    NoGrasps {
        /// The hand's description, or the object.
        name: String,
        /// Why not, and the remedy.
        why: String,
    },
    /// Colours cannot be drawn here.
    #[error("colours cannot be drawn: {why}")]
    NoColour {
        /// Why not, and the remedy.
        why: String,
    },
    /// The robot cannot be worked with as the job says.
    #[error("{name}: {why}")]
    NoLabeller {
        /// The robot's description.
        name: String,
        /// Why not, and the remedy.
        why: String,
    },
}
