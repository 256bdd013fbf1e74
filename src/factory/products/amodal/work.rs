//! A job for amodal pairs as the factory runs it.

use std::{collections::BTreeMap, path::Path};

use super::{
    meshes::LoadedObjects,
    settings::AmodalJob,
    worker::{AmodalWorker, Shared},
};
use crate::{
    ProduceError,
    job::{shards_section, subjects_section},
    plan::{JobSplits, SubjectItems},
    products::input::open_input,
    work::{OpenWork, Opening, Producer, Work, WorkTables},
};
use format::Product;
use kernel::{ids::ObjectId, words::NumberClass};

impl Work for AmodalJob {
    fn product(&self) -> Product {
        Product::AMODAL
    }

    fn subjects(&self) -> Vec<SubjectItems> {
        let items = |scene: &super::ViewedScene| SubjectItems {
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

    /// The scenes by name and content, with the splits: the root of the views does not depend on those.
    fn subject_keys(&self) -> toml::Table {
        let names = self.views.scenes.iter().map(|scene| (scene.id.0, scene.name.clone()));
        subjects_section(&self.views.splits, names)
    }

    fn tables(&self, _: Option<&JobSplits>) -> WorkTables {
        WorkTables {
            class: NumberClass::Exact,
            channel_classes: BTreeMap::new(),
            platform: BTreeMap::new(),
            assets: self.views.assets.clone(),
            subjects: self.views.subjects.clone(),
            hands: Vec::new(),
            splits: Some(self.views.splits.clone()),
        }
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        let Opening { seed, level, .. } = opening;
        let name = || self.dataset.display().to_string();
        let (views, root) = open_input(&self.dataset, Product::VIEWS, NumberClass::Exact)
            .map_err(|error| ProduceError::unusable(name(), error))?;
        if root != self.views.root {
            let (found, expected) = (ObjectId(root), ObjectId(self.views.root));
            return Err(ProduceError::Changed { name: name(), found, expected });
        }
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
        Ok(Box::new(AmodalWorker::new(&self.0)))
    }
}
