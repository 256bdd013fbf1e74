//! The per-view chain against rays in double precision, closed forms and brute force, on real scans and made shapes, at
//! every SIMD level.

mod depth;
mod grids;
mod meshes;
mod thesis;

use graspmill::geom::{CameraCv, Intrinsics, Object, Pose, rotation_from_rpy};
use nalgebra::{Point3, Vector3};

/// The camera of the jobs: 640 x 480, 1.047 rad.
pub fn camera() -> Intrinsics {
    Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).expect("a camera")
}

/// Turned about `centre`, which stands `distance` metres away on the optical axis. View `index` of a fixed list that
/// begins with the six head-on views.
pub fn pose(index: usize, centre: Point3<f64>, distance: f64) -> Pose<CameraCv, Object> {
    let quarter = std::f64::consts::FRAC_PI_2;
    let turn = index as f64;
    let (roll, pitch, yaw) = match index {
        0..4 => (0.0, turn * quarter, 0.0),
        4 | 5 => (quarter * (2.0 * turn - 9.0), 0.0, 0.0),
        _ => (turn * 2.399, (turn * 0.754).sin() * 1.3, turn * 1.117),
    };
    let rotation = rotation_from_rpy(roll, pitch, yaw);
    Pose::new(rotation, Vector3::new(0.0, 0.0, distance) - rotation * centre.coords)
}
