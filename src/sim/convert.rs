//! MuJoCo's numbers as types of this house: indices, frames, solids.

use mujoco_rs::wrappers::mj_model::MjtGeomBase;
use nalgebra::{IsometryMatrix3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

use kernel::geom::{Frame, Pose, Shape, World};

/// MuJoCo's indices are C integers; those of existing elements are not negative.
pub(super) fn index(value: i32) -> usize {
    usize::try_from(value).expect("an index of the compiled model")
}

/// A frame from MuJoCo's position [m] and quaternion, w first.
pub(super) fn isometry(position: &[f64; 3], quaternion: &[f64; 4]) -> IsometryMatrix3<f64> {
    let [w, x, y, z] = *quaternion;
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)).to_rotation_matrix();
    IsometryMatrix3::from_parts(Translation3::from(Vector3::from(*position)), rotation)
}

/// The rotation of a frame as MuJoCo's quaternion, w first.
pub(super) fn quaternion(pose: &IsometryMatrix3<f64>) -> [f64; 4] {
    let rotation = UnitQuaternion::from_rotation_matrix(&pose.rotation);
    [rotation.w, rotation.i, rotation.j, rotation.k]
}

/// A frame in the world, from MuJoCo's position [m] and row-major rotation.
pub(super) fn pose_from<F: Frame>(position: &[f64; 3], rotation: &[f64; 9]) -> Pose<World, F> {
    Pose::new(Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(rotation)), Vector3::from_column_slice(position))
}

/// A placement as MuJoCo has it: a position and a rotation by rows.
pub(super) fn placement(position: &[f64], rows: &[f64]) -> IsometryMatrix3<f64> {
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(rows));
    IsometryMatrix3::from_parts(Translation3::from(Vector3::from_column_slice(position)), rotation)
}

/// A geom that is a solid in closed form: a box, a ball, a capsule or a cylinder.
pub(super) fn solid(kind: MjtGeomBase, [x, y, z]: &[f64; 3]) -> Option<Shape> {
    match kind {
        MjtGeomBase::mjGEOM_BOX => Some(Shape::Box { half: [*x, *y, *z] }),
        MjtGeomBase::mjGEOM_SPHERE => Some(Shape::Sphere { radius: *x }),
        MjtGeomBase::mjGEOM_CAPSULE => Some(Shape::Capsule { radius: *x, half: *y }),
        MjtGeomBase::mjGEOM_CYLINDER => Some(Shape::Cylinder { radius: *x, half: *y }),
        _ => None,
    }
}

/// The angle between two placements [rad].
pub(super) fn angle_between(one: &IsometryMatrix3<f64>, other: &IsometryMatrix3<f64>) -> f64 {
    // By the chord: good for small angles as well.
    let chord = (one.rotation.matrix() - other.rotation.matrix()).norm() / std::f64::consts::SQRT_2;
    2.0 * libm::asin((chord / 2.0).min(1.0))
}
