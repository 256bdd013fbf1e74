//! An object of a completion job, ready for its views.

use nalgebra::Point3;

use super::{depth::SimObject, scene::pivot_point, settings::CompletionSettings};
use crate::products::pair::{ObjectChannels, PairObject, touch::TouchSurface};
use kernel::{
    geom::{Aabb, SimdLevel},
    ids::ObjectId,
    object::PreparedObject,
    voxel::SolidObject,
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
        let CompletionSettings { solid_with_surface, truth, channels, .. } = settings;
        let PairObject { kernel, channels } = PairObject::new(prepared, *solid_with_surface, *truth, channels, level);
        let bounds = prepared.bounds();
        Self {
            id: prepared.id(),
            pivot: pivot_point(settings.pivot, &bounds),
            bounds,
            sim,
            channels,
            touch: settings.touch.is_asked().then(|| TouchSurface::of_tree(prepared.tree(), level)),
            kernel,
        }
    }
}
