//! The checked job: nothing optional that means "default", all reading and hashing done.

mod completion;
mod grasp;
mod objects;
mod patches;
mod reachability;

pub use completion::{
    Channels, Completion, CompletionJob, DepthFormat, Distance, Gate, ImplicitSamples, JobHand, JobObject, KnownMass,
    ModelChoice, PackageFile, Pivot, RandomRays, RayTarget, Renderer, SceneCamera, SplitSettings, SubsetSize, Touch,
    TouchByHand, Truth,
};
pub use grasp::{GraspJob, GraspSettings, Physics};
pub use objects::Divided;
pub use patches::{
    ChosenGrasp, FoundGrasps, GraspedObject, ObjectSide, PatchColours, PatchJob, PatchLabel, PatchSettings, TypeChoice,
};
pub use reachability::{Collisions, ReachabilityJob, Robot, Solver, WORLD};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    assets::MeshRefusal,
    ids::{ObjectId, Product},
};

/// A job, ready to be planned. The plan is a pure function of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// Name, for people; not part of any digest.
    pub name: String,
    /// Which defaults were taken; for people, since every switch stands below.
    pub profile: Profile,
    /// What `--set` changed, as given.
    pub overrides: Vec<String>,
    /// Seed of every random stream.
    pub seed: u64,
    /// Things to tell the user: an optional source that is not there, ...
    pub notes: Vec<String>,
    /// Samples a shard, at most; a shard is a run of consecutive sample indices.
    pub shard_samples: u32,
    /// What is made of what.
    pub work: Work,
}

/// What a job makes of what.
#[derive(Clone, Debug, PartialEq)]
pub enum Work {
    /// Pairs of grids, of objects.
    Completion(CompletionJob),
    /// A map of reachable poses, of a robot.
    Reachability(ReachabilityJob),
    /// Grasps of a hand, of objects.
    Grasps(GraspJob),
    /// Patches of images, of grasps.
    Patches(PatchJob),
}

/// A named set of defaults; every quirk is a switch of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// Good practice.
    Standard,
    /// Faithful to the thesis, quirks included.
    Thesis,
}

impl Job {
    /// What it makes.
    pub fn product(&self) -> Product {
        match self.work {
            Work::Completion(_) => Product::Completion,
            Work::Reachability(_) => Product::Reachability,
            Work::Grasps(_) => Product::Grasps,
            Work::Patches(_) => Product::Patches,
        }
    }

    /// The same job without touch by hands.
    pub fn without_hands(&self) -> Self {
        let mut job = self.clone();
        if let Work::Completion(work) = &mut job.work {
            work.settings.touch.by_hand = None;
        }
        job
    }

    /// Count of subjects: objects, or the one robot.
    pub fn subjects(&self) -> usize {
        match &self.work {
            Work::Reachability(_) => 1,
            Work::Patches(job) => job.grasps.objects.len(),
            _ => self.objects().len(),
        }
    }

    /// A subject by content.
    ///
    /// # Panics
    /// When there are not so many.
    pub fn subject(&self, place: usize) -> ObjectId {
        match &self.work {
            Work::Reachability(job) => job.robot.id,
            Work::Patches(job) => job.grasps.objects[place].id,
            _ => self.objects()[place].id(),
        }
    }

    /// The objects that are read; none of a job about a robot or about what another dataset holds.
    pub fn objects(&self) -> &[JobObject] {
        match &self.work {
            Work::Completion(job) => &job.objects,
            Work::Grasps(job) => &job.objects,
            Work::Reachability(_) | Work::Patches(_) => &[],
        }
    }

    /// The objects to be split; `None` of a job about a robot, and where another dataset has split them.
    pub fn divided(&self) -> Option<Divided<'_>> {
        match &self.work {
            Work::Completion(job) => Some(job.divided()),
            Work::Grasps(job) => Some(job.divided()),
            Work::Reachability(_) | Work::Patches(_) => None,
        }
    }

    /// Samples a subject, at most: views of an object, seeds of one, positions of a robot's grid, grasps of an object.
    pub fn views(&self) -> u32 {
        match &self.work {
            Work::Completion(job) => job.settings.views.len() as u32,
            Work::Reachability(job) => job.positions(),
            Work::Grasps(job) => job.settings.seeds,
            Work::Patches(_) => (0..self.subjects()).map(|subject| self.views_of(subject)).max().unwrap_or(0),
        }
    }

    /// Samples of one subject: it may have fewer than others.
    ///
    /// # Panics
    /// When there are not so many.
    pub fn views_of(&self, subject: usize) -> u32 {
        match &self.work {
            Work::Patches(job) => job.grasps.objects[subject].grasps.len() as u32,
            _ => self.views(),
        }
    }

    /// Meshes that cannot be used; the run goes on without them and ends with exit code 3.
    pub fn refused(&self) -> &[MeshRefusal] {
        match &self.work {
            Work::Completion(job) => &job.refused,
            Work::Grasps(job) => &job.refused,
            Work::Reachability(_) | Work::Patches(_) => &[],
        }
    }

    /// The completion job, where it is one.
    pub fn completion(&self) -> Option<&CompletionJob> {
        match &self.work {
            Work::Completion(job) => Some(job),
            _ => None,
        }
    }

    /// The reachability job, where it is one.
    pub fn reachability(&self) -> Option<&ReachabilityJob> {
        match &self.work {
            Work::Reachability(job) => Some(job),
            _ => None,
        }
    }

    /// The job for grasps, where it is one.
    pub fn grasps(&self) -> Option<&GraspJob> {
        match &self.work {
            Work::Grasps(job) => Some(job),
            _ => None,
        }
    }

    /// The job for patches, where it is one.
    pub fn patches(&self) -> Option<&PatchJob> {
        match &self.work {
            Work::Patches(job) => Some(job),
            _ => None,
        }
    }
}
