//! The hands compared with the numbers that they are made from.

use std::collections::BTreeMap;

use graspmill::{
    collision::Geometry,
    geom::{Shape, TouchShape},
    hand::{Driven, Motor},
    seed::Stream,
};
use mujoco_rs::wrappers::{
    mj_data::MjData,
    mj_model::{MjModel, MjtObjBase},
};
use nalgebra::{IsometryMatrix3, Matrix3, Point3, Vector3};

use super::{frames_at, link_named};
use crate::support::robots::{BARRETT, GRIPPER, open_hand};

fn assert_near(found: &Point3<f64>, expected: [f64; 3], within: f64) {
    assert!((found - Point3::from(expected)).amax() <= within, "{found} is not {expected:?}");
}

/// Forward kinematics of GraspIt's model of the hand, whose frame lies on the palm's face [mm].
#[test]
fn the_barrett_hand_has_the_published_places() {
    let model = open_hand(BARRETT);
    let hand = model.hand();
    let approach = hand.approach_pose(&frames_at(hand, &[0.0; 4]));
    assert_eq!(approach.translation().z, 0.0787);
    let in_palm = |link: usize, frames: &[IsometryMatrix3<f64>]| {
        let from_palm = approach.isometry().inverse() * frames[link - 1];
        Point3::from(from_palm.translation.vector * 1e3)
    };
    let [medial, distal] = ["medial_1", "distal_1"].map(|name| link_named(hand, name));
    let frames = frames_at(hand, &[0.0; 4]);
    assert_near(&in_palm(medial, &frames), [-25.0, 50.0, -3.3], 0.1);
    assert_near(&in_palm(distal, &frames), [-25.6, 119.9, -6.3], 0.1);
    let frames = frames_at(hand, &[90.0, 90.0, 90.0, 90.0]);
    assert_near(&in_palm(distal, &frames), [-78.0, -0.6, 66.6], 0.1);
    // From the flange: J2 of finger 3, which has no spread; the same at every spread.
    let third = link_named(hand, "medial_3");
    for spread in [0.0, 77.0, 180.0] {
        let position = frames_at(hand, &[spread, 10.0, 10.0, 10.0])[third - 1].translation.vector;
        assert!((position - Vector3::new(0.0, -0.05, 0.0754)).norm() < 1e-12);
    }
}

#[test]
fn the_barrett_hand_has_the_published_lengths_limits_and_masses() {
    let model = open_hand(BARRETT);
    let hand = model.hand();
    let joints: BTreeMap<&str, _> =
        hand.tree().joints().iter().map(|joint| (joint.joint.name.as_str(), &joint.joint)).collect();
    assert_eq!(joints.len(), 8);
    for (name, joint) in &joints {
        let limits = joint.limits.expect("limits");
        let high = match name.split('_').next().expect("a word") {
            "spread" => 180.0,
            "proximal" => 140.0,
            "distal" => 48.0,
            other => panic!("{other}"),
        };
        assert!(limits.low == 0.0 && (limits.high.to_degrees() - high).abs() < 1e-12, "{name}: {limits:?}");
    }
    // J2 to J3 is 70 mm, but for what the links are set off sideways; J3 to the tip 50, to the farthest point 60.
    let j3 = joints["distal_1"].origin.translation.vector;
    assert!((Vector3::new(j3.x, 0.0, j3.z).norm() - 0.07).abs() < 1e-5 && (j3.y.abs() - 0.0006).abs() < 1e-12);
    let (bodies, _) = model.bodies().expect("bodies");
    let distal = bodies.bodies.iter().find(|body| body.name == "distal_1").expect("a fingertip");
    let Shape::Capsule { radius, half } = distal.geometries[0].shape else { panic!("a capsule") };
    let middle = distal.geometries[0].link_from_shape.translation.vector.norm();
    assert!((middle + half - 0.05).abs() < 1e-12 && (middle + half + radius - 0.06).abs() < 1e-12);
    // At rest the fingertip rises by 40 degrees, the line from J2 to J3 falls by 2.46.
    let frames = frames_at(hand, &[0.0; 4]);
    let along = |name: &str| frames[link_named(hand, name) - 1].rotation * Vector3::x();
    let rise = |name| along(name).z.asin().to_degrees();
    assert!((rise("medial_1") + 2.46).abs() < 1e-9 && (rise("distal_1") - 40.0).abs() < 1e-9);
    assert!((model.mass() - 1.10).abs() < 0.005, "{}", model.mass());
    let compiled = MjModel::from_xml(BARRETT).expect("the hand");
    for (body, mass) in [("palm", 0.506), ("proximal_2", 0.141), ("medial_3", 0.062), ("distal_1", 0.041)] {
        let id = compiled.name_to_id(MjtObjBase::mjOBJ_BODY, body).expect("a body");
        assert!((compiled.body_mass()[id] - mass).abs() < 1e-12, "{body}");
        // As if its mass sat at 5 to 60 mm from its axes.
        let gyration = compiled.body_inertia()[id].map(|inertia| (inertia / mass).sqrt());
        assert!(gyration.iter().all(|arm| (0.005..0.06).contains(arm)), "{body}: {gyration:?}");
    }
}

