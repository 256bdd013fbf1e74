//! An object of a completion job, ready for its views.

use nalgebra::{Point3, Rotation3};

use super::{depth::SimObject, scene::pivot_point, settings::CompletionSettings};
use crate::products::pair::{ObjectChannels, PairObject, touch::TouchSurface};
use assets::object::PreparedObject;
use kernel::{
    geom::{Aabb, SimdLevel, rotation_from_quaternion},
    ids::ObjectId,
    seed::Stream,
    voxel::SolidObject,
};

/// An object ready for its views.
pub struct CompletionObject {
    pub(super) id: ObjectId,
    pub(super) bounds: Aabb,
    pub(super) pivot: Point3<f64>,
    /// Rotation of the object before that of each view, if the job has one.
    pub(super) own_rotation: Option<Rotation3<f64>>,
    pub(super) kernel: SolidObject,
    pub(super) sim: SimObject,
    pub(super) channels: ObjectChannels,
    /// For touch, if the job has touch.
    pub(super) touch: Option<TouchSurface>,
}

impl CompletionObject {
    pub(super) fn new(
        prepared: &PreparedObject,
        settings: &CompletionSettings,
        seed: u64,
        level: SimdLevel,
        sim: SimObject,
    ) -> Self {
        let CompletionSettings { solid_with_surface, truth, channels, .. } = settings;
        let PairObject { kernel, channels } = PairObject::new(prepared, *solid_with_surface, *truth, channels, level);
        let bounds = prepared.bounds();
        Self {
            id: prepared.id(),
            pivot: pivot_point(settings.pivot, &bounds),
            own_rotation: settings.views_per_object.then(|| own_rotation(seed, prepared.id())),
            bounds,
            sim,
            channels,
            touch: settings.touch.is_asked().then(|| TouchSurface::of_tree(prepared.tree(), level)),
            kernel,
        }
    }
}

/// The random rotation of an object, all rotations alike likely (a quaternion of four normal numbers: Muller 1959).
fn own_rotation(seed: u64, object: ObjectId) -> Rotation3<f64> {
    let mut stream = Stream::of_job(seed, &object.0.0, "views");
    rotation_from_quaternion(std::array::from_fn(|_| stream.normal()))
}

#[cfg(test)]
mod tests {
    use kernel::{geom::rotation_from_rpy, ids::Digest};

    use super::*;

    #[test]
    fn all_rotations_are_alike_likely() {
        // Uniform on SO(3): the traces of R^T Q for a fixed Q average to 0, their squares to 1.
        for reference in [Rotation3::identity(), rotation_from_rpy(0.3, -1.1, 2.0)] {
            let traces = (0..4000_u32).map(|object| {
                let own = own_rotation(7, ObjectId(Digest::hash_parts([&object.to_le_bytes()[..]])));
                (own.inverse() * reference).matrix().trace()
            });
            let traces: Vec<f64> = traces.collect();
            let mean = traces.iter().sum::<f64>() / 4000.0;
            let second = traces.iter().map(|trace| trace * trace).sum::<f64>() / 4000.0;
            // Four standard errors.
            assert!(mean.abs() < 4.0 / 4000_f64.sqrt() && (second - 1.0).abs() < 0.11, "{mean} {second}");
        }
    }
}
