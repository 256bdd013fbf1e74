//! Completion pairs: what one camera saw of an object, and the solid object, on one grid; also touch and further channels.

mod channels;
mod check;
mod contact;
mod facts;
mod hand;
mod occlusion;
mod pair;
mod row;
#[cfg(test)]
mod tests;
mod touch;

pub use channels::{Cloud, Coverage, Implicit, Tsdf, Visibility};
pub use check::PARTIAL_INSIDE_COMPLETE;
pub(super) use check::{CHECKS, check_touch};
pub use contact::{BlockedProbe, TouchContact};
pub use facts::PairFacts;
pub use hand::{Approach, ApproachEnd, HandTouch, LinkContact};
pub use occlusion::{Occlusion, OcclusionFacts, PixelMask};
pub use pair::VoxelPair;
pub use row::FORMAT;
pub use touch::TactileContacts;

use crate::{Channel, Depth, Product, Record, RecordError};

/// Message of touch of a body in clutter.
const CLUTTER_CONTACTS: &str = "graspmill.ClutterContacts";

/// Messages of touch.
const TOUCH_MESSAGES: [&str; 3] = ["graspmill.TactileContacts", "graspmill.HandContacts", CLUTTER_CONTACTS];

impl Product {
    /// Pairs of occupancy grids: the part of an object that one camera saw, and the solid object.
    pub const COMPLETION: Self = Self::named("completion");
}

impl Channel {
    /// [`VoxelPair`]: partial and complete grid, camera, poses; every completion sample has one.
    pub const PAIR: Self = Self::at("/completion/pair");
    /// [`Visibility`]: cells seen to be free.
    pub const VISIBILITY: Self = Self::at("/completion/visibility");
    /// [`Depth`](crate::Depth): the depth crop.
    pub const DEPTH: Self = Self::at("/completion/depth");
    /// [`Cloud`]: the partial point cloud.
    pub const CLOUD: Self = Self::at("/completion/cloud");
    /// [`Tsdf`]: truncated signed distance.
    pub const TSDF: Self = Self::at("/completion/tsdf");
    /// [`Coverage`]: share of each cell that is solid.
    pub const COVERAGE: Self = Self::at("/completion/coverage");
    /// [`Implicit`]: samples for implicit networks.
    pub const IMPLICIT: Self = Self::at("/completion/implicit");
    /// [`Occlusion`]: the occluder between the camera and the object.
    pub const OCCLUSION: Self = Self::at("/completion/occlusion");
    /// [`TactileContacts`] of random rays from the far side.
    pub const TOUCH_RAYS: Self = Self::at("/completion/touch_rays");
    /// [`TactileContacts`] of a hand that explores the surface that the camera did not see.
    pub const TOUCH_EXPLORATION: Self = Self::at("/completion/touch_exploration");
    /// [`TactileContacts`] of a hand that closes on the object once.
    pub const TOUCH_GRASP: Self = Self::at("/completion/touch_grasp");

    /// Whether messages are [`TactileContacts`]; each kind of touch has its own channel.
    pub fn is_touch(self) -> bool {
        TOUCH_MESSAGES.contains(&self.message)
    }

    /// Whether messages are [`TactileContacts`] with a [`HandTouch`].
    pub fn is_touch_by_hand(self) -> bool {
        self.is_touch() && self.name() != Self::TOUCH_RAYS.name()
    }

    /// Whether messages are [`TactileContacts`] that list the probes that an obstacle stopped.
    pub fn is_touch_in_clutter(self) -> bool {
        self.message == CLUTTER_CONTACTS
    }
}

impl Record for VoxelPair {
    const CHANNEL: Channel = Channel::PAIR;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for Visibility {
    const CHANNEL: Channel = Channel::VISIBILITY;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for Depth {
    const CHANNEL: Channel = Channel::DEPTH;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for Cloud {
    const CHANNEL: Channel = Channel::CLOUD;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for Tsdf {
    const CHANNEL: Channel = Channel::TSDF;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for Coverage {
    const CHANNEL: Channel = Channel::COVERAGE;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for Implicit {
    const CHANNEL: Channel = Channel::IMPLICIT;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for Occlusion {
    const CHANNEL: Channel = Channel::OCCLUSION;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}
