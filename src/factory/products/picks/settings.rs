//! A job for picks, checked, with everything that it takes from the datasets of scenes and grasps but contacts and meshes.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

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
    /// Source of the grasps.
    pub source: PickSource,
    /// The hand.
    pub hand: JobHand,
    /// Everything else.
    pub settings: PickSettings,
}

/// Source of the grasps that are evaluated.
#[derive(Clone, Debug, PartialEq)]
pub enum PickSource {
    /// Grasps of lone objects, transferred to the scene.
    Transferred {
        /// The folder of the dataset of grasps.
        folder: PathBuf,
        /// Grasps of that dataset.
        grasps: PickGrasps,
    },
    /// Grasps sampled among the obstacles of the scene.
    Scene(ScenePoses),
}

/// Settings of grasps that are sampled in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScenePoses {
    /// Poses of a body, at most.
    pub poses: u32,
    /// Largest angle between the approach and straight down [degree].
    pub half_angle_deg: f64,
    /// Coefficient of friction of the cone in which the second point of a pair lies.
    pub cone_friction: f64,
}

/// Settings of picks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickSettings {
    /// Directions in which each stored grasp is evaluated; 1 where grasps are sampled.
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

impl PickSource {
    /// Stored grasps, with the folder of their dataset; `None` where grasps are sampled in the scene.
    pub fn transferred(&self) -> Option<(&Path, &PickGrasps)> {
        match self {
            Self::Transferred { folder, grasps } => Some((folder, grasps)),
            Self::Scene(_) => None,
        }
    }

    /// Stored grasps of an object; none where grasps are sampled in the scene.
    pub fn stored(&self, object: ObjectId) -> &[StoredGrasp] {
        self.transferred().map(|(_, grasps)| grasps.grasps_of(object)).unwrap_or_default()
    }
}

impl PickGrasps {
    /// The grasps of an object.
    pub fn grasps_of(&self, object: ObjectId) -> &[StoredGrasp] {
        self.objects.get(&object).map(Vec::as_slice).unwrap_or_default()
    }
}
