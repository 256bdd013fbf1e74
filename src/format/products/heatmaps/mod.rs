//! Heatmaps of scenes: where palm and fingertips of grasps of all bodies would be in an image of a settled scene, and how good each
//! grasp is.

mod check;
mod coding;
mod facts;
mod heatmap;
mod row;
mod row_coding;
mod rows;
#[cfg(test)]
mod tests;

pub(super) use check::CHECKS;
pub use facts::HeatmapFacts;
pub use heatmap::{HeatmapLabel, SceneHeatmap};
pub use row::FORMAT;
pub use rows::{ForbiddenGrasp, PatchSquare, ProjectedPoint, SeenGrasp};

use crate::{Channel, Product, Record, RecordError};

impl Product {
    /// Grasps of all bodies of settled scenes, as images of these scenes show them.
    pub const HEATMAPS: Self = Self::named("heatmaps");
}

impl Channel {
    /// [`SceneHeatmap`]: grasps of all bodies in one image; every sample of heatmaps has one.
    pub const HEATMAP_GRASPS: Self = Self::at("/heatmaps/grasps");

    /// [`Depth`](crate::Depth) of the whole image.
    pub const HEATMAP_DEPTH: Self = Self::at("/heatmaps/depth");
}

impl Record for SceneHeatmap {
    const CHANNEL: Channel = Channel::HEATMAP_GRASPS;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}
