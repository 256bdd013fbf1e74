//! Marks beside patches: the hand-written encoders against the generated one, what is refused, and what contradicts the patches.

use nalgebra::Vector3;
use prost::Message;

use super::*;
use crate::{FORCE, GraspLabel, RecordError, TrialVerdict, checks_of, codec::proto};
use kernel::{
    geom::{Intrinsics, Pose},
    ids::{Digest, ItemId, ObjectId, SampleId},
    words::GraspVerdict,
};

const SIDE: u32 = 8;

/// Patches of a plane across the camera's axis at 2 m, of points at 1.99 m, 2.004 m, 2.006 m and beside the plane.
fn patch() -> HeatmapPatch {
    let camera = Intrinsics::from_horizontal_fov(64, 48, 1.047, 0.1).expect("a camera");
    let points = [[0.0, 0.0, 1.99], [0.1, 0.0, 2.004], [0.0, 0.1, 2.006], [-0.2, 0.1, 2.5]];
    let mut depth = Vec::new();
    let points = points.map(|point| {
        let (u, v) = camera.project(&point.into());
        let corner = [u, v].map(|pixel| (pixel - f64::from(SIDE) / 2.0 + 0.5).floor() as u32);
        let is_beside = point[0] < 0.0;
        depth.extend((0..SIDE * SIDE).map(|_| if is_beside { f32::NAN } else { 2.0 }));
        PatchPoint { name: "tip".to_owned(), point, pixel: [u, v], corner }
    });
    HeatmapPatch {
        sample: SampleId::of_object(ObjectId(Digest([1; 32])), ItemId(4)),
        grasps: Digest([3; 32]),
        run: 1,
        rank: 2,
        type_index: 1,
        types: vec![12, 77],
        energy: 0.5,
        epsilon: 0.0,
        space: FORCE.to_owned(),
        hand: "hand".to_owned(),
        hand_id: ObjectId(Digest([9; 32])),
        camera,
        point_focal_length: None,
        camera_from_object: Pose::identity(),
        object_from_approach: Pose::identity(),
        points,
        side: SIDE,
        depth,
        label: TRIAL_LABEL.to_owned(),
        value: 1.0,
    }
}

fn trial() -> PatchTrial {
    PatchTrial {
        sample: patch().sample,
        trials: Digest([5; 32]),
        outcome: GraspLabel::Failed,
        trial: TrialVerdict::LostLifting,
        verdict: GraspVerdict::NoForceClosure,
        tested: PatchTrial::mask(GraspLabel::Failed, 1, 2),
    }
}

fn visibility() -> PatchVisibility {
    PatchVisibility {
        sample: patch().sample,
        surfaces: [2.0, 2.0, 2.0, f32::NAN],
        visible: [true, true, false, true],
        heatmap_visible: Vec::new(),
    }
}

fn metric() -> PatchMetric {
    let patch = patch();
    let size = 0.2;
    let windows = patch.points.each_ref().map(|point| window_side(size, patch.camera.fx, point.point[2]));
    let corners = [0, 1, 2, 3].map(|index: usize| {
        patch.points[index].pixel.map(|pixel| (pixel - f64::from(windows[index]) / 2.0 + 0.5).floor() as u32)
    });
    PatchMetric { sample: patch.sample, size, side: SIDE, windows, corners, depth: patch.depth }
}

fn table() -> PatchTable {
    // The plane z = 0 of the table is what the camera sees at 2 m.
    let camera_from_table = Pose::from_xyz_rpy([0.0, 0.0, 2.0, std::f64::consts::PI, 0.0, 0.3]);
    PatchTable { sample: patch().sample, resting_pose: 3, camera_from_table }
}

/// The bytes of a record, after they came back and were compared with those of the generated encoder.
macro_rules! encoded {
    ($record:expr, $kind:ident) => {{
        let (record, mut bytes) = ($record, Vec::new());
        record.encode(&mut bytes);
        let raw = proto::$kind::decode(bytes.as_slice()).expect("protobuf");
        assert_eq!(raw.encode_to_vec(), bytes);
        let mut again = Vec::new();
        $kind::decode(&bytes).expect("a record").encode(&mut again);
        assert_eq!(again, bytes);
        bytes
    }};
}

/// Requires that each change of the message is refused with the name of its field.
macro_rules! refused {
    ($bytes:expr, $kind:ident, $($field:literal: $change:expr;)*) => {$({
        let mut raw = proto::$kind::decode($bytes.as_slice()).expect("protobuf");
        let change: fn(&mut proto::$kind) = $change;
        change(&mut raw);
        let error = $kind::decode(&raw.encode_to_vec()).expect_err($field).to_string();
        assert!(error.contains($field), "{}: {error}", $field);
    })*};
}

#[test]
fn marks_come_back_and_are_bytes_of_the_generated_encoder() {
    let bytes = encoded!(trial(), PatchTrial);
    refused!(bytes, PatchTrial,
        "sample": |raw| raw.sample = None;
        "trials": |raw| raw.trials.truncate(3);
        "outcome": |raw| raw.outcome = "bad".to_owned();
        "trial": |raw| raw.trial = "dropped".to_owned();
        "verdict": |raw| raw.verdict = String::new();
        "tested": |raw| raw.tested[0] = 2;
    );
    let bytes = encoded!(visibility(), PatchVisibility);
    refused!(bytes, PatchVisibility,
        "surfaces": |raw| raw.surfaces[..4].copy_from_slice(&(-1.0_f32).to_le_bytes());
        "surfaces": |raw| raw.surfaces.truncate(12);
        "visible": |raw| raw.visible.truncate(3);
        "heatmap_visible": |raw| raw.heatmap_visible = vec![7];
    );
    let bytes = encoded!(metric(), PatchMetric);
    refused!(bytes, PatchMetric,
        "size": |raw| raw.size = 0.0;
        "side": |raw| raw.side = 0;
        "windows": |raw| raw.windows[2] = 0;
        "corners": |raw| raw.corners.truncate(7);
        "depth": |raw| raw.depth.truncate(8);
    );
    let bytes = encoded!(table(), PatchTable);
    refused!(bytes, PatchTable, "camera_from_table": |raw| raw.camera_from_table[0] = 3.0;);
}

