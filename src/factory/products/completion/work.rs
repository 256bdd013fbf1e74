//! A completion job as the factory runs it.

use std::{collections::BTreeMap, path::Path};

use super::{
    channels_of,
    settings::{CompletionJob, CompletionSettings, Renderer},
    worker::CompletionWorker,
};
use crate::{
    ProduceError, RunError,
    objects::{check_hand, cost_of_descriptions, describe_all},
    plan::{JobSplits, SubjectItems},
    sections::{JobObjects, SplitInput, shards_section},
    work::{Closing, OpenWork, Opening, Producer, SideCost, Work, WorkTables},
};
use format::{Channel, Product};
use kernel::{
    cancel::Cancel,
    files::Folder,
    geom::{DepthCrop, SimdLevel},
    ids::SampleId,
    render::{DepthError, DepthSource},
    words::NumberClass,
};
use sim::{gl_facts, sim_facts};

impl Work for CompletionJob {
    fn product(&self) -> Product {
        Product::COMPLETION
    }

    fn subjects(&self) -> Vec<SubjectItems> {
        let items = self.settings.views.len() as u32;
        self.objects.ids().map(|id| SubjectItems { id, items, samples_per_item: 1 }).collect()
    }

    fn resolved(&self, folder: &Path, shard_samples: u32) -> toml::Table {
        let mut keys = self.keys(Some(folder));
        keys.extend(self.objects.resolved(folder));
        keys.extend([shards_section("samples", shard_samples)]);
        keys
    }

    fn sample_keys(&self) -> toml::Table {
        self.keys(None)
    }

    fn subject_keys(&self) -> toml::Table {
        self.objects.subject_keys()
    }

    fn objects(&self) -> Option<&JobObjects> {
        Some(&self.objects)
    }

    fn divided(&self) -> Option<SplitInput<'_>> {
        Some(self.objects.divided(self.settings.views.equal_rotations()))
    }

    fn tables(&self, splits: Option<&JobSplits>) -> WorkTables {
        let settings = &self.settings;
        let class = match settings.renderer {
            Renderer::Raster => NumberClass::Exact,
            Renderer::MujocoRay => NumberClass::Physics,
            Renderer::MujocoGl => NumberClass::Colour,
        };
        // Contacts are placed on the grid of the pair: they are no more equal than that is.
        let class_of_hands = class.max(NumberClass::Physics);
        let by_hand = settings.touch.by_hand.as_ref();
        let channels = channels_of(settings).into_iter().filter(|channel| TOUCH_BY_HAND.contains(channel));
        WorkTables {
            class,
            channel_classes: channels.map(|channel| (channel, class_of_hands)).collect(),
            platform: platform(settings),
            assets: self.objects.rows(),
            subjects: Vec::new(),
            hands: by_hand.map(|touch| touch.hand.row()).into_iter().collect(),
            containers: Vec::new(),
            splits: Some(splits.map(|splits| splits.table.clone()).unwrap_or_default()),
        }
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        let Opening { seed, level, .. } = opening;
        if let Some(touch) = &self.settings.touch.by_hand {
            check_hand(&touch.hand)?;
        }
        Ok(Box::new(OpenCompletion { job: self, seed, level }))
    }

    fn remarks(&self) -> Vec<String> {
        vec![format!("{} views per object", self.settings.views.len())]
    }

    fn depth_source(&self, seed: u64, level: SimdLevel) -> Result<Option<Box<dyn DepthSource + '_>>, ProduceError> {
        Ok(Some(Box::new(DepthAgain { job: self, worker: CompletionWorker::new(self, seed, level, None)? })))
    }
}

/// Channels of touch by a hand.
const TOUCH_BY_HAND: [Channel; 2] = [Channel::TOUCH_EXPLORATION, Channel::TOUCH_GRASP];

/// Facts of the machine that the numbers depend on in addition to our own code; none for class `exact`.
fn platform(settings: &CompletionSettings) -> BTreeMap<String, String> {
    match settings.renderer {
        Renderer::Raster if settings.touch.by_hand.is_none() => BTreeMap::new(),
        Renderer::Raster | Renderer::MujocoRay => sim_facts().platform(None),
        Renderer::MujocoGl => sim_facts().platform(gl_facts().ok().as_ref()),
    }
}

/// A completion job whose producers can be made; they share nothing.
struct OpenCompletion<'j> {
    job: &'j CompletionJob,
    seed: u64,
    level: SimdLevel,
}

impl OpenWork for OpenCompletion<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        let hand = self.job.settings.touch.by_hand.as_ref();
        Ok(Box::new(CompletionWorker::new(self.job, self.seed, self.level, hand)?))
    }

    fn side_cost(&self, visited: &[usize], _: &Folder) -> Result<SideCost, ProduceError> {
        cost_of_descriptions(&self.job.objects, visited)
    }

    /// Writes into the row of every object what it weighs and is.
    fn finish(&self, closing: &mut Closing<'_>) -> Result<(), RunError> {
        describe_all(&self.job.objects, closing)
    }
}

/// Makes the depth images of views again, without touching.
struct DepthAgain<'j> {
    job: &'j CompletionJob,
    worker: CompletionWorker<'j>,
}

impl DepthSource for DepthAgain<'_> {
    fn depth(&mut self, sample: &SampleId) -> Result<Option<DepthCrop>, DepthError> {
        let Some(object) = self.job.objects.ids().position(|id| id == sample.subject) else { return Ok(None) };
        self.worker.load(object, &Cancel::new())?;
        Ok(Some(self.worker.depth_of(sample.item)?.clone()))
    }
}
