//! Physics labels: trials against closed forms, and that they leave no trace.

use std::{collections::BTreeMap, f64::consts::FRAC_PI_2, sync::Arc};

use graspmill::{
    contact::ContactSurface,
    geom::{MassProperties, TriMesh},
    seed::Stream,
    sim::{
        Effort, Gravity, HandApproachEnd, HandModel, HandSim, HandWorker, NativeContacts, Outcome, Phase, Series,
        TrialConditions, TrialProtocol, TrialSim, TrialSpread, TrialWorker, Verdict, mass_of_volume,
    },
    voxel::InsideTest,
};
use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

use crate::support::{
    measures::{median, thread_seconds},
    meshes::{built_in_mesh, centred_block, prepare_scan, scan_file},
    robots::{BARRETT, GRIPPER, open_hand, random_approach},
};

/// A solid of revolution about z, by (radius, height) from below; the first and the last radius are 0.
fn revolved(profile: &[[f32; 2]]) -> TriMesh {
    const SECTORS: u32 = 64;
    let mut mesh = TriMesh { vertices: vec![[0.0, 0.0, profile[0][1]]], triangles: Vec::new() };
    let inner = &profile[1..profile.len() - 1];
    for [radius, height] in inner {
        for sector in 0..SECTORS {
            let (sine, cosine) = (sector as f32 / SECTORS as f32 * std::f32::consts::TAU).sin_cos();
            mesh.vertices.push([radius * cosine, radius * sine, *height]);
        }
    }
    mesh.vertices.push([0.0, 0.0, profile[profile.len() - 1][1]]);
    let top = mesh.vertices.len() as u32 - 1;
    let at = |ring: u32, sector: u32| 1 + ring * SECTORS + sector % SECTORS;
    let last = inner.len() as u32 - 1;
    for sector in 0..SECTORS {
        mesh.triangles.push([0, at(0, sector + 1), at(0, sector)]);
        for ring in 0..last {
            let [a, b, c, d] = [at(ring, sector), at(ring, sector + 1), at(ring + 1, sector + 1), at(ring + 1, sector)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
        mesh.triangles.push([top, at(last, sector), at(last, sector + 1)]);
    }
    mesh
}

fn ball(radius: f32) -> TriMesh {
    let profile: Vec<[f32; 2]> = (0..=32)
        .map(|step| {
            let (sine, cosine) = (step as f32 / 32.0 * std::f32::consts::PI).sin_cos();
            [radius * sine, -radius * cosine]
        })
        .collect();
    revolved(&profile)
}

fn cylinder(radius: f32, half: f32) -> TriMesh {
    revolved(&[[0.0, -half], [radius, -half], [radius, half], [0.0, half]])
}

fn trials(model: &HandModel, mesh: &TriMesh) -> TrialSim {
    let surface = Arc::new(ContactSurface::new(mesh, InsideTest::Crossings).expect("a surface"));
    let mass = MassProperties::of_solid(&surface.solid()).expect("a solid");
    TrialSim::new(model, &surface, &mass).expect("a simulation")
}

fn gripper(mesh: &TriMesh, protocol: TrialProtocol) -> TrialWorker {
    TrialWorker::new(&trials(&open_hand(GRIPPER), mesh).with_protocol(protocol).expect("a protocol"))
}

/// A pose between the pads of the gripper, up along x of its base, so that an object that slips falls past the palm.
fn pinched() -> IsometryMatrix3<f64> {
    let upright = Rotation3::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
    IsometryMatrix3::from_parts(Translation3::new(0.0, 0.0, 0.106), upright)
}

/// A pose before the palm of the Barrett hand, which comes from above.
fn below_palm(distance: f64) -> IsometryMatrix3<f64> {
    let upright = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    IsometryMatrix3::from_parts(Translation3::new(0.0, 0.0, 0.0787 + distance), upright)
}

fn slipped(outcome: &Outcome) -> f64 {
    1e3 * outcome.farthest
}

#[test]
fn air_and_a_palm_hold_nothing() {
    let model = open_hand(BARRETT);
    let mut worker = TrialWorker::new(&trials(&model, &ball(0.03)));
    let conditions = TrialConditions::new(0.1);
    let away = IsometryMatrix3::translation(0.5, 0.0, 0.3);
    let air = worker.run(&[0.0; 4], &away, &conditions).expect("a pose");
    assert_eq!((air.verdict, air.start.penetration), (Verdict::NotTouching, 0.0));
    assert!(air.closed.is_some_and(|grip| grip.touches.is_empty()));
    // On the back of the hand.
    for pressed in [-1e-4, 1e-4] {
        let behind = IsometryMatrix3::translation(0.0, 0.0, -0.03 + pressed);
        let palm = worker.run(&[0.0; 4], &behind, &conditions).expect("a pose");
        assert!(matches!(palm.verdict, Verdict::NotTouching | Verdict::OneLink | Verdict::Lost { .. }), "{palm:?}");
        assert_eq!(palm.start.penetration > 0.0, pressed > 0.0);
    }
    // The fingers are too short for what lies before the palm.
    let wide = trials(&model, &centred_block([0.2, 0.2, 0.05]));
    let wide = TrialWorker::new(&wide).run(&[0.0; 4], &below_palm(0.0499), &conditions).expect("a pose");
    assert!(!wide.verdict.is_held(), "{wide:?}");
}

/// The gripper's pads press with a force that the outcome tells; friction carries 2 mu F and no more.
#[test]
fn a_pinch_slips_where_friction_ends() {
    const FRICTION: f64 = 0.3;
    let still = TrialProtocol { lift: 0.0, shake: 0.0, ..TrialProtocol::STANDARD };
    let mut worker = gripper(&centred_block([0.02; 3]), still);
    let at = |mass: f64| TrialConditions { friction: FRICTION, ..TrialConditions::new(mass) };
    let light = worker.run(&[0.035], &pinched(), &at(0.2)).expect("a pose");
    assert!(light.verdict.is_held(), "{light:?}");
    let force = light.closed.as_ref().expect("closed").force();
    assert!((force - 80.0).abs() < 8.0, "two pads press with 40 N each: {force}");
    let limit = FRICTION * force / 9.81;
    let mut rows = Vec::new();
    for factor in [0.5, 0.8, 0.9, 0.95, 0.98, 1.02, 1.05, 1.1, 1.3] {
        let outcome = worker.run(&[0.035], &pinched(), &at(factor * limit)).expect("a pose");
        println!("{factor}: {:?}, {:.3} mm, {:?}", outcome.verdict, slipped(&outcome), outcome.slips);
        rows.push((factor, outcome));
    }
    for (factor, outcome) in &rows {
        let held = outcome.verdict.is_held();
        // Four points per pad do not lie evenly about the middle: near the limit what they carry aside turns the brick.
        if (0.85..1.0).contains(factor) {
            continue;
        }
        assert!(held == (*factor < 1.0), "{factor}: {outcome:?}");
        assert!(!held || outcome.farthest < 1e-3, "{factor}: {outcome:?}");
        assert!(held || matches!(outcome.verdict, Verdict::Lost { phase: Phase::Lift, .. }), "{factor}: {outcome:?}");
    }
}

/// MuJoCo's own contacts of the triangles agree on where friction ends; meshes for whose contacts it has no memory are refused
/// before it would end the process.
#[test]
fn triangles_slip_where_friction_ends() {
    const FRICTION: f64 = 0.3;
    let (model, mesh) = (open_hand(GRIPPER), ball(0.02));
    let surface = ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface");
    let mass = MassProperties::of_solid(&surface.solid()).expect("a solid");
    let still = TrialProtocol { lift: 0.0, shake: 0.0, ..TrialProtocol::STANDARD };
    let native = |mesh: &TriMesh| TrialSim::with_native_mesh(&model, mesh, &mass, NativeContacts::Triangles);
    let sim = native(&mesh).and_then(|sim| sim.with_protocol(still)).expect("a simulation");
    let mut worker = TrialWorker::new(&sim);
    // 40 N on either pad.
    let limit = FRICTION * 80.0 / 9.81;
    for factor in [0.5, 0.8, 1.15, 1.3] {
        let conditions = TrialConditions { friction: FRICTION, ..TrialConditions::new(factor * limit) };
        let outcome = worker.run(&[0.035], &pinched(), &conditions).expect("a pose");
        println!("{factor}: {:?}, {:.3} mm", outcome.verdict, slipped(&outcome));
        assert_eq!(outcome.verdict.is_held(), factor < 1.0, "{factor}: {outcome:?}");
        assert!(outcome.closed.is_some_and(|grip| (grip.force() - 80.0).abs() < 8.0), "{factor}");
    }
    let count = mesh.triangles.len();
    let many = TriMesh { triangles: mesh.triangles.repeat(90), ..mesh };
    assert!(!TrialSim::can_touch_triangles(&model, &many));
    let refusal = native(&many).expect_err("too many triangles").to_string();
    assert!(refusal.contains(&format!("{} triangles", 90 * count)), "{refusal}");
}

/// Faces of two triangles, and triangles as long as the object, are pressed on between their corners as any others are.
#[test]
#[ignore = "slow: many trials"]
fn triangles_wider_than_a_pad_are_touched() {
    let model = open_hand(GRIPPER);
    let still = TrialProtocol { lift: 0.0, shake: 0.0, ..TrialProtocol::STANDARD };
    for mesh in [cylinder(0.02, 0.1), centred_block([0.02, 0.02, 0.1])] {
        let surface = ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface");
        let mass = MassProperties::of_solid(&surface.solid()).expect("a solid");
        let sim = TrialSim::with_native_mesh(&model, &mesh, &mass, NativeContacts::Triangles).expect("a simulation");
        let mut worker = TrialWorker::new(&sim.with_protocol(still).expect("a protocol"));
        let outcome = worker.run(&[0.035], &pinched(), &TrialConditions::new(0.3)).expect("a pose");
        assert!(outcome.verdict.is_held(), "{outcome:?}");
        // 40 N on either pad.
        assert!(outcome.closed.is_some_and(|grip| (grip.force() - 80.0).abs() < 8.0));
    }
}

/// Over time, the pads press with the force that the shake along their line requires: their forces differ by the
/// object's mass times that acceleration. Drift starts again when gravity is switched on, and the stored data moves no
/// trial.
#[test]
fn forces_over_time_carry_the_shake() {
    const MASS: f64 = 0.5;
    let protocol = TrialProtocol { lift: 0.0, frequencies: [0.0, 3.0, 0.0], ..TrialProtocol::STANDARD };
    let mut worker = gripper(&centred_block([0.02; 3]), protocol);
    let plain = TrialConditions { friction: 2.0, ..TrialConditions::new(MASS) };
    let mut outcome = worker.run(&[0.035], &pinched(), &TrialConditions { has_series: true, ..plain }).expect("a pose");
    let series = outcome.series.take().expect("a series");
    assert_eq!(worker.run(&[0.035], &pinched(), &plain), Ok(outcome.clone()));
    assert!(outcome.verdict.is_held() && series.samples.len() as u32 == outcome.steps / 10, "{outcome:?}");
    let closed = outcome.closed.as_ref().expect("closed");
    let last = series.samples.iter().rfind(|sample| sample.phase == Phase::Closing).expect("a sample");
    for (link, force) in last.forces.iter().enumerate() {
        assert!((force - closed.force_of(link)).abs() < 0.5, "link {link}: {force} N, {closed:?}");
    }
    // The shake is the last of the trial.
    let before = f64::from(outcome.steps) * 0.002 - protocol.shake_time;
    let (rate, mut apart, mut moved) = (std::f64::consts::TAU * 3.0, Vec::new(), 0.0_f64);
    for (number, sample) in (1..).zip(&series.samples) {
        if sample.phase != Phase::Closing {
            moved = moved.max(sample.moved);
            assert!(sample.moved <= outcome.farthest && sample.turned < 0.1, "{sample:?}");
        }
        if sample.phase == Phase::Shake {
            let time = f64::from(number) * Series::INTERVAL - before - 0.001;
            let pull = protocol.shake * rate * rate * (rate * time).sin() * MASS;
            // The object's y is that of the hand's base, along which the pads face each other.
            let [left, right] = [
                closed.touches.iter().find(|touch| touch.normal.y > 0.0),
                closed.touches.iter().find(|touch| touch.normal.y < 0.0),
            ]
            .map(|touch| sample.forces[touch.expect("a touch").link]);
            apart.push([left - right, pull]);
        }
    }
    let off = apart.iter().map(|[found, pull]| (found - pull).abs()).fold(0.0, f64::max);
    let largest = apart.iter().map(|[_, pull]| pull.abs()).fold(0.0, f64::max);
    println!("{} samples in the shake, forces apart by up to {largest:.2} N, off by {off:.3} N", apart.len());
    assert!(apart.len() == 50 && largest > 3.0 && off < 0.1 * largest, "{apart:?}");
    assert!(moved > 0.5 * outcome.farthest, "{moved} of {}", outcome.farthest);
    // Of a hand that is refused there is nothing over time.
    let deep = pinched() * Translation3::new(0.0, 0.01, 0.0);
    let refused = worker.run(&[0.02], &deep, &TrialConditions { has_series: true, ..plain }).expect("a pose");
    assert!(matches!(refused.verdict, Verdict::Refused { .. }), "{refused:?}");
    assert_eq!(refused.series, Some(Series::default()));
}

/// A stopped finger of the gripper bears 1.25 times the 40 N that its motor gives, and creeps under more: gravity along the line of
/// the pads pushes a thin brick of 200 N away, and not one of 45 N; friction carries both in all other directions.
#[test]
fn a_stopped_finger_gives_way_beyond_what_it_holds() {
    let mut worker = gripper(&centred_block([0.02, 0.005, 0.02]), TrialProtocol::STANDARD);
    let mut at = |weight: f64| {
        let conditions =
            TrialConditions { friction: 4.0, gravity: Gravity::Six, ..TrialConditions::new(weight / 9.81) };
        worker.run(&[0.035], &pinched(), &conditions).expect("a pose")
    };
    let (light, heavy) = (at(45.0), at(200.0));
    assert!(light.verdict.is_held(), "{light:?}");
    // Two of the six directions lie along y of the hand's base.
    let along = light.start.base_from_object.rotation.inverse() * Vector3::y();
    let axis = 2 - u8::try_from(along.iamax()).expect("an axis");
    let is_along = |verdict: &Verdict| matches!(verdict, Verdict::Lost { phase: Phase::Turned(direction), .. } if direction / 2 == axis);
    assert!(is_along(&heavy.verdict), "axis {axis}: {heavy:?}");
}

/// Friction gives way in the shake of an object that it carries at rest, when g and the shake's acceleration require
/// more.
#[test]
fn lift_and_shake_are_felt() {
    const FRICTION: f64 = 0.3;
    let vertical = TrialProtocol { lift: 0.0, frequencies: [0.0, 0.0, 4.0], ..TrialProtocol::STANDARD };
    let still = TrialProtocol { shake: 0.0, ..vertical };
    let mesh = centred_block([0.02; 3]);
    let (mut shaken, mut at_rest) = (gripper(&mesh, vertical), gripper(&mesh, still));
    let at = |mass: f64| TrialConditions { friction: FRICTION, ..TrialConditions::new(mass) };
    let force = at_rest.run(&[0.035], &pinched(), &at(0.2)).expect("a pose").closed.expect("closed").force();
    let max = 9.81 + 0.02 * (8.0 * std::f64::consts::PI).powi(2);
    for (factor, slips) in [(0.8, false), (0.95, false), (1.15, true), (1.6, true)] {
        let conditions = at(factor * FRICTION * force / max);
        let rest = at_rest.run(&[0.035], &pinched(), &conditions).expect("a pose");
        let shake = shaken.run(&[0.035], &pinched(), &conditions).expect("a pose");
        println!("{factor}: {:.3} mm at rest, {:.3} mm shaken, {:?}", slipped(&rest), slipped(&shake), shake.verdict);
        assert!(rest.verdict.is_held() && slipped(&rest) < 0.5, "{rest:?}");
        assert_eq!(slipped(&shake) > 1.0, slips, "{factor}: {shake:?}");
    }
    // A lift so quick that its peak, 10/sqrt(3) lift / time^2, is as much as gravity.
    let quick =
        TrialProtocol { lift: 9.81 * 0.3 * 0.3 / 5.7735, lift_time: 0.3, shake: 0.0, ..TrialProtocol::STANDARD };
    let mut lifted = gripper(&mesh, quick);
    for (factor, slips) in [(0.9, false), (1.5, true)] {
        let outcome = lifted.run(&[0.035], &pinched(), &at(factor * FRICTION * force / 19.62)).expect("a pose");
        println!("lift {factor}: {:.3} mm, {:?}", slipped(&outcome), outcome.verdict);
        assert_eq!(slipped(&outcome) > 0.5, slips, "{factor}: {outcome:?}");
    }
}

/// Off its middle, a brick turns between two pads: torsion holds it, a hard point does not.
#[test]
fn torsion_holds_what_hangs_aside() {
    let still = TrialProtocol { lift: 0.0, shake: 0.0, ..TrialProtocol::STANDARD };
    // A ball with a stick that points out of the hand.
    let mut profile: Vec<[f32; 2]> = (0..=26)
        .map(|step| {
            let (sine, cosine) = (step as f32 / 32.0 * std::f32::consts::PI).sin_cos();
            [0.018 * sine, -0.018 * cosine]
        })
        .collect();
    profile.extend([[0.01, 0.06], [0.0, 0.06]]);
    let mut mesh = revolved(&profile);
    for corner in &mut mesh.vertices {
        *corner = [-corner[2], -corner[0], corner[1]];
    }
    let mut worker = gripper(&mesh, still);
    for (torsion, turns) in [(0.0, true), (TrialConditions::TORSION, false)] {
        let conditions = TrialConditions { torsion, ..TrialConditions::new(0.05) };
        let outcome = worker.run(&[0.035], &pinched(), &conditions).expect("a pose");
        println!("{torsion}: {:?} {:?}", outcome.verdict, outcome.slips);
        assert_eq!(outcome.closed.as_ref().expect("closed").touches.len(), 2);
        let turned = outcome.slips.iter().map(|slip| slip.turned).fold(0.0, f64::max);
        assert_eq!(!outcome.verdict.is_held() || turned > 0.1, turns, "{outcome:?}");
    }
}

#[test]
fn a_barrett_hand_holds_ball_brick_and_can() {
    let model = open_hand(BARRETT);
    let spread = 60.0_f64.to_radians();
    let lying = Rotation3::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
    for (name, mesh, posture, pose) in [
        ("ball", ball(0.05), [spread, 0.3, 0.3, 0.3], below_palm(0.055)),
        ("brick", centred_block([0.05, 0.03, 0.03]), [0.0, 0.8, 0.8, 0.8], below_palm(0.04)),
        ("can", cylinder(0.033, 0.06), [0.0, 0.8, 0.8, 0.8], below_palm(0.04) * lying),
    ] {
        let sim = trials(&model, &mesh);
        let mut worker = TrialWorker::new(&sim);
        let conditions = TrialConditions::new(0.3);
        let outcome = worker.run(&posture, &pose, &conditions).expect("a pose");
        let closed = outcome.closed.as_ref().expect("closed");
        println!(
            "{name}: {:?}, links {:?}, {:.0} N, closed in {:.2} s, slips {:?}, depths {:.0} and {:.0} um, {} steps",
            outcome.verdict,
            closed.links(),
            closed.force(),
            outcome.closing_time,
            outcome.slips,
            1e6 * closed.penetration(),
            1e6 * outcome.shaken_penetration,
            outcome.steps
        );
        assert!(outcome.verdict.is_held(), "{name}: {outcome:?}");
        assert!(closed.links().len() >= 3 && outcome.warnings == 0, "{name}: {outcome:?}");
        assert!(outcome.shaken_penetration < 1e-3 && outcome.farthest < 5e-3, "{name}: {outcome:?}");
        // So it does however gravity pulls; and nothing holds without friction or with too much weight.
        let six = worker.run(&posture, &pose, &TrialConditions { gravity: Gravity::Six, ..conditions });
        assert_eq!(six.expect("a pose").slips.len(), 6);
        let heavy = worker.run(&posture, &pose, &TrialConditions { friction: 0.02, mass: 40.0, ..conditions });
        assert!(!heavy.expect("a pose").verdict.is_held());
    }
}

#[test]
fn a_start_that_is_too_deep_is_refused_or_backed_off() {
    let model = open_hand(BARRETT);
    let sim = trials(&model, &cylinder(0.033, 0.06));
    let mut worker = TrialWorker::new(&sim);
    let lying = Rotation3::from_axis_angle(&Vector3::y_axis(), FRAC_PI_2);
    let posture = [0.0, 1.9, 1.9, 1.9];
    let conditions = TrialConditions::new(0.3);
    let backing = TrialConditions { backs_off: true, ..conditions };
    let pose = below_palm(0.04) * lying;
    let refused = worker.run(&posture, &pose, &conditions).expect("a pose");
    let Verdict::Refused { penetration } = refused.verdict else { panic!("{refused:?}") };
    assert!(penetration > 0.001 && refused.steps == 0 && refused.end.is_none());
    let opened = worker.run(&posture, &pose, &backing).expect("a pose");
    assert!(opened.start.opened_by > 0.0 && opened.start.drawn_back == 0.0, "{:?}", opened.start);
    assert!(opened.start.penetration < 1e-4 && opened.verdict.is_held(), "{opened:?}");
    // The palm is 2 mm deep, and 10: more than a hand draws back.
    for (depth, starts) in [(0.002, true), (0.010, false)] {
        let deep = worker.run(&[0.0; 4], &(below_palm(0.033 - depth) * lying), &backing).expect("a pose");
        assert_eq!(!matches!(deep.verdict, Verdict::Refused { .. }), starts, "{deep:?}");
        assert!(deep.start.opened_by == 0.0 || !starts, "{:?}", deep.start);
        assert!(deep.start.drawn_back >= 0.0019, "{:?}", deep.start);
    }
    let nowhere = IsometryMatrix3::translation(f64::NAN, 0.0, 0.0);
    assert!(worker.run(&posture, &nowhere, &conditions).is_err());
    assert!(worker.run(&[0.0; 3], &pose, &conditions).is_err());
    assert!(worker.run(&posture, &pose, &TrialConditions { mass: -1.0, ..conditions }).is_err());
}

/// Trials come to the same bytes after other trials, by another worker, and in another thread.
#[test]
fn trials_leave_no_trace() {
    let model = open_hand(BARRETT);
    let mesh = built_in_mesh("mug-01");
    let sim = trials(&model, &mesh);
    let mut draw = Stream::of_job(3, b"", "trials");
    let tasks: Vec<(IsometryMatrix3<f64>, TrialConditions)> = (0..6)
        .map(|number| {
            let rotation = Vector3::from_fn(|_, _| draw.uniform(-0.4, 0.4));
            let off = IsometryMatrix3::new(Vector3::from_fn(|_, _| draw.uniform(-0.02, 0.02)), rotation);
            let conditions = TrialConditions::new(0.2).perturbed(&TrialSpread::STANDARD, &mut draw);
            let gravity = if number == 5 { Gravity::Six } else { Gravity::Lifted };
            (below_palm(0.1) * off, TrialConditions { gravity, ..conditions })
        })
        .collect();
    let mut worker = TrialWorker::new(&sim);
    let run = |worker: &mut TrialWorker, (pose, conditions): &(IsometryMatrix3<f64>, TrialConditions)| {
        worker.run(&[0.0; 4], pose, conditions).expect("a pose")
    };
    let first: Vec<Outcome> = tasks.iter().map(|task| run(&mut worker, task)).collect();
    println!("{:?}", first.iter().map(|outcome| outcome.verdict).collect::<Vec<_>>());
    for (task, outcome) in tasks.iter().zip(&first).rev() {
        assert_eq!(&run(&mut worker, task), outcome);
    }
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                let mut worker = TrialWorker::new(&sim);
                for (task, outcome) in tasks.iter().zip(&first) {
                    assert_eq!(&run(&mut worker, task), outcome);
                }
            });
        }
    });
}

