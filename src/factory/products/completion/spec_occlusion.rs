//! The keys of occluders in front of the objects.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Occluders between the camera and the object in a share of the views. The section is optional; without it there are
/// none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OcclusionSpec {
    /// Kinds of occluders. Each occluded view draws one of them.
    #[serde(default = "defaults::modes")]
    #[schemars(length(min = 1), extend("examples" = [["half_space"]]))]
    pub modes: Vec<OcclusionMode>,
    /// Share of the views with an occluder in front of the object.
    #[serde(default = "defaults::share")]
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 1))]
    pub share: f64,
    /// Smallest share of the object's visible pixels that an occluder hides. Each occluded view draws a share.
    #[serde(default = "defaults::min_hidden")]
    #[schemars(range(min = 0, max = 0.95))]
    pub min_hidden: f64,
    /// Largest share of the object's visible pixels that an occluder hides.
    #[serde(default = "defaults::max_hidden")]
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 0.95))]
    pub max_hidden: f64,
}

/// A kind of occluder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OcclusionMode {
    /// A convex piece (a box, cylinder, frustum or superquadric with random sides) at a random pose between camera and
    /// object, moved in from a random side until it hides the drawn share.
    Neighbours,
    /// Everything on one side of a random straight line across the image, like the edge of a board.
    HalfSpace,
}

/// Defaults of missing keys: the section itself has none.
mod defaults {
    use super::OcclusionMode;

    pub(super) fn modes() -> Vec<OcclusionMode> {
        vec![OcclusionMode::Neighbours, OcclusionMode::HalfSpace]
    }

    pub(super) fn share() -> f64 {
        0.5
    }

    pub(super) fn min_hidden() -> f64 {
        0.0
    }

    pub(super) fn max_hidden() -> f64 {
        0.5
    }
}
