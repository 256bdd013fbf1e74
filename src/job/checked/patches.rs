//! A job for patches, checked: with all that it takes from the dataset of grasps but the meshes.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
};

use super::JobHand;
use crate::{
    geom::{Approach, HandBase, Intrinsics, Object, Pose},
    ids::{Digest, ObjectId},
};

/// Which grasps are looked at, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchJob {
    /// The folder of the dataset of grasps.
    pub dataset: PathBuf,
    /// What of it is looked at.
    pub grasps: FoundGrasps,
    /// The hand.
    pub hand: JobHand,
    /// How it is looked at.
    pub settings: PatchSettings,
}

/// What a dataset of grasps holds of its most common types.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundGrasps {
    /// The digest of its exact numbers.
    pub root: Digest,
    /// Its hand by content.
    pub hand: ObjectId,
    /// The space in which it asks for force closure: `force` or `wrench`.
    pub space: String,
    /// Its grasps by type, and the chosen types.
    pub types: TypeChoice,
    /// Its objects, sorted by content.
    pub objects: Vec<GraspedObject>,
    /// Models in each nested training subset, smallest first.
    pub training_subsets: Vec<u32>,
}

/// The most common types of kept grasps.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TypeChoice {
    /// Kept grasps of each type.
    pub counts: BTreeMap<u32, u64>,
    /// Kept grasps that have no type.
    pub without: u64,
    /// The chosen types, the most common first.
    pub chosen: Vec<u32>,
}

impl TypeChoice {
    /// Chooses the `most` most common types; of two that are as common the lower comes first.
    pub fn new(counts: BTreeMap<u32, u64>, without: u64, most: u32) -> Self {
        let mut chosen: Vec<u32> = counts.keys().copied().collect();
        // The sort is stable, and keys come in order.
        chosen.sort_by_key(|kind| std::cmp::Reverse(counts[kind]));
        chosen.truncate(most as usize);
        Self { counts, without, chosen }
    }

    /// The place of a type among the chosen ones.
    pub fn index_of(&self, kind: u32) -> Option<usize> {
        self.chosen.iter().position(|chosen| *chosen == kind)
    }
}

/// An object, and its grasps of the chosen types.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspedObject {
    /// By content.
    pub id: ObjectId,
    /// Its name in the dataset of grasps.
    pub name: String,
    /// Its row in that dataset's table of assets.
    pub asset: serde_json::Value,
    /// Whether it trains or tests there.
    pub side: ObjectSide,
    /// Of one that trains: runs that are held out.
    pub holdout_runs: BTreeSet<u32>,
    /// Of one that trains: the smallest nested subset that holds it.
    pub subset: Option<u32>,
    /// Its grasps of the chosen types, by run and rank.
    pub grasps: Vec<ChosenGrasp>,
}

/// The side of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ObjectSide {
    /// Trains.
    Training,
    /// Chooses hyper-parameters.
    Validation,
    /// Tests.
    Test,
}

impl ObjectSide {
    /// The name in a job's digest.
    pub(in crate::job) fn name(self) -> &'static str {
        match self {
            Self::Training => "training",
            Self::Validation => "validation",
            Self::Test => "test",
        }
    }
}

/// A kept grasp of one of the chosen types.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenGrasp {
    /// Its run: the number of the seed.
    pub run: u32,
    /// Its place in that run.
    pub rank: u32,
    /// Its type.
    pub kind: u32,
    /// The approach frame.
    pub object_from_approach: Pose<Object, Approach>,
    /// The hand's base.
    pub object_from_base: Pose<Object, HandBase>,
    /// All joints of the closed hand [rad or m].
    pub joints: Vec<f64>,
    /// What annealing minimised, before closing.
    pub energy: f64,
    /// Epsilon of the closed hand, in the space of the job for grasps.
    pub epsilon: f64,
}

/// How grasps are looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchSettings {
    /// Types that are asked for, at least 1.
    pub types: u32,
    /// Side of a patch [px].
    pub side: u32,
    /// The contacts of the hand that are F0, F1 and F2.
    pub tips: [String; 3],
    /// What the label is.
    pub label: PatchLabel,
    /// The camera.
    pub camera: Intrinsics,
    /// The camera's horizontal field of view [rad], as written.
    pub horizontal_fov: f64,
    /// How far it is from the centre of the object's box [m].
    pub distance: f64,
    /// Quirk of the thesis: the focal length that points are projected with [px]; `None`: the camera's.
    pub point_focal_length: Option<f64>,
    /// Colours besides depth.
    pub colour: Option<PatchColours>,
    /// The whole image is stored besides its patches.
    pub image: bool,
    /// Truth for heatmaps over the whole image: how far approaches are from the camera's axis, at most [rad].
    pub heatmap_angle: Option<f64>,
}

impl PatchSettings {
    /// The camera that points are projected with.
    pub fn projection(&self) -> Intrinsics {
        self.camera.with_focal_length(self.point_focal_length)
    }

    /// The label of a grasp.
    pub fn label_of(&self, grasp: &ChosenGrasp) -> f32 {
        let label = match self.label {
            PatchLabel::Epsilon => -grasp.epsilon,
            PatchLabel::Energy => grasp.energy,
        };
        label as f32
    }
}

/// What a label is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PatchLabel {
    /// -epsilon.
    Epsilon,
    /// The energy (`thesis`).
    Energy,
}

impl PatchLabel {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Epsilon => "epsilon",
            Self::Energy => "energy",
        }
    }
}

/// How colours are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PatchColours {
    /// Lights and colours are drawn anew for each grasp.
    pub randomise: bool,
}

impl PatchJob {
    /// Grasps of the chosen types.
    pub fn samples(&self) -> u64 {
        self.grasps.objects.iter().map(|object| object.grasps.len() as u64).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_common_types_are_chosen_and_the_lower_of_equals() {
        let counts = BTreeMap::from([(7, 3), (2, 5), (9, 5), (1, 1)]);
        let choice = TypeChoice::new(counts.clone(), 4, 3);
        assert_eq!((choice.chosen.as_slice(), choice.index_of(9), choice.index_of(1)), (&[2, 9, 7][..], Some(1), None));
        assert_eq!(TypeChoice::new(counts, 0, 8).chosen, [2, 9, 7, 1]);
        assert!(TypeChoice::new(BTreeMap::new(), 0, 8).chosen.is_empty());
    }
}
