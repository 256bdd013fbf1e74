use nalgebra::{Rotation3, Vector3};

use super::*;
use crate::{Facts, PressedContact, RecordError, SceneContainer};
use kernel::{
    geom::Pose,
    ids::{Digest, ItemId, ObjectId, SampleId},
    words::{BothWays, FreeWays, PathStage, PointScheme},
};

fn sample() -> SampleId {
    SampleId::of_object(ObjectId(Digest([9; 32])), ItemId(1))
}

type Lost = Option<(PathStage, PickObstacle)>;

fn passage(blocked: Lost, clearance: f64) -> PickPassage {
    PickPassage { blocked: blocked.map(|(stage, by)| Blocked { stage, by }), clearance }
}

fn candidate(key: [u32; 3], shaped: (Lost, f64), opened: (Lost, f64)) -> PickCandidate {
    let [run, rank, direction] = key;
    let ways = BothWays { shaped, opened }.map(|(blocked, clearance)| passage(blocked, clearance));
    let is_free = ways.shaped.is_free() || ways.opened.is_free();
    PickCandidate {
        run,
        rank,
        direction,
        world_from_base: Pose::new(Rotation3::from_euler_angles(0.1, 0.2, 0.3), Vector3::new(0.0, 0.1, 0.5)),
        ways,
        closed: if is_free { vec![0.01, 0.02] } else { Vec::new() },
    }
}

/// The second of three bodies: two grasps that are free in both ways, and one lost to each obstacle, one of these on one way.
fn candidates() -> PickCandidates {
    let both = |key, blocked, clearance| candidate(key, (blocked, clearance), (blocked, clearance));
    let body = |byte| (ObjectId(Digest([byte; 32])), Pose::identity());
    PickCandidates {
        sample: sample(),
        container: SceneContainer::Bin { inner: [0.4, 0.3, 0.2], wall: 0.02, tilt_deg: 0.0 },
        bodies: vec![body(1), body(2), body(3)],
        hand: "gripper".to_owned(),
        hand_id: ObjectId(Digest([7; 32])),
        joints: vec!["left".to_owned(), "right".to_owned()],
        take: TakenGrasps::Held,
        stored: 2,
        rolls: 4,
        margin: 0.002,
        candidates: vec![
            both([0, 3, 0], None, 0.01),
            both([0, 3, 2], Some((PathStage::Pregrasp, PickObstacle::Ground)), -0.001),
            candidate(
                [0, 3, 3],
                (Some((PathStage::Approach, PickObstacle::Container)), 0.0),
                (Some((PathStage::Shaping, PickObstacle::Own)), -0.0005),
            ),
            candidate([5, 0, 0], (Some((PathStage::Approach, PickObstacle::Own)), -0.001), (None, 0.004)),
            both([5, 0, 1], Some((PathStage::Closing, PickObstacle::Neighbour(3))), 0.0019),
            both([5, 0, 3], None, 0.0021),
        ],
    }
}

