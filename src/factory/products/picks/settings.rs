//! A job for picks, checked, with everything that it takes from the datasets of scenes and grasps but contacts and meshes.

use std::{collections::BTreeMap, path::PathBuf};

use crate::{
    products::settled::FoundScenes,
    sections::{JobHand, JobObjects},
};
use format::{AwakeBodies, TakenGrasps};
use kernel::{
    geom::{HandBase, Object, Pose},
    ids::{Digest, ObjectId},
};

/// Scenes, grasps, hand and settings of a job for picks.
#[derive(Clone, Debug, PartialEq)]
pub struct PickJob {
    /// The folder of the dataset of scenes.
    pub scenes_folder: PathBuf,
    /// Scenes of that dataset.
    pub scenes: FoundScenes,
    /// Rolling friction among bodies in these scenes [m].
    pub rolling: f64,
    /// Objects of the scenes, by their own job.
    pub objects: JobObjects,
    /// The folder of the dataset of grasps.
    pub grasps_folder: PathBuf,
    /// Grasps of that dataset.
    pub grasps: PickGrasps,
    /// The hand.
    pub hand: JobHand,
    /// Everything else.
    pub settings: PickSettings,
}

/// Settings of picks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickSettings {
    /// Directions in which each stored grasp is evaluated.
    pub rolls: u32,
    /// Grasps of each body that are evaluated, at most.
    pub candidates: u32,
    /// Distance that the hand keeps from everything but the body that it grasps [m].
    pub margin: f64,
    /// Free grasps of each body that are tried, at most.
    pub trials: u32,
    /// Bodies that may move in a trial.
    pub awake: AwakeBodies,
}

/// The grasps of a dataset that are taken.
#[derive(Clone, Debug, PartialEq)]
pub struct PickGrasps {
    /// Digest of the dataset's exact numbers.
    pub root: Digest,
    /// Digest of its numbers of physics, where trials select the grasps.
    pub trials: Option<Digest>,
    /// The hand by content.
    pub hand: ObjectId,
    /// Choice of the grasps.
    pub take: TakenGrasps,
    /// The grasps of each object, sorted by run and rank.
    pub objects: BTreeMap<ObjectId, Vec<StoredGrasp>>,
}

/// A stored grasp.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredGrasp {
    /// Number of its run.
    pub run: u32,
    /// Index in the run.
    pub rank: u32,
    /// The hand's base where it closes.
    pub object_from_base: Pose<Object, HandBase>,
    /// Posture before closing, one value per driven joint [rad or m].
    pub posture: Vec<f64>,
    /// The mean of the points at which the closed hand touches, in `Object` [m].
    pub middle: [f64; 3],
}

impl PickGrasps {
    /// The grasps of an object.
    pub fn grasps_of(&self, object: ObjectId) -> &[StoredGrasp] {
        self.objects.get(&object).map(Vec::as_slice).unwrap_or_default()
    }
}
