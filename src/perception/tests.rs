//! A scene whose truth is known: balls on a table, rendered ray by ray.

use kernel::{
    geom::{Intrinsics, SimdLevel},
    seed::Stream,
};
use nalgebra::{Point3, Vector3};

use super::*;

const RADIUS: f64 = 0.05;
const HEIGHT: f64 = 0.6;

/// Unit normal of the table, towards the camera: it looks down by 40 degrees.
fn normal() -> Vector3<f64> {
    Vector3::new(0.0, -cosine(40.0), -sine(40.0))
}

fn cosine(degrees: f64) -> f64 {
    degrees.to_radians().cos()
}

fn sine(degrees: f64) -> f64 {
    degrees.to_radians().sin()
}

/// Middles of six balls that rest on the table, in `CameraCv` [m].
fn balls() -> Vec<Point3<f64>> {
    let (across, along) = (Vector3::x(), Vector3::x().cross(&normal()));
    let foot = Point3::from(-HEIGHT * normal()) + RADIUS * normal();
    let ahead = if along.z > 0.0 { along } else { -along };
    let at = |(x, y): (f64, f64)| foot + across * x + ahead * (0.55 + y);
    [(-0.2, 0.0), (0.0, 0.0), (0.2, 0.0), (-0.15, 0.25), (0.05, 0.3), (0.25, 0.25)].map(at).to_vec()
}

/// The scene with noise in depth [m], and the ball of each pixel from 1, 0 for the table.
fn scene(noise: f64) -> (DepthFrame, Vec<u32>) {
    let camera = Intrinsics { width: 320, height: 240, fx: 260.0, fy: 262.0, cx: 161.5, cy: 119.0, near: 0.01 };
    let mut draw = Stream::of_job(5, b"", "noise");
    let (mut depth, mut labels) = (Vec::new(), Vec::new());
    for pixel in 0..camera.width * camera.height {
        let (column, row) = (f64::from(pixel % camera.width), f64::from(pixel / camera.width));
        let ray = camera.unproject(column + 0.5, row + 0.5, 1.0).coords;
        let table = -HEIGHT / normal().dot(&ray);
        let mut nearest = (if table > 0.0 { table } else { f64::INFINITY }, 0);
        for (index, middle) in balls().iter().enumerate() {
            let (a, b) = (ray.norm_squared(), ray.dot(&middle.coords));
            let root = b * b - a * (middle.coords.norm_squared() - RADIUS * RADIUS);
            if root > 0.0 && (b - root.sqrt()) / a < nearest.0 {
                nearest = ((b - root.sqrt()) / a, index as u32 + 1);
            }
        }
        depth.push(if nearest.0 < 3.0 { (nearest.0 + noise * draw.normal()) as f32 } else { f32::NAN });
        labels.push(nearest.1);
    }
    (DepthFrame::new(camera, depth), labels)
}

#[test]
fn the_table_and_what_stands_on_it_are_found() {
    for noise in [0.0, 0.0015] {
        let (frame, labels) = scene(noise);
        let plane = find_plane(&frame, &PlaneRule::default()).expect("a table");
        assert!(plane.normal.angle(&normal()).to_degrees() < 1.0, "{plane:?}");
        assert!((plane.offset - HEIGHT).abs() < 0.003, "{plane:?}");
        assert!(plane.height(&plane.foot()).abs() < 1e-12);
        let clusters = find_clusters(&frame, Some(&plane), &ClusterRule::default());
        let score = SegmentationScore::new(&clusters, &labels, |pixel| !frame.depth[pixel].is_nan());
        assert_eq!((clusters.len(), score.found, score.merged, score.split), (6, 6, 0, 0), "{score:?}");
        assert!(score.precision > 0.999 && score.recall > 0.85, "{score:?}");
        assert!(clusters.windows(2).all(|pair| pair[0].pixels.len() >= pair[1].pixels.len()));
        // Equal draws find an equal plane; without it, balls and the table around them are one thing.
        assert_eq!(find_plane(&frame, &PlaneRule::default()), Some(plane));
        let all = find_clusters(&frame, None, &ClusterRule::default());
        assert!(2 * all[0].pixels.len() > frame.returns().count(), "{}", all[0].pixels.len());
    }
}

