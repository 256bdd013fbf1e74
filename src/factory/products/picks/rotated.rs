//! Grasps rotated about the line along which a gripper closes.

use std::f64::consts::TAU;

use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3, Unit, Vector3};

use super::settings::StoredGrasp;

/// The hand's base of a stored grasp that is rotated by `steps` of `rolls` even steps over the full circle, about the hand's closing line,
/// expressed in its base frame, through the middle of the grasp's contacts. Without a step it is the stored pose to the bit.
pub fn rotated_about_line(
    grasp: &StoredGrasp,
    line: Option<Vector3<f64>>,
    steps: u32,
    rolls: u32,
) -> IsometryMatrix3<f64> {
    let object_from_base = *grasp.object_from_base.isometry();
    let Some(line) = line.filter(|_| steps > 0) else { return object_from_base };
    let axis = Unit::new_normalize(object_from_base.rotation * line);
    let rotation = Rotation3::from_axis_angle(&axis, TAU * f64::from(steps) / f64::from(rolls));
    let middle = Point3::from(grasp.middle);
    let shifted = middle + rotation * (Point3::from(object_from_base.translation.vector) - middle);
    IsometryMatrix3::from_parts(Translation3::from(shifted.coords), rotation * object_from_base.rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::geom::Pose;

    #[test]
    fn half_a_rotation_brings_the_base_to_the_other_side_of_the_line() {
        let grasp = StoredGrasp {
            run: 0,
            rank: 0,
            object_from_base: Pose::from_xyz_rpy([0.0, 0.0, 0.1, 0.0, 0.0, 0.0]),
            posture: Vec::new(),
            middle: [0.01, 0.02, 0.03],
        };
        let line = Some(Vector3::new(0.0, 2.0, 0.0));
        let stored = *grasp.object_from_base.isometry();
        assert_eq!(rotated_about_line(&grasp, line, 0, 4), stored);
        assert_eq!(rotated_about_line(&grasp, None, 1, 4), stored);
        // About y through (0.01, 0.03): (0, 0.1) goes to (0.02, -0.04), and by a quarter to (0.08, 0.04).
        let half = rotated_about_line(&grasp, line, 2, 4);
        assert!((half.translation.vector - Vector3::new(0.02, 0.0, -0.04)).norm() < 1e-15, "{half}");
        assert!((half.rotation * Vector3::z() + Vector3::z()).norm() < 1e-15);
        let quarter = rotated_about_line(&grasp, line, 1, 4);
        assert!((quarter.translation.vector - Vector3::new(0.08, 0.0, 0.04)).norm() < 1e-15, "{quarter}");
        assert!((quarter.rotation * Vector3::y() - Vector3::y()).norm() < 1e-15, "the line stays");
    }
}
