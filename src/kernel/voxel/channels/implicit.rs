//! Samples for implicit networks: points on the surface with normals, points in space with signed distance.

use nalgebra::{Point3, Vector3};

use super::surface::Surface;
use crate::{
    geom::{CameraCv, GridPlacement, Object, Pose, SolidGrid},
    seed::Stream,
};

/// Spreads of the points around the surface [cells], in turn. The two scales of Park et al. 2019, "DeepSDF", section
/// 5.1 (variances 0.0025 and 0.00025 of a unit ball), where a ball of radius 1 spans 16 cells of 40.
const SPREADS: [f64; 2] = [0.8, 0.25];
/// Draws of a point near the surface before one anywhere in the box is taken instead.
const TRIES: u32 = 16;

/// Training points of an implicit network, in `CameraCv` [m]. Keep one per thread; its memory is reused.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImplicitPoints {
    /// Points on the whole surface, uniform over its area; shape (surface, 3) [m].
    pub surface: Vec<[f32; 3]>,
    /// Unit normal of the surface at each surface point, outward; shape (surface, 3).
    pub normals: Vec<[f32; 3]>,
    /// Points in the grid's box: the first half (rounded up) uniform, the others near the surface; shape (space, 3) [m].
    pub space: Vec<[f32; 3]>,
    /// Signed distance of each space point to the surface, negative inside; shape (space,) [m].
    pub distances: Vec<f32>,
}

/// Draws `surface_count` points of the surface and `space_count` points in the grid's box with their exact distance.
///
/// Points near the surface are points of it moved by a normal offset of 0.8 or 0.25 cells along each axis; one that leaves
/// the box is drawn again. A mesh without area gives none on or near the surface.
pub fn implicit_points(
    surface: &Surface,
    solid: &SolidGrid,
    camera_from_object: &Pose<CameraCv, Object>,
    placement: &GridPlacement,
    (surface_count, space_count): (u32, u32),
    stream: &mut Stream,
    out: &mut ImplicitPoints,
) {
    out.surface.clear();
    out.normals.clear();
    out.space.clear();
    out.distances.clear();
    // Uniform point on the surface with its normal.
    let draw = |stream: &mut Stream| surface.point_at(stream.unit(), stream.unit(), stream.unit());
    // Surface points and normals in the camera's frame.
    for _ in 0..surface_count {
        if let Some((point, normal)) = draw(stream) {
            out.surface.push(single(&camera_from_object.point(&point)));
            out.normals.push((camera_from_object.rotation() * normal).map(|v| v as f32).into());
        }
    }
    let object_from_camera = camera_from_object.inverse();
    let (corner, side) = (placement.lower_corner(), f64::from(placement.resolution) * placement.cell_size);
    // Query points: uniform in the grid's box first, then around the surface.
    for i in 0..space_count {
        let anywhere = |stream: &mut Stream| corner + Vector3::from_fn(|_, _| stream.unit() * side);
        let point = if i < space_count.div_ceil(2) {
            anywhere(stream)
        } else {
            // Gaussian offset from a surface point, drawn again while outside the box.
            let spread = SPREADS[i as usize % SPREADS.len()] * placement.cell_size;
            let near = (0..TRIES).find_map(|_| {
                let (point, _) = draw(stream)?;
                let point = camera_from_object.point(&point) + Vector3::from_fn(|_, _| stream.normal() * spread);
                (point - corner).iter().all(|v| (0.0..side).contains(v)).then_some(point)
            });
            near.unwrap_or_else(|| anywhere(stream))
        };
        // The distance belongs to the point as stored.
        let stored = single(&point);
        let point = object_from_camera.point(&Point3::from(stored.map(f64::from)));
        out.space.push(stored);
        out.distances.push(surface.signed_distance(solid, &point) as f32);
    }
}

fn single(point: &Point3<f64>) -> [f32; 3] {
    point.coords.map(|v| v as f32).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::channels::surface::shapes;

    #[test]
    fn points_of_a_box_have_its_distances_and_normals() {
        let shape = shapes::cuboid([0.1, 0.06, 0.03]);
        let surface = Surface::new(&shape.mesh);
        let mut out = ImplicitPoints::default();
        for (view, (pose, placement)) in shapes::views(&shape).enumerate() {
            let mut stream = Stream::of_job(1, &[view as u8], "implicit");
            implicit_points(&surface, &shape.solid, &pose, &placement, (4000, 4001), &mut stream, &mut out);
            assert_eq!((out.surface.len(), out.normals.len()), (4000, 4000));
            assert_eq!((out.space.len(), out.distances.len()), (4001, 4001));
            let inverse = pose.inverse();
            let to_object = |point: &[f32; 3]| inverse.point(&Point3::from(point.map(f64::from)));
            for (point, normal) in out.surface.iter().zip(&out.normals) {
                let normal = inverse.rotation() * Vector3::from(normal.map(f64::from));
                let point = to_object(point);
                assert!((shape.distance)(&point).abs() < 1e-6);
                assert!(((shape.distance)(&(point + normal * 0.001)) - 0.001).abs() < 1e-6);
            }
            for (point, distance) in out.space.iter().zip(&out.distances) {
                assert!(((shape.distance)(&to_object(point)) - f64::from(*distance)).abs() < 1e-7);
                let cell = (Point3::from(point.map(f64::from)) - placement.lower_corner()) / placement.cell_size;
                assert!(cell.iter().all(|v| (-1e-4..40.0001).contains(v)));
            }
        }
    }

    #[test]
    fn surface_points_are_uniform_over_the_area() {
        let shape = shapes::cuboid([0.1, 0.06, 0.03]);
        let surface = Surface::new(&shape.mesh);
        let mut stream = Stream::of_job(2, b"", "area");
        let count = 60_000;
        let mut on_top = 0.0;
        let mut mean = Vector3::zeros();
        for _ in 0..count {
            let (point, normal) =
                surface.point_at(stream.unit(), stream.unit(), stream.unit()).expect("a mesh with area");
            on_top += f64::from(u8::from(normal.z > 0.5));
            mean += point.coords / f64::from(count);
        }
        let area = 2.0 * (0.1 * 0.06 + 0.06 * 0.03 + 0.03 * 0.1);
        assert!((surface.area() - area).abs() < 1e-8);
        assert!((on_top / f64::from(count) - 0.1 * 0.06 / area).abs() < 0.008, "{on_top}");
        assert!((mean - shape.centre.coords).norm() < 0.001, "{mean}");
    }

    #[test]
    fn the_same_stream_gives_the_same_points() {
        let shape = shapes::sphere(0.05);
        let surface = Surface::new(&shape.mesh);
        let (pose, placement) = shapes::views(&shape).next().expect("a view");
        let draw = || {
            let (mut stream, mut out) = (Stream::of_job(5, b"", "implicit"), ImplicitPoints::default());
            implicit_points(&surface, &shape.solid, &pose, &placement, (50, 50), &mut stream, &mut out);
            out
        };
        assert_eq!(draw(), draw());
    }
}
