//! The checked job: nothing optional that means "default", all reading and hashing done.

use std::{any::Any, sync::Arc};

use crate::{
    sections::{JobObject, Profile, SplitInput},
    work::Work,
};
use assets::MeshRefusal;
use format::Product;

/// A job, ready to be planned. The plan is a pure function of it.
#[derive(Clone, Debug)]
pub struct Job {
    /// Name, for people; not part of any digest.
    pub name: String,
    /// Profile that supplied the defaults; for readers, since the work contains every switch.
    pub profile: Profile,
    /// Overrides by `--set`, as given.
    pub overrides: Vec<String>,
    /// Seed of every random stream.
    pub seed: u64,
    /// Notes for the user: an optional source that is not there, ...
    pub notes: Vec<String>,
    /// Samples per shard, at most; a shard is a run of consecutive sample indices.
    pub shard_samples: u32,
    /// Settings and subjects of the product.
    pub work: Arc<dyn Work>,
}

impl Job {
    /// Product of its samples.
    pub fn product(&self) -> Product {
        self.work.product()
    }

    /// The work as that of one product; `None` for another product.
    pub fn work_of<W: Work>(&self) -> Option<&W> {
        let work: &dyn Any = self.work.as_ref();
        work.downcast_ref()
    }

    /// The objects that are read; none for a job about a robot or about the objects of another dataset.
    pub fn objects(&self) -> &[JobObject] {
        self.work.objects().map_or(&[], |objects| &objects.list)
    }

    /// Meshes that cannot be used; the run continues without them and ends with exit code 3.
    pub fn refused(&self) -> &[MeshRefusal] {
        self.work.objects().map_or(&[], |objects| &objects.refused)
    }

    /// The objects to be split; `None` for a job about a robot, and when another dataset has split them.
    pub fn divided(&self) -> Option<SplitInput<'_>> {
        self.work.divided()
    }
}
