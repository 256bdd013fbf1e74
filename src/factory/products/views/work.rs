//! A job for views as the factory runs it.

use std::{collections::BTreeMap, path::Path};

use super::{
    loaded::LoadedMeshes,
    settings::{FoundScenes, ViewJob},
    worker::{Shared, ViewWorker},
};
use crate::{
    ProduceError, RunError,
    job::{JobObject, JobObjects, shards_section, subjects_section},
    objects::{MEASURED_OBJECTS, prepared},
    plan::{JobSplits, SubjectItems},
    work::{Closing, OpenWork, Opening, Producer, Work, WorkTables},
};
use format::{ObjectShape, Product, products::grasps::ShapesWriter};
use kernel::{
    ids::{Digest, JobDigest, ObjectId},
    words::{NumberClass, ObjectSplit, Split, SplitTable},
};

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
        let names = self.scenes.list.iter().map(|scene| (scene.id.0, scene.name()));
        subjects_section(&splits(&self.scenes, self.settings.views()), names)
    }

    fn objects(&self) -> Option<&JobObjects> {
        Some(&self.objects)
    }

    fn tables(&self, _: Option<&JobSplits>) -> WorkTables {
        let subject = |scene: &super::ViewScene| {
            serde_json::json!({
                "object": scene.id,
                "name": scene.name(),
                "split": scene.split,
                "scene": scene.number,
                "objects": scene.bodies.iter().map(|(object, _)| *object).collect::<Vec<ObjectId>>(),
            })
        };
        WorkTables {
            class: NumberClass::Exact,
            channel_classes: BTreeMap::new(),
            platform: BTreeMap::new(),
            assets: self.scenes.assets.clone(),
            subjects: self.scenes.list.iter().map(subject).collect(),
            hands: Vec::new(),
            splits: Some(splits(&self.scenes, self.settings.views())),
        }
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        let Opening { seed, level, .. } = opening;
        let objects: BTreeMap<ObjectId, usize> = self.objects.ids().zip(0..).collect();
        for row in &self.scenes.assets {
            let id = row["object"].as_str().and_then(Digest::from_hex).map(ObjectId);
            if let Some(id) = id.filter(|id| !objects.contains_key(id)) {
                let name = row["name"].as_str().unwrap_or_default().to_owned();
                let cause = format!("no mesh of content {} is found any more; restore it", id.0.short());
                return Err(ProduceError::unusable(name, cause));
            }
        }
        Ok(Box::new(OpenViews(Shared { job: self, seed, level, objects, meshes: LoadedMeshes::default() })))
    }

    fn remarks(&self) -> Vec<String> {
        vec![
            format!("{} views of each of {} scenes", self.settings.views(), self.scenes.list.len()),
            format!("root of the scenes {}", self.scenes.root),
        ]
    }
}

/// Splits of the objects, and of the scenes as wholes.
fn splits(scenes: &FoundScenes, views: u32) -> SplitTable {
    let mut table = scenes.splits.clone();
    table.objects.extend(scenes.list.iter().map(|scene| ObjectSplit {
        object: scene.id,
        split: scene.side(),
        holdout_items: if scene.split == Split::Holdout { (0..views).collect() } else { Vec::new() },
        subset: None,
    }));
    table
}

/// A job for views whose objects are known.
struct OpenViews<'j>(Shared<'j>);

impl OpenWork for OpenViews<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        Ok(Box::new(ViewWorker::new(&self.0)))
    }

    /// Bytes of the meshes, by those of a few.
    fn side_bytes(&self, _: &[usize], folder: &Path) -> Result<f64, ProduceError> {
        let all = &self.0.job.objects.list;
        let mut few: Vec<&JobObject> = all.iter().take(MEASURED_OBJECTS).collect();
        few.sort_by_key(|object| object.id());
        let triangles = |objects: &mut dyn Iterator<Item = &JobObject>| {
            objects.map(|object| object.asset.triangles as f64).sum::<f64>()
        };
        let share = triangles(&mut all.iter()) / triangles(&mut few.iter().copied()).max(1.0);
        Ok(write_shapes(&few, folder, &JobDigest(Digest([0; 32])))? as f64 * share)
    }

    /// Writes the meshes.
    fn finish(&self, closing: &mut Closing<'_>) -> Result<(), RunError> {
        let mut objects: Vec<&JobObject> = self.0.job.objects.list.iter().collect();
        objects.sort_by_key(|object| object.id());
        if closing.cancel.is_cancelled() {
            return Err(RunError::Interrupted);
        }
        write_shapes(&objects, closing.folder, &closing.job)?;
        Ok(())
    }
}

/// Writes the meshes of objects that are sorted by content, one in memory at a time; the size of the file [bytes].
fn write_shapes(objects: &[&JobObject], folder: &Path, job: &JobDigest) -> Result<u64, ProduceError> {
    let mut writer = ShapesWriter::of_objects(folder, job, Product::VIEWS)?;
    for object in objects {
        writer.object(&ObjectShape { object: object.id(), mesh: prepared(object)?.mesh().clone() })?;
    }
    Ok(writer.finish(None)?)
}
