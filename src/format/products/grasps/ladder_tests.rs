//! Graded labels: the hand-written encoder against the generated one, what follows from levels, and what is refused.

use prost::Message;

use super::*;
use crate::codec::proto;
use kernel::{
    geom::Pose,
    ids::{Digest, ItemId, ObjectId, SampleId},
    words::{BothWays, GraspVerdict},
};

fn trial(verdict: TrialVerdict) -> LevelTrial {
    let held = verdict.is_held();
    LevelTrial {
        outcome: TrialOutcome {
            verdict,
            time: 2.5,
            closing_time: 0.5,
            closed_at_rest: true,
            penetration: [0.0, 2e-4, 3e-3],
            farthest: if held { 1e-3 } else { 0.061 },
            slips: vec![],
            force: 30.0,
            links: 2,
            opened_by: 0.0,
            drawn_back: 0.0,
            warnings: 0,
        },
        reason: (!held).then_some(FailureReason::SlippedShake),
        farthest_phase: 2,
        rotation: 0.25,
        rotation_phase: 1,
        touched: true,
        closing: [2e-3, 0.01],
        pressed_speed: 0.05,
        closed_links: 2,
        imbalance: 0.125,
    }
}

fn tried(verdict: TrialVerdict) -> LevelResult {
    LevelResult::Tried(Box::new(trial(verdict)))
}

const FREE: WayObstacles = WayObstacles { object: false, table: false };

fn ladder(grasp: u32, levels: Option<[LevelResult; 4]>, second_law: Option<TrialVerdict>) -> GraspLadder {
    GraspLadder {
        grasp,
        resting_pose: Some(1),
        obstacles: BothWays { shaped: FREE, opened: WayObstacles { object: false, table: true } },
        levels,
        second_law: second_law.map(|verdict| Box::new(trial(verdict))),
        closed: None,
    }
}

/// Ladders of every shape, with their success and label.
fn cases() -> [(GraspLadder, Option<f64>, LadderLabel); 8] {
    use LevelResult::{Inferred, Unknown};
    let [held, lost, unstable] = [TrialVerdict::Held, TrialVerdict::LostShaking, TrialVerdict::Unstable];
    let low = |easy: TrialVerdict| Some([tried(easy), tried(lost), Inferred(false), Inferred(false)]);
    let high = |adverse: LevelResult, hard| Some([Inferred(true), tried(held), adverse, tried(hard)]);
    let in_way = WayObstacles { object: true, table: false };
    let blocked = GraspLadder {
        obstacles: BothWays { shaped: in_way, opened: WayObstacles { object: true, table: true } },
        ..ladder(9, None, None)
    };
    [
        (ladder(0, high(Inferred(true), held), None), Some(1.0), LadderLabel::Held),
        (ladder(1, high(tried(held), lost), None), Some(0.75), LadderLabel::Held),
        (ladder(2, high(tried(lost), unstable), None), Some(0.5), LadderLabel::Partial),
        (ladder(3, low(held), None), Some(0.25), LadderLabel::Partial),
        (ladder(4, low(lost), Some(held)), Some(0.0), LadderLabel::Partial),
        (ladder(6, low(lost), Some(lost)), Some(0.0), LadderLabel::Failed),
        (ladder(7, Some([Unknown, tried(unstable), Unknown, Unknown]), None), None, LadderLabel::Untested),
        (blocked, Some(0.0), LadderLabel::Blocked),
    ]
}

fn ladders() -> GraspLadders {
    let mut ladders: Vec<GraspLadder> = cases().into_iter().map(|(ladder, ..)| ladder).collect();
    let contact =
        PressedContact { link: 2, point: [0.1, 0.0, -0.2], normal: [0.0, 0.6, 0.8], distance: -1e-4, force: 12.0 };
    ladders[0].closed = Some(ClosedHand {
        joints: vec![0.5, 0.0],
        object_from_base: Pose::from_xyz_rpy([0.1, 0.2, 0.3, -0.4, 0.5, 0.6]),
        contacts: vec![contact, PressedContact { link: 0, ..contact }],
    });
    GraspLadders {
        sample: SampleId::of_object(ObjectId(Digest([7; 32])), ItemId(3)),
        hand: "hand".to_owned(),
        links: ["palm", "finger", "tip"].map(str::to_owned).to_vec(),
        joints: 2,
        method: LadderMethod {
            friction: 0.5,
            torsion: 0.002,
            mass: 0.35,
            mass_from: "table".to_owned(),
            mass_source: "scales".to_owned(),
            tried: TriedStates::Closed,
            table_friction: Some(0.4),
            lost: [0.03, 0.5],
            followed: 0.06,
        },
        ladders,
    }
}

