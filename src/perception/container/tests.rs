//! Bins of known size on a table, seen ray by ray.

use kernel::{geom::Intrinsics, seed::Stream};
use nalgebra::{Isometry3, Rotation3};

use super::*;
use crate::{
    frame::DepthFrame,
    labels::CONTAINER_LABEL,
    plane::{PlaneRule, find_plane},
    scene::{SceneRule, SegmentedScene},
};

const CAMERA: Intrinsics =
    Intrinsics { width: 320, height: 240, fx: 262.5, fy: 262.5, cx: 160.0, cy: 120.0, near: 0.01 };
/// Inner size of the bin, and thickness of its walls and floor [m].
const SIZE: [f64; 3] = [0.44, 0.34, 0.18];
const WALL: f64 = 0.015;

/// A box by two corners; lengths in metres, z up from the middle of the bin's floor.
type Cuboid = [[f64; 3]; 2];

/// Floor and walls of the bin.
fn bin() -> Vec<Cuboid> {
    let [x, y] = [0.5 * SIZE[0], 0.5 * SIZE[1]];
    let (outer_x, outer_y, top) = (x + WALL, y + WALL, SIZE[2]);
    vec![
        [[-outer_x, -outer_y, -WALL], [outer_x, outer_y, 0.0]],
        [[-outer_x, y, 0.0], [outer_x, outer_y, top]],
        [[-outer_x, -outer_y, 0.0], [outer_x, -y, top]],
        [[x, -outer_y, 0.0], [outer_x, outer_y, top]],
        [[-outer_x, -outer_y, 0.0], [-x, outer_y, top]],
    ]
}

/// The camera's pose in the bin's frame: it looks at a point 10 cm above the floor from an angle above the table and a direction in it
/// [degree], at a distance [m].
fn camera(elevation: f64, azimuth: f64, distance: f64) -> Isometry3<f64> {
    let (sine, cosine) = elevation.to_radians().sin_cos();
    let eye = Vector3::new(0.0, -distance * cosine, distance * sine);
    let axes = [Vector3::x(), Vector3::new(0.0, -sine, -cosine), Vector3::new(0.0, cosine, -sine)];
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), azimuth.to_radians());
    let rotation = turn * Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&axes));
    let position = turn * eye + Vector3::new(0.0, 0.0, 0.1);
    Isometry3::from_parts(position.into(), nalgebra::UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Depths with noise [m], and per pixel the number of the box that it shows, from 1; 0 for the table under the bin.
fn seen(boxes: &[Cuboid], pose: &Isometry3<f64>, noise: f64) -> (DepthFrame, Vec<usize>) {
    let mut draw = Stream::of_job(4, b"", "noise");
    let (mut depth, mut owners) = (Vec::new(), Vec::new());
    for pixel in 0..CAMERA.width * CAMERA.height {
        let (column, row) = (f64::from(pixel % CAMERA.width), f64::from(pixel / CAMERA.width));
        let ray = pose.rotation * CAMERA.unproject(column + 0.5, row + 0.5, 1.0).coords;
        let eye = pose.translation.vector;
        let table = (-WALL - eye.z) / ray.z;
        let mut nearest = (if table > 0.0 { table } else { f64::INFINITY }, 0);
        for (number, [low, high]) in (1..).zip(boxes) {
            // Slabs (Kay and Kajiya 1986).
            let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
            for axis in 0..3 {
                let [a, b] = [low[axis], high[axis]].map(|side| (side - eye[axis]) / ray[axis]);
                enter = enter.max(a.min(b));
                leave = leave.min(a.max(b));
            }
            if enter < leave && enter < nearest.0 {
                nearest = (enter, number);
            }
        }
        depth.push(if nearest.0 < 2.0 { (nearest.0 + noise * draw.normal()) as f32 } else { f32::NAN });
        owners.push(nearest.1);
    }
    (DepthFrame::new(CAMERA, depth), owners)
}

/// Boxes that lie on the floor, apart from each other.
fn contents() -> Vec<Cuboid> {
    vec![
        [[-0.14, -0.03, 0.0], [-0.06, 0.09, 0.06]],
        [[0.02, 0.02, 0.0], [0.10, 0.08, 0.09]],
        [[0.0, -0.09, 0.0], [0.11, -0.05, 0.03]],
    ]
}

#[test]
fn a_bin_is_found_and_its_objects_are_apart_from_it() {
    for (elevation, azimuth) in [(60.0, 20.0), (50.0, -35.0), (70.0, 130.0)] {
        for noise in [0.0, 0.001] {
            let pose = camera(elevation, azimuth, 0.8);
            let boxes: Vec<Cuboid> = bin().into_iter().chain(contents()).collect();
            let (frame, owners) = seen(&boxes, &pose, noise);
            let scene = SegmentedScene::segment(frame, &SceneRule::default());
            let container = scene.container.as_ref().expect("a container");
            let case = format!("{elevation} {azimuth} {noise}: {container:?}");
            // The floor, not the table 15 mm below it.
            let up = pose.rotation.inverse() * Vector3::z();
            assert!(container.floor.normal.angle(&up).to_degrees() < 0.5, "{case}");
            assert!((container.floor.offset - pose.translation.z).abs() < 0.003, "{case}");
            assert!((container.rim - SIZE[2]).abs() < 0.012, "{case}");
            // Inner faces that were seen are those of the bin.
            for wall in container.walls.iter().filter(|wall| wall.is_seen) {
                let normal = pose.rotation * wall.normal;
                let (axis, half) =
                    if normal.x.abs() > 0.5 { (normal.x, 0.5 * SIZE[0]) } else { (normal.y, 0.5 * SIZE[1]) };
                assert!(axis.abs() > 0.999, "{case}");
                let distance = wall.offset + wall.normal.dot(&(pose.rotation.inverse() * -pose.translation.vector));
                assert!((distance.abs() - half).abs() < 0.006, "{distance} {case}");
            }
            let found: Vec<usize> = scene.clusters.iter().map(|cluster| owner_of(&cluster.pixels, &owners)).collect();
            let mut sorted = found.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, [6, 7, 8], "{case}");
            // Labels of the container are walls and rim.
            let labels = scene.labels(0.008).labels;
            let walls: Vec<usize> = (0..labels.len()).filter(|pixel| (2..=5).contains(&owners[*pixel])).collect();
            let labelled = walls.iter().filter(|pixel| labels[**pixel] == CONTAINER_LABEL).count();
            assert!(10 * labelled > 9 * walls.len(), "{labelled} of {} {case}", walls.len());
            let wrong = labels.iter().zip(&owners).filter(|(label, owner)| **label == CONTAINER_LABEL && **owner > 5);
            assert!(wrong.count() < 40, "{case}");
        }
    }
}