#[test]
fn without_enough_points_of_a_plane_there_is_none() {
    let (mut frame, labels) = scene(0.0);
    frame.depth.iter_mut().zip(&labels).filter(|(_, label)| **label == 0).for_each(|(depth, _)| *depth = f32::NAN);
    let strict = PlaneRule { tolerance: 0.0005, ..PlaneRule::default() };
    assert_eq!(find_plane(&frame, &strict), None, "balls have no tenth of their points in a thin plane");
    frame.depth.fill(f32::NAN);
    assert_eq!(find_plane(&frame, &PlaneRule::default()), None);
    assert!(find_clusters(&frame, None, &ClusterRule::default()).is_empty());
}

#[test]
fn sheets_and_grids_hold_what_was_seen() {
    let (frame, _) = scene(0.0);
    let plane = find_plane(&frame, &PlaneRule::default()).expect("a table");
    for cluster in find_clusters(&frame, Some(&plane), &ClusterRule::default()) {
        let sheet = visible_sheet(&frame, &cluster.pixels);
        assert!(sheet.triangles.len() > cluster.pixels.len(), "about two triangles per pixel");
        for index in 0..sheet.triangles.len() {
            let [a, b, c] = sheet.corners(index);
            assert!((b - a).cross(&(c - a)).dot(&a.coords) < 0.0, "triangles face the camera");
        }
        let nearest = |point: &[f32; 3]| {
            let point = Point3::from(point.map(f64::from));
            balls().iter().map(|middle| (point - middle).norm() - RADIUS).fold(f64::INFINITY, f64::min)
        };
        assert!(sheet.vertices.iter().all(|vertex| nearest(vertex).abs() < 1e-6));
        // A flying pixel behind the ball is left out, and does not move the grid.
        let input = NetworkInput::new(&frame, &cluster, Some(&plane), 40, SimdLevel::detect()).expect("a grid");
        let mut flying = (frame.clone(), cluster.clone());
        let pixel = cluster.pixels[cluster.pixels.len() / 2];
        flying.0.depth[pixel as usize] += 0.2;
        let other = NetworkInput::new(&flying.0, &flying.1, Some(&plane), 40, SimdLevel::detect()).expect("a grid");
        assert_eq!((other.placement, other.outliers.len()), (input.placement, input.outliers.len() + 1));
        assert!(input.partial.count() > 100);
        // Free cells lie in front of what is seen, beside it, or under the table; the ball's own inside is none.
        let middle = balls().into_iter().min_by(|a, b| {
            let distance = |point: &Point3<f64>| (point - input.placement.centre).norm();
            distance(a).total_cmp(&distance(b))
        });
        let middle = middle.expect("a ball");
        let corner = input.placement.lower_corner();
        for cell in input.free.cells() {
            assert!(!input.partial.get(cell), "free and seen");
            let offset = Vector3::from(cell.map(|index| (f64::from(index) + 0.5) * input.placement.cell_size));
            let point = corner + offset;
            let depth_inside = RADIUS - (point - middle).norm();
            assert!(depth_inside < 2.0 * input.placement.cell_size, "{depth_inside} m inside of the ball");
        }
        let under = input.free.cells().filter(|cell| {
            let offset = Vector3::from(cell.map(|index| (f64::from(index) + 0.5) * input.placement.cell_size));
            plane.height(&(corner + offset)) < 0.0
        });
        assert!(under.count() > 0, "cells below the table are free");
    }
}

#[test]
fn pictures_of_what_was_found_are_png_files_of_the_same_size() {
    let (frame, _) = scene(0.0);
    let clusters = find_clusters(&frame, None, &ClusterRule::default());
    let picture = draw_outlines(&frame, &clusters);
    let reader = png::Decoder::new(std::io::Cursor::new(&picture)).read_info().expect("a PNG");
    assert_eq!((reader.info().width, reader.info().height), (320, 240));
    assert_eq!(picture, draw_outlines(&frame, &clusters));
}
