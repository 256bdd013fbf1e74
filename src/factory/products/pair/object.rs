//! An object as its pairs need it.

use std::sync::Arc;

use super::{Channels, ObjectChannels};
use assets::{Winding, object::PreparedObject};
use kernel::{
    geom::SimdLevel,
    voxel::{SolidObject, Truth, solid_occupancy},
};

/// An object as its pairs need it.
pub struct PairObject {
    /// Surface and solid.
    pub kernel: SolidObject,
    /// Parts of which its channels are made.
    pub channels: ObjectChannels,
}

impl PairObject {
    /// An object; `solid_with_surface`: its solid also holds every cell that the surface crosses.
    pub fn new(
        prepared: &PreparedObject,
        solid_with_surface: bool,
        truth: Truth,
        channels: &Channels,
        level: SimdLevel,
    ) -> Self {
        let (mesh, record) = (prepared.mesh(), prepared.record());
        let solid = match solid_with_surface {
            false => Arc::clone(prepared.solid()),
            true => Arc::new(solid_occupancy(mesh, prepared.inside_test(), true)),
        };
        let is_outward = record.winding == Winding::Outward;
        Self {
            channels: ObjectChannels::new(channels, prepared, &solid, level),
            kernel: SolidObject::new(mesh, solid, record.watertight, is_outward, truth),
        }
    }
}
