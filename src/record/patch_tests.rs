//! Patches: the hand-written encoder against the generated one, and what is refused.

use proptest::prelude::*;
use prost::Message;

use super::*;
use crate::geom::{Intrinsics, Pose};

fn patch() -> impl Strategy<Value = HeatmapPatch> {
    let place = (any::<[u8; 32]>(), 0..9u32, 0..9u32, 0..3u32);
    let point = (prop::array::uniform3(-0.1..0.1f64), "[a-z_]{0,9}");
    let points = prop::collection::vec(point, PATCH_POINTS);
    let numbers = (-9.0..9.0f64, 0.0..0.5f64, any::<bool>(), prop::array::uniform6(-3.0..3.0f64), 4..9u32);
    let depth = prop::collection::vec(prop_oneof![Just(f32::NAN), 1.0..3.0f32], 8 * 8 * PATCH_POINTS);
    (place, points, numbers, depth).prop_map(|((digest, run, rank, type_index), points, numbers, mut depth)| {
        let (energy, epsilon, quirk, approach, side) = numbers;
        let camera = Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).expect("a camera");
        let camera_from_object = Pose::from_xyz_rpy([0.0, 0.0, 2.0, 0.3, 0.2, -1.0]);
        let points: Vec<PatchPoint> = points
            .into_iter()
            .map(|(point, name)| {
                let (u, v) = camera.project(&camera_from_object.point(&point.into()));
                let corner = [u, v].map(|pixel| (pixel - f64::from(side) / 2.0 + 0.5).floor() as u32);
                PatchPoint { name, point, pixel: [u, v], corner }
            })
            .collect();
        depth.truncate(PATCH_POINTS * (side * side) as usize);
        depth.resize(PATCH_POINTS * (side * side) as usize, f32::NAN);
        HeatmapPatch {
            sample: SampleId::of_object(ObjectId(Digest(digest)), ViewId(rank)),
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
            let place = 4 * patch.type_index as usize + point;
            let mut expected = vec![0.0; 12];
            expected[place] = patch.value;
            prop_assert_eq!(labels, expected);
        }
        let mut checker = Checker::default();
        prop_assert_eq!(checker.check(Channel::Patch, &bytes).expect("a record").facts, Some(patch.facts().into()));
    }

    #[test]
    fn colours_come_back(side in 1..9u32, level in any::<u8>()) {
        let rgb = (0..PATCH_POINTS as u32 * side * side).map(|place| [place as u8, level, 7]).collect();
        let colour = PatchColour { sample: SampleId::of_object(ObjectId(Digest([1; 32])), ViewId(2)), side, rgb };
        let mut bytes = Vec::new();
        colour.encode(&mut bytes);
        prop_assert_eq!(&proto::PatchColour::decode(bytes.as_slice()).expect("protobuf").encode_to_vec(), &bytes);
        prop_assert_eq!(&PatchColour::decode(&bytes).expect("a record"), &colour);
        bytes.pop();
        prop_assert!(PatchColour::decode(&bytes).is_err());
    }
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
    let refused: [(&str, Change); 12] = [
        ("sample", |raw| raw.sample = None),
        ("grasps", |raw| raw.grasps.truncate(31)),
        ("type", |raw| raw.r#type += 1),
        ("digits", |raw| raw.digits[2] += 1),
        ("type_index", |raw| raw.type_index = 3),
        ("space", |raw| raw.space = "colour".to_owned()),
        ("pixels", |raw| raw.pixels[5] += 1e-3),
        ("corners", |raw| raw.corners[0] += 1),
        ("points", |raw| raw.points[2] = f64::NAN),
        ("depth", |raw| raw.depth[..4].copy_from_slice(&(-1.0f32).to_le_bytes())),
        ("labels", |raw| {
            // The palm's label in another place as well.
            let place = 4 * ((4 * raw.type_index as usize + 5) % 12);
            raw.labels[place..place + 4].copy_from_slice(&0.5f32.to_le_bytes());
        }),
        ("labels", |raw| (raw.epsilon, raw.energy) = (raw.epsilon + 1.0, raw.energy + 1.0)),
    ];
    for (field, change) in refused {
        let error = changed(change).expect_err(field).to_string();
        assert!(error.contains(field), "{field}: {error}");
    }
}
