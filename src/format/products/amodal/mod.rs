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

use crate::{Channel, Product, Record, RecordError};

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

impl Record for Clutter {
    const CHANNEL: Channel = Channel::CLUTTER;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}
