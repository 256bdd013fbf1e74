//! Grippers give way until both pads hold the object, and grasps that no search was for: against the geometry of boxes and
//! cans.

use std::f64::consts::{FRAC_PI_2, TAU};

use graspmill::{
    geom::SimdLevel,
    grasp::{Antipodal, GraspSampler, Keeping, PairHold, Rolls, Uniform, axes},
    words::GraspVerdict,
};
use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

use super::{QUICK, Searcher, stream};
use crate::support::{annealing::KEEPING, robots::GRIPPER};

pub(super) const FETCH_GRIPPER: &str = "scenes/fetch_gripper.xml";

/// Contacts that hold torsion.
pub(super) const WITH_TORSION: Keeping = Keeping { torsion: Some(0.002), ..KEEPING };

pub(super) fn sampler(searcher: &Searcher) -> GraspSampler {
    GraspSampler::new(&searcher.search, &QUICK, &WITH_TORSION, SimdLevel::detect())
}

fn uniform(grasps: u32, rolls: &[f64]) -> Uniform {
    Uniform { grasps, rolls: Rolls(rolls.to_vec()), upright: true }
}

/// A box that lies a centimetre aside and turned by four degrees comes to lie flat between the pads: their distance is its
/// side.
#[test]
fn pads_come_to_lie_flat_on_a_box() {
    for scene in [FETCH_GRIPPER, "scenes/panda_hand.xml", GRIPPER] {
        let searcher = Searcher::with_hand("box-01", scene);
        let bounds = *searcher.surface.bounds();
        let [size, middle] = [bounds.max - bounds.min, bounds.centre().coords];
        let off = 4.0f64.to_radians();
        let (sin, cos) = off.sin_cos();
        let rotation = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let aside = Translation3::from(middle + Vector3::new(0.01, 0.01, 0.0));
        let frame = IsometryMatrix3::from_parts(aside, Rotation3::from_matrix_unchecked(rotation));
        let run = sampler(&searcher).uniform(&searcher.object, &frame, &uniform(4, &[FRAC_PI_2]));
        let mut flat = 0;
        for grasp in &run.grasps {
            let closing = grasp.object_from_approach.rotation * Vector3::y();
            let side = if closing.x.abs() > 0.9 { 0 } else { 1 };
            let opened = searcher.hand.link_frames(&searcher.hand.posture_values(&searcher.hand.opened()));
            if searcher.hand.width(&opened).expect("a gripper") < size[side] + 0.03 {
                continue;
            }
            flat += 1;
            let width = searcher.hand.width(&searcher.hand.link_frames(&grasp.joints)).expect("a gripper");
            println!("{scene}: {width} of {}, {:?} {:?}", size[side], grasp.shift, grasp.turn);
            assert!((width - size[side]).abs() < 5e-5, "{scene}: {width} m between pads, {} m wide", size[side]);
            let angle = grasp.turn.expect("it was off").norm();
            assert!((angle - off).abs() < 5e-4, "{scene}: turned by {angle}");
            // The middle between the pads is that of the box.
            let aside = (grasp.object_from_approach.translation.vector - middle)[side];
            assert!(aside.abs() < 5e-5, "{scene}: {aside} m off the middle");
            assert!(closing[side].abs() > 0.999_999, "{scene}: closes along {closing}");
            let sides = |sign: f64| grasp.contacts.iter().filter(|contact| contact.normal[side] * sign > 0.999).count();
            assert!(sides(1.0) >= 2 && sides(-1.0) >= 2, "{:?}", grasp.contacts);
            let overlap = grasp.contacts.iter().map(|contact| contact.distance).fold(0.0, f64::min);
            assert!(overlap > -2e-5, "{overlap}");
        }
        assert!(flat > 0, "{scene}: {size} is too wide for it");
    }
}

