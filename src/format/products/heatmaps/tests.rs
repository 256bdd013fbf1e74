use nalgebra::{Point3, Rotation3, Vector3};
use prost::Message;

use super::*;
use crate::{
    Depth, DepthCoding, Facts, PickState, RecordError, checks_of, codec::proto, products::patches::window_side,
};
use kernel::{
    geom::{DepthCrop, Intrinsics, Pose},
    ids::{Digest, ItemId, ObjectId, SampleId},
};

const CAMERA: Intrinsics = Intrinsics { width: 64, height: 48, fx: 60.0, fy: 60.0, cx: 32.0, cy: 24.0, near: 0.1 };

const SIDE: u32 = 8;
const SIZE: f64 = 0.1;

/// Depth of the image, which sees a plane across the camera's axis.
const PLANE: f32 = 0.8;

fn square_around(pixel: [f64; 2], side: u32) -> [u32; 2] {
    pixel.map(|value| (value - f64::from(side) / 2.0 + 0.5).floor() as u32)
}

/// A grasp of these points in camera axes [m], with patches if requested.
fn grasp(key: [u32; 2], state: PickState, points: [[f64; 3]; 2], with_patches: bool) -> SeenGrasp {
    let world_from_camera = world_from_camera();
    let point = |at: [f64; 3]| {
        let at = world_from_camera.point(&Point3::from(at));
        ProjectedPoint::new(at, &CAMERA, &world_from_camera.inverse(), |_| PLANE)
    };
    let points: Vec<ProjectedPoint> = points.map(point).to_vec();
    let patch = |point: &ProjectedPoint| {
        let pixel = point.pixel.expect("before the camera");
        let depth = world_from_camera.inverse().point(&point.point.into()).z;
        let window = window_side(SIZE, CAMERA.fx, depth);
        PatchSquare { corner: square_around(pixel, SIDE), window, window_corner: square_around(pixel, window) }
    };
    SeenGrasp {
        body: key[0],
        candidate: key[1],
        run: 4,
        rank: key[1],
        direction: 2,
        type_index: 1,
        state,
        value: HeatmapLabel::Trial.value(state),
        world_from_base: Pose::new(Rotation3::from_euler_angles(0.1, 0.2, 0.3), Vector3::new(0.0, 0.1, 0.5)),
        patches: if with_patches { points.iter().map(patch).collect() } else { Vec::new() },
        points,
    }
}

fn world_from_camera() -> Pose<kernel::geom::World, kernel::geom::CameraCv> {
    Pose::new(Rotation3::from_euler_angles(2.5, 0.3, -0.4), Vector3::new(0.2, -0.1, 0.7))
}

/// Four grasps of the first and third of three bodies, of which the second was not evaluated, and two forbidden ones: of the
/// grasps one has its fingertip behind the plane, one outside the image and one behind the camera.
fn heatmap() -> SceneHeatmap {
    SceneHeatmap {
        sample: SampleId { camera: 2, ..SampleId::of_object(ObjectId(Digest([9; 32])), ItemId(3)) },
        picks: Digest([5; 32]),
        trials: Some(Digest([6; 32])),
        hand: "hand".to_owned(),
        hand_id: ObjectId(Digest([7; 32])),
        names: vec!["approach".to_owned(), "tip".to_owned()],
        types: vec![12, 77],
        label: HeatmapLabel::Trial,
        angle: 0.3,
        camera: CAMERA,
        world_from_camera: world_from_camera(),
        side: SIDE,
        size: Some(SIZE),
        evaluated: vec![true, false, true],
        other_types: 4,
        grasps: vec![
            grasp([1, 0], PickState::Held, [[0.0, 0.0, 0.7], [0.05, 0.0, 0.81]], true),
            grasp([1, 5], PickState::Failed, [[0.0, 0.0, 0.75], [0.02, 0.1, 0.79]], true),
            grasp([3, 2], PickState::Untried, [[-0.1, 0.05, 0.7], [0.6, 0.0, 0.8]], false),
            grasp([3, 4], PickState::Untried, [[-0.1, 0.05, 0.7], [0.0, 0.0, -0.1]], false),
        ],
        forbidden: vec![
            ForbiddenGrasp { body: 1, candidate: 1, obstacle: 2, pixel: Some([10.5, 11.25]) },
            ForbiddenGrasp { body: 3, candidate: 0, obstacle: 4, pixel: None },
        ],
    }
}

fn payload(heatmap: &SceneHeatmap) -> Vec<u8> {
    let mut out = Vec::new();
    heatmap.encode(&mut out);
    out
}

#[test]
fn a_heatmap_comes_back_as_it_was_with_its_counts() {
    let heatmap = heatmap();
    let bytes = payload(&heatmap);
    assert_eq!(proto::SceneHeatmap::decode(bytes.as_slice()).expect("protobuf").encode_to_vec(), bytes);
    let again = SceneHeatmap::decode(&bytes).expect("a record");
    // Equal except for NaN, which does not equal itself.
    assert_eq!(payload(&again), bytes);
    assert_eq!((&again.evaluated, &again.forbidden), (&heatmap.evaluated, &heatmap.forbidden));
    let facts = HeatmapFacts::from_heatmap(&again);
    let expected = HeatmapFacts {
        bodies: 3,
        evaluated: 2,
        states: [2, 1, 1],
        forbidden: [0, 1, 0, 1],
        other_types: 4,
        points: 6,
        visible_points: 5,
        patches: 2,
    };
    assert_eq!(facts, expected);
    assert_eq!(HeatmapFacts::from(&Facts::from(facts)), facts);
    // Without patches in metres, trials and types.
    let mut bare = SceneHeatmap { size: None, trials: None, types: Vec::new(), ..heatmap };
    for grasp in &mut bare.grasps {
        grasp.type_index = 0;
        for square in &mut grasp.patches {
            (square.window, square.window_corner) = (0, [0; 2]);
        }
    }
    assert_eq!(payload(&SceneHeatmap::decode(&payload(&bare)).expect("a record")), payload(&bare));
}

