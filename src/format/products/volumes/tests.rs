use nalgebra::{Rotation3, Vector3};

use super::*;
use crate::{Facts, PickState, RecordError, SceneImage};
use kernel::{
    geom::{Intrinsics, Pose},
    ids::{Digest, ItemId, ObjectId, SampleId},
    voxel::VolumeGrid,
};

const GRID: VolumeGrid = VolumeGrid { resolution: 3, size: 0.3 };

fn sample() -> SampleId {
    SampleId::of_object(ObjectId(Digest([9; 32])), ItemId(2))
}

/// Two images of three voxels: one seen twice, one at the cut, one free.
fn volume() -> SceneVolume {
    let intrinsics = Intrinsics { width: 640, height: 480, fx: 554.3, fy: 554.3, cx: 320.0, cy: 240.0, near: 0.1 };
    let view = |view, camera| FusedView {
        view,
        camera,
        intrinsics,
        world_from_camera: Pose::new(Rotation3::from_euler_angles(0.1, 0.2, 0.3), Vector3::new(0.0, 0.1, 0.5)),
    };
    let mut volume = SceneVolume {
        world_from_volume: Pose::new(Rotation3::identity(), Vector3::new(-0.15, -0.15, -0.05)),
        views: vec![view(0, 0), view(4, 1)],
        ..SceneVolume::empty(sample(), GRID, 0.04)
    };
    (volume.steps[0], volume.weights[0]) = (-32767, 2);
    (volume.steps[5], volume.weights[5]) = (120, 1);
    (volume.steps[26], volume.weights[26]) = (32767, 1);
    volume
}

fn truth() -> VolumeTruth {
    let mut instances = vec![0; 27];
    instances[..5].copy_from_slice(&[1, 1, 3, 254, 255]);
    let body = |byte| (ObjectId(Digest([byte; 32])), Pose::identity());
    VolumeTruth { sample: sample(), resolution: 3, instances, bodies: vec![body(1), body(2), body(3)] }
}

/// A grasp of each state in the corners of the cube.
fn affordance() -> VolumeAffordance {
    let grasp = |key: [u32; 2], state, centre| VoxelGrasp {
        body: key[0],
        candidate: key[1],
        state,
        centre,
        rotation: [0.6, 0.0, 0.0, 0.8],
        width: 0.03,
    };
    VolumeAffordance {
        sample: sample(),
        grid: GRID,
        picks: Digest([5; 32]),
        trials: Some(Digest([6; 32])),
        hand: "gripper".to_owned(),
        hand_id: ObjectId(Digest([7; 32])),
        evaluated: vec![true, false, true],
        forbidden: [10, 20, 30, 40],
        outside: 7,
        grasps: vec![
            grasp([1, 0], PickState::Held, [0.01, 0.0, 0.09]),
            grasp([1, 9], PickState::Failed, [0.29, 0.29, 0.29]),
            grasp([3, 2], PickState::Untried, [0.0, 0.1, 0.25]),
        ],
    }
}

#[test]
fn grasps_that_contradict_themselves_are_refused() {
    let affordance = affordance();
    assert_eq!(affordance.grasps.iter().map(|grasp| affordance.voxel(grasp)).collect::<Vec<_>>(), [0, 26, 5]);
    for outside in [[-1e-9, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, f64::NAN]] {
        assert_eq!(VolumeAffordance::voxel_of(&GRID, &outside.into()), None);
    }
    type Change = fn(&mut VolumeAffordance);
    let changes: [(Change, &str); 8] = [
        (|affordance| affordance.grid.resolution = 129, "resolution"),
        (|affordance| affordance.grid.size = f64::INFINITY, "size"),
        (|affordance| affordance.evaluated[2] = false, "bodies"),
        (|affordance| affordance.grasps[0].candidate = 9, "candidates"),
        (|affordance| affordance.grasps[1].centre[0] = 0.31, "voxels"),
        (|affordance| affordance.grasps[1].rotation[3] = -0.8, "rotations"),
        (|affordance| affordance.grasps[1].rotation[0] = 0.7, "rotations"),
        (|affordance| affordance.grasps[2].width = f64::NAN, "widths"),
    ];
    for (change, expected) in changes {
        let mut changed = affordance.clone();
        change(&mut changed);
        let error = VolumeAffordance::decode(&payload(|out| changed.encode(out))).expect_err(expected);
        assert_eq!(field_of(&error), expected, "{error:?}");
    }
    let coarse = SceneVolume { grid: VolumeGrid { resolution: 2, ..GRID }, ..volume() };
    assert_eq!(field_of(&affordance.check_beside(&coarse).expect_err("another cube")), "resolution");
}

