//! A job for heatmaps as the factory runs it.

use std::path::Path;

use super::{
    grasps::MarkedHand,
    meshes::LoadedMeshes,
    settings::HeatmapJob,
    worker::{HeatmapWorker, Shared},
};
use crate::{
    ProduceError,
    plan::{JobSplits, SubjectItems},
    products::{
        patches::Fingertips,
        picked::{PickedHand, open_picks},
        viewed::{ViewMeshes, ViewedScene, open_views},
    },
    sections::shards_section,
    work::{OpenWork, Opening, Producer, Work, WorkTables},
};
use format::Product;

impl Work for HeatmapJob {
    fn product(&self) -> Product {
        Product::HEATMAPS
    }

    fn subjects(&self) -> Vec<SubjectItems> {
        let items =
            |scene: &ViewedScene| SubjectItems { id: scene.id, items: scene.cameras.len() as u32, samples_per_item: 1 };
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
        WorkTables { hands: vec![self.hand.row()], ..self.views.tables() }
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        let hand = PickedHand::open(&self.hand)?;
        let unusable = |cause| ProduceError::unusable(self.hand.file.display().to_string(), cause);
        let tips = Fingertips::new(hand.hand(), &self.settings.tips).map_err(unusable)?;
        Ok(Box::new(OpenHeatmaps(Shared {
            job: self,
            level: opening.level,
            views: open_views(&self.views_folder, &self.views)?,
            picks: open_picks(&self.picks_folder, &self.picks)?,
            meshes: LoadedMeshes::new(ViewMeshes::open(&self.views_folder, &self.views)?),
            marked: MarkedHand { hand, tips, types: self.types.clone() },
        })))
    }

    fn remarks(&self) -> Vec<String> {
        let views: usize = self.views.scenes.iter().map(|scene| scene.cameras.len()).sum();
        let mut remarks = vec![
            format!("{views} views of {} scenes", self.views.scenes.len()),
            match self.types.len() {
                0 => format!("grasps of {}, which has no types", self.hand.name),
                types => format!("grasps of {types} types"),
            },
            format!("root of the views {}", self.views.root),
            format!("root of the picks {}", self.picks.root),
        ];
        remarks.extend(self.picks.trials.map(|root| format!("root of their trials {root}")));
        remarks
    }
}

/// A job for heatmaps whose hand and datasets are open.
struct OpenHeatmaps<'j>(Shared<'j>);

impl OpenWork for OpenHeatmaps<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        Ok(Box::new(HeatmapWorker::new(&self.0)))
    }
}
