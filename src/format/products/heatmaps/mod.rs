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
pub use rows::{ForbiddenGrasp, PatchSquare, SeenGrasp, SeenPoint};

use crate::{
    Channel, Depth, Product,
    dataset::{DatasetError, Sample},
};

impl Product {
    /// Grasps of all bodies of settled scenes, as images of these scenes show them.
    pub const HEATMAPS: Self = Self::named("heatmaps");
}

impl Channel {
    /// [`SceneHeatmap`]: grasps of all bodies in one image; every sample of heatmaps has one.
    pub const HEATMAP_GRASPS: Self = Self::at("/heatmaps/grasps");

    /// [`Depth`] of the whole image.
    pub const HEATMAP_DEPTH: Self = Self::at("/heatmaps/depth");
}

impl Sample {
    /// Grasps of all bodies of a scene in one image.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is not a valid record.
    pub fn scene_heatmap(&self) -> Result<SceneHeatmap, DatasetError> {
        self.leading(Channel::HEATMAP_GRASPS, SceneHeatmap::decode)
    }

    /// Depth of that image, exact up to the step in which it is stored; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn heatmap_depth(&self) -> Result<Option<Depth>, DatasetError> {
        self.decoded(Channel::HEATMAP_DEPTH, Depth::decode)
    }
}
