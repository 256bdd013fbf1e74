//! Hands and true meshes: guarded moves, feeling fingers, grasps; the native distance field of MuJoCo as the oracle.

use std::{sync::Arc, time::Instant};

use graspmill::{
    contact::ContactSurface,
    geom::TriMesh,
    seed::Stream,
    sim::{
        ApproachOutcome, Effort, HandApproach, HandApproachEnd, HandModel, HandSim, HandWorker, LinkTouch,
        NativeContacts,
    },
    voxel::InsideTest,
};
use nalgebra::{IsometryMatrix3, Translation3, Vector3};

use crate::support::{
    meshes::built_in_mesh,
    robots::{BARRETT, open_hand, random_approach},
};

fn surface(mesh: &TriMesh) -> Arc<ContactSurface> {
    Arc::new(ContactSurface::new(mesh, InsideTest::Crossings).expect("a surface"))
}

fn min_by_link(touches: &[LinkTouch], links: usize) -> Vec<f64> {
    (0..links)
        .map(|link| {
            let own = touches.iter().filter(|touch| touch.link == link);
            own.map(|touch| touch.distance).fold(f64::INFINITY, f64::min)
        })
        .collect()
}

/// Postures next to a felt one: every finger rotated by a third of a degree, in and out; and the object moved by 0.3
/// mm, towards the base and away from it.
fn pushed(model: &HandModel, felt: &ApproachOutcome) -> Vec<(bool, bool, Vec<f64>, IsometryMatrix3<f64>)> {
    let hand = model.hand();
    let rotated = |by: f64| {
        let mut joints = felt.joints.clone();
        for driven in hand.driven().iter().filter(|driven| driven.closed.is_some()) {
            joints[driven.joint] += by * driven.closing_sign();
        }
        joints
    };
    let ahead = felt.object_from_base.rotation * (hand.approach().link_from_frame.rotation * Vector3::z());
    let moved = |by: f64| (Translation3::from(ahead * by) * felt.object_from_base).inverse();
    vec![
        (true, false, rotated(0.006), moved(0.0)),
        (false, false, rotated(-0.006), moved(0.0)),
        (true, true, felt.joints.clone(), moved(3e-4)),
        (false, true, felt.joints.clone(), moved(-3e-4)),
    ]
}

#[test]
fn closings_touch_what_mujocos_own_field_touches() {
    assert_closings_touch(3, &["mug-01"]);
}

#[test]
#[ignore = "slow: make test-all"]
fn many_closings_touch_what_mujocos_own_field_touches() {
    assert_closings_touch(20, &["mug-01", "bowl-01", "can-01", "kettle-01"]);
}

