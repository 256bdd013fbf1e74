use nalgebra::{Rotation3, Vector3};

use super::*;
use crate::{Blocked, Facts, PickObstacle, PickPassage, SceneContainer, checks_of};
use kernel::{
    geom::Pose,
    ids::{Digest, ItemId, ObjectId, SampleId},
    words::{PathStage, PointScheme},
};

fn surface() -> SealedSurface {
    SealedSurface {
        seat: 0.001,
        compression: 0.0004,
        spread: 0.0011,
        slope: [0.01, -0.02],
        flex: 0.0002,
        stretch: 0.003,
        bulge: 0.0001,
        hole: -0.0001,
        curvatures: [-1.0, 12.0],
    }
}

fn pose(number: u32, hold: Option<f64>, blocked: Option<(PathStage, PickObstacle)>) -> SuctionPose {
    let hold = hold.map(|margin| SuctionHold { strength: 3, margin, used: [0.1, 0.2, 0.3, 1.0 - margin], force: 18.0 });
    SuctionPose {
        number,
        scheme: PointScheme::Cells,
        object_from_cup: Pose::new(Rotation3::from_euler_angles(0.1, 0.2, 0.3), Vector3::new(0.0, 0.1, 0.5)),
        seal_limit: 6,
        seal_margin: if hold.is_some() { 0.4 } else { -0.2 },
        missed: 0,
        surface: Some(surface()),
        suctionnet: [0.9, 0.7],
        hold,
        passage: PickPassage {
            blocked: blocked.map(|(stage, by)| Blocked { stage, by }),
            clearance: if blocked.is_some() { 0.001 } else { 0.006 },
        },
        robustness: None,
    }
}

/// The second of three bodies: a pose of each result, and one whose rays miss.
fn poses() -> SuctionPoses {
    let body = |byte| (ObjectId(Digest([byte; 32])), Pose::identity());
    let missing = SuctionPose { seal_limit: 0, seal_margin: -0.1, missed: 17, surface: None, ..pose(9, None, None) };
    let free = SuctionPose { robustness: Some(0.75), ..pose(2, Some(0.5), None) };
    SuctionPoses {
        sample: SampleId::of_object(ObjectId(Digest([9; 32])), ItemId(1)),
        container: SceneContainer::Bin { inner: [0.4, 0.3, 0.2], wall: 0.02, tilt_deg: 0.0 },
        bodies: vec![body(1), body(2), body(3)],
        mass: 0.2,
        centre_of_mass: [0.0, 0.01, 0.02],
        cup: CupMeasures { radius: 0.01, outer_radius: 0.011, height: 0.02, tube_radius: 0.008, tube_length: 0.1 },
        rules: SuctionRules {
            margin: 0.002,
            half_angle: 1.0,
            tilt: 0.2,
            safety: 1.5,
            any_direction: false,
            budget: 100,
            wanted: 4,
        },
        draws: SuctionDraws {
            drawn: 20,
            tilted: 3,
            leaking: [2, 0, 0, 0, 0, 0, 4],
            weak: [0, 0, 0, 2],
            alike: 5,
            blocked: [0, 0, 0, 3],
            free: 1,
        },
        poses: vec![
            pose(0, None, Some((PathStage::Pregrasp, PickObstacle::Ground))),
            free,
            pose(4, Some(-0.3), None),
            pose(7, Some(0.3), Some((PathStage::Approach, PickObstacle::Neighbour(3)))),
            missing,
        ],
    }
}

fn encoded(poses: &SuctionPoses) -> Vec<u8> {
    let mut payload = Vec::new();
    poses.encode(&mut payload);
    payload
}

#[test]
fn records_come_back_with_their_results_and_facts() {
    let record = poses();
    let payload = encoded(&record);
    let found = SuctionPoses::decode(&payload).expect("a record");
    assert_eq!(found, record);
    let results: Vec<&str> = found.poses.iter().map(|pose| pose.result().name()).collect();
    assert_eq!(results, ["leaking", "free", "weak", "blocked", "leaking"]);
    let facts = SuctionFacts::from_poses(&found);
    assert_eq!((facts.with_free, facts.robust, facts.stored), (1, 1, 5));
    let mut checks = (checks_of(Product::SUCTION).samples)();
    let checked = checks.check(Channel::SUCTION_POSES, &payload).expect("a record");
    let expected: Vec<(usize, f64)> = Facts::from(facts).values().iter().copied().enumerate().collect();
    assert_eq!((checked.sample, checked.facts), (record.sample, expected));
}

#[test]
fn every_contradiction_is_named_with_its_field() {
    type Change = fn(&mut SuctionPoses);
    let changes: [(&str, Change); 18] = [
        ("sample.item", |record| record.sample.item = ItemId(3)),
        ("mass", |record| record.mass = 0.0),
        ("centre_of_mass", |record| record.centre_of_mass[1] = f64::NAN),
        ("cup", |record| record.cup.height = f64::INFINITY),
        ("margin", |record| record.rules.margin = 0.01),
        ("drawn", |record| record.draws.drawn += 1),
        ("drawn", |record| record.rules.budget = 19),
        ("free", |record| {
            record.draws.free = 2;
            record.draws.alike = 4;
        }),
        ("weak", |record| {
            record.draws.weak = [0; 4];
            record.draws.tilted = 5;
        }),
        ("poses", |record| record.poses[2].number = 2),
        ("drawn", |record| record.poses[4].number = 20),
        ("seal_limits", |record| record.poses[0].seal_limit = 7),
        ("missed", |record| record.poses[0].missed = 1),
        ("seals", |record| record.poses[0].suctionnet[0] = 1.1),
        ("strengths", |record| record.poses[1].hold.as_mut().expect("sealed").strength = 4),
        ("neighbours", |record| {
            record.poses[3].passage.blocked =
                Some(Blocked { stage: PathStage::Approach, by: PickObstacle::Neighbour(2) });
        }),
        ("stages", |record| {
            record.poses[3].passage.blocked = Some(Blocked { stage: PathStage::Closing, by: PickObstacle::Own });
        }),
        ("robustness", |record| record.poses[3].robustness = Some(0.5)),
    ];
    for (field, change) in changes {
        let mut record = poses();
        change(&mut record);
        let error = SuctionPoses::decode(&encoded(&record)).expect_err(field);
        assert!(error.to_string().contains(field), "{field}: {error}");
    }
}