/// A grasp at random: the opened hand comes along an inward normal, rolled at random, until it touches, and draws back a
/// little.
fn random_grasp(feeler: &mut HandWorker, surface: &ContactSurface, draw: &mut Stream) -> Option<IsometryMatrix3<f64>> {
    let felt = feeler.feel(&random_approach(surface, Effort::FEEL, draw)).expect("a pose");
    let ahead = felt.object_from_base.rotation * Vector3::z();
    let back = Translation3::from(-ahead * draw.uniform(0.0005, 0.01));
    (felt.end == HandApproachEnd::AtRest).then(|| (back * felt.object_from_base).inverse())
}

/// Variants of a trial, which may change its verdict: (name, change).
type Variant = (&'static str, fn(&TrialConditions) -> TrialConditions);

const SCANS: [&str; 8] =
    ["025_mug", "035_power", "024_bowl", "011_banana", "003_cracker", "006_mustard", "005_tomato", "048_ham"];

/// A scan, and grasps of it at random.
struct Grasped {
    mesh: TriMesh,
    mass: MassProperties,
    worker: TrialWorker,
    poses: Vec<IsometryMatrix3<f64>>,
    conditions: TrialConditions,
    draw: Stream,
}

impl Grasped {
    fn new(model: &HandModel, name: &str, grasps: usize) -> Self {
        let mesh = prepare_scan(&scan_file(name));
        let surface = Arc::new(ContactSurface::new(&mesh, InsideTest::WindingNumber).expect("a surface"));
        let mass = MassProperties::of_solid(&surface.solid()).expect("a solid");
        let worker = TrialWorker::new(&TrialSim::new(model, &surface, &mass).expect("a simulation"));
        let mut feeler = HandWorker::new(&Arc::new(HandSim::with_mesh(model, &surface).expect("a simulation")));
        let mut draw = Stream::of_job(4, name.as_bytes(), "trials");
        let poses = (0..grasps).filter_map(|_| random_grasp(&mut feeler, &surface, &mut draw)).collect();
        let conditions = TrialConditions::new(mass_of_volume(mass.volume));
        Self { mesh, mass, worker, poses, conditions, draw }
    }

    /// All trials, with the processor time of each [s].
    fn run(&mut self, posture: &[f64], change: impl Fn(&TrialConditions) -> TrialConditions) -> Vec<(Outcome, f64)> {
        let conditions = change(&self.conditions);
        let run = |pose: &IsometryMatrix3<f64>| {
            let began = thread_seconds();
            let outcome = self.worker.run(posture, pose, &conditions).expect("a pose");
            assert!(outcome.warnings == 0 && !matches!(outcome.verdict, Verdict::Unstable { .. }), "{outcome:?}");
            (outcome, thread_seconds() - began)
        };
        self.poses.iter().map(run).collect()
    }
}

/// A row of the table.
fn row(name: &str, mass: f64, outcomes: &[(Outcome, f64)]) -> String {
    let (mut times, mut counts) = ([(0.0, 0, 0); 2], BTreeMap::new());
    let (mut closed_depths, mut shaken, mut slips, mut farthest) = (vec![], vec![], vec![], vec![]);
    for (outcome, took) in outcomes {
        let held = outcome.verdict.is_held();
        let time = &mut times[usize::from(held)];
        *time = (time.0 + took, time.1 + 1, time.2 + outcome.steps);
        *counts.entry(outcome.verdict.reason()).or_insert(0) += 1;
        if held {
            closed_depths.push(1e6 * outcome.closed.as_ref().expect("closed").penetration());
            shaken.push(1e6 * outcome.shaken_penetration);
            slips.push(1e6 * outcome.slips[0].moved);
            farthest.push(1e3 * outcome.farthest);
        }
    }
    let each = |(time, count, steps): (f64, u32, u32)| {
        let (count, steps) = (f64::from(count.max(1)), f64::from(steps.max(1)));
        format!("{:5.1} ms ({:4.0} steps of {:4.1} us)", 1e3 * time / count, steps / count, 1e6 * time / steps)
    };
    format!(
        "{name:12} {mass:.2} kg: held {}, failed {}; depth closed {:.0} um, shaken {:.0} (worst {:.0}), slip in lift {:.1} um, \
         farthest {:.2} mm; {counts:?}",
        each(times[1]),
        each(times[0]),
        median(&closed_depths),
        median(&shaken),
        shaken.iter().copied().fold(0.0, f64::max),
        median(&slips),
        median(&farthest),
    )
}

/// A table of trials on scans: verdicts, times, penetration, slip, and changes that alter verdicts.
#[test]
#[ignore = "a table; run by hand with --ignored --nocapture"]
fn trials_on_scans() {
    let model = open_hand(BARRETT);
    let variants: [Variant; 4] = [
        ("hard point", |conditions| TrialConditions { torsion: 0.0, ..*conditions }),
        ("friction x 0.8", |conditions| TrialConditions { friction: 0.4, ..*conditions }),
        ("friction x 1.2", |conditions| TrialConditions { friction: 0.6, ..*conditions }),
        ("six", |conditions| TrialConditions { gravity: Gravity::Six, ..*conditions }),
    ];
    let mut flips = BTreeMap::new();
    let posture = model.hand().opened();
    let mut count = [0; 2];
    for name in SCANS {
        let mut grasped = Grasped::new(&model, name, 60);
        let outcomes = grasped.run(&posture, |conditions| *conditions);
        println!("{}", row(name, grasped.conditions.mass, &outcomes));
        let held: Vec<bool> = outcomes.iter().map(|(outcome, _)| outcome.verdict.is_held()).collect();
        held.iter().for_each(|held| count[usize::from(*held)] += 1);
        let mut compare = |name: &'static str, others: Vec<bool>| {
            for (held, other) in held.iter().zip(others).filter(|(held, other)| *held != other) {
                flips.entry(name).or_insert([0; 2])[usize::from(*held)] += u32::from(*held != other);
            }
        };
        for (name, change) in variants {
            let others = grasped.run(&posture, change);
            compare(name, others.iter().map(|(outcome, _)| outcome.verdict.is_held()).collect());
        }
        let Grasped { worker, poses, conditions, draw, .. } = &mut grasped;
        let mut perturbed = |pose: &IsometryMatrix3<f64>| {
            let conditions = conditions.perturbed(&TrialSpread::STANDARD, draw);
            worker.run(&posture, pose, &conditions).expect("a pose").verdict.is_held()
        };
        compare("perturbed", poses.iter().map(&mut perturbed).collect());
    }
    println!("of {} not held and {} held, turned: {flips:?}", count[0], count[1]);
}

