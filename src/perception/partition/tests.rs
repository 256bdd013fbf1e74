//! Objects of known shape on a table, seen ray by ray.

use kernel::{
    geom::{Intrinsics, SimdLevel},
    seed::Stream,
};
use nalgebra::Vector3;

use super::*;
use crate::{
    clusters::find_clusters,
    input::NetworkInput,
    plane::PlaneRule,
    plane::find_plane,
    scene::{SceneRule, SegmentedScene},
    score::SegmentationScore,
};

/// Half a Kinect's picture.
const CAMERA: Intrinsics =
    Intrinsics { width: 320, height: 240, fx: 262.5, fy: 262.5, cx: 160.0, cy: 120.0, near: 0.01 };
/// Distance of the camera from the table's middle [m], and its angle above the table [degree].
const DISTANCE: f64 = 0.7;
const ELEVATION: f64 = 40.0;

/// A solid that rests on the table or on another one; lengths in metres, z up from the table.
#[derive(Clone, Copy)]
enum Solid {
    /// A box by two corners.
    Cuboid([f64; 3], [f64; 3]),
    /// An upright tube by the middle of its base, its outer and inner radius, and its height; the inside has a floor of 5 mm.
    Tube([f64; 3], [f64; 2], f64),
    /// A ball by its middle and radius.
    Ball([f64; 3], f64),
}

impl Solid {
    fn contains(&self, [x, y, z]: [f64; 3]) -> bool {
        match *self {
            Self::Cuboid(low, high) => (0..3).all(|axis| (low[axis]..high[axis]).contains(&[x, y, z][axis])),
            Self::Tube([cx, cy, cz], [outer, inner], height) => {
                let square = (x - cx).powi(2) + (y - cy).powi(2);
                (cz..cz + height).contains(&z) && square < outer * outer && (square > inner * inner || z < cz + 0.005)
            }
            Self::Ball([cx, cy, cz], radius) => {
                (x - cx).powi(2) + (y - cy).powi(2) + (z - cz).powi(2) < radius * radius
            }
        }
    }
}

/// The camera's position and its axes to the right, down and forward, in the table's frame.
fn camera() -> (Vector3<f64>, [Vector3<f64>; 3]) {
    let (sine, cosine) = ELEVATION.to_radians().sin_cos();
    let eye = Vector3::new(0.0, -DISTANCE * cosine, DISTANCE * sine);
    (eye, [Vector3::x(), Vector3::new(0.0, -sine, -cosine), Vector3::new(0.0, cosine, -sine)])
}

/// Depths of objects on a table with noise [m], and the number of the object of each pixel from 1, 0 for the table.
fn seen(objects: &[&[Solid]], noise: f64) -> (DepthFrame, Vec<u32>) {
    let (eye, axes) = camera();
    let mut draw = Stream::of_job(3, b"", "noise");
    let (mut depth, mut labels) = (Vec::new(), Vec::new());
    for pixel in 0..CAMERA.width * CAMERA.height {
        let (column, row) = (f64::from(pixel % CAMERA.width), f64::from(pixel / CAMERA.width));
        let ray = CAMERA.unproject(column + 0.5, row + 0.5, 1.0).coords;
        let ray = axes[0] * ray.x + axes[1] * ray.y + axes[2] * ray.z;
        let table = if ray.z < 0.0 { -eye.z / ray.z } else { f64::INFINITY };
        // Steps of half a millimetre where objects can be, then the table.
        let owner = |at: f64| {
            let point = (eye + ray * at).into();
            objects.iter().position(|solids| solids.iter().any(|solid| solid.contains(point)))
        };
        // No object is higher than 16 cm.
        let first = ((eye.z - 0.16) / -ray.z).max(0.0);
        let steps = (0..).map(|step| first + f64::from(step) * 0.0005).take_while(|at| *at < table.min(1.5));
        let hit = if ray.z < 0.0 { steps.into_iter().find_map(|at| Some((at, owner(at)?))) } else { None };
        let (at, label) = hit.map_or((table, 0), |(at, object)| (at, object as u32 + 1));
        depth.push(if at < 1.5 { (at + noise * draw.normal()) as f32 } else { f32::NAN });
        labels.push(label);
    }
    (DepthFrame::new(CAMERA, depth), labels)
}

/// Score of the parts of objects on a table; laws that hold for every picture are checked.
fn score(objects: &[&[Solid]], noise: f64) -> (usize, SegmentationScore) {
    let (frame, labels) = seen(objects, noise);
    let scene = SegmentedScene::segment(frame.clone(), &SceneRule::default());
    let plane = find_plane(&frame, &PlaneRule::default()).expect("a table");
    let clusters = ClusterRule { tolerance: PartitionRule::GAP, ..ClusterRule::default() };
    let parts = find_parts(&frame, Some(&plane), &clusters, &PartitionRule::default());
    assert_eq!(scene.clusters, parts, "a scene has these parts, always the same");
    let mut owners = vec![0; frame.depth.len()];
    for part in &parts {
        assert!(part.pixels.is_sorted() && part.pixels.len() >= clusters.min_points);
        assert!(NetworkInput::new(&frame, part, Some(&plane), 40, SimdLevel::detect()).is_ok());
        for pixel in &part.pixels {
            owners[*pixel as usize] += 1;
            assert!(plane.height(&frame.point(*pixel)) > clusters.min_height);
        }
    }
    assert!(owners.iter().all(|count| *count <= 1), "parts share no pixel");
    assert!(parts.windows(2).all(|pair| pair[0].pixels.len() >= pair[1].pixels.len()), "the largest first");
    (parts.len(), SegmentationScore::new(&parts, &labels, |pixel| !frame.depth[pixel].is_nan()))
}

