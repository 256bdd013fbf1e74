//! Balls, cans and boxes that a camera saw are found again.

use kernel::geom::{GridPlacement, Intrinsics, OccupancyGrid};
use nalgebra::{Point3, Rotation3, Vector3};

use super::*;
use crate::seen_cells::SeenPoint;

const CAMERA: Intrinsics =
    Intrinsics { width: 320, height: 240, fx: 280.0, fy: 280.0, cx: 160.0, cy: 120.0, near: 0.1 };
const N: u32 = 40;

/// A view of a solid: points with normals by stepping along each pixel's ray as far as the surface is away, grids about them.
struct View {
    points: Vec<SeenPoint>,
    partial: OccupancyGrid,
    free: OccupancyGrid,
    placement: GridPlacement,
}

impl View {
    /// Noise is the standard deviation of depths [m]; normals are those of a plane through noisy neighbours three pixels away.
    fn new(solid: &Primitive, noise: f64) -> Self {
        let mut draw = Stream::of_job(4, b"", "noise");
        let ray = |pixel: u32| {
            CAMERA.unproject(f64::from(pixel % CAMERA.width) + 0.5, f64::from(pixel / CAMERA.width) + 0.5, 1.0).coords
        };
        let depth = |pixel: u32| {
            let (ray, mut depth) = (ray(pixel), 0.2);
            for _ in 0..200 {
                let away = solid.signed_distance(&Point3::from(ray * depth));
                if away < 1e-7 {
                    return Some(depth);
                }
                depth += away / ray.norm();
            }
            None
        };
        let depths: Vec<Option<f64>> =
            (0..CAMERA.width * CAMERA.height).map(|pixel| Some(depth(pixel)? + noise * draw.normal())).collect();
        let point = |pixel: u32| Some(Point3::from(ray(pixel) * (*depths.get(pixel as usize)?)?));
        let seen = (0..CAMERA.width * CAMERA.height).filter_map(|pixel| {
            let position = point(pixel)?;
            // The farthest of three pixels to either side that sees the solid.
            let last = |step: i64| (0..=3).rev().find_map(|far| point((i64::from(pixel) + far * step) as u32));
            let across = |step: u32| Some(last(i64::from(step))? - last(-i64::from(step))?);
            let normal = across(1)?.cross(&across(CAMERA.width)?).try_normalize(1e-12)?;
            Some(SeenPoint { position, normal: if normal.dot(&position.coords) > 0.0 { -normal } else { normal } })
        });
        let points: Vec<SeenPoint> = seen.collect();
        let placement = placed(&points);
        let partial = cells_of(&points, &placement);
        let mut free = OccupancyGrid::new(N);
        for cell in (0..N.pow(3)).map(|at| [at / N / N, at / N % N, at % N]) {
            let centre = evidence::centre_of(cell, &placement);
            let (u, v) = CAMERA.project(&centre);
            let depth = depths[v as usize * CAMERA.width as usize + u as usize];
            if depth.is_none_or(|depth| centre.z < depth) && !partial.get(cell) {
                free.set(cell);
            }
        }
        Self { points, partial, free, placement }
    }

    fn seen(&self) -> SeenCells<'_> {
        SeenCells {
            partial: &self.partial,
            free: Some(&self.free),
            points: &self.points,
            placement: &self.placement,
            support: None,
        }
    }
}

fn placed(points: &[SeenPoint]) -> GridPlacement {
    let first = points[0].position;
    let (low, high) =
        points.iter().fold((first, first), |(low, high), point| (low.inf(&point.position), high.sup(&point.position)));
    let cell_size = (high - low).max() / (GridPlacement::FILL * f64::from(N));
    GridPlacement { resolution: N, centre: nalgebra::center(&low, &high), cell_size }
}

fn cells_of(points: &[SeenPoint], placement: &GridPlacement) -> OccupancyGrid {
    let mut partial = OccupancyGrid::new(N);
    for point in points {
        let cell = placement.coordinates_of(point.position.into());
        if cell.iter().all(|index| (0.0..f64::from(N)).contains(index)) {
            partial.set(cell.map(|index| index as u32));
        }
    }
    partial
}

/// Solids whose sizes a view shows: of the cylinder an end and the round side, of the box three sides.
fn solids() -> [Primitive; 3] {
    let turned = Rotation3::from_euler_angles(0.6, 0.5, 0.2);
    let axis = turned * Vector3::y();
    [
        Primitive::Ball { centre: Point3::new(0.02, -0.01, 0.6), radius: 0.05 },
        Primitive::Cylinder { centre: Point3::new(-0.02, 0.0, 0.6), axis, radius: 0.033, half_length: 0.06 },
        Primitive::Cuboid {
            centre: Point3::new(0.0, 0.02, 0.6),
            axes: [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| turned * axis),
            half_sides: [0.05, 0.03, 0.04],
        },
    ]
}