/// Verdicts compared with those by MuJoCo's own distance field: some ten seconds of processor each.
#[test]
#[ignore = "a table of ten minutes; run by hand with --ignored --nocapture"]
fn verdicts_beside_mujocos_own_field() {
    let model = open_hand(BARRETT);
    let posture = model.hand().opened();
    let (mut agree, mut count) = (0, 0);
    for name in SCANS {
        let mut grasped = Grasped::new(&model, name, 60);
        let outcomes = grasped.run(&posture, |conditions| *conditions);
        let Grasped { mesh, mass, poses, conditions, .. } = &grasped;
        let native = TrialSim::with_native_mesh(&model, mesh, mass, NativeContacts::Sdf).expect("a simulation");
        let mut native = TrialWorker::new(&native);
        let decided = outcomes.iter().zip(poses).filter(|((outcome, _), _)| outcome.closed.is_some());
        for ((outcome, _), pose) in decided.take(4) {
            let began = thread_seconds();
            let theirs = native.run(&posture, pose, conditions).expect("a pose");
            let same = theirs.verdict.is_held() == outcome.verdict.is_held();
            (agree, count) = (agree + u32::from(same), count + 1);
            let seconds = thread_seconds() - began;
            println!("{name}: native {:?}, ours {:?}, {seconds:.1} s", theirs.verdict, outcome.verdict);
        }
    }
    println!("{agree} of {count} agree");
}