/// Checks the patches, then one of their marks.
fn beside(patch: &HeatmapPatch, channel: crate::Channel, mark: &[u8]) -> Result<Vec<(usize, f64)>, RecordError> {
    let mut checks = (checks_of(crate::Product::PATCHES).samples)();
    let mut bytes = Vec::new();
    patch.encode(&mut bytes);
    checks.check(crate::Channel::PATCH, &bytes).expect("patches");
    checks.check(channel, mark).map(|checked| checked.facts)
}

#[test]
fn a_trial_says_what_the_labels_say() {
    let check = |trial: &PatchTrial, value: f32| {
        let patch = HeatmapPatch { value, ..patch() };
        beside(&patch, crate::Channel::PATCH_TRIAL, &encoded!(trial, PatchTrial))
    };
    assert_eq!(check(&trial(), 1.0), Ok(vec![(4, 3.0)]));
    for (outcome, value, known) in
        [(GraspLabel::Held, -1.0, 4), (GraspLabel::Borderline, 0.0, 0), (GraspLabel::Untested, 0.0, 0)]
    {
        let tested = PatchTrial::mask(outcome, 1, 2);
        assert_eq!(tested.iter().filter(|known| **known).count(), known);
        let trial = PatchTrial { outcome, tested, ..trial() };
        assert!(check(&trial, value).is_ok());
        assert!(check(&trial, 1.0).is_err(), "the labels state that it failed");
    }
    // The masks of other types, of other points, and of nothing.
    for tested in [PatchTrial::mask(GraspLabel::Failed, 0, 2), vec![true; 32], vec![false; 32], Vec::new()] {
        assert!(check(&PatchTrial { tested, ..trial() }, 1.0).is_err());
    }
    // Labels that are not those of trials.
    let patch = HeatmapPatch { label: "energy".to_owned(), value: 0.5, ..patch() };
    assert!(beside(&patch, crate::Channel::PATCH_TRIAL, &encoded!(trial(), PatchTrial)).is_err());
}

#[test]
fn what_is_hidden_follows_from_depth() {
    let check = |visibility: &PatchVisibility| {
        beside(&patch(), crate::Channel::PATCH_VISIBILITY, &encoded!(visibility, PatchVisibility))
    };
    assert_eq!(check(&visibility()), Ok(vec![(5, 3.0)]));
    let mut other = visibility();
    other.surfaces[1] = 2.1;
    assert!(check(&other).is_err(), "another depth than the patch has");
    let mut other = visibility();
    other.visible[2] = true;
    assert!(check(&other).is_err(), "6 mm behind the surface");
    assert!(check(&PatchVisibility { heatmap_visible: vec![true], ..visibility() }).is_err(), "there is no heatmap");
    assert!(is_visible(2.0 + VISIBLE_TOLERANCE, 2.0) && !is_visible(2.0 + 1.01 * VISIBLE_TOLERANCE, 2.0));
}

#[test]
fn squares_in_metres_show_the_pixels_of_their_windows() {
    let check = |metric: &PatchMetric| beside(&patch(), crate::Channel::PATCH_METRIC, &encoded!(metric, PatchMetric));
    assert!(metric().windows.iter().all(|window| (4..=6).contains(window)), "{:?}", metric().windows);
    assert_eq!(check(&metric()), Ok(Vec::new()));
    let changes: [fn(&mut PatchMetric); 4] = [
        |metric| metric.windows[0] += 1,
        |metric| metric.corners[3][1] += 1,
        |metric| metric.depth[5] = 1.5,
        |metric| metric.size *= 2.0,
    ];
    for change in changes {
        let mut other = metric();
        change(&mut other);
        assert!(check(&other).is_err());
    }
    // Every pixel of the window where there are as many or more pixels, and the middle ones where there are fewer.
    let pixels = |window, side| (0..side).map(|index| window_pixel(index, window, side)).collect::<Vec<_>>();
    assert_eq!(pixels(4, 4), [0, 1, 2, 3]);
    assert_eq!(pixels(2, 4), [0, 0, 1, 1]);
    assert_eq!(pixels(3, 2), [0, 2]);
    assert_eq!(pixels(8, 2), [2, 6]);
    assert_eq!(pixels(1, 3), [0, 0, 0]);
}

#[test]
fn nothing_is_seen_through_a_table() {
    let check = |table: &PatchTable| beside(&patch(), crate::Channel::PATCH_TABLE, &encoded!(table, PatchTable));
    assert_eq!(check(&table()), Ok(Vec::new()));
    assert_eq!(table().depth_along(&Vector3::new(0.3, -0.2, 1.0)).map(|depth| (depth * 1e9).round()), Some(2e9));
    let at = |z: f64, roll: f64| PatchTable {
        camera_from_table: Pose::from_xyz_rpy([0.0, 0.0, z, roll, 0.0, 0.3]),
        ..table()
    };
    assert!(check(&at(1.99, std::f64::consts::PI)).is_err(), "the plane at 2 m lies behind the table");
    assert!(check(&at(2.0, 0.0)).is_err(), "the camera is below the table");
}
