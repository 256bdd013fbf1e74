//! Placement, partial, complete and visibility grids against their definitions in double precision.

use graspmill::{
    geom::{CameraCv, DepthCrop, GridPlacement, Object, OccupancyGrid, Pose, SimdLevel, TriMesh},
    render::{Rasteriser, RenderMesh},
    voxel::{InsideTest, NoGrid, SolidObject, Truth, ViewGrids, solid_occupancy},
};
use nalgebra::{Point3, Vector3};

use super::{pose, read_scans};
use crate::support::{
    meshes::{block, bumpy, round},
    pairs::default_camera,
};

fn object(mesh: &TriMesh, truth: Truth) -> SolidObject {
    SolidObject::new(
        mesh,
        solid_occupancy(mesh, InsideTest::Crossings, truth == Truth::LowerCorners),
        true,
        true,
        truth,
    )
}

fn shapes(step: usize) -> Vec<(String, TriMesh)> {
    let mut shapes = read_scans(step);
    shapes.push(("block".into(), block([-0.1, -0.05, -0.02], [0.1, 0.07, 0.02])));
    shapes.push(("cube".into(), block([0.0; 3], [0.064; 3])));
    shapes.push(("rod".into(), block([0.0; 3], [0.008, 0.006, 0.3])));
    shapes.push(("coarse".into(), bumpy(6)));
    shapes.push(("bumpy".into(), bumpy(64)));
    shapes
}

/// One scan in every `step`, and built shapes.
#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn assert_partial_lies_in_complete(step: usize) {
    let camera = default_camera();
    let (mut raster, mut grids) = (Rasteriser::new(SimdLevel::detect()), ViewGrids::new(SimdLevel::detect()));
    let (mut partial, mut complete) = (OccupancyGrid::default(), OccupancyGrid::default());
    let mut pairs = 0;
    let shapes = shapes(step);
    let views = 24 * shapes.len();
    for (name, mesh) in shapes {
        let object = object(&mesh, Truth::AnyOverlap);
        let centre = mesh.aabb().expect("vertices").centre();
        for view in 0..24 {
            let pose = pose(view, centre, [1.0, 0.5, 1.7][view % 3]);
            let crop = raster.render(&object.render, &camera, &pose);
            let Ok(placement) = grids.place_grid(crop, &camera, [40, 40, 64, 128][view % 4]) else { continue };
            grids.partial(crop, &camera, &placement, false, &mut partial);
            grids.complete(&object, &pose, &placement, Truth::AnyOverlap, false, &mut complete);
            assert!(partial.count() > 0);
            assert_eq!(partial.count_both(&complete), partial.count(), "{name}, view {view}");
            pairs += 1;
        }
    }
    println!("{pairs} pairs of {views} views");
    assert!(pairs * 1992 > views * 1950);
}

#[test]
fn partial_lies_in_complete() {
    assert_partial_lies_in_complete(5);
}

#[test]
#[ignore = "slow: make test-all"]
fn partial_lies_in_complete_on_every_scan() {
    assert_partial_lies_in_complete(1);
}

#[test]
fn every_level_gives_the_same_grids() {
    let camera = default_camera();
    for (name, mesh) in shapes(7) {
        let objects = [Truth::AnyOverlap, Truth::LowerCorners].map(|truth| object(&mesh, truth));
        let centre = mesh.aabb().expect("vertices").centre();
        // Every resolution and rounding.
        for view in 0..4 {
            let pose = pose(view, centre, 1.0);
            let crop = Rasteriser::new(SimdLevel::Scalar).render(&objects[0].render, &camera, &pose).clone();
            let make = |level| {
                let mut grids = ViewGrids::new(level);
                let placement = grids.place_grid(&crop, &camera, [40, 33, 128, 64][view % 4]).expect("something seen");
                let mut all = [const { Vec::new() }; 6];
                let mut grid = OccupancyGrid::default();
                let mut partial = OccupancyGrid::default();
                grids.partial(&crop, &camera, &placement, false, &mut partial);
                all[0].extend_from_slice(partial.bytes());
                let truths = [Truth::AnyOverlap, Truth::Centre, Truth::Fraction(0.5), Truth::LowerCorners];
                for (truth, all) in truths.into_iter().zip(&mut all[1..]) {
                    let object = &objects[usize::from(truth == Truth::LowerCorners)];
                    grids.complete(object, &pose, &placement, truth, view % 2 == 1, &mut grid);
                    all.extend_from_slice(grid.bytes());
                }
                grids.free(&crop, &camera, &placement, &partial, &mut grid);
                all[5].extend_from_slice(grid.bytes());
                (placement, all)
            };
            let scalar = make(SimdLevel::Scalar);
            for level in SimdLevel::available() {
                assert!(make(level) == scalar, "{name}, view {view}, {level}");
            }
        }
    }
}