/// A hand of several motors closes where it is.
#[test]
fn hands_without_a_line_between_pads_stay() {
    let searcher = Searcher::new("can-01");
    assert_eq!(searcher.hand.closing_line(), None);
    let frame = axes(&searcher.surface, &uniform(20, &[0.0]), 1, &mut stream(1))[0];
    let run = sampler(&searcher).uniform(&searcher.object, &frame, &uniform(20, &[0.0]));
    assert_eq!((run.grasps.len(), run.steps, run.failed), (20, 20, 0));
    assert!(run.grasps.iter().all(|grasp| grasp.shift.is_none() && grasp.turn.is_none()));
    // All round the axis, at right angles to it, in equal steps, the palm on its way to it.
    let mut angles: Vec<f64> = Vec::new();
    for grasp in &run.grasps {
        let direction = grasp.object_from_approach.rotation * Vector3::z();
        let position = grasp.object_from_approach.translation.vector - frame.translation.vector;
        assert!(
            direction.z.abs() < 1e-12 && position.cross(&direction).norm() < 1e-9 && position.dot(&direction) < 1e-9
        );
        angles.push(direction.y.atan2(direction.x).rem_euclid(TAU));
        assert!(grasp.penetration < 1e-4, "{}", grasp.penetration);
    }
    angles.sort_by(f64::total_cmp);
    assert!(angles.windows(2).all(|pair| (pair[1] - pair[0] - TAU / 20.0).abs() < 1e-9));
    assert!(run.grasps.windows(2).all(|pair| pair[0].energies.total <= pair[1].energies.total));
}

/// Upright axes are one above the other; those of any pose point everywhere.
#[test]
fn axes_stand_upright_or_anyhow() {
    let searcher = Searcher::new("bottle-01");
    let made = axes(&searcher.surface, &uniform(20, &[0.0]), 4, &mut stream(2));
    let bounds = searcher.surface.bounds();
    let height = bounds.max.z - bounds.min.z;
    for (run, frame) in made.iter().enumerate() {
        let share = (frame.translation.vector.z - bounds.min.z) / height;
        assert!((share - (run as f64 + 0.5) / 4.0).abs() < 1e-12);
        assert!((frame.rotation * Vector3::z() - Vector3::z()).norm() < 1e-15);
    }
    let any = Uniform { upright: false, ..uniform(20, &[0.0]) };
    let made = axes(&searcher.surface, &any, 2_000, &mut stream(2));
    // Uniform over the sphere: every component has mean 0 and variance 1/3.
    let sum = made.iter().fold(Vector3::zeros(), |sum, frame| sum + frame.rotation * Vector3::z());
    let squares = made.iter().fold(Vector3::zeros(), |sum, frame| {
        let z = frame.rotation * Vector3::z();
        sum + z.component_mul(&z)
    });
    assert!((sum / 2e3).amax() < 0.05 && (squares / 2e3 - Vector3::repeat(1.0 / 3.0)).amax() < 0.03, "{sum} {squares}");
    assert!(made.iter().all(|frame| (frame.rotation.matrix().determinant() - 1.0).abs() < 1e-12));
}

/// On a can a line within the friction cones of both ends goes nearly through its axis, or is nearly parallel to it.
#[test]
fn antipodal_pads_face_each_other_across_the_object() {
    let searcher = Searcher::with_hand("can-01", FETCH_GRIPPER);
    let antipodal = Antipodal { pairs: 150, friction: 0.3, best: 5, hold: PairHold::Middle };
    let run = sampler(&searcher).antipodal(&searcher.object, &antipodal, &mut stream(3));
    assert_eq!((run.steps, run.tries, run.grasps.len()), (150, 150, 5));
    let found: u32 = run.course.iter().map(|stretch| stretch.accepted).sum();
    assert_eq!(found + run.failed, 150);
    assert!(found > 5, "{found}");
    for grasp in &run.grasps {
        assert!(grasp.amplitudes.is_empty() && grasp.penetration <= 1e-4);
        let before = searcher.hand.width(&searcher.hand.link_frames(&searcher.hand.posture_values(&grasp.posture)));
        let closed = searcher.hand.width(&searcher.hand.link_frames(&grasp.joints));
        assert!(closed < before);
    }
    let kept = run.grasps.iter().filter(|grasp| grasp.verdict == GraspVerdict::Kept).count();
    assert!(kept >= 2, "{kept} of 5");
    let again = sampler(&searcher).antipodal(&searcher.object, &antipodal, &mut stream(3));
    assert_eq!(format!("{again:?}"), format!("{run:?}"), "the same every time");
    let mut scalar = GraspSampler::new(&searcher.search, &QUICK, &WITH_TORSION, SimdLevel::Scalar);
    let scalar = scalar.antipodal(&searcher.object, &antipodal, &mut stream(3));
    assert_eq!(format!("{scalar:?}"), format!("{run:?}"), "and at every level");
}
