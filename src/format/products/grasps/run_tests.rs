//! Grasps and shapes: the hand-written encoder against the generated one, and what is refused.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3, Unit, Vector3};
use proptest::prelude::*;
use prost::Message;

use super::*;
use crate::codec::proto;
use kernel::{
    geom::{HandBase, Object, Pose, Shape, TriMesh, Triangles},
    ids::{Digest, ItemId, ObjectId, SampleId},
    words::{BothWays, GraspVerdict, PathStage, PointScheme, STRETCHES},
};

fn pose() -> impl Strategy<Value = [f64; 6]> {
    prop::array::uniform6(-3.0..3.0f64)
}

fn grasp() -> impl Strategy<Value = Grasp> {
    let contact = (0..3u32, prop::array::uniform3(-0.3..0.3f64), prop::array::uniform3(0.1..1.0f64), -1e-3..1e-3f64);
    let numbers = (0.0..9.0f64, prop::array::uniform3(0.0..2.0f64), prop::array::uniform4(-2.0..2.0f64));
    let more = (prop::option::of(0..390_625u32), prop::option::of(-0.1..0.2f64), 0..6usize);
    let lowest = prop::array::uniform2(prop::array::uniform2(-0.1..0.1f64));
    let (pregrasp, approach, shaping) =
        (Some(PathStage::Pregrasp), Some(PathStage::Approach), Some(PathStage::Shaping));
    let stages = (
        prop::sample::select(vec![None, pregrasp, approach]),
        prop::sample::select(vec![None, pregrasp, approach, shaping]),
    );
    (pose(), pose(), prop::collection::vec(contact, 0..9), numbers, more, (lowest, stages)).prop_map(
        |(approach, base, contacts, (energy, quality, joints), (kind, width, verdict), (lowest, stages))| {
            let contacts = contacts.into_iter().map(|(link, point, normal, distance)| HeldContact {
                link,
                point,
                normal: Vector3::from(normal).normalize().into(),
                distance,
            });
            Grasp {
                object_from_approach: Pose::from_xyz_rpy(approach),
                object_from_base: Pose::from_xyz_rpy(base),
                opening: vec![0.0],
                posture: vec![joints[0]],
                amplitudes: joints[2..].to_vec(),
                joints_before: joints[..2].to_vec(),
                joints: joints[1..3].to_vec(),
                advance: quality[1],
                shift: width.map(|width| [width, joints[0], joints[1]]),
                turn: width.map(|_| quality),
                penetration: quality[0],
                energy,
                contact_energy: energy,
                potential: joints[3],
                contacts: contacts.collect(),
                epsilon_force: quality[0],
                epsilon_wrench: quality[1],
                volume: quality[2],
                kind,
                width,
                verdict: GraspVerdict::ALL[verdict],
                clearances: if verdict == 1 { Vec::new() } else { lowest.to_vec() },
                object_in_way: (verdict != 1).then_some(BothWays { shaped: stages.0, opened: stages.1 }),
                point_scheme: PointScheme::of_number(verdict as u32 % 4),
            }
        },
    )
}

fn run() -> impl Strategy<Value = GraspRun> {
    let sample = (any::<[u8; 32]>(), any::<u32>());
    let counts = (1..1000u32, 0..1000u32, any::<u32>());
    (sample, "[a-z ü]{0,9}", pose(), counts, prop::collection::vec(grasp(), 0..6), any::<bool>()).prop_map(
        |((subject, item), name, seed, (steps, more, tries), mut grasps, soft)| {
            grasps.sort_by(|a, b| a.energy.total_cmp(&b.energy));
            let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
            let mut course = [RunInterval { accepted: 3, mean_energy: -0.5 }; STRETCHES];
            course[0].mean_energy = 0.0;
            GraspRun {
                sample: SampleId::of_object(ObjectId(Digest(subject)), ItemId(item)),
                hand: HandNames {
                    name,
                    id: ObjectId(Digest([9; 32])),
                    links: names(&["palm", "", "tip"]),
                    joints: names(&["spread", "finger"]),
                    driven: names(&["spread"]),
                },
                object_from_seed: Pose::from_xyz_rpy(seed),
                asked_steps: steps + more,
                steps,
                failed: steps / 2,
                tries: u64::from(tries) << 8,
                potentials: u64::from(tries),
                course,
                method: GraspMethod {
                    sampler: if soft { "uniform" } else { "annealing" }.to_owned(),
                    energy: "contact_and_potential".to_owned(),
                    energy_space: WRENCH.to_owned(),
                    energy_friction: 0.2,
                    potential_scale: 100.0,
                    contact_model: if soft { "soft_finger" } else { "hard_point" }.to_owned(),
                    friction: 0.5,
                    edges: 16,
                    torsion: if soft { 0.1 } else { 0.0 },
                    space: FORCE.to_owned(),
                    min_epsilon: 0.01,
                    max_penetration: 5e-4,
                    max_advance: 0.03,
                    stand_off: 0.1,
                },
                grasps,
                resting_poses: 2,
                budget_spent: soft,
            }
        },
    )
}