/// Sides of the box around each link, its own axes: the published ones within 4 mm.
#[test]
fn the_barrett_hands_links_fill_the_published_boxes() {
    let model = open_hand(BARRETT);
    let (bodies, _) = model.bodies().expect("bodies");
    for (name, published, within) in [
        ("palm", [0.089, 0.109, 0.090], 0.001),
        ("proximal_1", [0.077, 0.025, 0.054], 0.001),
        ("medial_1", [0.092, 0.021, 0.026], 0.004),
        ("distal_1", [0.068, 0.023, 0.021], 0.004),
    ] {
        let body = bodies.bodies.iter().find(|body| body.name == name).expect("a body");
        // A link's frame may be turned against its body's by the joint's; no joint here does.
        let sides = [0, 1, 2].map(|axis| {
            let reach = |sign: f64| {
                let of = |geometry: &Geometry| {
                    let pose = &geometry.link_from_shape;
                    let in_shape = pose.rotation.inverse() * (Vector3::ith(axis, sign));
                    sign * pose.translation.vector[axis] + support(&geometry.shape, &in_shape)
                };
                body.geometries.iter().map(of).fold(f64::NEG_INFINITY, f64::max)
            };
            reach(1.0) + reach(-1.0)
        });
        println!("{name}: {:.1?} mm", sides.map(|side| side * 1e3));
        for (side, published) in sides.iter().zip(published) {
            assert!((side - published).abs() <= within, "{name}: {sides:?}");
        }
    }
}

/// Reach of a shape in a direction of unit length [m].
fn support(shape: &Shape, towards: &Vector3<f64>) -> f64 {
    let across = towards.x.hypot(towards.y);
    match shape {
        Shape::Box { half } => (0..3).map(|axis| half[axis] * towards[axis].abs()).sum(),
        Shape::Sphere { radius } => *radius,
        Shape::Capsule { radius, half } => radius + half * towards.z.abs(),
        Shape::Cylinder { radius, half } => radius * across + half * towards.z.abs(),
        Shape::Mesh(_) => panic!("no meshes here"),
    }
}

