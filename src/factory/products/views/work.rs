//! A job for views as the factory runs it.

use std::path::Path;

use super::{
    loaded::LoadedMeshes,
    settings::ViewJob,
    worker::{Shared, ViewWorker},
};
use crate::{
    ProduceError, RunError,
    plan::{JobSplits, SubjectItems},
    products::{
        appearance::check_colours,
        settled::{by_content, cost_of_meshes, write_meshes},
    },
    sections::{JobObject, JobObjects, shards_section},
    work::{Closing, OpenWork, Opening, Producer, SideCost, Work, WorkTables},
};
use format::{Channel, Product};
use kernel::{
    files::Folder,
    ids::{Digest, JobDigest},
    words::NumberClass,
};
use sim::{gl_facts, sim_facts};

impl Work for ViewJob {
    fn product(&self) -> Product {
        Product::VIEWS
    }

    fn subjects(&self) -> Vec<SubjectItems> {
        let items = self.settings.views();
        self.scenes.list.iter().map(|scene| SubjectItems { id: scene.id, items, samples_per_item: 1 }).collect()
    }

    fn resolved(&self, folder: &Path, shard_samples: u32) -> toml::Table {
        let mut keys = self.keys(Some(folder));
        keys.extend([shards_section("samples", shard_samples)]);
        keys
    }

    fn sample_keys(&self) -> toml::Table {
        self.keys(None)
    }

    /// The scenes by name and content, with the splits: the root of the scenes does not depend on those.
    fn subject_keys(&self) -> toml::Table {
        self.scenes.subject_keys(|_| self.settings.views())
    }

    fn objects(&self) -> Option<&JobObjects> {
        Some(&self.objects)
    }

    fn tables(&self, _: Option<&JobSplits>) -> WorkTables {
        let tables = self.scenes.tables(|_| self.settings.views());
        match self.settings.colour {
            None => tables,
            Some(_) => WorkTables {
                channel_classes: [(Channel::VIEW_COLOUR, NumberClass::Colour)].into(),
                platform: sim_facts().platform(gl_facts().ok().as_ref()),
                ..tables
            },
        }
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        let Opening { seed, level, .. } = opening;
        if self.settings.colour.is_some() {
            check_colours()?;
        }
        let objects = self.scenes.indices_of(&self.objects)?;
        let meshes = LoadedMeshes::new(self.settings.colour.is_some());
        Ok(Box::new(OpenViews(Shared { job: self, seed, level, objects, meshes })))
    }

    fn remarks(&self) -> Vec<String> {
        vec![
            format!("{} views of each of {} scenes", self.settings.views(), self.scenes.list.len()),
            format!("root of the scenes {}", self.scenes.root),
        ]
    }
}

/// A job for views whose objects are known.
struct OpenViews<'j>(Shared<'j>);

impl OpenWork for OpenViews<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        Ok(Box::new(ViewWorker::new(&self.0)))
    }

    /// Cost of the meshes, by those of a few.
    fn side_cost(&self, _: &[usize], folder: &Folder) -> Result<SideCost, ProduceError> {
        let write = |few: &[&JobObject]| write_meshes(few, folder, &JobDigest(Digest([0; 32])), Product::VIEWS);
        cost_of_meshes(&self.0.job.objects, write)
    }

    /// Writes the meshes.
    fn finish(&self, closing: &mut Closing<'_>) -> Result<(), RunError> {
        if closing.cancel.is_cancelled() {
            return Err(RunError::Interrupted);
        }
        write_meshes(&by_content(&self.0.job.objects), closing.folder, &closing.job, Product::VIEWS)?;
        Ok(())
    }
}