fn trials() -> PickTrials {
    let failed = PickTrial {
        candidate: 0,
        verdict: PickVerdict::LostClosing,
        time: 0.75,
        steps: 375,
        raised: -0.001,
        penetration: 0.0,
        object_from_base: None,
        contacts: Vec::new(),
        touched: vec![PressedThing { thing: 0, phase: PickPhase::Closing, time: 0.6, force: 2.5 }],
        awake: vec![AwakeNeighbour { body: 1, moved: 0.02, lifted: 0.05 }],
    };
    let held = PickTrial {
        candidate: 5,
        verdict: PickVerdict::Held,
        time: 2.1,
        steps: 1050,
        raised: 0.1,
        penetration: 1e-5,
        object_from_base: Some(Pose::identity()),
        contacts: vec![PressedContact {
            link: 1,
            point: [0.1, 0.0, 0.2],
            normal: [0.0, 1.0, 0.0],
            distance: -1e-5,
            force: 3.0,
        }],
        touched: vec![PressedThing { thing: 3, phase: PickPhase::Lift, time: 1.2, force: 0.5 }],
        awake: vec![
            AwakeNeighbour { body: 1, moved: 0.0, lifted: 0.0 },
            AwakeNeighbour { body: 3, moved: 0.11, lifted: 0.09 },
        ],
    };
    PickTrials {
        sample: sample(),
        links: vec!["base".to_owned(), "left".to_owned(), "right".to_owned()],
        mass: 0.2,
        friction: 0.5,
        torsion: 0.002,
        rolling: 0.002,
        awake: AwakeBodies::Near,
        protocol: PickProtocol {
            approach: [0.1, 0.5],
            start_depth: 0.001,
            closing_time: 1.0,
            lift: [0.1, 1.0],
            hold_time: 0.5,
            least_raised: 0.08,
            lost: [0.03, 0.5],
            carried_height: 0.04,
        },
        trials: vec![failed, held],
    }
}

fn payload(encode: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut out = Vec::new();
    encode(&mut out);
    out
}

#[test]
fn candidates_and_trials_come_back_as_they_were_with_their_counts() {
    let (candidates, trials) = (candidates(), trials());
    assert_eq!(PickCandidates::decode(&payload(|out| candidates.encode(out))), Ok(candidates.clone()));
    assert_eq!(PickTrials::decode(&payload(|out| trials.encode(out))), Ok(trials.clone()));
    assert_eq!(trials.check_beside(&candidates), Ok(()));
    let facts = PickFacts::from_candidates(&candidates, Some(&trials), None);
    assert_eq!((facts.stored, facts.candidates, facts.free, facts.lost), (2, 6, 2, [1; 4]));
    assert_eq!((facts.trials.tried(), facts.trials.held()), (2, 1));
    let PickTrialFacts { held_touching, held_moving, held_carrying, .. } = facts.trials;
    assert_eq!((held_touching, held_moving, held_carrying), (1, 1, 1));
    assert_eq!(PickFacts::from(&Facts::from(facts)), facts);
    assert_eq!((candidates.body(), candidates.object()), (2, ObjectId(Digest([2; 32]))));
    assert_eq!(candidates.free().collect::<Vec<_>>(), [0, 5]);
    let ways: Vec<FreeWays> = candidates.candidates.iter().map(PickCandidate::free_ways).collect();
    let (none, both) = (FreeWays::None, FreeWays::Both);
    assert_eq!(ways, [both, none, none, FreeWays::Opened, none, both]);
    assert_eq!((facts.free, facts.free_opened, facts.free_either), (2, 3, 3));
    assert_eq!(trials.trials[1].carried(0.04).collect::<Vec<_>>(), [3]);
}