/// The box with the most of these pixels.
fn owner_of(pixels: &[u32], owners: &[usize]) -> usize {
    let count = |number: usize| pixels.iter().filter(|pixel| owners[**pixel as usize] == number).count();
    (0..9).max_by_key(|number| count(*number)).expect("a number")
}

#[test]
fn boxes_on_a_table_are_no_container() {
    // Two boxes whose sides face each other at a right angle, apart, and one box alone.
    let boxes: Vec<Cuboid> =
        vec![[[-0.2, 0.05, -WALL], [-0.06, 0.11, 0.15]], [[0.08, -0.12, -WALL], [0.14, 0.04, 0.10]]];
    for count in [1, 2] {
        let (frame, _) = seen(&boxes[..count], &camera(45.0, 30.0, 0.8), 0.001);
        let scene = SegmentedScene::segment(frame, &SceneRule::default());
        assert_eq!((scene.container, scene.clusters.len()), (None, count));
    }
    let (frame, _) = seen(&bin(), &camera(60.0, 20.0, 0.8), 0.001);
    let off = SceneRule { container: ContainerChoice::Without, ..SceneRule::default() };
    let scene = SegmentedScene::segment(frame.clone(), &off);
    assert!(scene.container.is_none() && scene.container_pixels.is_empty() && !scene.clusters.is_empty());
    assert_eq!(scene.plane, find_plane(&frame, &PlaneRule::default()), "the plane is that without a search");
}

#[test]
fn a_known_box_is_kept_as_given() {
    let pose = camera(60.0, 20.0, 0.8);
    let boxes: Vec<Cuboid> = bin().into_iter().chain(contents()).collect();
    let (frame, owners) = seen(&boxes, &pose, 0.001);
    let inverse = pose.inverse();
    let container = Container::from_size(SIZE, inverse.translation.vector.into(), inverse.rotation).expect("a box");
    let middle = inverse * Point3::new(0.0, 0.0, 0.1);
    assert!(container.walls.iter().all(|wall| wall.distance(&middle) > 0.15));
    assert!((container.floor.height(&middle) - 0.1).abs() < 1e-12);
    let rule = SceneRule { container: ContainerChoice::Given(container.clone()), ..SceneRule::default() };
    let scene = SegmentedScene::segment(frame, &rule);
    assert_eq!((scene.plane, scene.container.as_ref()), (Some(container.floor), Some(&container)));
    let mut found: Vec<usize> = scene.clusters.iter().map(|cluster| owner_of(&cluster.pixels, &owners)).collect();
    found.sort_unstable();
    assert_eq!(found, [6, 7, 8]);
    assert_eq!(Container::from_size([0.1, 0.0, 0.1], Point3::origin(), UnitQuaternion::identity()), None);
}

#[test]
fn a_rim_is_found_from_overhead() {
    let boxes: Vec<Cuboid> = bin().into_iter().chain(contents()).collect();
    let (frame, owners) = seen(&boxes, &camera(90.0, 10.0, 0.8), 0.001);
    let scene = SegmentedScene::segment(frame, &SceneRule::default());
    let container = scene.container.expect("a container");
    assert!((container.rim - SIZE[2]).abs() < 0.006, "{}", container.rim);
    let mut found: Vec<usize> = scene.clusters.iter().map(|cluster| owner_of(&cluster.pixels, &owners)).collect();
    found.sort_unstable();
    assert_eq!(found, [6, 7, 8]);
}

#[test]
fn points_above_the_rim_reach_over_a_wall() {
    let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let upright = Container::from_size(SIZE, Point3::new(0.0, 0.0, 1.0), turned).expect("a box");
    let region = |x: f64, height: f64| upright.region(&Point3::new(x, 0.0, 1.0 - height));
    assert_eq!(region(0.0, 0.05), Region::Inside);
    assert_eq!(region(0.22, 0.05), Region::Wall);
    assert_eq!(region(0.23, 0.18), Region::Wall);
    assert_eq!(region(0.23, 0.25), Region::Inside);
    assert_eq!(region(0.40, 0.25), Region::Outside);
    assert_eq!(region(0.40, 0.05), Region::Outside);
}
