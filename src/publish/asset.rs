//! Kinds of assets, and the parts of their shapes that a dataset contains.

use serde::Serialize;

/// Kind of an asset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum AssetKind {
    /// A mesh.
    Object,
    /// A hand's description.
    Hand,
    /// A container of scenes, a mesh.
    Container,
    /// A robot's description.
    Robot,
}

impl AssetKind {
    pub fn name(self) -> &'static str {
        match self {
            Self::Object => "object",
            Self::Hand => "hand",
            Self::Container => "container",
            Self::Robot => "robot",
        }
    }
}

/// Part of an asset's shape that a dataset contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum AssetUse {
    /// The shape itself (`shapes.mcap`), and data made from it.
    Copied,
    /// Data made from the shape: grids, depth, images.
    Derived,
    /// Only facts: labels of poses, positions of contacts.
    Measured,
}