fn payload(encode: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut out = Vec::new();
    encode(&mut out);
    out
}

#[test]
fn volume_and_truth_come_back_as_they_were_with_their_counts() {
    let (volume, truth) = (volume(), truth());
    assert_eq!(SceneVolume::decode(&payload(|out| volume.encode(out))), Ok(volume.clone()));
    assert_eq!(VolumeTruth::decode(&payload(|out| truth.encode(out))), Ok(truth.clone()));
    assert_eq!(truth.check_beside(&volume), Ok(()));
    let affordance = affordance();
    assert_eq!(VolumeAffordance::decode(&payload(|out| affordance.encode(out))), Ok(affordance.clone()));
    assert_eq!(affordance.check_beside(&volume), Ok(()));
    let facts = VolumeFacts::from_volume(&volume, &truth, Some(&affordance));
    let expected = VolumeFacts {
        images: 2,
        observed_voxels: 3,
        near_voxels: 1,
        bodies: 3,
        bodies_inside: 2,
        occupied_voxels: 3,
        grasps: GraspsInVolume { states: [1, 1, 1], forbidden: 100, outside: 7 },
    };
    assert_eq!(facts, expected);
    assert_eq!(
        VolumeFacts { grasps: GraspsInVolume::default(), ..facts },
        VolumeFacts::from_volume(&volume, &truth, None)
    );
    assert_eq!((volume.value(0), volume.value(26)), (-1.0, 1.0));
    assert_eq!(VolumeFacts::from(&Facts::from(facts)), facts);
    // Each record states its own part of the table, by the same indices.
    let values = Facts::from(facts);
    let of_grasps =
        (facts::FIRST_OF_GRASPS..).zip(GraspsInVolume::from_affordance(&affordance).values().map(f64::from));
    let stated = volume.stated_facts().into_iter().chain(truth.stated_facts()).chain(of_grasps);
    let stated: Vec<_> = stated.collect();
    assert_eq!(stated, values.values().iter().copied().enumerate().collect::<Vec<_>>());
}

#[test]
fn numbers_are_those_of_images() {
    let numbers = [VolumeTruth::FREE, VolumeTruth::CONTAINER, VolumeTruth::TABLE];
    assert_eq!(numbers, [SceneImage::NOTHING, SceneImage::CONTAINER, SceneImage::TABLE]);
    assert_eq!(VolumeTruth::MAX_BODIES, SceneImage::MAX_BODIES);
    assert!(!numbers.iter().any(|number| VolumeTruth::is_body(*number)) && VolumeTruth::is_body(252));
}

fn field_of(error: &RecordError) -> &'static str {
    match error {
        RecordError::Range { field, .. } | RecordError::Length { field, .. } | RecordError::Rotation { field, .. } => {
            field
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_volume_that_contradicts_itself_is_refused() {
    type Change = fn(&mut SceneVolume);
    let changes: [(Change, &str); 9] = [
        (|volume| volume.grid.resolution = 129, "resolution"),
        (|volume| volume.grid.size = 0.0, "size"),
        (|volume| volume.truncation = f64::NAN, "truncation"),
        (|volume| volume.views.clear(), "views"),
        (|volume| volume.views[1].view = 0, "views"),
        (|volume| volume.weights[3] = 3, "weights"),
        (|volume| volume.steps[5] = i16::MIN, "values"),
        (|volume| volume.steps[7] = 1, "values"),
        (|volume| volume.weights.truncate(26), "weights"),
    ];
    for (change, expected) in changes {
        let mut volume = volume();
        change(&mut volume);
        let error = SceneVolume::decode(&payload(|out| volume.encode(out))).expect_err(expected);
        assert_eq!(field_of(&error), expected, "{error:?}");
    }
}

#[test]
fn a_truth_of_unknown_bodies_or_of_another_grid_is_refused() {
    type Change = fn(&mut VolumeTruth);
    let changes: [(Change, &str); 4] = [
        (|truth| truth.instances[9] = 4, "instances"),
        (|truth| truth.instances[9] = 253, "instances"),
        (|truth| truth.bodies.clear(), "objects"),
        (|truth| truth.resolution = 4, "instances"),
    ];
    for (change, expected) in changes {
        let mut truth = truth();
        change(&mut truth);
        let error = VolumeTruth::decode(&payload(|out| truth.encode(out))).expect_err(expected);
        assert_eq!(field_of(&error), expected, "{error:?}");
    }
    let coarse = VolumeTruth { resolution: 2, instances: vec![0; 8], ..truth() };
    assert_eq!(field_of(&coarse.check_beside(&volume()).expect_err("another grid")), "resolution");
}