#[test]
fn couplings_are_a_third_and_after_breakaway_four_thirds() {
    let model = open_hand(BARRETT);
    let hand = model.hand();
    let names: Vec<&str> = hand.driven().iter().map(|driven| driven.name.as_str()).collect();
    assert_eq!(names, ["spread", "finger_1", "finger_2", "finger_3"]);
    let mut values = vec![0.0; 8];
    let motors = [0.3, 0.6, 0.9, 1.2].map(Motor::engaged);
    hand.joint_values(&motors, &mut values);
    let value = |values: &[f64], name: &str| values[hand.tree().joint_named(name).expect("a joint")];
    assert_eq!((value(&values, "spread_1"), value(&values, "spread_2")), (0.3, 0.3));
    for (finger, motor) in [(1, 0.6), (2, 0.9), (3, 1.2)] {
        assert_eq!(value(&values, &format!("proximal_{finger}")), motor);
        assert!((value(&values, &format!("distal_{finger}")) - motor / 3.0).abs() < 1e-15);
    }
    // J2 of finger 2 stays at 0.9, its motor moves on by 0.2.
    let motors = [motors[0], motors[1], Motor { angle: 1.1, released: Some(0.9) }, motors[3]];
    hand.joint_values(&motors, &mut values);
    assert_eq!(value(&values, "proximal_2"), 0.9);
    assert!((value(&values, "distal_2") - (0.3 + 0.2 * 4.0 / 3.0)).abs() < 1e-15);
    // Seven values define the state: the mirrored spread joint adds nothing.
    let commanded: Vec<&str> =
        hand.commanded_joints().into_iter().map(|joint| hand.tree().joints()[joint].joint.name.as_str()).collect();
    let seven = ["spread_1", "proximal_1", "proximal_2", "proximal_3", "distal_1", "distal_2", "distal_3"];
    assert_eq!(commanded, seven);
}

/// Fingers 1 and 2 are mirror images at every spread: together at +y, opposite each other, next to finger 3. The parts
/// are the same, not mirrored, so that their links are offset to one side by up to 0.8 mm.
#[test]
fn the_spread_is_mirrored() {
    let model = open_hand(BARRETT);
    let hand = model.hand();
    for (spread, towards) in [(0.0, [0.0, 1.0]), (90.0, [-1.0, 0.0]), (180.0, [0.0, -1.0])] {
        let frames = frames_at(hand, &[spread, 20.0, 20.0, 20.0]);
        let out = |name: &str| frames[link_named(hand, name) - 1].rotation * Vector3::x();
        let [one, two, three] = ["proximal_1", "proximal_2", "medial_3"].map(out);
        assert!((one - Vector3::new(towards[0], towards[1], 0.0)).norm() < 1e-12, "{spread}: {one}");
        assert!((two - Vector3::new(-towards[0], towards[1], 0.0)).norm() < 1e-12, "{spread}: {two}");
        assert!(three.y < -0.9);
        for part in ["medial", "distal"] {
            let [a, b] =
                [1, 2].map(|finger| frames[link_named(hand, &format!("{part}_{finger}")) - 1].translation.vector);
            assert!((a - Vector3::new(-b.x, b.y, b.z)).amax() <= 0.0016, "{spread}: {a} {b}");
        }
    }
    // Closing curls every finger to the palm's axis.
    for finger in ["distal_1", "distal_2", "distal_3"] {
        let reach = |flexion: f64| {
            let frame = frames_at(hand, &[90.0, flexion, flexion, flexion])[link_named(hand, finger) - 1];
            (frame * Point3::new(0.05, 0.0, 0.0)).xy().coords.norm()
        };
        assert!(reach(0.0) > reach(30.0) && reach(30.0) > reach(60.0) && reach(60.0) > reach(90.0), "{finger}");
    }
}

/// Every body and site against MuJoCo, joints anywhere.
#[test]
fn forward_kinematics_is_mujocos() {
    for scene in [BARRETT, GRIPPER] {
        let model = open_hand(scene);
        let hand = model.hand();
        let compiled = MjModel::from_xml(scene).expect("the hand");
        let mut data = MjData::new(&compiled);
        let mut stream = Stream::of_job(1, scene.as_bytes(), "forward");
        let mut worst = 0.0_f64;
        for _ in 0..500 {
            let limits = hand.tree().joints().iter().map(|joint| joint.joint.limits.expect("limits"));
            let values: Vec<f64> = limits.map(|limits| stream.uniform(limits.low, limits.high)).collect();
            for (joint, value) in hand.tree().joints().iter().zip(&values) {
                let id = compiled.name_to_id(MjtObjBase::mjOBJ_JOINT, &joint.joint.name).expect("a joint");
                data.qpos_mut()[compiled.jnt_qposadr()[id] as usize] = *value;
            }
            data.forward();
            let frames = hand.link_frames(&values);
            for (index, name) in hand.links().iter().enumerate().skip(1) {
                // Every joint here sits in its body's origin, so that the link's frame is the body's.
                let id = compiled.name_to_id(MjtObjBase::mjOBJ_BODY, name).expect("a body");
                worst = worst.max(apart(&frames[index - 1], &data.xpos()[id], &data.xmat()[id]));
            }
            for (index, contact) in hand.contacts().iter().enumerate() {
                let (point, normal) = hand.contact_in_base(index, &frames);
                // Contacts given by numbers have no site.
                let Some(id) = compiled.name_to_id(MjtObjBase::mjOBJ_SITE, &contact.name) else { continue };
                let axes = Matrix3::from_row_slice(&data.site_xmat()[id]);
                worst = worst.max((point - Point3::from(data.site_xpos()[id])).amax());
                worst = worst.max((normal.into_inner() - axes.column(2)).amax());
            }
        }
        println!("{scene}: at most {worst:.1e} from MuJoCo's");
        assert!(worst <= 1e-12);
    }
}