/// The largest distance between the surfaces' signed distances on points around both [m].
fn difference(found: &Primitive, solid: &Primitive, placement: &GridPlacement) -> f64 {
    let cells = (0..N.pow(3)).map(|at| [at / N / N, at / N % N, at % N]);
    let centres = cells.map(|cell| evidence::centre_of(cell, placement));
    let near = centres.filter(|centre| solid.signed_distance(centre).abs() < 0.01);
    near.map(|centre| (found.signed_distance(&centre) - solid.signed_distance(&centre)).abs()).fold(0.0, f64::max)
}

#[test]
fn a_ball_a_can_and_a_box_are_found_again() {
    for (noise, wanted) in [(0.0, 0.003), (0.0015, 0.006)] {
        for solid in &solids() {
            let view = View::new(solid, noise);
            let found = Primitive::fit(&view.seen()).expect("a shape");
            assert_eq!(std::mem::discriminant(&found), std::mem::discriminant(solid), "{found:?}, not {solid:?}");
            let off = difference(&found, solid, &view.placement);
            println!("noise {noise}: {off} m off, {found:?}");
            assert!(off < wanted, "{off} m off with noise of {noise} m: {found:?}, not {solid:?}");
            assert_eq!(Primitive::fit(&view.seen()), Some(found), "the same again");
            // Filled: all seen cells, and the inside of the solid.
            let filled = filled_primitive(&view.seen());
            assert_eq!(filled.count_both(&view.partial), view.partial.count());
            let cells = (0..N.pow(3)).map(|at| [at / N / N, at / N % N, at % N]);
            let is_deep =
                |cell: &[u32; 3]| solid.signed_distance(&evidence::centre_of(*cell, &view.placement)) < -wanted;
            assert!(cells.filter(is_deep).all(|cell| filled.get(cell)));
        }
    }
}

#[test]
fn a_shape_that_the_camera_sees_through_is_none() {
    // A ring of points of a ball: as many are near to it as before, yet the camera saw through its middle.
    let solid = solids()[0];
    let mut view = View::new(&solid, 0.0);
    let Primitive::Ball { centre, .. } = solid else { unreachable!("the first is a ball") };
    view.points.retain(|point| (point.position - centre).xy().norm() > 0.03);
    let whole = Primitive::fit(&view.seen());
    assert!(matches!(whole, Some(Primitive::Ball { .. })), "{whole:?}");
    view.partial = cells_of(&view.points, &view.placement);
    for cell in (0..N.pow(3)).map(|at| [at / N / N, at / N % N, at % N]) {
        if (evidence::centre_of(cell, &view.placement) - centre).xy().norm() < 0.03 {
            view.free.set(cell);
        }
    }
    let found = Primitive::fit(&view.seen());
    assert!(!matches!(found, Some(Primitive::Ball { radius, .. }) if radius > 0.03), "{found:?}");
}

#[test]
fn nothing_is_found_in_noise_and_in_a_few_points() {
    let mut draw = Stream::of_job(2, b"", "noise");
    let mut vector = || Vector3::from_fn(|_, _| draw.uniform(-0.05, 0.05));
    let points: Vec<SeenPoint> = (0..2000)
        .map(|_| SeenPoint { position: Point3::new(0.0, 0.0, 0.6) + vector(), normal: vector().normalize() })
        .collect();
    let placement = placed(&points);
    let partial = cells_of(&points, &placement);
    let seen = |points| SeenCells { partial: &partial, free: None, points, placement: &placement, support: None };
    assert_eq!(Primitive::fit(&seen(&points)), None);
    assert_eq!(filled_primitive(&seen(&points)).count(), 0, "an empty grid means that nothing was completed");
    assert_eq!(Primitive::fit(&seen(&points[..MIN_POINTS - 1])), None);
    assert_eq!(Primitive::fit(&seen(&[])), None);
}

#[test]
fn distances_are_those_of_the_solids() {
    let [ball, can, cuboid] = solids();
    let Primitive::Ball { centre, radius } = ball else { unreachable!("the first is a ball") };
    assert!((ball.signed_distance(&centre) + radius).abs() < 1e-15);
    let Primitive::Cylinder { centre, axis, radius, half_length } = can else { unreachable!("the second is a can") };
    let across = axis.cross(&Vector3::x()).normalize();
    for (along, out, wanted) in [
        (0.0, 0.0, -radius),
        (half_length - 0.01, 0.0, -0.01),
        (half_length + 0.03, radius + 0.04, 0.05),
        (0.0, radius + 0.02, 0.02),
    ] {
        let found = can.signed_distance(&(centre + axis * along + across * out));
        assert!((found - wanted).abs() < 1e-12, "{found}, not {wanted}");
    }
    let Primitive::Cuboid { centre, axes, half_sides: [a, b, c] } = cuboid else { unreachable!("the third is a box") };
    let corner = centre + axes[0] * (a + 0.02) + axes[1] * (b + 0.03) - axes[2] * (c + 0.06);
    assert!((cuboid.signed_distance(&corner) - 0.07).abs() < 1e-12);
    assert!((cuboid.signed_distance(&centre) + 0.03).abs() < 1e-12);
}
