//! Pose of the object in front of the camera.
//!
//! The world has z up; the camera is at its origin and points along +x (as in `scenes/single_view.xml`, which a test
//! compares). The object is rotated about its pivot, which is on the optical axis at the sample's distance.

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use super::settings::{CompletionSettings, Distance, Pivot};
use kernel::{
    geom::{Aabb, CameraCv, Intrinsics, Object, Pose, World},
    seed::Stream,
};

/// The fixed camera: x right = -y of the world, y down = -z of the world, z away = x of the world.
pub fn camera_from_world() -> Pose<CameraCv, World> {
    let axes = Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);
    Pose::new(Rotation3::from_matrix_unchecked(axes), Vector3::zeros())
}

/// The object rotated by `rotation` about its pivot, which is `distance` metres along the optical axis.
pub fn world_from_object(pivot: &Point3<f64>, rotation: &Rotation3<f64>, distance: f64) -> Pose<World, Object> {
    Pose::new(*rotation, Vector3::new(distance, 0.0, 0.0) - rotation * pivot.coords)
}

/// The point that the object is rotated about, in `Object` [m].
pub fn pivot_point(pivot: Pivot, bounds: &Aabb) -> Point3<f64> {
    match pivot {
        Pivot::BoxCentre => bounds.centre(),
        Pivot::MeshOrigin => Point3::origin(),
    }
}

/// Distance from the camera to the pivot along the optical axis [m]; drawn from the sample's stream `distance` where
/// the job gives a range.
pub fn distance(settings: &CompletionSettings, bounds: &Aabb, stream: impl FnOnce() -> Stream) -> f64 {
    match settings.distance {
        Distance::Fixed(distance) => distance,
        Distance::Range { min, max } => stream().uniform(min, max),
        Distance::Fit { share } => distance_to_fit(&settings.camera, bounds, share),
    }
}

/// Shortest distance from the camera to the pivot of a job's samples of an object [m].
pub fn shortest_distance(settings: &CompletionSettings, bounds: &Aabb) -> f64 {
    match settings.distance {
        Distance::Fixed(distance) | Distance::Range { min: distance, .. } => distance,
        Distance::Fit { share } => distance_to_fit(&settings.camera, bounds, share),
    }
}

/// Radius of the ball about its pivot that holds an object, however it is rotated [m].
pub fn reach_of(pivot: Pivot, bounds: &Aabb) -> f64 {
    let pivot = pivot_point(pivot, bounds);
    (bounds.max - pivot).sup(&(pivot - bounds.min)).norm()
}

/// Where the sphere around the box fills `share` of the shorter image side. A sphere of radius R at distance d on the
/// optical axis has an outline of radius f R / sqrt(d^2 - R^2) pixels.
fn distance_to_fit(camera: &Intrinsics, bounds: &Aabb, share: f64) -> f64 {
    let radius = (bounds.max - bounds.min).norm() / 2.0;
    let outline = share * f64::from(camera.width.min(camera.height)) / 2.0;
    let ratio = camera.fx.min(camera.fy) / outline;
    radius * (1.0 + ratio * ratio).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::geom::rotation_from_rpy;

    #[test]
    fn the_pivot_stands_on_the_optical_axis() {
        let pivot = Point3::new(0.1, -0.2, 0.3);
        let pose = camera_from_world() * world_from_object(&pivot, &rotation_from_rpy(0.3, -1.0, 2.0), 1.25);
        assert!((pose.point(&pivot) - Point3::new(0.0, 0.0, 1.25)).norm() < 1e-15);
    }

    #[test]
    fn up_in_the_world_is_up_in_the_image() {
        let seen = camera_from_world().point(&Point3::new(1.0, -0.1, 0.2));
        assert_eq!(seen, Point3::new(0.1, -0.2, 1.0));
    }

    #[test]
    fn a_fitted_sphere_has_the_stated_outline() {
        let camera = Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).expect("a camera");
        let side = 0.2 / 3f64.sqrt();
        let bounds = Aabb { min: Point3::origin(), max: Point3::new(side, side, side) };
        let d = distance_to_fit(&camera, &bounds, 0.5);
        let tangent = (0.1 / d) / (1.0 - (0.1 / d) * (0.1 / d)).sqrt();
        assert!((camera.fx * tangent - 120.0).abs() < 1e-9);
    }
}
