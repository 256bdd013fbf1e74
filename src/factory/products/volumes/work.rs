//! A job for volumes as the factory runs it.

use std::path::Path;

use super::{
    grasps::OpenGrasps,
    settings::{VolumeGrasps, VolumeJob},
    worker::{Shared, VolumeWorker},
};
use crate::{
    ProduceError,
    plan::{JobSplits, SubjectItems},
    products::viewed::{ViewMeshes, ViewedScene, open_views},
    sections::shards_section,
    work::{OpenWork, Opening, Producer, Work, WorkTables},
};
use format::Product;

impl Work for VolumeJob {
    fn product(&self) -> Product {
        Product::VOLUMES
    }

    fn subjects(&self) -> Vec<SubjectItems> {
        let items =
            |scene: &ViewedScene| SubjectItems { id: scene.id, items: self.settings.per_scene, samples_per_item: 1 };
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
        let hands = self.grasps.iter().map(|grasps| grasps.hand.row()).collect();
        WorkTables { hands, ..self.views.tables() }
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        let views = open_views(&self.dataset, &self.views)?;
        let meshes = ViewMeshes::open(&self.dataset, &self.views)?;
        let grasps = self.grasps.as_ref().map(OpenGrasps::open).transpose()?;
        Ok(Box::new(OpenVolumes(Shared::new(self, opening.seed, (views, meshes), grasps))))
    }

    fn remarks(&self) -> Vec<String> {
        let views: usize = self.views.scenes.iter().map(|scene| scene.cameras.len()).sum();
        let mut remarks = vec![
            format!("{} fusions of {} scenes with {views} views", self.settings.per_scene, self.views.scenes.len()),
            format!("root of the views {}", self.views.root),
        ];
        if let Some(VolumeGrasps { picks, hand, .. }) = &self.grasps {
            remarks.push(format!("grasps of {}", hand.name));
            remarks.push(format!("root of the picks {}", picks.root));
            remarks.extend(picks.trials.map(|root| format!("root of their trials {root}")));
        }
        remarks
    }
}

/// A job for volumes whose views are open.
struct OpenVolumes<'j>(Shared<'j>);

impl OpenWork for OpenVolumes<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        Ok(Box::new(VolumeWorker::new(&self.0)))
    }
}
