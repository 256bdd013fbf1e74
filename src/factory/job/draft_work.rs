//! The checked keys of a product, before its meshes are read.

use std::{fmt, sync::Arc};

use super::{JobObjects, ObjectsDraft};
use crate::work::Work;

/// The checked keys of a product, before its meshes are read.
pub struct DraftWork {
    /// Samples per shard.
    pub shard_samples: u32,
    /// Whether the job draws with OpenGL.
    pub draws_colours: bool,
    /// Rules that every record of the job obeys, by name, for `verify`.
    pub rules: Vec<&'static str>,
    /// Notes for the user.
    pub notes: Vec<String>,
    /// The objects, for a product that has some.
    pub objects: Option<ObjectsDraft>,
    /// Whether something depends on the mass of each object.
    pub with_masses: bool,
    /// Whether each object must have a solid: a mesh of which no cell is inside is refused.
    pub with_solids: bool,
    /// Whether each object must hang together: a mesh in loose parts is refused unless the job joins them.
    pub of_one_body: bool,
    /// Makes the work of the prepared objects.
    pub make: MakeWork,
}

/// Makes the work of a job out of its prepared objects and the notes for the user, to which it may add. Objects are `None` for
/// a product without.
pub type MakeWork = Box<dyn FnOnce(Option<JobObjects>, &mut Vec<String>) -> Arc<dyn Work> + Send>;

impl DraftWork {
    /// Work that is complete: no mesh is to be read.
    pub fn ready(work: impl Work, shard_samples: u32) -> Self {
        Self {
            shard_samples,
            draws_colours: false,
            rules: Vec::new(),
            notes: Vec::new(),
            objects: None,
            with_masses: false,
            with_solids: false,
            of_one_body: false,
            make: Box::new(move |_, _| Arc::new(work)),
        }
    }

    /// Work about objects.
    pub fn of_objects<W: Work>(
        (objects, notes): (ObjectsDraft, Vec<String>),
        shard_samples: u32,
        make: impl FnOnce(JobObjects, &mut Vec<String>) -> W + Send + 'static,
    ) -> Self {
        let make = move |objects: Option<JobObjects>, notes: &mut Vec<String>| -> Arc<dyn Work> {
            Arc::new(make(objects.expect("a draft with objects resolves them"), notes))
        };
        let objects = Some(objects);
        Self {
            shard_samples,
            draws_colours: false,
            rules: Vec::new(),
            notes,
            objects,
            with_masses: false,
            with_solids: false,
            of_one_body: false,
            make: Box::new(make),
        }
    }
}

impl fmt::Debug for DraftWork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            shard_samples,
            draws_colours,
            rules,
            notes,
            objects,
            with_masses,
            with_solids,
            of_one_body,
            make: _,
        } = self;
        f.debug_struct("DraftWork")
            .field("shard_samples", shard_samples)
            .field("draws_colours", draws_colours)
            .field("rules", rules)
            .field("notes", notes)
            .field("objects", objects)
            .field("with_masses", with_masses)
            .field("with_solids", with_solids)
            .field("of_one_body", of_one_body)
            .finish_non_exhaustive()
    }
}

/// The multiple of the items per object that is nearest below 4,096, so that shards end where objects end; 4,096 when an
/// object has more items than that.
pub fn default_shard_samples(items: u32) -> u32 {
    const ABOUT: u32 = 4096;
    if items == 0 || items > ABOUT { ABOUT } else { ABOUT / items * items }
}