fn apart(ours: &IsometryMatrix3<f64>, position: &[f64; 3], rotation: &[f64; 9]) -> f64 {
    let theirs = Matrix3::from_row_slice(rotation);
    let moved = (ours.translation.vector - Vector3::from(*position)).amax();
    moved.max((ours.rotation.matrix() - theirs).amax())
}

fn contacts_lie_on_links(scene: &str, count: usize) {
    let model = open_hand(scene);
    let hand = model.hand();
    let (bodies, _) = model.bodies().expect("bodies");
    assert_eq!(hand.contacts().len(), count);
    for contact in hand.contacts() {
        let of_link = bodies.bodies.iter().filter(|body| body.link == contact.link);
        let shapes: Vec<_> = of_link
            .flat_map(|body| &body.geometries)
            .map(|geometry| (TouchShape::new(&geometry.shape).expect("a solid"), geometry.link_from_shape))
            .collect();
        let off = |point: &Point3<f64>| {
            shapes.iter().map(|(shape, pose)| shape.distance(pose, point)).fold(f64::INFINITY, f64::min)
        };
        for step in [-1e-4, 0.0, 1e-4] {
            let found = off(&(contact.point + contact.normal.into_inner() * step));
            assert!((found - step).abs() < 1e-9, "{}: {found:e} at {step:e}", contact.name);
        }
    }
}

/// On the surface of all the link's shapes together, looking straight out.
#[test]
fn contacts_lie_on_their_links_and_look_out() {
    let grippers = ["scenes/fetch_gripper.xml", "scenes/panda_hand.xml"];
    for (scene, count) in [(BARRETT, 16), (GRIPPER, 10), (grippers[0], 12), (grippers[1], 12)] {
        contacts_lie_on_links(scene, count);
    }
    // Names, links and positions along the links.
    let model = open_hand(BARRETT);
    let hand = model.hand();
    for (name, carrier, along) in [
        ("palm_1", "palm", -0.02),
        ("medial_1_inner", "medial_1", 0.027),
        ("medial_2_outer", "medial_2", 0.054),
        ("distal_3_inner", "distal_3", 0.021),
        ("distal_1_outer", "distal_1", 0.046),
    ] {
        let contact = hand.contacts().iter().find(|contact| contact.name == name).expect("a contact");
        assert_eq!(hand.links()[contact.link], carrier);
        assert!((contact.point.x - along).abs() < 1e-12, "{name}");
        // Inward: towards the inside of the curling finger, out of the palm.
        assert!((contact.normal.into_inner() - Vector3::z()).norm() < 1e-12, "{name}");
    }
}