fn hand() -> HandShape {
    let solid = |link, shape| LinkSolid { link, shape, link_from_solid: IsometryMatrix3::translation(0.1, 0.0, -0.2) };
    let corners = vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
    HandShape {
        name: "hand".to_owned(),
        id: ObjectId(Digest([9; 32])),
        links: ["palm", "finger", "tip"].map(str::to_owned).to_vec(),
        joints: [("hinge", false, 0), ("slide", true, 1)]
            .map(|(name, slides, carried_by)| HandJoint {
                name: name.to_owned(),
                slides,
                carried_by,
                link_from_joint: IsometryMatrix3::translation(0.0, 0.1, 0.0),
                axis: if slides { Vector3::x_axis() } else { Vector3::z_axis() },
            })
            .to_vec(),
        solids: vec![
            solid(0, Shape::Box { half: [0.1, 0.2, 0.3] }),
            solid(1, Shape::Sphere { radius: 0.1 }),
            solid(1, Shape::Capsule { radius: 0.1, half: 0.3 }),
            solid(2, Shape::Cylinder { radius: 0.1, half: 0.3 }),
            solid(2, Shape::Mesh(Arc::new(Triangles { corners, triangles: vec![[0, 1, 2]] }))),
        ],
    }
}

proptest! {
    /// The palm goes straight back along its own z, the lift straight up, and no waypoint states what is not stored.
    #[test]
    fn waypoints_follow_from_what_is_stored(run in run(), up in prop::array::uniform3(0.1..1.0f64)) {
        let up = Unit::new_normalize(Vector3::from(up));
        for (grasp, pose) in run.grasps.iter().zip([None, Some(0), Some(1)].into_iter().cycle()) {
            // Opened where that way is free, else in the posture.
            let is_free = |stage: Option<PathStage>, way: usize| {
                stage.is_none() && pose.is_none_or(|pose| grasp.clearances[pose][way] >= 0.0)
            };
            let free = grasp.object_in_way.map(|BothWays { shaped, opened }| [is_free(shaped, 0), is_free(opened, 1)]);
            let Some(way) = run.waypoints(grasp, &up, pose) else {
                prop_assert!(free.is_none_or(|free| free == [false, false]));
                continue;
            };
            let is_opened = free.is_some_and(|[_, opened]| opened);
            prop_assert!(is_opened || free.is_some_and(|[shaped, _]| shaped));
            prop_assert_eq!(way.each_ref().map(|waypoint| waypoint.name), Waypoint::NAMES);
            let approach_from_base = grasp.object_from_approach.isometry().inverse() * grasp.object_from_base.isometry();
            let back = nalgebra::Translation3::new(0.0, 0.0, -run.method.stand_off);
            let expected = grasp.object_from_approach.isometry() * back * approach_from_base;
            let found = way[0].object_from_base.isometry();
            prop_assert!((expected.to_homogeneous() - found.to_homogeneous()).norm() < 1e-12);
            let base = grasp.object_from_base;
            prop_assert!(way[1..4].iter().all(|waypoint| waypoint.object_from_base == base));
            let lifted = way[4].object_from_base.isometry().translation.vector - base.isometry().translation.vector;
            prop_assert!((lifted - up.into_inner() * 0.1).norm() < 1e-12);
            let driven = way.each_ref().map(|waypoint| waypoint.driven.as_deref());
            let posture = Some(&grasp.posture[..]);
            let coming = if is_opened { Some(&grasp.opening[..]) } else { posture };
            prop_assert_eq!(driven, [coming, coming, posture, None, None]);
            let joints = way.each_ref().map(|waypoint| waypoint.joints.as_deref());
            let (before, closed) = (Some(&grasp.joints_before[..]), Some(&grasp.joints[..]));
            let coming = if is_opened { None } else { before };
            prop_assert_eq!(joints, [coming, coming, before, closed, closed]);
        }
    }

    #[test]
    fn a_run_reads_back_and_has_the_generated_encoders_bytes(run in run()) {
        let mut payload = Vec::new();
        run.encode(&mut payload);
        prop_assert_eq!(&GraspRun::decode(&payload).unwrap(), &run);
        let generated = proto::GraspRun::decode(payload.as_slice()).unwrap();
        prop_assert_eq!(generated.encode_to_vec(), payload);
        let facts = run.facts();
        prop_assert_eq!(facts.found() as usize, run.grasps.len());
        prop_assert_eq!(facts.kept() as usize, run.kept().count());
        prop_assert_eq!((facts.given_up, facts.budget_spent), (run.steps < run.asked_steps, run.budget_spent));
        prop_assert_eq!(facts.best_energy.is_finite(), !run.grasps.is_empty());
    }

    #[test]
    fn a_run_that_contradicts_itself_is_refused(run in run(), extra in grasp()) {
        let (mut run, mut payload) = (run, Vec::new());
        run.grasps = vec![Grasp { contacts: vec![HeldContact {
            link: 0, point: [0.0; 3], normal: [0.0, 0.0, 1.0], distance: 0.0,
        }], ..extra }];
        run.encode(&mut payload);
        let generated = proto::GraspRun::decode(payload.as_slice()).unwrap();
        let lies: [fn(&mut proto::GraspRun); 27] = [
            |run| run.grasps[0].object_in_way.push(0),
            |run| run.grasps[0].object_in_way = vec![4, 0],
            |run| run.grasps[0].object_in_way = vec![0, 3],
            |run| run.grasps[0].object_in_way = vec![5, 0],
            |run| run.steps = 0,
            |run| run.asked_steps = run.steps - 1,
            |run| run.failed = run.steps + 1,
            |run| run.potentials = run.tries + 1,
            |run| _ = run.links.pop(),
            |run| run.driven.clear(),
            |run| run.hand_digest.push(0),
            |run| run.mean_energy[3] = f64::INFINITY,
            |run| _ = run.accepted.pop(),
            |run| run.energy = "energy".to_owned(),
            |run| run.edges = 2,
            |run| run.torsion += if run.torsion > 0.0 { -run.torsion } else { 0.1 },
            |run| run.object_from_seed[0] += 1.0,
            |run| run.grasps[0].joints.push(0.0),
            |run| run.grasps[0].links[0] = 3,
            |run| run.grasps[0].normals[2] = 0.5,
            |run| run.grasps[0].verdict = 6,
            |run| run.grasps[0].point_scheme = 4,
            |run| run.grasps[0].clearances.push(0.1),
            |run| run.grasps[0].clearances_opened.push(0.1),
            |run| (run.resting_poses, run.grasps[0].clearances) = (3, vec![0.1; 2]),
            |run| run.grasps[0].epsilon_wrench = -1e-9,
            |run| {
                let better = proto::Grasp { energy: run.grasps[0].energy - 1.0, ..run.grasps[0].clone() };
                run.grasps.push(better);
            },
        ];
        for (number, lie) in lies.into_iter().enumerate() {
            let mut lying = generated.clone();
            lie(&mut lying);
            prop_assert!(GraspRun::decode(&lying.encode_to_vec()).is_err(), "lie {number}");
        }
    }

    #[test]
    fn no_bytes_make_the_decoders_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = (GraspRun::decode(&bytes), HandShape::decode(&bytes), ObjectShape::decode(&bytes));
    }
}

