//! The thesis's conventions on a body whose numbers can be worked by hand.
//!
//! A square frustum, axes as the camera's: front face |x|, |y| <= 0.05 at z = 0.2, back face |x|, |y| <= 0.115 at
//! z = 0.5. Its flanks widen by 0.0433 a 0.2 m, less than the view's 0.05 a 0.2 m, so that the camera sees the front face
//! and nothing else, while the body behind it is far wider than what is seen.

use graspmill::{
    geom::{OccupancyGrid, Pose, SimdLevel, TriMesh},
    render::Rasteriser,
    voxel::{InsideTest, SolidObject, Truth, ViewGrids, solid_occupancy},
};
use nalgebra::{Rotation3, Vector3};

use crate::support::{meshes::block, pairs::default_camera};

fn frustum() -> TriMesh {
    let mut mesh = block([-0.05, -0.05, 0.2], [0.05, 0.05, 0.5]);
    for [x, y, _] in mesh.vertices.iter_mut().filter(|vertex| vertex[2] == 0.5) {
        (*x, *y) = (0.115_f32.copysign(*x), 0.115_f32.copysign(*y));
    }
    mesh
}

#[test]
fn the_frustum_has_the_grid_worked_by_hand() {
    let (camera, mesh) = (default_camera(), frustum());
    let solid = solid_occupancy(&mesh, InsideTest::Crossings, true);
    let object = SolidObject::new(&mesh, solid, true, true, Truth::LowerCorners);
    let pose = Pose::new(Rotation3::identity(), Vector3::zeros());
    let mut raster = Rasteriser::new(SimdLevel::detect());
    let mut grids = ViewGrids::new(SimdLevel::detect());
    let crop = raster.render(&object.render, &camera, &pose);

    // f = 320 / tan(0.5235) = 554.3827 px. The face ends 0.05 * f / 0.2 = 138.6 px from the middle, so the outermost pixel
    // centres are at 138.5 px: 277 + 1 = 278 rows and columns, all of them at depth 0.2.
    assert_eq!((crop.left, crop.top, crop.width, crop.height), (181, 101, 278, 278));
    assert!(crop.depth.iter().all(|depth| (depth - 0.2).abs() < 1e-7));

    // Those pixels see x and y up to 138.5 / f * 0.2 = 0.0499655 m: the longest side is 0.0999310 m, and 0.8 of 40 cells
    // are 32, so that a cell has 0.0031228 m. The middle of the seen box lies on the axis at depth 0.2.
    let placement = grids.place_grid(crop, &camera, 40).expect("a grid");
    let seen = 138.5 / (320.0 / (1.047_f64 / 2.0).tan()) * 0.2;
    assert!(
        (placement.cell_size - 2.0 * seen / 32.0).abs() < 1e-9 && (placement.cell_size - 0.003_122_84).abs() < 1e-8
    );
    assert!((placement.centre - nalgebra::Point3::new(0.0, 0.0, 0.2)).norm() < 1e-7);

    // Partial: x and y from -16 to 16 cells about the middle, 20: cells 4 to 35, and 36 for points on the far end itself,
    // which rounding may put there. Depth 0.2 is 0 cells from the centre: 0.45 * 40 = 18.
    let mut partial = OccupancyGrid::default();
    grids.partial(crop, &camera, &placement, true, &mut partial);
    for [x, y, z] in partial.cells().map(|cell| cell.map(i64::from)) {
        assert!((4..=36).contains(&x) && (4..=36).contains(&y) && (17..=18).contains(&z), "{:?}", (x, y, z));
    }
    assert!((5..35).all(|x| (5..35).all(|y| partial.get([x, y, 18]) || partial.get([x, y, 17]))));

    // Complete: lower corners of the solid's fine cells, and nothing with an index of 0. Layer z holds depths from
    // 0.2 + (z - 18) * c on. At layer z the body is 0.05 + 0.21667 * (depth - 0.2) wide either way.
    let mut complete = OccupancyGrid::default();
    grids.complete(&object, &pose, &placement, Truth::LowerCorners, true, &mut complete);
    let (c, pitch) = (placement.cell_size, 0.3 / 256.0);
    let layer = |z: u32| -> (i64, i64) {
        let xs = (0..40).filter(|x| (0..40).any(|y| complete.get([*x, y, z]))).map(i64::from);
        xs.fold((i64::MAX, i64::MIN), |(low, high), x| (low.min(x), high.max(x)))
    };
    for z in 19..40 {
        let depths = [0.2 + (f64::from(z) - 18.0) * c, 0.2 + (f64::from(z) - 17.0) * c];
        let [narrow, wide] = depths.map(|depth| 0.05 + 0.065 / 0.3 * (depth - 0.2));
        let (low, high) = layer(z);
        // A fine cell belongs to the solid when the surface meets it or its middle is inside, so its lower corner lies up
        // to one pitch below the body, and never above it.
        let cell = |x: f64| (x / c + 20.0).floor() as i64;
        assert!((cell(-wide - pitch).max(1)..=cell(-narrow + pitch).max(1)).contains(&low), "layer {z}: from {low}");
        assert!((cell(narrow - pitch).min(39)..=cell(wide).min(39)).contains(&high), "layer {z}: to {high}");
    }
    // At the last layer the body is 0.0642 m / c = 20.6 cells wide either way: index 0 is full there, and is dropped; index
    // 39 is kept.
    assert_eq!(layer(39), (1, 39));
    let mut kept = OccupancyGrid::default();
    grids.complete(&object, &pose, &placement, Truth::LowerCorners, false, &mut kept);
    assert!((0..40).any(|y| kept.get([0, y, 39])), "without the quirk index 0 is full");
    let lost: Vec<_> = kept.cells().filter(|&[x, y, z]| !complete.get([x, y, z])).collect();
    assert!(!lost.is_empty() && lost.iter().all(|cell| cell.contains(&0)));
    // Nothing lies in front of the front face: layers before 17 are empty.
    assert!(complete.cells().all(|[_, _, z]| z >= 17));
}