/// The ranges that the eigengrasps' amplitudes may run through, worked out by hand.
#[test]
fn eigengrasps_stay_within_the_joints() {
    let model = open_hand(BARRETT);
    let hand = model.hand();
    let grasps = hand.eigengrasps().expect("eigengrasps");
    assert_eq!(grasps.origin, [1.13, 0.79, 0.79, 0.79]);
    let [low, high] = hand.amplitude_range(0);
    assert!((low + 1.13).abs() < 1e-12 && (high - 2.01).abs() < 0.005, "{low} {high}");
    let [low, high] = hand.amplitude_range(1);
    assert!((low + 0.79).abs() < 1e-12 && (high - 1.65).abs() < 0.005, "{low} {high}");
    let posture = hand.posture_of(&[0.5, 0.2]);
    for (found, expected) in posture.iter().zip([1.63, 0.99, 0.99, 0.99]) {
        assert!((found - expected).abs() < 1e-15);
    }
    assert_eq!(hand.posture_of(&[4.0, -4.0]), [std::f64::consts::PI, 0.0, 0.0, 0.0]);
    assert_eq!((hand.opened(), hand.closed()[1..].to_vec()), (vec![0.0; 4], vec![140.0_f64.to_radians(); 3]));
}

#[test]
fn a_parallel_gripper_has_a_width() {
    let model = open_hand(GRIPPER);
    let hand = model.hand();
    assert_eq!((hand.driven().len(), hand.tree().len(), hand.commanded_joints()), (1, 2, vec![0]));
    assert_eq!(hand.amplitude_range(0), [-0.02, 0.02]);
    // The left pad goes to the right one, which comes as fast.
    let line = hand.closing_line().expect("a gripper");
    assert!((line - -Vector3::y()).norm() < 1e-15);
    assert_eq!([0, 1, 2].map(|link| hand.closing_side(link)), [0.0, 1.0, -1.0]);
    for value in [0.0, 0.013, 0.04] {
        let frames = hand.link_frames(&hand.posture_values(&[value]));
        assert!((hand.width(&frames).expect("a width") - 2.0 * value).abs() < 1e-15);
    }
    assert_eq!((hand.opened(), hand.closed()), (vec![0.04], vec![0.0]));
    let barrett = open_hand(BARRETT);
    assert_eq!(barrett.hand().width(&frames_at(barrett.hand(), &[0.0; 4])), None);
}

/// Plain MuJoCo, without us, has the same couplings.
#[test]
fn the_description_alone_is_a_coupled_hand() {
    let compiled = MjModel::from_xml(BARRETT).expect("the hand");
    assert_eq!(compiled.actuator_group().len(), 4);
    let mut data = MjData::new(&compiled);
    data.ctrl_mut().copy_from_slice(&[1.0, 0.9, 1.2, 1.5]);
    for _ in 0..2000 {
        data.step();
    }
    let value = |name: &str| {
        let id = compiled.name_to_id(MjtObjBase::mjOBJ_JOINT, name).expect("a joint");
        data.qpos()[compiled.jnt_qposadr()[id] as usize]
    };
    for (name, expected) in
        [("spread_1", 1.0), ("spread_2", 1.0), ("proximal_2", 1.2), ("distal_2", 0.4), ("distal_3", 0.5)]
    {
        assert!((value(name) - expected).abs() < 0.02, "{name}: {}", value(name));
    }
    let model = open_hand(BARRETT);
    let ranges: Vec<[f64; 2]> = model.hand().driven().iter().map(Driven::range).collect();
    assert!(ranges.iter().all(|[low, high]| *low == 0.0 && *high > 2.4));
}

/// The Allegro hand of a package (`make hands`), which floats there: sixteen motors, contacts on its boxes, and a thumb
/// that opposes the fingers.
#[test]
#[ignore = "needs `make hands`"]
fn the_packaged_allegro_hand_is_read() {
    contacts_lie_on_links("scenes/allegro.xml", 17);
    let model = open_hand("scenes/allegro.xml");
    let hand = model.hand();
    model.check_grasping().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((hand.driven().len(), hand.tree().len(), hand.closing_line()), (16, 16, None));
    let values = hand.posture_values(&hand.posture_of(&[0.0; 5]));
    let frames = hand.link_frames(&values);
    let of = |name: &str| {
        let contact = hand.contacts().iter().position(|contact| contact.name == name).expect("a contact");
        hand.contact_in_base(contact, &frames)
    };
    let [(thumb, out), (finger, inward)] = [of("th_pad"), of("mf_pad")];
    assert!(out.dot(&inward) < 0.0 && out.dot(&(finger - thumb)) > 0.0 && inward.dot(&(thumb - finger)) > 0.0);
}