/// Whether each object has its own part, with and without noise.
fn assert_each_found(objects: &[&[Solid]]) {
    for noise in [0.0, 0.0008] {
        let (parts, score) = score(objects, noise);
        let wanted = [objects.len(); 2];
        println!("noise {noise}: {parts} parts, {score:?}");
        assert_eq!(([parts, score.found], score.merged, score.split), (wanted, 0, 0), "noise {noise}: {score:?}");
        assert!(score.objects.iter().all(|object| object.iou > 0.75), "{score:?}");
    }
}

const LOW: Solid = Solid::Cuboid([-0.10, -0.04, 0.0], [0.0, 0.06, 0.06]);
const TALL: Solid = Solid::Cuboid([0.0, -0.02, 0.0], [0.09, 0.08, 0.14]);
const UPPER: Solid = Solid::Cuboid([-0.08, 0.0, 0.06], [-0.02, 0.05, 0.12]);

#[test]
fn boxes_side_by_side_are_two_objects() {
    assert_each_found(&[&[LOW], &[TALL]]);
    // By distance alone, they are one.
    let (frame, _) = seen(&[&[LOW], &[TALL]], 0.0);
    let plane = find_plane(&frame, &PlaneRule::default());
    assert_eq!(find_clusters(&frame, plane.as_ref(), &ClusterRule::default()).len(), 1);
    let rule = SceneRule { partition: None, clusters: ClusterRule::default(), ..SceneRule::default() };
    assert_eq!(SegmentedScene::segment(frame, &rule).clusters.len(), 1);
}

#[test]
fn a_stack_is_as_many_objects_as_it_has_boxes() {
    assert_each_found(&[&[LOW], &[UPPER]]);
    assert_each_found(&[&[LOW], &[UPPER], &[TALL]]);
}

#[test]
fn cans_that_touch_are_two_objects() {
    let can = |x: f64, height: f64| [Solid::Tube([x, 0.0, 0.0], [0.035, 0.0], height)];
    assert_each_found(&[&can(-0.035, 0.12), &can(0.035, 0.09)]);
}

#[test]
fn a_convex_object_is_never_cut() {
    assert_each_found(&[&[TALL]]);
    assert_each_found(&[&[Solid::Ball([0.0, 0.0, 0.05], 0.05)]]);
}

#[test]
fn an_angled_object_with_one_top_stays_whole() {
    let long = Solid::Cuboid([-0.10, 0.0, 0.0], [0.10, 0.05, 0.05]);
    let short = Solid::Cuboid([0.05, -0.10, 0.0], [0.10, 0.0, 0.05]);
    assert_each_found(&[&[long, short]]);
}

#[test]
fn a_mug_keeps_its_handle_and_its_inside() {
    let body = Solid::Tube([0.0, 0.0, 0.0], [0.045, 0.041], 0.10);
    let bar = Solid::Cuboid([0.062, -0.006, 0.03], [0.072, 0.006, 0.09]);
    let arm = |z: f64| Solid::Cuboid([0.040, -0.006, z], [0.072, 0.006, z + 0.01]);
    assert_each_found(&[&[body, bar, arm(0.03), arm(0.08)]]);
}

#[test]
fn a_threshold_of_half_a_turn_cuts_nothing() {
    let (frame, _) = seen(&[&[LOW], &[TALL]], 0.0);
    let plane = find_plane(&frame, &PlaneRule::default());
    let clusters = ClusterRule { tolerance: PartitionRule::GAP, ..ClusterRule::default() };
    let parts = find_parts(&frame, plane.as_ref(), &clusters, &PartitionRule { concavity: 180.0 });
    assert_eq!(parts.len(), 1);
}

#[test]
fn holes_of_a_few_pixels_divide_nothing() {
    let (mut frame, _) = seen(&[&[TALL]], 0.0);
    let plane = find_plane(&frame, &PlaneRule::default());
    // A stripe without depth down the middle of the box.
    for row in 0..CAMERA.height {
        frame.depth[(row * CAMERA.width + 176) as usize..][..2].fill(f32::NAN);
    }
    let clusters = ClusterRule { tolerance: PartitionRule::GAP, ..ClusterRule::default() };
    assert_eq!(find_parts(&frame, plane.as_ref(), &clusters, &PartitionRule::default()).len(), 1);
}

#[test]
fn a_picture_without_points_has_no_parts() {
    let mut frame = DepthFrame::new(CAMERA, vec![f32::NAN; 320 * 240]);
    assert!(find_parts(&frame, None, &ClusterRule::default(), &PartitionRule::default()).is_empty());
    frame.depth[0] = 1.0;
    let rule = ClusterRule { min_points: 1, ..ClusterRule::default() };
    let parts = find_parts(&frame, None, &rule, &PartitionRule::default());
    assert_eq!(parts, [Cluster { pixels: vec![0], touches_border: true }]);
}
