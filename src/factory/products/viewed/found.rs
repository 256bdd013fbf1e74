//! Facts of the views of a dataset, without their images.

use std::collections::BTreeMap;

use crate::{sections::subjects_section, work::WorkTables};
use format::SceneContainer;
use kernel::{
    ids::{Digest, ObjectId},
    words::{NumberClass, SplitTable},
};

/// The views of a dataset, without their images.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundViews {
    /// Digest of the dataset's exact numbers.
    pub root: Digest,
    /// The scenes, in the order of the dataset.
    pub scenes: Vec<ViewedScene>,
    /// Whether a sensor measured the depth; else it is exact but for the step in which it is stored.
    pub measured: bool,
    /// Container of the first scene; those of a job are alike.
    pub container: SceneContainer,
    /// Rows of its objects in the table of assets.
    pub assets: Vec<serde_json::Value>,
    /// Rows of its containers in the table of assets.
    pub containers: Vec<serde_json::Value>,
    /// Rows of its scenes in the table of assets.
    pub subjects: Vec<serde_json::Value>,
    /// Splits of its scenes and objects.
    pub splits: SplitTable,
}

/// A scene with views.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewedScene {
    /// The scene by content.
    pub id: ObjectId,
    /// Name, for people.
    pub name: String,
    /// Bodies of the scene.
    pub bodies: u32,
    /// The camera of each view, in order, kept or rejected.
    pub cameras: Vec<u32>,
}

impl FoundViews {
    /// The scenes by name and content, with the splits: the root of the views does not depend on those.
    pub fn subject_keys(&self) -> toml::Table {
        let names = self.scenes.iter().map(|scene| (scene.id.0, scene.name.clone()));
        subjects_section(&self.splits, names)
    }

    /// Tables of a dataset of exact numbers from the views, which has their scenes, objects and splits.
    pub fn tables(&self) -> WorkTables {
        WorkTables {
            class: NumberClass::Exact,
            channel_classes: BTreeMap::new(),
            platform: BTreeMap::new(),
            assets: self.assets.clone(),
            subjects: self.subjects.clone(),
            hands: Vec::new(),
            containers: self.containers.clone(),
            splits: Some(self.splits.clone()),
        }
    }
}
