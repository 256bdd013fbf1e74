//! Kinds of touch that go with each pair, checked.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::sections::JobHand;

/// Kinds of touch that go with each pair.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Touch {
    /// Rays at random positions.
    pub random_rays: Option<RandomRays>,
    /// By a hand.
    pub by_hand: Option<TouchByHand>,
}

impl Touch {
    /// Whether there is any.
    pub fn is_asked(&self) -> bool {
        self.random_rays.is_some() || self.by_hand.is_some()
    }
}

/// Touch by a hand; at least one of its two kinds.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchByHand {
    /// The hand.
    pub hand: JobHand,
    /// Exploration of the surface that the camera did not see.
    pub exploration: Option<Exploration>,
    /// Whether the hand grasps once.
    pub grasp: bool,
}

impl TouchByHand {
    /// Approaches per view, of both kinds.
    pub fn approaches(&self) -> u32 {
        self.exploration.map_or(0, |exploration| exploration.approaches) + u32::from(self.grasp)
    }
}

/// Exploration of the surface that the camera did not see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exploration {
    /// Approaches per view, at least 1.
    pub approaches: u32,
    /// Targets of the approaches.
    pub target: ExplorationTarget,
}

/// Targets of an exploration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExplorationTarget {
    /// Cells of the surface that the camera does not see and the partial grid does not hold. Of many approaches those are taken
    /// that are forecast to touch the largest number of them and the fewest points in sight.
    UnseenCells,
    /// Points that face away from the camera (`thesis`). The opened hand comes along their inward normals.
    FacingAway,
}

/// Rays from the object's far side towards the camera, along its optical axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RandomRays {
    /// Rays per view, at least 1.
    pub count: u32,
    /// Target of the rays.
    pub target: RayTarget,
}

/// Target of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RayTarget {
    /// The mesh's own triangles.
    Mesh,
    /// Quirk of the thesis: cells of the complete grid. A ray runs along a column of cells and stops at the lower corner of
    /// the first occupied one.
    Cells,
}