/// `closings` closings on each of these objects: penetration by the mesh, and link by link against MuJoCo's own
/// distance field in the same postures.
#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn assert_closings_touch(closings: u32, objects: &[&str]) {
    let model = open_hand(BARRETT);
    let mut draw = Stream::of_job(1, b"", "feeling");
    let (mut agree, mut differ, mut apart, mut deepest) = (0, 0, Vec::new(), Vec::new());
    let mut ends = std::collections::BTreeMap::new();
    let (mut own_time, mut native_time, mut counted, mut steps) = (0.0, 0.0, 0, 0);
    for name in objects {
        let mesh = built_in_mesh(name);
        let surface = surface(&mesh);
        let sim = Arc::new(HandSim::with_mesh(&model, &surface).expect("a simulation"));
        let mut worker = HandWorker::new(&sim);
        let native = HandSim::with_native_mesh(&model, &mesh, NativeContacts::Sdf).expect("a simulation");
        let mut native = HandWorker::new(&Arc::new(native));
        for number in 0..closings {
            let effort = if number % 2 == 0 { Effort::GRASP } else { Effort::FEEL };
            let began = Instant::now();
            let felt = worker.feel(&random_approach(&surface, effort, &mut draw)).expect("a finite pose");
            let seconds = began.elapsed().as_secs_f64();
            *ends.entry(format!("{:?}", felt.end)).or_insert(0) += 1;
            own_time += seconds;
            steps += felt.steps;
            for touch in &felt.touches {
                deepest.push(-touch.distance);
                let off = surface.signed_distance(&touch.point).abs();
                assert!(off < 2e-5, "{name}: a contact {off} m off the surface: {touch:?}");
            }
            if felt.end != HandApproachEnd::AtRest {
                continue;
            }
            // A little further in, where every link that touched does, and a little out, where none does.
            for (inward, of_base, joints, base_from_object) in pushed(&model, &felt) {
                let ours = worker.touches_at(&joints, &base_from_object);
                let began = Instant::now();
                let theirs = native.touches_at(&joints, &base_from_object);
                counted += 1;
                native_time += began.elapsed().as_secs_f64();
                let links = model.hand().links().len();
                let (ours, theirs) = (min_by_link(&ours, links), min_by_link(&theirs, links));
                for link in (0..links).filter(|link| (*link == 0) == of_base) {
                    let (own, their) = (ours[link], theirs[link]);
                    if own.is_finite() == their.is_finite() {
                        agree += 1;
                        if own.is_finite() {
                            // MuJoCo's depth is how far a point can be inside both: half of the distance that separates
                            // the two.
                            apart.push((own - 2.0 * their).abs());
                        }
                    } else {
                        differ += 1;
                        println!("{name} {number}, inward {inward}, link {link}: ours {own}, theirs {their}");
                    }
                }
            }
        }
    }
    let sorted = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        (values[values.len() / 2], values[values.len() * 99 / 100], values[values.len() - 1])
    };
    let share = f64::from(differ) / f64::from(agree + differ);
    println!("{ends:?}; of {} verdicts {differ} differ, {:.1} %", agree + differ, 100.0 * share);
    let (median, _, worst) = sorted(apart);
    println!("distances differ by {:.0} um in the median, {:.0} um at worst", 1e6 * median, 1e6 * worst);
    let (middle, max, worst_depth) = sorted(deepest);
    println!("penetration: median {:.1}, 99 % {:.1}, worst {:.1} um", 1e6 * middle, 1e6 * max, 1e6 * worst_depth);
    let approaches = closings * objects.len() as u32;
    println!(
        "{:.1} ms per approach of {:.0} steps, {:.1} us per step; a step with the native field {:.1} ms",
        1e3 * own_time / f64::from(approaches),
        f64::from(steps) / f64::from(approaches),
        1e6 * own_time / f64::from(steps),
        1e3 * native_time / f64::from(counted)
    );
    assert_eq!(ends.get("AtRest"), Some(&approaches), "{ends:?}");
    assert!(share < 0.04 && median < 1e-4 && worst_depth < 5e-4);
}

/// Runs leave no trace: in another order, and by another worker, each comes to the same bits.
#[test]
fn what_is_felt_does_not_depend_on_what_was_felt_before() {
    let model = open_hand(BARRETT);
    let mesh = built_in_mesh("mug-01");
    let surface = surface(&mesh);
    let sim = Arc::new(HandSim::with_mesh(&model, &surface).expect("a simulation"));
    let mut draw = Stream::of_job(2, b"", "feeling");
    let approaches: Vec<HandApproach> = (0..4).map(|_| random_approach(&surface, Effort::FEEL, &mut draw)).collect();
    let mut worker = HandWorker::new(&sim);
    let first: Vec<ApproachOutcome> =
        approaches.iter().map(|approach| worker.feel(approach).expect("a pose")).collect();
    for (approach, felt) in approaches.iter().zip(&first).rev() {
        assert_eq!(&worker.feel(approach).expect("a pose"), felt);
        assert_eq!(&HandWorker::new(&sim).feel(approach).expect("a pose"), felt);
    }
    assert!(first.iter().any(|felt| felt.touches.len() > 1), "{first:?}");
}

/// A hand that passes by misses; one in an impossible pose is refused.
#[test]
fn a_hand_that_passes_by_misses() {
    let model = open_hand(BARRETT);
    let surface = surface(&built_in_mesh("can-01"));
    let sim = Arc::new(HandSim::with_mesh(&model, &surface).expect("a simulation"));
    let mut worker = HandWorker::new(&sim);
    let start = IsometryMatrix3::translation(1.0, 0.0, -0.3);
    let felt = worker
        .feel(&HandApproach { object_from_start: start, distance: 0.5, closed: 0.0, effort: Effort::FEEL })
        .expect("a pose");
    assert_eq!((felt.end, felt.touches.len()), (HandApproachEnd::Missed, 0));
    assert!((felt.travelled - 0.5).abs() < 0.02, "{}", felt.travelled);
    let nowhere = IsometryMatrix3::translation(f64::NAN, 0.0, 0.0);
    assert!(
        worker
            .feel(&HandApproach { object_from_start: nowhere, distance: 0.5, closed: 0.0, effort: Effort::FEEL })
            .is_err()
    );
}
