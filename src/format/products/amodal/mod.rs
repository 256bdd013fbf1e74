//! Amodal pairs: completion pairs of the bodies of settled scenes, and their surroundings.

mod check;
mod clutter;
mod facts;
mod row;
#[cfg(test)]
mod tests;

pub(super) use check::CHECKS;
pub use clutter::Clutter;
pub use facts::AmodalFacts;
pub use row::FORMAT;

use crate::{
    Channel, Product,
    dataset::{DatasetError, Sample},
};
use kernel::ids::ObjectId;

impl Product {
    /// Completion pairs of the bodies of settled scenes.
    pub const AMODAL: Self = Self::named("amodal");
}

impl Channel {
    /// [`VoxelPair`](crate::VoxelPair): partial and complete grid of one body, camera, poses; every amodal sample has one.
    pub const AMODAL_PAIR: Self = Self::at("/amodal/pair");
    /// [`Visibility`](crate::Visibility): cells seen to be free.
    pub const AMODAL_VISIBILITY: Self = Self::at("/amodal/visibility");
    /// [`Depth`](crate::Depth): the crop of the depth measured on the body.
    pub const AMODAL_DEPTH: Self = Self::at("/amodal/depth");
    /// [`Cloud`](crate::Cloud): the partial point cloud.
    pub const AMODAL_CLOUD: Self = Self::at("/amodal/cloud");
    /// [`Tsdf`](crate::Tsdf): truncated signed distance to the body.
    pub const AMODAL_TSDF: Self = Self::at("/amodal/tsdf");
    /// [`Coverage`](crate::Coverage): share of each cell that is solid.
    pub const AMODAL_COVERAGE: Self = Self::at("/amodal/coverage");
    /// [`Implicit`](crate::Implicit): samples for implicit networks.
    pub const AMODAL_IMPLICIT: Self = Self::at("/amodal/implicit");
    /// [`TactileContacts`](crate::TactileContacts) of random rays from the far side.
    pub const AMODAL_TOUCH_RAYS: Self = Self::at("/amodal/touch_rays");
    /// [`TactileContacts`](crate::TactileContacts) of a hand that explores the surface that the camera did not see.
    pub const AMODAL_TOUCH_EXPLORATION: Self = Self::at("/amodal/touch_exploration");
    /// [`Clutter`]: surroundings of the body; every amodal sample has one.
    pub const CLUTTER: Self = Self::at("/amodal/clutter");
}

impl Sample {
    /// Surroundings of the body of an amodal sample.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is not a valid record.
    pub fn clutter(&self) -> Result<Clutter, DatasetError> {
        self.leading(Channel::CLUTTER, Clutter::decode)
    }

    /// The object of a pair: in clutter a body of the scene, otherwise the sample's subject.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn object(&self) -> Result<ObjectId, DatasetError> {
        let clutter = self.decoded(Channel::CLUTTER, Clutter::decode)?;
        Ok(clutter.map_or(self.id.subject, |clutter| clutter.object))
    }
}
