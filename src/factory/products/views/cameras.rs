//! Poses of cameras: drawn on a shell, straight above, or given one by one.

use nalgebra::{Matrix3, Point3, Rotation3, Unit, Vector3};

use super::settings::{ViewPlacement, pose_of};
use kernel::{
    geom::{CameraCv, Pose, World},
    seed::Stream,
};

/// A direction this close to straight down has x as up: the sine of the angle.
const ALMOST_DOWN: f64 = 1e-3;

/// The pose of a camera at a point that points at another, rolled about its axis [rad]. Up in the image is up in the world; of a
/// camera that looks straight down or up, x.
pub fn camera_at(eye: &Point3<f64>, target: &Point3<f64>, roll: f64) -> Pose<World, CameraCv> {
    let forward = (target - eye).try_normalize(0.0).unwrap_or_else(|| -Vector3::z());
    let right = forward.cross(&Vector3::z());
    let up = if right.norm() < ALMOST_DOWN { Vector3::x() } else { Vector3::z() };
    let right = forward.cross(&up).normalize();
    let down = forward.cross(&right);
    let (sin, cos) = libm::sincos(roll);
    let columns = [right * cos + down * sin, down * cos - right * sin, forward];
    Pose::new(Rotation3::from_matrix_unchecked(Matrix3::from_columns(&columns)), eye.coords)
}

/// The pose of a view: `view` counts those of one camera. Where it has a shell, it is drawn from `stream` around `aim`, at which
/// it points.
///
/// # Panics
/// When there are fewer poses.
pub fn world_from_camera(
    placement: &ViewPlacement,
    view: u32,
    aim: &Point3<f64>,
    stream: &mut Stream,
) -> Pose<World, CameraCv> {
    match placement {
        ViewPlacement::Shell { radius, polar_deg, roll_deg, .. } => {
            let azimuth = stream.uniform(0.0, std::f64::consts::TAU);
            let [low, high] = polar_deg.map(|angle| libm::cos(angle.to_radians()));
            // Uniform by area: the cosine is.
            let cosine = stream.uniform(high, low);
            let sine = libm::sqrt((1.0 - cosine * cosine).max(0.0));
            let distance = stream.uniform(radius[0], radius[1]);
            let roll = stream.uniform(roll_deg[0], roll_deg[1]).to_radians();
            let (sin, cos) = libm::sincos(azimuth);
            let out = Unit::new_unchecked(Vector3::new(sine * cos, sine * sin, cosine));
            camera_at(&(aim + out.into_inner() * distance), aim, roll)
        }
        ViewPlacement::Overhead(height) => {
            // Half a turn about x: right is x, up is y.
            Pose::from_rows(&[1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, *height])
        }
        ViewPlacement::Poses(poses) => pose_of(&poses[view as usize]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::products::views::Aim;
    use kernel::ids::{Digest, ItemId, ObjectId, SampleId};

    #[test]
    fn cameras_look_where_they_should_with_up_above() {
        let target = Point3::new(0.1, -0.2, 0.05);
        for eye in [Point3::new(0.6, 0.2, 0.4), Point3::new(-0.3, -0.2, 0.9), Point3::new(0.1, -0.2, 0.7)] {
            let pose = camera_at(&eye, &target, 0.0);
            let seen = pose.inverse().point(&target);
            assert!(seen.x.abs() < 1e-12 && seen.y.abs() < 1e-12 && (seen.z - (target - eye).norm()).abs() < 1e-12);
            let matrix = pose.rotation().matrix();
            assert!((matrix.transpose() * matrix - Matrix3::identity()).amax() < 1e-12);
            assert!((matrix.determinant() - 1.0).abs() < 1e-12);
            // Points above the target are above it in the image; from straight above, points along x are.
            let is_above = (eye - target).xy().norm() < 1e-9;
            let higher = target + if is_above { Vector3::x() } else { Vector3::z() } * 0.05;
            let above = pose.inverse().point(&higher);
            assert!(above.y < -1e-3 && above.x.abs() < 1e-12, "{above}");
            // A quarter turn to the right rotates up to the right.
            let rolled = camera_at(&eye, &target, std::f64::consts::FRAC_PI_2).inverse().point(&higher);
            assert!(rolled.y.abs() < 1e-12 && rolled.x.abs() > 1e-3);
        }
    }

    #[test]
    fn a_shell_is_filled_evenly() {
        let polar_deg = [0.0, 60.0];
        let placement = ViewPlacement::Shell { radius: [0.4, 0.6], polar_deg, roll_deg: [0.0; 2], aim: Aim::Origin };
        let sample = SampleId::of_object(ObjectId(Digest([3; 32])), ItemId(0));
        let mut stream = Stream::of_sample(1, &sample, "shell");
        let aim = Point3::new(0.0, 0.0, 0.1);
        let (mut heights, mut around, count) = (0.0, Vector3::zeros(), 4000);
        for _ in 0..count {
            let offset = world_from_camera(&placement, 0, &aim, &mut stream).translation() - aim.coords;
            let distance = offset.norm();
            assert!((0.4..0.6 + 1e-12).contains(&distance) && offset.z / distance > 0.5 - 1e-9);
            heights += offset.z / distance;
            around += Vector3::new(offset.x, offset.y, 0.0);
        }
        // The cosine is uniform from 0.5 to 1: mean 3/4, within five standard errors.
        let mean = heights / f64::from(count);
        assert!((mean - 0.75).abs() < 5.0 * 0.5 / (12.0 * f64::from(count)).sqrt(), "{mean}");
        assert!(around.norm() / f64::from(count) < 0.03);
    }
}
