//! Closing on cylinders: the simulation against plane geometry, before and after the clutch opens.
//!
//! The cylinders lie along x, so that finger 3 moves in a plane: u away from the palm's axis, w up, from its J2. A link is a
//! segment thickened by a radius; it touches where the circle's centre is radius + radius away from the segment's line.

use std::sync::Arc;

use graspmill::{
    collision::Geometry,
    geom::Shape,
    hand::Hand,
    sim::{HandError, HandSim, HandWorker, LinkTouch, MotorCommand, Run, RunEnd},
};
use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

use super::link_named;
use crate::support::robots::{BARRETT, GRIPPER, open_hand};

/// [m] and [rad], as the description has them.
const MEDIAL_RADIUS: f64 = 0.0115;
const MEDIAL_ABOVE: f64 = 0.0012;
const DISTAL_RADIUS: f64 = 0.01;
const J2_OUT: f64 = 0.05;
const J2_UP: f64 = 0.0754;
const J2_TO_J3: f64 = 0.07;
const J3_TO_TIP: f64 = 0.05;

fn falls() -> f64 {
    2.46_f64.to_radians()
}

fn bends() -> f64 {
    42.46_f64.to_radians()
}

/// A cylinder along x, expressed in its own frame.
fn cylinder(radius: f64) -> [Geometry; 1] {
    let along_x = Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
    let link_from_shape = IsometryMatrix3::from_parts(Translation3::identity(), along_x);
    [Geometry { shape: Shape::Cylinder { radius, half: 0.1 }, link_from_shape }]
}

fn worker(scene: &str, object: &[Geometry]) -> HandWorker {
    HandWorker::new(&Arc::new(HandSim::new(&open_hand(scene), object).expect("a simulation")))
}

/// A circle in the plane of finger 3 (`side` -1) or of fingers 1 and 2 (`side` 1).
#[derive(Clone, Copy, Debug)]
struct Circle {
    out: f64,
    up: f64,
    radius: f64,
}

impl Circle {
    /// The circle of a cylinder whose axis goes through (y, z), relative to J2 of a finger that points to y times `side`.
    fn relative_to_j2(y: f64, z: f64, radius: f64, side: f64) -> Self {
        Self { out: y * side - J2_OUT, up: z - J2_UP, radius }
    }

    fn polar(out: f64, up: f64) -> (f64, f64) {
        (out.hypot(up), up.atan2(out).rem_euclid(std::f64::consts::TAU))
    }

    /// J2 where the medial link's inner side touches.
    fn medial_touches(&self) -> f64 {
        let (far, direction) = Self::polar(self.out, self.up);
        direction - ((self.radius + MEDIAL_RADIUS + MEDIAL_ABOVE) / far).asin() + falls()
    }

    /// J3 where the fingertip touches, J2 given: with its inner side, or past its length with its round end.
    fn distal_touches(&self, j2: f64) -> f64 {
        let along = j2 - falls();
        let (far, direction) = Self::polar(self.out - J2_TO_J3 * along.cos(), self.up - J2_TO_J3 * along.sin());
        let apart = self.radius + DISTAL_RADIUS;
        let side = (apart / far).asin();
        let angle = if far * side.cos() <= J3_TO_TIP {
            side
        } else {
            ((J3_TO_TIP.powi(2) + far.powi(2) - apart.powi(2)) / (2.0 * J3_TO_TIP * far)).acos()
        };
        direction - angle - along - bends()
    }

    /// J2 where the fingertip touches while J3 is a third of J2: where its distance, in closed form, is 0.
    fn distal_touches_coupled(&self) -> f64 {
        let (mut low, mut high) = (0.0, 140.0_f64.to_radians());
        for _ in 0..100 {
            let middle = (low + high) / 2.0;
            if middle / 3.0 < self.distal_touches(middle) { low = middle } else { high = middle }
        }
        low
    }
}

fn value(hand: &Hand, run: &Run, joint: &str) -> f64 {
    run.joints[hand.tree().joint_named(joint).expect("a joint")]
}

fn touches_of<'a>(hand: &Hand, run: &'a Run, name: &str) -> Vec<&'a LinkTouch> {
    let link = link_named(hand, name);
    run.touches.iter().filter(|touch| touch.link == link).collect()
}

fn at(y: f64, z: f64) -> IsometryMatrix3<f64> {
    IsometryMatrix3::translation(0.0, y, z)
}

