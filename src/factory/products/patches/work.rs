//! A job for patches as the factory runs it.

use std::{collections::BTreeMap, path::Path};

use super::{
    hand::PatchHand,
    settings::{FoundGrasps, GraspedObject, PatchJob},
    worker::PatchWorker,
};
use crate::{
    ProduceError, RunError,
    plan::{JobSplits, SubjectItems},
    products::appearance::check_colours,
    sections::{shards_section, subjects_section},
    work::{Closing, OpenWork, Opening, Producer, Work, WorkTables},
};
use format::{
    Channel, Product,
    extras::{Shapes, write_types},
};
use kernel::{
    files::Folder,
    geom::SimdLevel,
    words::{NumberClass, ObjectSplit, SplitTable},
};
use sim::{gl_facts, sim_facts};

impl Work for PatchJob {
    fn product(&self) -> Product {
        Product::PATCHES
    }

    fn subjects(&self) -> Vec<SubjectItems> {
        let items = |object: &GraspedObject| SubjectItems {
            id: object.id,
            items: object.grasps.len() as u32,
            samples_per_item: 1,
        };
        self.grasps.objects.iter().map(items).collect()
    }

    fn resolved(&self, folder: &Path, shard_samples: u32) -> toml::Table {
        let mut keys = self.keys(Some(folder));
        keys.extend([shards_section("samples", shard_samples)]);
        keys
    }

    fn sample_keys(&self) -> toml::Table {
        self.keys(None)
    }

    /// The objects by name and content, with their splits: the root of the grasps does not depend on those.
    fn subject_keys(&self) -> toml::Table {
        let names = self.grasps.objects.iter().map(|object| (object.id.0, object.name.clone()));
        subjects_section(&splits(&self.grasps), names)
    }

    fn tables(&self, _: Option<&JobSplits>) -> WorkTables {
        let colour = self.settings.colour.map(|_| Channel::PATCH_COLOUR);
        let image = colour.filter(|_| self.settings.image).map(|_| Channel::PATCH_IMAGE_COLOUR);
        let metric = colour.filter(|_| self.settings.metric.is_some()).map(|_| Channel::PATCH_METRIC_COLOUR);
        let drawn = colour.into_iter().chain(image).chain(metric).map(|channel| (channel, NumberClass::Colour));
        WorkTables {
            class: NumberClass::Exact,
            channel_classes: drawn.collect(),
            platform: colour.map_or_else(BTreeMap::new, |_| sim_facts().platform(gl_facts().ok().as_ref())),
            assets: self.grasps.objects.iter().map(|object| object.asset.clone()).collect(),
            subjects: Vec::new(),
            hands: vec![self.hand.row()],
            containers: Vec::new(),
            splits: Some(splits(&self.grasps)),
        }
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        let Opening { seed, level, .. } = opening;
        if self.settings.colour.is_some() {
            check_colours()?;
        }
        let (hand, shapes) = (PatchHand::open(self)?, Shapes::open(&Folder::at(&self.dataset))?);
        Ok(Box::new(OpenPatches { job: self, hand, shapes, seed, level }))
    }

    fn remarks(&self) -> Vec<String> {
        let mut remarks = vec![
            format!("grasps of {} types", self.grasps.types.chosen.len()),
            format!("root of the grasps {}", self.grasps.root),
        ];
        remarks.extend(self.grasps.trials.map(|root| format!("root of their trials {root}")));
        remarks
    }
}

/// Splits of the grasps, with held-out patches for held-out runs.
fn splits(grasps: &FoundGrasps) -> SplitTable {
    let row = |object: &GraspedObject| ObjectSplit {
        object: object.id,
        split: object.split,
        holdout_items: (0..)
            .zip(&object.grasps)
            .filter_map(|(item, grasp)| object.holdout_runs.contains(&grasp.run).then_some(item))
            .collect(),
        subset: object.subset,
    };
    SplitTable { training_subsets: grasps.training_subsets.clone(), objects: grasps.objects.iter().map(row).collect() }
}

/// A job for patches whose hand and dataset are open.
struct OpenPatches<'j> {
    job: &'j PatchJob,
    hand: PatchHand,
    shapes: Shapes,
    seed: u64,
    level: SimdLevel,
}

impl OpenWork for OpenPatches<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        Ok(Box::new(PatchWorker::new(self.job, self.seed, &self.hand, &self.shapes, self.level)))
    }

    /// Writes `types.json`.
    fn finish(&self, closing: &mut Closing<'_>) -> Result<(), RunError> {
        Ok(write_types(closing.folder, &self.job.grasps.types)?)
    }
}
