//! Clearance of a hand above the tables on which an object rests, against all points of its solids one by one.

use graspmill::{
    collision::Body,
    geom::{RestingPose, Shape, SimdLevel},
    grasp::{Annealer, Keeping, RatedGrasp, STAND_OFF},
    hand::Hand,
    words::GraspVerdict,
};
use nalgebra::{IsometryMatrix3, Point3, Translation3, Vector3};

use super::{QUICK, Searcher, stream};
use crate::support::annealing::KEEPING;

/// Parts of the path between two postures.
const STEPS: u32 = 12;

/// The points at which a shape reaches farthest, all that matter for how low it comes, and how far it goes beyond each.
fn extreme_points(shape: &Shape) -> (Vec<Point3<f64>>, f64) {
    let ends = |half: f64| vec![Point3::new(0.0, 0.0, -half), Point3::new(0.0, 0.0, half)];
    match shape {
        Shape::Sphere { radius } => (vec![Point3::origin()], *radius),
        Shape::Capsule { radius, half } => (ends(*half), *radius),
        Shape::Box { half: [x, y, z] } => {
            let sign = |k: usize, bit: usize| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
            ((0..8).map(|k| Point3::new(x * sign(k, 0), y * sign(k, 1), z * sign(k, 2))).collect(), 0.0)
        }
        Shape::Cylinder { radius, half } => {
            let rim = |z: f64| {
                (0..90).map(move |k| {
                    let angle = f64::from(k) * std::f64::consts::PI / 45.0;
                    Point3::new(radius * angle.cos(), radius * angle.sin(), z)
                })
            };
            (rim(-half).chain(rim(*half)).collect(), 0.0)
        }
        Shape::Mesh(_) => panic!("no mesh is a solid of a hand"),
    }
}

/// The lowest point of a hand above the table [m].
pub(super) fn lowest(
    bodies: &[Body],
    pose: &RestingPose,
    object_from_base: &IsometryMatrix3<f64>,
    frames: &[IsometryMatrix3<f64>],
) -> f64 {
    let world_from_base = pose.world_from_object.isometry() * object_from_base;
    let mut low = f64::INFINITY;
    for body in bodies {
        for part in &body.geometries {
            let frame = body.link.checked_sub(1).map_or_else(IsometryMatrix3::identity, |link| frames[link]);
            let (points, radius) = extreme_points(&part.shape);
            for point in points {
                low = low.min((world_from_base * frame * part.link_from_shape * point).z - radius);
            }
        }
    }
    low
}

pub(super) fn object_from_base(hand: &Hand, grasp: &RatedGrasp) -> IsometryMatrix3<f64> {
    let frames = hand.link_frames(&hand.posture_values(&grasp.posture));
    grasp.object_from_approach * hand.approach_pose(&frames).isometry().inverse()
}

/// Checks a grasp's clearances: still in three postures, and, as the lowest that the hand could come to, in every mix of
/// where its joints begin and end.
fn check(searcher: &Searcher, grasp: &RatedGrasp) -> [u32; 2] {
    let hand = &searcher.hand;
    let (bodies, _) = searcher.model.bodies().expect("its bodies");
    let here = object_from_base(hand, grasp);
    let direction = grasp.object_from_approach.rotation * Vector3::z();
    let back = Translation3::from(direction * -STAND_OFF) * here;
    let shaped = hand.posture_values(&grasp.posture);
    let opened = hand.posture_values(&hand.opening(&grasp.posture));
    let resting = &searcher.object.resting().poses;
    assert_eq!(grasp.clearances.len(), resting.len());
    // Between two postures each finger is somewhere in the box of its joints: even ones by one share, odd ones by another.
    let mixes: Vec<Vec<IsometryMatrix3<f64>>> = (0..=STEPS * (STEPS + 2))
        .map(|k| {
            let shares = [k % (STEPS + 1), k / (STEPS + 1)].map(|part| f64::from(part) / f64::from(STEPS));
            let value = |joint: usize| shaped[joint] + shares[joint % 2] * (grasp.joints[joint] - shaped[joint]);
            hand.link_frames(&(0..shaped.len()).map(value).collect::<Vec<_>>())
        })
        .collect();
    let mut counts = [0; 2];
    for (pose, found) in resting.iter().zip(&grasp.clearances).take(4) {
        let at =
            |joints: &[f64], base: &IsometryMatrix3<f64>| lowest(&bodies.bodies, pose, base, &hand.link_frames(joints));
        let closed = at(&grasp.joints, &here);
        let [come_shaped, come_opened] = [&shaped, &opened].map(|joints| at(joints, &back).min(at(joints, &here)));
        let still = closed.min(come_shaped);
        assert!(found.shaped <= still + 1e-9, "{found:?}, {closed} {come_shaped}");
        assert!(found.opened <= closed.min(come_opened) + 1e-9, "{found:?}, {closed} {come_opened}");
        let mixed = mixes.iter().map(|frames| lowest(&bodies.bodies, pose, &here, frames)).fold(still, f64::min);
        // A point between two mixes is lower by an arc's height at most: 0.2 m times (2.5 / 12)^2 / 8, of two joints.
        assert!(found.shaped >= mixed - 2.5e-3, "{found:?}, {mixed}");
        counts[0] += u32::from(found.shaped >= 0.0);
        counts[1] += u32::from(found.shaped < still - 1e-6);
    }
    counts
}

#[test]
fn a_hand_stays_as_far_above_tables_as_its_solids_say() {
    let (mut above, mut between, mut all) = (0, 0, 0);
    for name in ["box-01", "can-01"] {
        let searcher = Searcher::new(name);
        assert!(searcher.object.resting().poses.len() >= 3);
        for run in searcher.runs(&QUICK, 3) {
            for grasp in run.grasps.iter().step_by(4) {
                if grasp.verdict == GraspVerdict::Penetrates {
                    assert!(grasp.clearances.is_empty());
                    continue;
                }
                let [clear, lower] = check(&searcher, grasp);
                (above, between, all) = (above + clear, between + lower, all + 4);
            }
        }
    }
    assert!(above > 0 && above < all && between > 0, "{above} of {all} above, {between} lowest on their way");
}

#[test]
fn a_table_drops_what_no_pose_allows() {
    let searcher = Searcher::new("box-01");
    let run = |keeping: &Keeping| {
        let mut annealer = Annealer::new(&searcher.search, &QUICK, keeping, SimdLevel::detect());
        (0..4).flat_map(|seed| annealer.run(&searcher.object, &searcher.seed(seed), &mut stream(seed)).grasps).collect()
    };
    let (plain, watched): (Vec<RatedGrasp>, Vec<RatedGrasp>) =
        (run(&KEEPING), run(&Keeping { table: true, ..KEEPING }));
    assert_eq!(plain.len(), watched.len());
    let mut dropped = 0;
    for (plain, watched) in plain.iter().zip(&watched) {
        let low = plain.clearances.iter().all(|lowest| lowest.shaped < 0.0);
        let falls = plain.verdict == GraspVerdict::Kept && low;
        let expected = if falls { GraspVerdict::BelowTable } else { plain.verdict };
        assert_eq!(*watched, RatedGrasp { verdict: expected, ..plain.clone() });
        dropped += u32::from(falls);
    }
    println!("{dropped} of {} dropped", plain.len());
}