/// The placement, partial and visibility grids in plain double precision.
#[test]
fn placement_partial_and_free_follow_their_definitions() {
    let camera = default_camera();
    let mut grids = ViewGrids::new(SimdLevel::detect());
    for (name, mesh) in shapes(9) {
        let render = RenderMesh::new(&mesh, true);
        let centre = mesh.aabb().expect("vertices").centre();
        for view in 0..10 {
            let pose = pose(view, centre, 1.0);
            let crop = Rasteriser::new(SimdLevel::detect()).render(&render, &camera, &pose).clone();
            let points: Vec<Point3<f64>> = (0..crop.height)
                .flat_map(|y| (0..crop.width).map(move |x| (crop.left + x, crop.top + y)))
                .map(|(x, y)| camera.unproject(f64::from(x) + 0.5, f64::from(y) + 0.5, f64::from(crop.at(x, y))))
                .filter(|point| !point.z.is_nan())
                .collect();
            let low = points.iter().fold(points[0], |a, b| a.inf(b));
            let high = points.iter().fold(points[0], |a, b| a.sup(b));
            let placement = grids.place_grid(&crop, &camera, 40).expect("something seen");
            assert_eq!(placement.centre, nalgebra::center(&low, &high), "{name} view {view}");
            assert_eq!(placement.cell_size, (high - low).max() / 32.0);

            let mut expected = OccupancyGrid::new(40);
            for point in &points {
                let cell: [f64; 3] = std::array::from_fn(|axis| {
                    ((point[axis] - placement.centre[axis]) / placement.cell_size + placement.anchor()[axis]).floor()
                });
                if cell.iter().all(|index| (0.0..40.0).contains(index)) {
                    expected.set(cell.map(|index| index as u32));
                }
            }
            let mut partial = OccupancyGrid::default();
            grids.partial(&crop, &camera, &placement, false, &mut partial);
            assert_eq!(partial, expected, "{name} view {view}");
            let mut dropped = OccupancyGrid::default();
            grids.partial(&crop, &camera, &placement, true, &mut dropped);
            assert_eq!(
                dropped.count(),
                expected.cells().filter(|cell| cell.iter().all(|index| *index > 0)).count() as u32
            );

            let mut free = OccupancyGrid::default();
            grids.free(&crop, &camera, &placement, &partial, &mut free);
            let corner = placement.lower_corner();
            for x in 0..40 {
                for y in 0..40 {
                    for z in 0..40 {
                        let middle = corner
                            + Vector3::new(f64::from(x) + 0.5, f64::from(y) + 0.5, f64::from(z) + 0.5)
                                * placement.cell_size;
                        let (u, v) = camera.project(&middle);
                        let seen = f64::from(crop.at(u.floor() as u32, v.floor() as u32));
                        let expected = !partial.get([x, y, z]) && (seen.is_nan() || seen > middle.z);
                        assert_eq!(free.get([x, y, z]), expected, "{name} view {view} cell {x} {y} {z}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_view_of_nothing_or_one_pixel_has_no_grid() {
    let mut grids = ViewGrids::new(SimdLevel::detect());
    assert_eq!(grids.place_grid(&DepthCrop::default(), &default_camera(), 40), Err(NoGrid::NothingSeen));
    let mut crop = DepthCrop { left: 3, top: 4, width: 2, height: 1, depth: vec![f32::NAN, f32::NAN] };
    assert_eq!(grids.place_grid(&crop, &default_camera(), 40), Err(NoGrid::NothingSeen));
    crop.depth[1] = 1.0;
    assert_eq!(grids.place_grid(&crop, &default_camera(), 40), Err(NoGrid::NoExtent));
}

/// Signed volume of the tetrahedra over the faces around a point over the full solid angle (van Oosterom and Strackee
/// 1983): 1 inside a closed mesh, 0 outside.
fn winding(mesh: &[[Point3<f64>; 3]], point: &Point3<f64>) -> f64 {
    let sum: f64 = mesh
        .iter()
        .map(|corners| {
            let [a, b, c] = corners.map(|corner| corner - point);
            let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
            let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
            a.dot(&b.cross(&c)).atan2(below)
        })
        .sum();
    sum / (2.0 * std::f64::consts::PI)
}

/// A cube and a triangle are apart when some axis separates them: all 13, in double precision, from scratch.
fn meets(corners: &[Point3<f64>; 3], centre: &Point3<f64>, half: f64) -> bool {
    let [a, b, c] = corners.map(|corner| corner - centre);
    let edges = [b - a, c - b, a - c];
    let boxes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let mut axes = boxes.to_vec();
    axes.push(edges[0].cross(&edges[1]));
    axes.extend(edges.iter().flat_map(|edge| boxes.iter().map(|axis| edge.cross(axis))));
    axes.iter().all(|axis| {
        let reach = half * axis.abs().sum();
        let along = [a.dot(axis), b.dot(axis), c.dot(axis)];
        along.iter().copied().fold(f64::MAX, f64::min) <= reach
            && along.iter().copied().fold(f64::MIN, f64::max) >= -reach
    })
}

/// `AnyOverlap` against every cell by every near triangle and the winding number of every cell's centre. Cells may
/// differ only where the surface is within the tolerance of the box.
fn assert_complete_meets_the_solid<const N: usize>(views: [usize; N]) {
    let camera = default_camera();
    let mut grids = ViewGrids::new(SimdLevel::detect());
    for (name, mesh) in shapes(20) {
        let object = object(&mesh, Truth::AnyOverlap);
        let centre = mesh.aabb().expect("vertices").centre();
        for view in views {
            let resolution = if mesh.triangles.len() > 1000 { 24 } else { 40 };
            let pose = pose(view, centre, 1.0);
            let crop = Rasteriser::new(SimdLevel::detect()).render(&object.render, &camera, &pose).clone();
            let placement = grids.place_grid(&crop, &camera, resolution).expect("something seen");
            let mut complete = OccupancyGrid::default();
            grids.complete(&object, &pose, &placement, Truth::AnyOverlap, false, &mut complete);
            let faces: Vec<[Point3<f64>; 3]> = (0..mesh.triangles.len())
                .map(|triangle| mesh.corners(triangle).map(|corner| to_grid(&placement, &pose.point(&corner))))
                .collect();
            let tolerance = 1e-6 * 1.3 / placement.cell_size + 4e-5;
            let (surely, perhaps) = (mark(&faces, resolution, 0.5), mark(&faces, resolution, 0.5 + 1.5 * tolerance));
            let stride = if mesh.triangles.len() > 1000 { 37 } else { 7 };
            for (index, (surely, perhaps)) in surely.into_iter().zip(perhaps).enumerate() {
                let n = resolution as usize;
                let cell = [index / n / n, index / n % n, index % n].map(|part| part as u32);
                if surely {
                    assert!(complete.get(cell), "{name} view {view} {cell:?}: meets the surface");
                } else if !perhaps && index % stride == 0 {
                    let inside = winding(&faces, &Point3::from(cell.map(|index| f64::from(index) + 0.5))) > 0.5;
                    assert_eq!(complete.get(cell), inside, "{name} view {view} {cell:?}");
                }
            }
        }
    }
}

#[test]
fn complete_is_every_cell_that_meets_the_solid() {
    assert_complete_meets_the_solid([2, 7]);
}

#[test]
#[ignore = "slow: make test-all"]
fn complete_is_every_cell_that_meets_the_solid_in_more_views() {
    assert_complete_meets_the_solid([1, 2, 7, 8]);
}

fn to_grid(placement: &GridPlacement, point: &Point3<f64>) -> Point3<f64> {
    Point3::from((point - placement.lower_corner()) / placement.cell_size)
}

fn mark(faces: &[[Point3<f64>; 3]], resolution: u32, half: f64) -> Vec<bool> {
    let n = resolution as usize;
    let mut marks = vec![false; n * n * n];
    for face in faces {
        let range = |axis: usize| {
            let values = face.map(|corner| corner[axis]);
            let low = values.iter().copied().fold(f64::MAX, f64::min) - 1.0;
            let high = values.iter().copied().fold(f64::MIN, f64::max) + 1.0;
            low.clamp(0.0, n as f64) as usize..(high.clamp(-1.0, n as f64 - 1.0) + 1.0) as usize
        };
        for x in range(0) {
            for y in range(1) {
                for z in range(2) {
                    let centre = Point3::new(x as f64 + 0.5, y as f64 + 0.5, z as f64 + 0.5);
                    let mark = &mut marks[(x * n + y) * n + z];
                    *mark = *mark || meets(face, &centre, half);
                }
            }
        }
    }
    marks
}

/// `LowerCorners` against every solid fine cell.
#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn assert_lower_corners<const N: usize>(views: [usize; N]) {
    let camera = default_camera();
    let mut grids = ViewGrids::new(SimdLevel::detect());
    let (mut cells, mut different) = (0, 0);
    for (name, mesh) in shapes(20) {
        let object = object(&mesh, Truth::LowerCorners);
        let centre = mesh.aabb().expect("vertices").centre();
        for view in views {
            let pose = pose(view, centre, 1.0);
            let crop = Rasteriser::new(SimdLevel::detect()).render(&object.render, &camera, &pose).clone();
            let placement = grids.place_grid(&crop, &camera, 40).expect("something seen");
            let mut complete = OccupancyGrid::default();
            grids.complete(&object, &pose, &placement, Truth::LowerCorners, true, &mut complete);
            let expected = corners(&object, &pose, &placement);
            cells += expected.count();
            different += expected.count() + complete.count() - 2 * expected.count_both(&complete);
            assert!(expected.cells().all(|cell| cell.iter().all(|index| *index > 0)), "{name} view {view}");
        }
    }
    println!("{different} of {cells} cells differ");
    // Single precision puts one corner in some ten thousand into the next cell.
    assert!(f64::from(different) <= 1e-4 * f64::from(cells));
}

#[test]
fn lower_corners_are_those_of_every_solid_cell() {
    assert_lower_corners([2, 7]);
}

#[test]
#[ignore = "slow: make test-all"]
fn lower_corners_are_those_of_every_solid_cell_in_more_views() {
    assert_lower_corners([1, 2, 7, 8]);
}

fn corners(object: &SolidObject, pose: &Pose<CameraCv, Object>, placement: &GridPlacement) -> OccupancyGrid {
    let mut grid = OccupancyGrid::new(placement.resolution);
    let solid = &object.solid;
    for x in 0..256 {
        for y in 0..256 {
            for z in 0..256 {
                if solid.get(x, y, z) {
                    let corner = solid.origin + Vector3::new(x as f64, y as f64, z as f64) * solid.pitch;
                    let cell = to_grid(placement, &pose.point(&corner)).map(f64::floor);
                    if cell.iter().all(|index| (1.0..40.0).contains(index)) {
                        grid.set(std::array::from_fn(|axis| cell[axis] as u32));
                    }
                }
            }
        }
    }
    grid
}

#[test]
fn centre_and_fraction_bracket_the_solid() {
    let camera = default_camera();
    let mut grids = ViewGrids::new(SimdLevel::detect());
    let radius = 0.1;
    let mesh = round(100, |_, _| radius);
    let object = object(&mesh, Truth::AnyOverlap);
    for view in [6, 7] {
        let pose = pose(view, Point3::origin(), 1.0);
        let crop = Rasteriser::new(SimdLevel::detect()).render(&object.render, &camera, &pose).clone();
        let placement = grids.place_grid(&crop, &camera, 40).expect("something seen");
        let volume = |grid: &OccupancyGrid| f64::from(grid.count()) * placement.cell_size.powi(3);
        // The grid ends before the sphere's back does.
        let whole = 4.0 / 3.0 * std::f64::consts::PI * f64::powi(radius, 3);
        let behind = 1.0 + radius - (placement.centre.z + 22.0 * placement.cell_size);
        let exact = whole - std::f64::consts::PI * behind * behind * (3.0 * radius - behind) / 3.0;
        let share = grids.solid_share(&object, &pose, &placement);
        assert!(behind > 0.01 && (share - exact / whole).abs() < 1e-3, "{share}");
        let mut make = |truth| {
            let mut grid = OccupancyGrid::default();
            grids.complete(&object, &pose, &placement, truth, false, &mut grid);
            grid
        };
        let [any, centre, half, full] =
            [Truth::AnyOverlap, Truth::Centre, Truth::Fraction(0.5), Truth::Fraction(1.0)].map(&mut make);
        assert!((volume(&centre) / exact - 1.0).abs() < 0.01 && (volume(&half) / exact - 1.0).abs() < 0.01);
        assert!(volume(&any) > 1.05 * exact && volume(&full) < 0.95 * exact);
        for (small, large) in [(&full, &half), (&half, &any), (&centre, &any)] {
            assert_eq!(small.count_both(large), small.count());
        }
        // A grid that ends in the sphere's middle holds half of it.
        let mut halved = placement;
        halved.centre = Point3::new(0.0, 0.0, 1.0);
        halved.centre.x -= 20.0 * placement.cell_size;
        assert!((grids.solid_share(&object, &pose, &halved) - 0.5).abs() < 0.01);
    }
}