#[test]
fn maps_have_the_lowest_label_of_free_grasps_and_nothing_where_one_is_forbidden() {
    let mut heatmap = heatmap();
    // Both palms fall into the middle of the image: the one that held counts.
    let maps = heatmap.maps();
    let pixels = 64 * 48;
    assert_eq!(maps.len(), 2 * 2 * pixels);
    let at = |maps: &[f32], map: usize, column: usize, row: usize| maps[map * pixels + row * 64 + column];
    assert_eq!(at(&maps, 2, 32, 24), -1.0);
    assert_eq!(maps.iter().filter(|value| **value != 0.0).count(), 3, "untried grasps have no label");
    assert!((0..4).all(|map| at(&maps, map, 10, 11) == 0.0), "a forbidden palm is background");
    // By what is free, all are as good.
    heatmap.label = HeatmapLabel::Free;
    heatmap.grasps.iter_mut().for_each(|grasp| grasp.value = HeatmapLabel::Free.value(grasp.state));
    let maps = heatmap.maps();
    assert_eq!(maps.iter().filter(|value| **value == -1.0).count(), 4);
    assert!((0..4).all(|map| at(&maps, map, 10, 11) == 0.0));
}

fn field_of(error: &RecordError) -> &'static str {
    match error {
        RecordError::Range { field, .. }
        | RecordError::Length { field, .. }
        | RecordError::Rotation { field, .. }
        | RecordError::Name { field, .. } => field,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_heatmap_that_contradicts_itself_is_refused() {
    type Change = fn(&mut proto::SceneHeatmap);
    let changes: [(Change, &str); 26] = [
        (|raw| raw.picks.truncate(3), "picks"),
        (|raw| raw.trials.truncate(3), "trials"),
        (|raw| raw.names.clear(), "names"),
        (|raw| raw.label = "epsilon".to_owned(), "label"),
        (|raw| raw.angle = 4.0, "angle"),
        (|raw| raw.side = 0, "side"),
        (|raw| raw.evaluated.clear(), "evaluated"),
        (|raw| raw.evaluated[0] = 0, "bodies"),
        (|raw| raw.bodies[3] = 4, "bodies"),
        (|raw| raw.candidates[1] = 0, "candidates"),
        (|raw| raw.type_indices[2] = 2, "type_indices"),
        (|raw| raw.states[0] = 3, "states"),
        (|raw| raw.states[0] = 2, "values"),
        (|raw| raw.values.truncate(12), "values"),
        (|raw| raw.world_from_base[0] = 3.0, "world_from_base"),
        (|raw| raw.points[2] = 9.0, "pixels"),
        (|raw| raw.pixels[0] = f64::NAN, "pixels"),
        (|raw| raw.surfaces[20..24].copy_from_slice(&0.5_f32.to_le_bytes()), "surfaces"),
        (|raw| raw.visible[1] = 1, "visible"),
        (|raw| raw.patches[1] = 0, "patches"),
        (|raw| raw.corners[0] += 1, "corners"),
        (|raw| raw.windows[0] += 1, "windows"),
        (|raw| raw.window_corners[3] += 2, "window_corners"),
        (|raw| raw.forbidden_candidates[0] = 5, "forbidden_candidates"),
        (|raw| raw.obstacles[1] = 5, "obstacles"),
        (|raw| raw.forbidden_pixels[0] = f64::INFINITY, "forbidden_pixels"),
    ];
    let bytes = payload(&heatmap());
    for (change, expected) in changes {
        let mut raw = proto::SceneHeatmap::decode(bytes.as_slice()).expect("protobuf");
        change(&mut raw);
        let error = SceneHeatmap::decode(&raw.encode_to_vec()).expect_err(expected);
        assert_eq!(field_of(&error), expected, "{error:?}");
    }
}

#[test]
fn surfaces_are_those_of_the_depth_in_its_steps() {
    let heatmap = heatmap();
    let check = |depth: f32, coding| {
        let crop = DepthCrop { left: 0, top: 0, width: 64, height: 48, depth: vec![depth; 64 * 48] };
        let mut bytes = Vec::new();
        Depth { sample: heatmap.sample, crop, coding }.encode(&mut bytes);
        let mut checks = (checks_of(Product::HEATMAPS).samples)();
        checks.check(Channel::HEATMAP_GRASPS, &payload(&heatmap)).expect("grasps");
        checks.check(Channel::HEATMAP_DEPTH, &bytes).map(|checked| checked.sample)
    };
    let steps = DepthCoding::U16 { step: 0.001 };
    assert_eq!(check(PLANE, DepthCoding::F32), Ok(heatmap.sample));
    assert_eq!(check(0.8004, steps), Ok(heatmap.sample));
    for (depth, coding) in [(0.8001, DepthCoding::F32), (0.802, steps)] {
        let error = check(depth, coding).expect_err("another depth");
        assert_eq!(field_of(&error), "surfaces", "{error:?}");
    }
}