type Fault<T> = (&'static str, fn(&mut T));

#[test]
fn candidates_that_make_no_sense_are_refused_by_field() {
    let faults: [Fault<PickCandidates>; 17] = [
        ("sample.item", |record| record.sample.item = ItemId(3)),
        ("rolls", |record| record.rolls = 0),
        ("directions", |record| record.rolls = 3),
        ("runs", |record| record.stored = 1),
        ("margin", |record| record.margin = 0.01),
        ("directions", |record| record.candidates.swap(0, 1)),
        ("clearances", |record| record.candidates[1].ways.shaped.clearance = 0.002),
        ("clearances", |record| record.candidates[1].ways.shaped.clearance = -0.0011),
        ("clearances", |record| record.candidates[0].ways.shaped.clearance = -0.001),
        ("clearances_opened", |record| record.candidates[3].ways.opened.clearance = -0.001),
        ("closed_joints", |record| record.candidates[0].closed.push(0.0)),
        ("closed_joints", |record| record.candidates[3].closed.clear()),
        ("neighbours", |record| {
            let by_itself = Some((PathStage::Closing, PickObstacle::Neighbour(2)));
            record.candidates[4].ways.shaped = passage(by_itself, 0.0);
        }),
        ("stages", |record| {
            record.candidates[4].ways.shaped = passage(Some((PathStage::Closing, PickObstacle::Own)), 0.0);
        }),
        ("stages", |record| {
            record.candidates[4].ways.shaped = passage(Some((PathStage::Shaping, PickObstacle::Container)), 0.0);
        }),
        ("stages_opened", |record| {
            record.candidates[2].ways.opened = passage(Some((PathStage::Closing, PickObstacle::Own)), 0.0);
        }),
        ("verdicts", |record| record.container = SceneContainer::Plane { size: [1.0, 1.0] }),
    ];
    for (field, fault) in faults {
        let mut record = candidates();
        fault(&mut record);
        let found = PickCandidates::decode(&payload(|out| record.encode(out)));
        let error = found.expect_err(field);
        let named = match &error {
            RecordError::Range { field, .. } | RecordError::Length { field, .. } => *field,
            _ => "?",
        };
        assert_eq!(named, field, "{error}");
    }
}

#[test]
fn trials_that_make_no_sense_are_refused_by_field() {
    let faults: [Fault<PickTrials>; 8] = [
        ("trials.candidate", |record| record.trials.swap(0, 1)),
        ("trials.links", |record| record.trials[1].contacts[0].link = 3),
        ("trials.normals", |record| record.trials[1].contacts[0].normal = [0.0, 1.1, 0.0]),
        ("trials.object_from_base", |record| record.trials[1].object_from_base = None),
        ("trials.awake", |record| record.trials[1].awake.swap(0, 1)),
        ("trials.moved", |record| record.trials[1].awake[0].moved = -1.0),
        ("trials.touched_forces", |record| record.trials[0].touched[0].force = f64::NAN),
        ("trials.time", |record| record.trials[0].time = -1.0),
    ];
    let named = |error: &RecordError| match error {
        RecordError::Range { field, .. } | RecordError::Length { field, .. } => *field,
        _ => "?",
    };
    for (field, fault) in faults {
        let mut record = trials();
        fault(&mut record);
        let error = PickTrials::decode(&payload(|out| record.encode(out))).expect_err(field);
        assert_eq!(named(&error), field, "{error}");
    }
    let beside: [Fault<PickTrials>; 3] = [
        ("trials.candidate", |record| record.trials[0].candidate = 1),
        ("trials.touched", |record| record.trials[0].touched[0].thing = 2),
        ("trials.awake", |record| record.trials[1].awake[1].body = 4),
    ];
    for (field, fault) in beside {
        let mut record = trials();
        fault(&mut record);
        let error = record.check_beside(&candidates()).expect_err(field);
        assert_eq!(named(&error), field, "{error}");
    }
}

/// Two sampled candidates: one is free, the other one blocked by a neighbour.
fn sampled() -> (PickCandidates, PickSampling) {
    let mut candidates = candidates();
    (candidates.take, candidates.stored, candidates.rolls) = (TakenGrasps::Sampled, 0, 1);
    candidates.candidates = vec![candidates.candidates[0].clone(), candidates.candidates[4].clone()];
    for (candidate, pose) in candidates.candidates.iter_mut().zip([7, 11]) {
        (candidate.run, candidate.rank, candidate.direction) = (0, pose, 0);
    }
    let drawn = |scheme, shift: f64| DrawnPick {
        scheme,
        points: [[shift, 0.0, 0.0], [0.0, 0.02, 0.01]],
        opening: 0.08,
        depth: 0.004,
    };
    let poses = PickPoses {
        poses: 100,
        unopposed: 40,
        too_wide: 3,
        tilted: 5,
        too_low: 20,
        rejected: [2, 14, 0, 8],
        alike: 5,
        blocked: [0, 0, 1, 1],
        free: 1,
    };
    let sampling = PickSampling {
        sample: candidates.sample,
        friction: 0.4,
        half_angle: 1.0,
        budget: 100,
        poses,
        palm_only: false,
        drawn: vec![drawn(PointScheme::Cells, -0.01), drawn(PointScheme::Area, 0.01)],
    };
    (candidates, sampling)
}

#[test]
fn samplings_come_back_as_they_were_with_their_counts() {
    let (candidates, sampling) = sampled();
    assert_eq!(PickCandidates::decode(&payload(|out| candidates.encode(out))), Ok(candidates.clone()));
    assert_eq!(PickSampling::decode(&payload(|out| sampling.encode(out))), Ok(sampling.clone()));
    assert_eq!(sampling.check_beside(&candidates), Ok(()));
    let facts = PickFacts::from_candidates(&candidates, None, Some(&sampling));
    assert_eq!(PickFacts::from(&Facts::from(facts)), facts);
    assert_eq!((facts.free, facts.sampling.poses.free, facts.sampling.blocked_by), (1, 1, [0; 4]));
    // Without a free grasp the obstacle of most poses on the exact path counts, else that of the tests before it.
    let none = PickPoses { free: 0, ..sampling.poses };
    assert_eq!(none.blocked_by(), Some(2));
    assert_eq!(PickPoses { blocked: [0; 4], ..none }.blocked_by(), Some(1));
    assert_eq!(PickPoses { blocked: [0; 4], rejected: [0; 4], ..none }.blocked_by(), None);
    assert!(PickPoses { poses: 4, unopposed: 1, too_wide: 3, ..PickPoses::default() }.is_too_wide());
}

/// Change of two records that belong together, and part of the message that refuses it.
type BesideMistake = (&'static str, fn(&mut PickCandidates, &mut PickSampling));

#[test]
fn samplings_that_make_no_sense_are_refused_by_field() {
    let faults: [Fault<PickSampling>; 7] = [
        ("friction", |record| record.friction = 0.0),
        ("half_angle", |record| record.half_angle = f64::NAN),
        ("poses", |record| record.poses.alike += 1),
        ("poses", |record| record.budget = 99),
        ("palm_only", |record| record.palm_only = true),
        ("points", |record| record.drawn[0].points[1][2] = f64::INFINITY),
        ("depths", |record| record.drawn[1].depth = -0.001),
    ];
    let named = |error: &RecordError| match error {
        RecordError::Range { field, .. } | RecordError::Length { field, .. } => *field,
        _ => "?",
    };
    for (field, fault) in faults {
        let (_, mut record) = sampled();
        fault(&mut record);
        let error = PickSampling::decode(&payload(|out| record.encode(out))).expect_err(field);
        assert_eq!(named(&error), field, "{error}");
    }
    let beside: [BesideMistake; 4] = [
        ("schemes", |_, record| _ = record.drawn.pop()),
        ("sample", |candidates, _| candidates.take = TakenGrasps::Held),
        ("free", |_, record| record.poses.free = 0),
        ("poses", |candidates, _| candidates.candidates[1].rank = 100),
    ];
    for (field, fault) in beside {
        let (mut candidates, mut record) = sampled();
        fault(&mut candidates, &mut record);
        let error = record.check_beside(&candidates).expect_err(field);
        assert_eq!(named(&error), field, "{error}");
    }
}

/// Rotations go to the nearest free direction of the same stored grasp, the short way round the circle.
#[test]
fn a_blocked_grasp_knows_its_nearest_free_rotation() {
    use std::f64::consts::{FRAC_PI_2, PI};
    let found = candidates().nearest_free_rotations();
    let expected = [0.0, PI, FRAC_PI_2, -FRAC_PI_2, PI, 0.0].map(Some);
    assert_eq!(found, expected);
    let mut blocked = candidates();
    blocked.candidates.truncate(5);
    assert_eq!(blocked.nearest_free_rotations()[3..], [None, None]);
}