/// The medial link touches first; J2 stays, the fingertip moves on until it also touches.
#[test]
fn after_breakaway_the_fingertip_touches_where_geometry_says() {
    let model = open_hand(BARRETT);
    let hand = model.hand();
    for (y, z, radius) in [(-0.0193, 0.126, 0.035), (-0.024, 0.121, 0.03), (-0.0243, 0.1332, 0.04)] {
        let circle = Circle::relative_to_j2(y, z, radius, -1.0);
        let j2 = circle.medial_touches();
        let j3 = circle.distal_touches(j2);
        // The case that is meant: the fingertip is not there yet when J2 stops, and gets there before its own stop.
        assert!(j2 / 3.0 < j3 - 0.05 && j3 < 48.0_f64.to_radians() - 0.02, "{j2} {j3}");
        let mut worker = worker(BARRETT, &cylinder(radius));
        worker.start(&hand.opened(), &at(y, z)).expect("a posture");
        let run = worker.close(3000);
        assert_eq!(run.end, RunEnd::AtRest);
        let (found_j2, found_j3) = (value(hand, &run, "proximal_3"), value(hand, &run, "distal_3"));
        println!(
            "r {radius}: J2 {:.3} deg (geometry {:.3}), J3 {:.3} (geometry {:.3}), {} steps",
            found_j2.to_degrees(),
            j2.to_degrees(),
            found_j3.to_degrees(),
            j3.to_degrees(),
            run.steps
        );
        // A quarter of a degree is 0.2 mm at 50 mm.
        assert!((found_j2 - j2).abs().to_degrees() < 0.25 && (found_j3 - j3).abs().to_degrees() < 0.35);
        let motor = run.motors[3];
        let left = motor.released.expect("the clutch is open");
        // J2's spring holds it with little more than its torque, on an object that gives way by hundredths of a millimetre;
        // the fingertip obeys the law to its own spring's give.
        println!("J2's spring: {:.2} mrad", 1e3 * (left - found_j2));
        assert!((0.0..0.005).contains(&(left - found_j2)));
        let law = 4.0 / 3.0 * motor.angle - left;
        assert!((law - found_j3).abs() < 0.003, "{law} {found_j3}");
        for part in ["medial_3", "distal_3"] {
            let touches = touches_of(hand, &run, part);
            assert!(
                !touches.is_empty() && touches.iter().all(|touch| touch.distance.abs() < 2e-4),
                "{part}: {touches:?}"
            );
            for touch in touches {
                // On the cylinder, looking out of it.
                let point = worker.base_from_object().inverse() * touch.point;
                let from_axis = Vector3::new(0.0, point.y, point.z);
                assert!((from_axis.norm() - radius).abs() < 1e-6, "{touch:?}");
                assert!((from_axis / radius - touch.normal.into_inner()).norm() < 1e-4, "{touch:?}");
            }
        }
    }
}

/// With the clutch shut the fingertip touches first: J3 is a third of J2 until then, and the contact is where geometry has it.
#[test]
fn before_breakaway_the_fingertip_touches_where_geometry_says() {
    let model = open_hand(BARRETT);
    let hand = model.hand();
    for (z, radius) in [(0.12, 0.03), (0.13, 0.02), (0.14, 0.035)] {
        let mut worker = worker(BARRETT, &cylinder(radius));
        worker.start(&hand.opened(), &at(0.0, z)).expect("a posture");
        let circle = Circle::relative_to_j2(0.0, z, radius, 1.0);
        let j2 = circle.distal_touches_coupled();
        assert!(circle.medial_touches() > j2 + 0.02);
        let mut joints = worker.joints();
        while worker.touches().is_empty() {
            joints = worker.joints();
            worker.step(&[MotorCommand::Close; 4]).expect("stable");
        }
        // As they were a step before the first touch.
        for finger in 1..=3 {
            let [proximal, distal] = ["proximal", "distal"]
                .map(|part| joints[hand.tree().joint_named(&format!("{part}_{finger}")).expect("a joint")]);
            // A step at full speed is 0.23 degrees.
            assert!((proximal - j2).abs().to_degrees() < 0.4, "{} {}", proximal.to_degrees(), j2.to_degrees());
            assert!((distal - proximal / 3.0).abs().to_degrees() < 0.03, "{distal} {}", proximal / 3.0);
        }
        let run = worker.close(3000);
        assert_eq!(run.end, RunEnd::AtRest);
        for finger in 1..=3 {
            let [proximal, distal] = ["proximal", "distal"].map(|part| value(hand, &run, &format!("{part}_{finger}")));
            // For every position of the two: the fingertip is on the cylinder.
            let off = circle.distal_touches(proximal) - distal;
            println!(
                "r {radius}, finger {finger}: J2 {:.3} deg (geometry {:.3}), off by {:.3} deg",
                proximal.to_degrees(),
                j2.to_degrees(),
                off.to_degrees()
            );
            assert!((proximal - j2).abs().to_degrees() < 0.5 && off.abs().to_degrees() < 0.3);
            assert!(touches_of(hand, &run, &format!("medial_{finger}")).is_empty());
            let touch = touches_of(hand, &run, &format!("distal_{finger}"))[0];
            assert!((touch.normal.y * [1.0, 1.0, -1.0][finger - 1]) > 0.0 && touch.distance.abs() < 2e-4);
            // 0.5 N m about J3 stop the motor.
            assert!((8.0..25.0).contains(&touch.force), "{touch:?}");
        }
    }
}

