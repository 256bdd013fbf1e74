//! A job for amodal pairs as the factory runs it.

use std::path::Path;

use super::{
    meshes::LoadedObjects,
    settings::AmodalJob,
    worker::{AmodalWorker, Shared},
};
use crate::{
    ProduceError,
    objects::check_hand,
    plan::{JobSplits, SubjectItems},
    products::viewed::{ViewedScene, open_views},
    sections::shards_section,
    work::{OpenWork, Opening, Producer, Work, WorkTables},
};
use format::{Channel, Product};
use kernel::words::NumberClass;
use sim::sim_facts;

impl Work for AmodalJob {
    fn product(&self) -> Product {
        Product::AMODAL
    }

    fn subjects(&self) -> Vec<SubjectItems> {
        let items = |scene: &ViewedScene| SubjectItems {
            id: scene.id,
            items: scene.cameras.len() as u32,
            samples_per_item: scene.bodies,
        };
        self.views.scenes.iter().map(items).collect()
    }

    fn resolved(&self, folder: &Path, shard_samples: u32) -> toml::Table {
        let mut keys = self.keys(Some(folder));
        keys.extend([shards_section("samples", shard_samples)]);
        keys
    }

    fn sample_keys(&self) -> toml::Table {
        self.keys(None)
    }

    fn subject_keys(&self) -> toml::Table {
        self.views.subject_keys()
    }

    fn tables(&self, _: Option<&JobSplits>) -> WorkTables {
        let tables = self.views.tables();
        let Some(touch) = &self.settings.touch.by_hand else { return tables };
        WorkTables {
            channel_classes: [(Channel::AMODAL_TOUCH_EXPLORATION, NumberClass::Physics)].into(),
            platform: sim_facts().platform(None),
            hands: vec![touch.hand.row()],
            ..tables
        }
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        let Opening { seed, level, .. } = opening;
        if let Some(touch) = &self.settings.touch.by_hand {
            check_hand(&touch.hand)?;
        }
        let views = open_views(&self.dataset, &self.views)?;
        let objects = LoadedObjects::open(self)?;
        Ok(Box::new(OpenAmodal(Shared { job: self, seed, level, views, objects })))
    }

    fn remarks(&self) -> Vec<String> {
        let views: usize = self.views.scenes.iter().map(|scene| scene.cameras.len()).sum();
        vec![
            format!("bodies in {views} views of {} scenes", self.views.scenes.len()),
            format!("root of the views {}", self.views.root),
        ]
    }
}

/// A job for amodal pairs whose views are open.
struct OpenAmodal<'j>(Shared<'j>);

impl OpenWork for OpenAmodal<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        Ok(Box::new(AmodalWorker::new(&self.0)?))
    }
}
