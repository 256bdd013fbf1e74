//! Facts of the scenes of a dataset, without their contacts.

use std::collections::BTreeMap;

use crate::{
    ProduceError,
    sections::{JobObjects, subjects_section},
    work::WorkTables,
};
use format::SceneContainer;
use kernel::{
    geom::{Object, Pose, World},
    ids::{Digest, ObjectId, SampleId},
    words::{NumberClass, ObjectSplit, Split, SplitTable},
};

/// The kept scenes of a dataset.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundScenes {
    /// Digest of the dataset's numbers of physics.
    pub root: Digest,
    /// The scenes, in the order of the dataset.
    pub list: Vec<SettledScene>,
    /// Rows of its objects in the table of assets.
    pub assets: Vec<serde_json::Value>,
    /// Rows of its containers in the table of assets.
    pub containers: Vec<serde_json::Value>,
    /// Splits of its objects.
    pub splits: SplitTable,
    /// Job of the dataset, which names the meshes.
    pub job_text: String,
}

/// A settled scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SettledScene {
    /// The scene by content.
    pub id: ObjectId,
    /// Sample of the dataset that it is.
    pub sample: SampleId,
    /// Split of the scene.
    pub split: Split,
    /// Number of the scene in its split.
    pub number: u32,
    /// Container of the scene.
    pub container: SceneContainer,
    /// Object and pose of each body, in the order of their first release.
    pub bodies: Vec<(ObjectId, Pose<World, Object>)>,
}

impl SettledScene {
    /// Name, for people.
    pub fn name(&self) -> String {
        format!("{} {}", self.split.name(), self.number)
    }

    /// Split of its objects.
    pub fn side(&self) -> Split {
        if self.split == Split::Holdout { Split::Training } else { self.split }
    }
}

impl FoundScenes {
    /// The scenes by name and content, with the splits: the root of the scenes does not depend on those. `items` is the
    /// number of samples of each scene.
    pub fn subject_keys(&self, items: impl Fn(&SettledScene) -> u32) -> toml::Table {
        let names = self.list.iter().map(|scene| (scene.id.0, scene.name()));
        subjects_section(&self.split_table(items), names)
    }

    /// Tables of a dataset of exact numbers with this number of samples per scene, which has the scenes, objects and
    /// splits of these.
    pub fn tables(&self, items: impl Fn(&SettledScene) -> u32) -> WorkTables {
        let subject = |scene: &SettledScene| {
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
            assets: self.assets.clone(),
            subjects: self.list.iter().map(subject).collect(),
            hands: Vec::new(),
            containers: self.containers.clone(),
            splits: Some(self.split_table(items)),
        }
    }

    /// Index of each object of the scenes in a job that found their meshes again.
    ///
    /// # Errors
    /// When a mesh is found no more.
    pub fn indices_of(&self, objects: &JobObjects) -> Result<BTreeMap<ObjectId, usize>, ProduceError> {
        let indices: BTreeMap<ObjectId, usize> = objects.ids().zip(0..).collect();
        for row in &self.assets {
            let id = row["object"].as_str().and_then(Digest::from_hex).map(ObjectId);
            if let Some(id) = id.filter(|id| !indices.contains_key(id)) {
                let name = row["name"].as_str().unwrap_or_default().to_owned();
                let cause = format!("the mesh of content {} is missing; restore it", id.0.short());
                return Err(ProduceError::unusable(name, cause));
            }
        }
        Ok(indices)
    }

    /// Splits of the objects, and of the scenes as wholes.
    fn split_table(&self, items: impl Fn(&SettledScene) -> u32) -> SplitTable {
        let mut table = self.splits.clone();
        table.objects.extend(self.list.iter().map(|scene| ObjectSplit {
            object: scene.id,
            split: scene.side(),
            holdout_items: if scene.split == Split::Holdout { (0..items(scene)).collect() } else { Vec::new() },
            subset: None,
        }));
        table
    }
}
