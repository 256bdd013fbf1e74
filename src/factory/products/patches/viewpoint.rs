//! The viewpoint of a grasp, and the positions of its patches.

use nalgebra::{Matrix3, Point3, Rotation3};

use kernel::geom::{Approach, CameraCv, Frame, Object, Pose, World};
use robot::grasp::camera_axes;

/// The camera `distance` [m] back along the approach from the middle of the object's box, at which it points; up is the
/// object's z axis, or its x axis where the approach is within 5 degrees of that.
pub fn camera_from_object(
    object_from_approach: &Pose<Object, Approach>,
    middle: &Point3<f64>,
    distance: f64,
) -> Pose<CameraCv, Object> {
    camera_along(object_from_approach, middle, distance)
}

/// The camera of [`camera_from_object`] where the object rests on a table: up is the table's normal, or its x axis where the
/// approach is within 5 degrees of that.
pub fn camera_over_table(
    object_from_approach: &Pose<Object, Approach>,
    world_from_object: &Pose<World, Object>,
    middle: &Point3<f64>,
    distance: f64,
) -> Pose<CameraCv, Object> {
    let approach = *world_from_object * *object_from_approach;
    camera_along(&approach, &world_from_object.point(middle), distance) * *world_from_object
}

fn camera_along<F: Frame>(approach: &Pose<F, Approach>, middle: &Point3<f64>, distance: f64) -> Pose<CameraCv, F> {
    let sight = approach.rotation().matrix().column(2).into_owned();
    let [right, down] = camera_axes(&sight);
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, down, sight]));
    Pose::<F, CameraCv>::new(rotation, middle.coords - sight * distance).inverse()
}

/// The left or top pixel of a patch of `side` pixels around a pixel coordinate: its middle is at most half a pixel
/// away. `None` where it exceeds an image of `length` pixels.
pub fn corner(pixel: f64, side: u32, length: u32) -> Option<u32> {
    let first = (pixel - f64::from(side) / 2.0 + 0.5).floor();
    (first >= 0.0 && first + f64::from(side) <= f64::from(length)).then_some(first as u32)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use kernel::geom::Intrinsics;
    use robot::grasp::wrist_roll;

    #[test]
    fn a_patch_lies_around_its_pixel_or_nowhere() {
        assert_eq!(corner(36.0, 72, 640), Some(0));
        assert_eq!(corner(35.5, 72, 640), Some(0));
        assert_eq!((corner(35.4, 72, 640), corner(604.5, 72, 640), corner(f64::NAN, 72, 640)), (None, None, None));
        assert_eq!(corner(604.4, 72, 640), Some(568));
        for step in 0..400 {
            let pixel = 100.0 + f64::from(step) * 0.013;
            for side in [71, 72] {
                let corner = corner(pixel, side, 640).expect("well inside");
                assert!((f64::from(corner) + f64::from(side) / 2.0 - pixel).abs() <= 0.5);
            }
        }
    }

    #[test]
    fn the_camera_stands_back_along_the_approach_and_upright() {
        let middle = Point3::new(0.1, -0.2, 0.3);
        let camera = Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).expect("a camera");
        for rpy in [[0.3, -0.8, 2.0], [0.0, 0.0, 0.0], [std::f64::consts::PI, 0.0, 1.0], [1.5, 0.1, -2.0]] {
            let approach = Pose::from_xyz_rpy([0.0, 0.1, 0.05, rpy[0], rpy[1], rpy[2]]);
            let pose = camera_from_object(&approach, &middle, 2.0);
            let seen = pose.point(&middle);
            assert!((seen - Point3::new(0.0, 0.0, 2.0)).norm() < 1e-12, "{seen}");
            assert_eq!(camera.project(&seen).0.round(), 320.0);
            // Along z of the approach.
            let axis = pose.rotation() * approach.rotation() * Vector3::z();
            assert!((axis - Vector3::z()).norm() < 1e-12);
            // The wrist's roll is what the camera sees of it.
            let x = pose.rotation() * approach.rotation() * Vector3::x();
            let roll = wrist_roll(approach.rotation().matrix());
            assert!((libm::atan2(x.y, x.x) - roll).abs() < 1e-9);
            let up = pose.rotation() * Vector3::z();
            assert!(up.y < 1e-9 || up.xy().norm() < 0.1, "z is up in the image, or along the axis");
            // On a table the same axis of sight, with the table's normal up.
            let world_from_object = Pose::from_xyz_rpy([0.3, 0.2, 0.1, 1.4, -0.4, 0.9]);
            let over = camera_over_table(&approach, &world_from_object, &middle, 2.0);
            assert!((over.point(&middle) - Point3::new(0.0, 0.0, 2.0)).norm() < 1e-12);
            let axis = over.rotation() * approach.rotation() * Vector3::z();
            assert!((axis - Vector3::z()).norm() < 1e-12);
            let normal = over.rotation() * world_from_object.inverse().rotation() * Vector3::z();
            assert!(normal.x.abs() < 1e-12 && normal.y < 1e-9 || normal.xy().norm() < 0.1, "{normal}");
        }
    }
}
