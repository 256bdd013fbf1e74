//! A job for grasps as the factory runs it.

use std::{collections::BTreeMap, path::Path};

use rayon::prelude::*;
use serde_json::{Map, Value};

use super::{
    hand::{GraspHand, can_grasp},
    settings::{GraspJob, GraspSettings},
    shapes::{hand_shape, object_shape, trial_hand},
    worker::GraspWorker,
};
use crate::{
    ProduceError, RunError,
    clock::processor_time,
    objects::{add_to_assets, bytes_of_row, measured, triangles_per},
    plan::{JobSplits, SubjectItems},
    sections::{JobObject, JobObjects, SplitInput, shards_section},
    work::{Closing, OpenWork, Opening, Producer, SideCost, Work, WorkTables},
};
use format::{ObjectShape, Product, extras::ShapesWriter};
use kernel::{
    files::Folder,
    geom::SimdLevel,
    ids::{Digest, JobDigest, ObjectId},
    words::NumberClass,
};
use sim::sim_facts;

impl Work for GraspJob {
    fn product(&self) -> Product {
        Product::GRASPS
    }

    fn subjects(&self) -> Vec<SubjectItems> {
        let items = self.settings.seeds;
        self.objects.ids().map(|id| SubjectItems { id, items, samples_per_item: 1 }).collect()
    }

    fn resolved(&self, folder: &Path, shard_samples: u32) -> toml::Table {
        let mut keys = self.keys(Some(folder));
        keys.extend(self.objects.resolved(folder));
        keys.extend([shards_section("runs", shard_samples)]);
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

    /// Every run starts elsewhere: no two are equal.
    fn divided(&self) -> Option<SplitInput<'_>> {
        Some(self.objects.divided((0..self.settings.seeds).collect()))
    }

    fn tables(&self, splits: Option<&JobSplits>) -> WorkTables {
        let tried = self.settings.physics.map(|physics| (physics.labels.channel(), NumberClass::Physics));
        WorkTables {
            class: NumberClass::Exact,
            channel_classes: tried.into_iter().collect(),
            platform: tried.map_or_else(BTreeMap::new, |_| sim_facts().platform(None)),
            assets: self.objects.rows(),
            subjects: Vec::new(),
            hands: vec![self.hand.row()],
            containers: Vec::new(),
            splits: Some(splits.map(|splits| splits.table.clone()).unwrap_or_default()),
        }
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        let Opening { seed, level, .. } = opening;
        let GraspSettings { sampler, physics, .. } = &self.settings;
        let hand = GraspHand::open(&self.hand, |model| can_grasp(model, sampler, physics.is_some()))?;
        Ok(Box::new(OpenGrasps { job: self, hand, seed, level }))
    }

    fn remarks(&self) -> Vec<String> {
        vec![format!("{} runs per object", self.settings.seeds)]
    }
}

/// A job for grasps whose hand is open.
struct OpenGrasps<'j> {
    job: &'j GraspJob,
    hand: GraspHand,
    seed: u64,
    level: SimdLevel,
}

impl OpenWork for OpenGrasps<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        Ok(Box::new(GraspWorker::new(self.job, self.seed, &self.hand, self.level)?))
    }

    /// Cost of `shapes.mcap` and of the facts of the objects, by those of a few: meshes grow with their triangles.
    fn side_cost(&self, visited: &[usize], folder: &Folder) -> Result<SideCost, ProduceError> {
        let all = &self.job.objects.list;
        let measured: Vec<&JobObject> = measured(visited).into_iter().map(|index| &all[index]).collect();
        let share = triangles_per(&all.iter().collect::<Vec<_>>(), &measured);
        let (mut shapes, mut rows, began) = (Vec::new(), 0.0, processor_time());
        for object in &measured {
            let (shape, row) = object_shape(object, self.job.settings.physics.as_ref())?;
            rows += bytes_of_row(row);
            shapes.push(shape);
        }
        let seconds = (processor_time() - began).as_secs_f64();
        shapes.sort_by_key(|shape| shape.object);
        let hand = self.bytes_of_shapes(&[], folder)?;
        let meshes = self.bytes_of_shapes(&shapes, folder)? - hand;
        let times = all.len() as f64 / measured.len().max(1) as f64;
        Ok(SideCost { bytes: hand + meshes * share + rows * times, seconds: seconds * times })
    }

    /// Writes `shapes.mcap`, and into the row of every object what it weighs and is and how it rests on a table.
    fn finish(&self, closing: &mut Closing<'_>) -> Result<(), RunError> {
        let mut rows = self.write_shapes(closing)?;
        add_to_assets(closing, |object| rows.remove(&object));
        Ok(())
    }
}

impl OpenGrasps<'_> {
    /// Size of the file of the hand and these shapes, which is written into a folder of no dataset [bytes].
    fn bytes_of_shapes(&self, shapes: &[ObjectShape], folder: &Folder) -> Result<f64, ProduceError> {
        let job = JobDigest(Digest([0; 32]));
        let mut writer =
            ShapesWriter::create(folder, &job, Product::GRASPS, &hand_shape(&self.hand, self.job.hand.id))?;
        shapes.iter().try_for_each(|shape| writer.object(shape))?;
        Ok(writer.finish(trial_hand(self.job)?.as_ref())? as f64)
    }

    /// Writes the shapes of the hand and of every object, a few meshes in memory at a time. Returns the facts of each object.
    fn write_shapes(&self, closing: &Closing<'_>) -> Result<BTreeMap<ObjectId, Map<String, Value>>, RunError> {
        let mut facts = BTreeMap::new();
        let physics = self.job.settings.physics.as_ref();
        let mut objects: Vec<&JobObject> = self.job.objects.list.iter().collect();
        objects.sort_by_key(|object| object.id());
        let hand = hand_shape(&self.hand, self.job.hand.id);
        let mut writer = ShapesWriter::create(closing.folder, &closing.job, Product::GRASPS, &hand)?;
        let pool = closing.parallelism.pool()?;
        for few in objects.chunks(closing.parallelism.threads.max(1)) {
            if closing.cancel.is_cancelled() {
                return Err(RunError::Interrupted);
            }
            let shapes: Vec<_> =
                pool.install(|| few.par_iter().map(|object| object_shape(object, physics)).collect::<Result<_, _>>())?;
            for (shape, row) in shapes {
                writer.object(&shape)?;
                facts.insert(shape.object, row);
            }
        }
        writer.finish(trial_hand(self.job)?.as_ref())?;
        Ok(facts)
    }
}
