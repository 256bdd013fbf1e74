//! Patches: the hand-written encoder against the generated one, and what is refused.

use proptest::prelude::*;
use prost::Message;

use super::*;
use crate::{FORCE, Facts, RecordError, WRENCH, checks_of, codec::proto};
use kernel::{
    geom::{Intrinsics, Pose},
    ids::{Digest, ItemId, ObjectId, SampleId},
};

fn patch() -> impl Strategy<Value = HeatmapPatch> {
    let key = (any::<[u8; 32]>(), 0..9u32, 0..9u32, 0..3u32);
    let point = (prop::array::uniform3(-0.1..0.1f64), "[a-z_]{0,9}");
    let points = prop::collection::vec(point, PATCH_POINTS);
    let numbers = (-9.0..9.0f64, 0.0..0.5f64, any::<bool>(), prop::array::uniform6(-3.0..3.0f64), 4..9u32);
    let depth = prop::collection::vec(prop_oneof![Just(f32::NAN), 1.0..3.0f32], 8 * 8 * PATCH_POINTS);
    (key, points, numbers, depth).prop_map(|((digest, run, rank, type_index), points, numbers, mut depth)| {
        let (energy, epsilon, quirk, approach, side) = numbers;
        let camera = Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).expect("a camera");
        let point_focal_length = quirk.then_some(589.366_454);
        let camera_from_object = Pose::from_xyz_rpy([0.0, 0.0, 2.0, 0.3, 0.2, -1.0]);
        let points: Vec<PatchPoint> = points
            .into_iter()
            .map(|(point, name)| {
                let (u, v) =
                    camera.with_focal_length(point_focal_length).project(&camera_from_object.point(&point.into()));
                let corner = [u, v].map(|pixel| (pixel - f64::from(side) / 2.0 + 0.5).floor() as u32);
                PatchPoint { name, point, pixel: [u, v], corner }
            })
            .collect();
        depth.truncate(PATCH_POINTS * (side * side) as usize);
        depth.resize(PATCH_POINTS * (side * side) as usize, f32::NAN);
        HeatmapPatch {
            sample: SampleId::of_object(ObjectId(Digest(digest)), ItemId(rank)),
            grasps: Digest([3; 32]),
            run,
            rank,
            type_index,
            types: vec![0, 390_624, 77],
            energy,
            epsilon,
            space: if quirk { FORCE } else { WRENCH }.to_owned(),
            hand: "hand".to_owned(),
            hand_id: ObjectId(Digest([9; 32])),
            camera,
            point_focal_length,
            camera_from_object,
            object_from_approach: Pose::from_xyz_rpy(approach),
            points: points.try_into().expect("four points"),
            side,
            depth,
            label: if quirk { "energy" } else { "epsilon" }.to_owned(),
            value: if quirk { energy } else { -epsilon } as f32,
        }
    })
}

proptest! {
    #[test]
    fn patches_come_back_and_are_bytes_of_the_generated_encoder(patch in patch()) {
        let mut bytes = Vec::new();
        patch.encode(&mut bytes);
        let raw = proto::HeatmapPatch::decode(bytes.as_slice()).expect("protobuf");
        prop_assert_eq!(raw.encode_to_vec(), bytes.clone());
        let again = HeatmapPatch::decode(&bytes).expect("a record");
        // NaN is not itself: compare what is written.
        let mut twice = Vec::new();
        again.encode(&mut twice);
        prop_assert_eq!(&twice, &bytes);
        prop_assert_eq!((again.kind(), again.facts(), again.depth_of(3).len()), (patch.kind(), patch.facts(), (patch.side * patch.side) as usize));
        for point in 0..PATCH_POINTS {
            let labels = again.labels(point);
            prop_assert_eq!(labels.len(), 12);
            let index = 4 * patch.type_index as usize + point;
            let mut expected = vec![0.0; 12];
            expected[index] = patch.value;
            prop_assert_eq!(labels, expected);
        }
        let checked = (checks_of(Product::PATCHES).samples)().check(Channel::PATCH, &bytes).expect("a record");
        let facts = Facts::from(patch.facts());
        prop_assert_eq!(checked.facts, facts.values().iter().copied().enumerate().take(4).collect::<Vec<_>>());
    }

    #[test]
    fn colours_come_back(side in 1..9u32, level in any::<u8>()) {
        let rgb = (0..PATCH_POINTS as u32 * side * side).map(|index| [index as u8, level, 7]).collect();
        let colour = PatchColour { sample: SampleId::of_object(ObjectId(Digest([1; 32])), ItemId(2)), side, rgb };
        let mut bytes = Vec::new();
        colour.encode(&mut bytes);
        prop_assert_eq!(&proto::PatchColour::decode(bytes.as_slice()).expect("protobuf").encode_to_vec(), &bytes);
        prop_assert_eq!(&PatchColour::decode(&bytes).expect("a record"), &colour);
        bytes.pop();
        prop_assert!(PatchColour::decode(&bytes).is_err());
    }
}

