//! An object of a completion job, ready for its views.

use std::sync::Arc;

use nalgebra::Point3;

use super::{
    channels::ObjectChannels, depth::SimObject, scene::pivot_point, settings::CompletionSettings, touch::TouchSurface,
};
use kernel::{
    assets::Winding,
    geom::{Aabb, SimdLevel},
    ids::ObjectId,
    object::PreparedObject,
    voxel::{SolidObject, solid_occupancy},
};

/// An object ready for its views.
pub struct CompletionObject {
    pub(super) id: ObjectId,
    pub(super) bounds: Aabb,
    pub(super) pivot: Point3<f64>,
    pub(super) kernel: SolidObject,
    pub(super) sim: SimObject,
    pub(super) channels: ObjectChannels,
    /// For touch, where the job wants it.
    pub(super) touch: Option<TouchSurface>,
}

impl CompletionObject {
    pub(super) fn new(
        prepared: &PreparedObject,
        settings: &CompletionSettings,
        level: SimdLevel,
        sim: SimObject,
    ) -> Self {
        let (mesh, record, bounds) = (prepared.mesh(), prepared.record(), prepared.bounds());
        let solid = match settings.solid_with_surface {
            false => Arc::clone(prepared.solid()),
            true => Arc::new(solid_occupancy(mesh, prepared.inside_test(), true)),
        };
        Self {
            id: record.object,
            pivot: pivot_point(settings.pivot, &bounds),
            bounds,
            sim,
            channels: ObjectChannels::new(&settings.channels, prepared, &solid, level),
            touch: settings.touch.is_asked().then(|| TouchSurface::of_tree(prepared.tree(), level)),
            kernel: SolidObject::new(
                mesh,
                solid,
                record.watertight,
                record.winding == Winding::Outward,
                settings.truth,
            ),
        }
    }
}