#[test]
fn shapes_read_back_and_have_the_generated_encoders_bytes() {
    let mut payload = Vec::new();
    hand().encode(&mut payload);
    assert_eq!(HandShape::decode(&payload), Ok(hand()));
    let generated = proto::HandShape::decode(payload.as_slice()).unwrap();
    assert_eq!(generated.encode_to_vec(), payload);
    let lies: [fn(&mut proto::HandShape); 7] = [
        |hand| _ = hand.links.pop(),
        |hand| hand.joints[0].carried_by = 1,
        |hand| hand.joints[0].kind = "ball".to_owned(),
        |hand| hand.joints[1].axis[0] = 0.0,
        |hand| hand.solids[0].link = 3,
        |hand| hand.solids[1].size.push(0.1),
        |hand| hand.solids[4].triangles[0] = 3,
    ];
    for (number, lie) in lies.into_iter().enumerate() {
        let mut lying = generated.clone();
        lie(&mut lying);
        assert!(HandShape::decode(&lying.encode_to_vec()).is_err(), "lie {number}");
    }
    let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mesh = TriMesh { vertices, triangles: vec![[0, 1, 2]] };
    let object = ObjectShape { object: ObjectId(Digest([3; 32])), mesh };
    payload.clear();
    object.encode(&mut payload);
    assert_eq!(ObjectShape::decode(&payload), Ok(object));
    let generated = proto::ObjectShape::decode(payload.as_slice()).unwrap();
    assert_eq!(generated.encode_to_vec(), payload);
}

/// A hinge by a quarter of a revolution, then a slide along what was x.
#[test]
fn links_go_where_the_joints_bring_them() {
    let frames = hand().link_frames(&[std::f64::consts::FRAC_PI_2, 0.5]);
    let origin = |frame: &IsometryMatrix3<f64>| frame * Point3::origin();
    assert!((origin(&frames[1]) - Point3::new(0.0, 0.1, 0.0)).norm() < 1e-12);
    assert!((origin(&frames[2]) - Point3::new(-0.1, 0.6, 0.0)).norm() < 1e-12, "{}", origin(&frames[2]));
    let still = Pose::<Object, HandBase>::identity();
    assert_eq!(frames[0], *still.isometry());
    assert_eq!(Unit::new_normalize(frames[1] * Vector3::x()).map(|part| part.round()), Vector3::y());
}