fn payload() -> Vec<u8> {
    let mut payload = Vec::new();
    ladders().encode(&mut payload);
    payload
}

#[test]
fn ladders_read_back_and_have_the_generated_encoders_bytes() {
    let payload = payload();
    assert_eq!(GraspLadders::decode(&payload).expect("valid"), ladders());
    let raw = proto::GraspLadders::decode(payload.as_slice()).expect("a message");
    assert_eq!(raw.encode_to_vec(), payload);
    let expected = LadderFacts { tried: 8, held: 2, partial: 3, failed: 1, blocked: 1, trials: 17 };
    assert_eq!(ladders().facts(), expected);
}

#[test]
fn success_and_label_follow_from_levels() {
    for (ladder, success, label) in cases() {
        assert_eq!((ladder.success(), ladder.label()), (success, label), "{ladder:?}");
        let strict = ladder.label_from(1.0);
        let expected = if success == Some(0.75) { LadderLabel::Partial } else { label };
        assert_eq!(strict, expected);
    }
    let reasons = cases().map(|(ladder, ..)| ladder.reason());
    let slipped = Some(FailureReason::SlippedShake);
    let expected = [None, slipped, slipped, slipped, slipped, slipped, slipped, Some(FailureReason::Blocked)];
    assert_eq!(reasons, expected);
    assert_eq!(cases()[0].0.level(LadderLevel::Easy), Some(&LevelResult::Inferred(true)));
    assert!((trial(TrialVerdict::Held).deepest() - 3e-3).abs() < 1e-12, "a depth is a number");
}

#[test]
fn wrong_ladders_are_refused() {
    type Change = fn(&mut proto::GraspLadders);
    let changes: [(&str, Change); 16] = [
        ("links", |raw| raw.links.truncate(2)),
        ("mass", |raw| raw.mass = 0.0),
        ("mass_from", |raw| raw.mass_from = "guess".to_owned()),
        ("friction", |raw| raw.friction = f64::NAN),
        ("levels", |raw| raw.levels.swap(0, 1)),
        ("grasp", |raw| raw.ladders.swap(0, 1)),
        ("resting_pose", |raw| raw.table_friction.clear()),
        ("obstacles", |raw| raw.ladders[0].obstacles[0] = 4),
        ("blocked", |raw| raw.ladders[0].obstacles = vec![1, 2]),
        ("label", |raw| raw.ladders[2].label = 2),
        ("second law", |raw| raw.ladders[4].second_law = None),
        ("state", |raw| raw.ladders[0].levels[0].state = 4),
        ("bisection", |raw| raw.ladders[0].levels[0].state = 2),
        ("reason", |raw| raw.ladders[1].levels[3].reason = 0),
        ("phase", |raw| raw.ladders[0].levels[1].farthest_phase = 3),
        ("imbalance", |raw| raw.ladders[0].levels[1].imbalance = 1.5),
    ];
    for (name, change) in changes {
        let mut raw = proto::GraspLadders::decode(payload().as_slice()).expect("a message");
        change(&mut raw);
        assert!(GraspLadders::decode(&raw.encode_to_vec()).is_err(), "{name}");
    }
}

#[test]
fn ladders_are_those_of_the_run() {
    use GraspVerdict::{Kept, OpenHand, Penetrates};
    let verdicts = [Kept, Kept, Kept, Kept, Kept, OpenHand, Kept, Kept, Penetrates, Kept];
    let ladders = ladders();
    assert!(ladders.check_beside(&verdicts, 2).is_ok());
    assert!(ladders.check_beside(&verdicts, 1).is_err(), "no such resting pose");
    assert!(ladders.check_beside(&verdicts[..9], 2).is_err(), "one too many");
    assert!(ladders.check_beside(&[Kept; 8], 2).is_err(), "other states");
}