fn heatmap() -> PatchHeatmap {
    let point =
        |run, rank, type_index, point, pixel, value| HeatmapPoint { run, rank, type_index, point, pixel, value };
    PatchHeatmap {
        sample: SampleId::of_object(ObjectId(Digest([1; 32])), ItemId(2)),
        width: 6,
        height: 4,
        types: 2,
        angle: 0.35,
        points: vec![
            point(0, 1, 1, 0, [0.0, 3.9], -0.25),
            point(0, 1, 1, 3, [5.5, 0.5], -0.25),
            point(2, 0, 1, 0, [0.7, 3.0], -0.5),
            point(2, 0, 1, 2, [2.0, 2.0], -0.5),
            point(2, 7, 1, 0, [0.2, 3.2], -0.125),
        ],
    }
}

#[test]
fn heatmaps_come_back_and_become_maps() {
    let heatmap = heatmap();
    let mut bytes = Vec::new();
    heatmap.encode(&mut bytes);
    let raw = proto::PatchHeatmap::decode(bytes.as_slice()).expect("protobuf");
    assert_eq!(raw.encode_to_vec(), bytes);
    assert_eq!(PatchHeatmap::decode(&bytes).expect("a record"), heatmap);
    let maps = heatmap.maps();
    let at = |map: usize, column: usize, row: usize| maps[(map * 4 + row) * 6 + column];
    assert_eq!(maps.len(), 8 * 4 * 6);
    // Of three palms in one pixel the best.
    assert_eq!((at(4, 0, 3), at(7, 5, 0), at(6, 2, 2)), (-0.5, -0.25, -0.5));
    assert_eq!(maps.iter().filter(|value| **value != 0.0).count(), 3);
    type Change = fn(&mut proto::PatchHeatmap);
    let refused: [(&str, Change); 7] = [
        ("width", |raw| raw.width = 0),
        ("types", |raw| raw.types = 0),
        ("angle", |raw| raw.angle = 4.0),
        ("ranks", |raw| raw.ranks.truncate(1)),
        ("type_indices", |raw| raw.type_indices[1] = 2),
        ("pixels", |raw| raw.pixels[1] = 4.0),
        ("runs", |raw| raw.runs.reverse()),
    ];
    for (field, change) in refused {
        let mut raw = raw.clone();
        change(&mut raw);
        let error = PatchHeatmap::decode(&raw.encode_to_vec()).expect_err(field).to_string();
        assert!(error.contains(field), "{field}: {error}");
    }
    // A label of the thesis may be above 0: the lowest wins there, too.
    let mut worse = heatmap.clone();
    worse.points.iter_mut().for_each(|point| point.value += 1.0);
    assert_eq!(worse.maps()[(4 * 4 + 3) * 6], 0.5);
}

/// The message with one thing changed, decoded.
fn changed(change: impl FnOnce(&mut proto::HeatmapPatch)) -> Result<HeatmapPatch, RecordError> {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let patch = proptest::strategy::ValueTree::current(&patch().new_tree(&mut runner).expect("a patch"));
    let mut bytes = Vec::new();
    patch.encode(&mut bytes);
    let mut raw = proto::HeatmapPatch::decode(bytes.as_slice()).expect("protobuf");
    change(&mut raw);
    HeatmapPatch::decode(&raw.encode_to_vec())
}

#[test]
fn what_contradicts_itself_is_no_patch() {
    assert!(changed(|_| ()).is_ok());
    type Change = fn(&mut proto::HeatmapPatch);
    let refused: [(&str, Change); 15] = [
        ("sample", |raw| raw.sample = None),
        ("grasps", |raw| raw.grasps.truncate(31)),
        ("type", |raw| raw.r#type += 1),
        ("digits", |raw| raw.digits[2] += 1),
        ("type_index", |raw| raw.type_index = 3),
        ("space", |raw| raw.space = "colour".to_owned()),
        ("pixels", |raw| raw.pixels[5] += 1e-3),
        ("corners", |raw| raw.corners[0] += 1),
        ("points", |raw| raw.points[2] = f64::NAN),
        ("point_focal_length", |raw| raw.point_focal_length = -1.0),
        ("point_focal_length", |raw| raw.point_focal_length = 1e300),
        ("point_focal_length", |raw| raw.point_focal_length = f64::NAN),
        ("depth", |raw| raw.depth[..4].copy_from_slice(&(-1.0f32).to_le_bytes())),
        ("labels", |raw| {
            // The palm's label at another point as well.
            let index = 4 * ((4 * raw.type_index as usize + 5) % 12);
            raw.labels[index..index + 4].copy_from_slice(&0.5f32.to_le_bytes());
        }),
        ("labels", |raw| (raw.epsilon, raw.energy) = (raw.epsilon + 1.0, raw.energy + 1.0)),
    ];
    for (field, change) in refused {
        let error = changed(change).expect_err(field).to_string();
        assert!(error.contains(field), "{field}: {error}");
    }
}