/// A thin cylinder stops J2 and is never reached by the fingertip: it ends at its own stop, and opening brings all back.
#[test]
fn a_released_fingertip_ends_at_its_stop_and_opening_shuts_the_clutch() {
    let model = open_hand(BARRETT);
    let hand = model.hand();
    let (y, z, radius) = (-0.025, 0.1, 0.01);
    let j2 = Circle::relative_to_j2(y, z, radius, -1.0).medial_touches();
    let mut worker = worker(BARRETT, &cylinder(radius));
    worker.start(&hand.opened(), &at(y, z)).expect("a posture");
    let closed = worker.run(&[MotorCommand::Hold, MotorCommand::Hold, MotorCommand::Hold, MotorCommand::Close], 3000);
    assert_eq!(closed.end, RunEnd::AtRest);
    assert!((value(hand, &closed, "proximal_3") - j2).abs().to_degrees() < 0.25);
    assert!((value(hand, &closed, "distal_3").to_degrees() - 48.0).abs() < 0.1, "{:?}", closed.joints);
    let motor = closed.motors[3];
    let left = motor.released.expect("the clutch is open");
    assert!((motor.angle - left - 0.75 * (48.0_f64.to_radians() - left / 3.0)).abs() < 1e-9);
    assert_eq!(closed.motors[1].angle, 0.0);
    assert!(touches_of(hand, &closed, "distal_3").is_empty() && !touches_of(hand, &closed, "medial_3").is_empty());
    let opened = worker.run(&[MotorCommand::Open; 4], 3000);
    assert_eq!((opened.end, opened.motors[3].released), (RunEnd::AtRest, None));
    assert!(opened.joints.iter().all(|joint| joint.abs() < 1e-3) && opened.touches.is_empty(), "{opened:?}");
}

/// Closing on nothing, spread on the way: every joint arrives, coupled.
#[test]
fn an_empty_hand_closes() {
    let model = open_hand(BARRETT);
    let hand = model.hand();
    let mut worker = worker(BARRETT, &cylinder(0.01));
    worker.start(&hand.opened(), &at(0.0, 1.0)).expect("a posture");
    let (spread, flexion) = (90.0_f64.to_radians(), 60.0_f64.to_radians());
    let run = worker.run(
        &[MotorCommand::To(spread), MotorCommand::To(flexion), MotorCommand::To(flexion), MotorCommand::Close],
        3000,
    );
    assert_eq!((run.end, run.touches.len()), (RunEnd::AtRest, 0));
    for (joint, degrees) in [
        ("spread_1", 90.0),
        ("spread_2", 90.0),
        ("proximal_1", 60.0),
        ("distal_1", 20.0),
        ("proximal_2", 60.0),
        ("distal_2", 20.0),
    ] {
        assert!((value(hand, &run, joint).to_degrees() - degrees).abs() < 0.02, "{joint} {:?}", run.joints);
    }
    // A second of closing.
    println!("{} steps", run.steps);
    assert!((400..1000).contains(&run.steps), "{}", run.steps);
    // What is past a joint's range is brought within it.
    let run = worker.run(&[MotorCommand::To(-1.0), MotorCommand::Open, MotorCommand::Open, MotorCommand::Open], 3000);
    assert_eq!(run.end, RunEnd::AtRest);
    assert!(run.joints.iter().all(|joint| joint.abs() < 1e-3));
}

/// The touch sensors of the description agree with the contacts.
#[test]
fn touch_sensors_feel_the_contacts() {
    let model = open_hand(BARRETT);
    let hand = model.hand();
    let mut worker = worker(BARRETT, &cylinder(0.035));
    worker.start(&hand.opened(), &at(-0.0193, 0.126)).expect("a posture");
    let run = worker.close(3000);
    let felt: Vec<(String, f64)> = worker.touch_sensors().map(|(name, force)| (name.to_owned(), force)).collect();
    assert_eq!(felt.len(), 7);
    for (name, force) in felt {
        let sum: f64 = touches_of(hand, &run, &name["touch_".len()..]).iter().map(|touch| touch.force).sum();
        println!("{name}: {force:.2} N");
        assert!((sum - force).abs() <= 0.02 * force.max(1.0), "{name}: {force} {sum}");
    }
}

#[test]
fn a_gripper_stops_at_the_cylinders_width() {
    let model = open_hand(GRIPPER);
    let hand = model.hand();
    for radius in [0.01, 0.02, 0.035] {
        let mut worker = worker(GRIPPER, &cylinder(radius));
        worker.start(&hand.opened(), &at(0.0, 0.1)).expect("a posture");
        let run = worker.close(3000);
        let width = hand.width(&hand.link_frames(&run.joints)).expect("a width");
        println!("r {radius}: {:.4} mm wide, {} steps", width * 1e3, run.steps);
        assert!(run.end == RunEnd::AtRest && (width - 2.0 * radius).abs() < 5e-5);
        for finger in ["finger_left", "finger_right"] {
            let force: f64 = touches_of(hand, &run, finger).iter().map(|touch| touch.force).sum();
            assert!((force - 40.0).abs() < 2.0, "{finger}: {force} N");
        }
    }
}

/// Workers that have run before, new ones, and those on other threads come to the same bits.
#[test]
fn runs_repeat_bit_by_bit() {
    let model = open_hand(BARRETT);
    let hand = model.hand();
    let sim = Arc::new(HandSim::new(&model, &cylinder(0.035)).expect("a simulation"));
    let close = |worker: &mut HandWorker, y: f64| {
        worker.start(&hand.opened(), &at(y, 0.126)).expect("a posture");
        worker.close(3000)
    };
    let mut first = HandWorker::new(&sim);
    let start = std::time::Instant::now();
    let run = close(&mut first, -0.0193);
    let taken = start.elapsed().as_secs_f64();
    println!("{:.1} ms for {} steps, {:.1} us each", taken * 1e3, run.steps, taken * 1e6 / f64::from(run.steps));
    assert_ne!(run, close(&mut first, 0.01));
    assert_eq!(run, close(&mut first, -0.0193));
    assert_eq!(run, close(&mut HandWorker::new(&sim), -0.0193));
    let elsewhere = std::thread::scope(|scope| scope.spawn(|| close(&mut HandWorker::new(&sim), -0.0193)).join());
    assert_eq!(run, elsewhere.expect("the thread"));
}

#[test]
fn what_cannot_run_is_refused() {
    let model = open_hand(BARRETT);
    let refused = |object: &[Geometry]| HandSim::new(&model, object).expect_err("refused");
    assert!(matches!(refused(&[]), HandError::Object { .. }));
    assert!(matches!(refused(&cylinder(-0.01)), HandError::Object { .. }));
    assert!(matches!(refused(&cylinder(f64::NAN)), HandError::Object { .. }));
    let mut worker = worker(BARRETT, &cylinder(0.03));
    assert!(matches!(worker.start(&[0.0; 3], &at(0.0, 0.1)), Err(HandError::Posture { .. })));
    assert!(matches!(worker.start(&[0.0, 3.0, 0.0, 0.0], &at(0.0, 0.1)), Err(HandError::Posture { .. })));
    assert!(matches!(worker.start(&[0.0; 4], &at(f64::NAN, 0.1)), Err(HandError::Object { .. })));
    // A run without time ends with that result.
    worker.start(&[0.0; 4], &at(0.0, 1.0)).expect("a posture");
    let run = worker.close(10);
    assert_eq!((run.end, run.steps), (RunEnd::TimedOut, 10));
}
