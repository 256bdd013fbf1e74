//! Grasps without a search: approaches all round an axis, as in a planner of the thesis (7.4.1). Use them for
//! comparison with annealing, and where many plain grasps are enough.

use std::{f64::consts::TAU, sync::Arc};

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

use super::{
    best::BestList,
    closing::Closing,
    found::SearchRun,
    kind::camera_axes,
    motion::preshape,
    object::ObjectSearch,
    rate::{HandState, Rating},
    settings::{Annealing, Keeping, Uniform},
    solids::Solid,
    state::{HandSearch, StateScratch},
    tally::Tally,
};
use crate::kinematics::JointKind;
use kernel::{
    geom::{SimdLevel, rotation_towards},
    seed::Stream,
};

/// Before it closes a finger is so far from where it meets the object, by its motor: [rad], of a slide [m].
pub(super) const BEFORE: [f64; 2] = [0.1, 0.005];

/// One thread's sampling of one hand.
pub struct GraspSampler {
    pub(super) search: Arc<HandSearch>,
    pub(super) level: SimdLevel,
    pub(super) scratch: StateScratch,
    pub(super) closing: Closing,
    pub(super) rating: Rating,
    pub(super) best: BestList,
}

impl GraspSampler {
    /// With vector instructions up to a level; the results are the same at every level. Only the energy of `annealing`
    /// is used.
    pub fn new(search: &Arc<HandSearch>, annealing: &Annealing, keeping: &Keeping, level: SimdLevel) -> Self {
        Self {
            search: Arc::clone(search),
            level: level.usable(),
            scratch: search.scratch(),
            closing: Closing::new(&search.hand, &search.solids),
            rating: Rating::new(search, annealing, keeping, level.usable()),
            best: BestList::new(0),
        }
    }

    /// Finds every overlap of hand and object by exact distances: for comparison, with the same states in several times the time.
    #[must_use]
    pub fn with_exact_overlaps(mut self) -> Self {
        self.closing.without_prefilter();
        self.rating.without_prefilter();
        self
    }

    /// A run all round the z axis of a frame.
    pub fn uniform(
        &mut self,
        object: &ObjectSearch,
        object_from_frame: &IsometryMatrix3<f64>,
        uniform: &Uniform,
    ) -> SearchRun {
        let mut tally = Tally::new(uniform.grasps);
        let mut grasps = Vec::new();
        for index in 0..uniform.grasps {
            let (sin, cos) = libm::sincos(TAU * f64::from(index) / f64::from(uniform.grasps));
            let sight = Vector3::new(-cos, -sin, 0.0);
            let [right, down] = camera_axes(&sight);
            let (sin, cos) = libm::sincos(uniform.rolls.roll_of(index));
            let x = right * cos + down * sin;
            let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, sight.cross(&x), sight]));
            let frame_from_approach = IsometryMatrix3::from_parts(Translation3::identity(), rotation);
            let start = self.come(object, &(object_from_frame * frame_from_approach));
            let grasp = self.rating.started(object, start);
            tally.count(index, Some(grasp.energies.total));
            grasps.push(grasp);
        }
        tally.run(object_from_frame, grasps)
    }

    /// Moves the opened hand along an approach from afar until it meets the object, or until the approach frame reaches
    /// its end, and closes there except for the last part of each motor's range.
    fn come(&mut self, object: &ObjectSearch, object_from_approach: &IsometryMatrix3<f64>) -> HandState {
        let hand = Arc::clone(&self.search.hand);
        let opened = preshape(&hand);
        let joints = hand.posture_values(&opened);
        let approach_from_base = hand.approach_pose(&hand.link_frames(&joints)).isometry().inverse();
        let direction = object_from_approach.rotation * Vector3::z();
        let far = self.distance_outside(object, object_from_approach, &joints);
        let outside = Translation3::from(direction * -far) * object_from_approach * approach_from_base;
        let come = match self.closing.advance(object.surface(), &outside, &joints, &direction, far) {
            0.0 => far,
            come => come,
        };
        let object_from_approach = Translation3::from(direction * (come - far)) * object_from_approach;
        let closed = self.closing.close(object.surface(), &(object_from_approach * approach_from_base), &opened);
        let before = hand.driven().iter().zip(&closed.motors).zip(&opened).map(|((driven, motor), opened)| {
            let slides = hand.tree().joints()[driven.joint].joint.kind == JointKind::Prismatic;
            let back = BEFORE[usize::from(slides)];
            let value = driven.value(*motor);
            if (value - opened).abs() <= back { *opened } else { value - driven.closing_sign() * back }
        });
        HandState { object_from_approach, posture: before.collect(), amplitudes: Vec::new() }
    }

    /// Distance back along the approach from where a ball that holds the hand is outside of one that holds the object [m].
    pub(super) fn distance_outside(
        &self,
        object: &ObjectSearch,
        object_from_approach: &IsometryMatrix3<f64>,
        joints: &[f64],
    ) -> f64 {
        let aside = (object_from_approach.translation.vector - object.middle.coords).norm();
        object.radius + aside + self.reach(joints)
    }

    /// Radius of a ball about the approach frame's origin that holds the hand [m].
    fn reach(&self, joints: &[f64]) -> f64 {
        let frames = self.search.hand.link_frames(joints);
        let origin = self.search.hand.approach_pose(&frames).isometry().translation.vector;
        let far = |solid: &Solid| {
            let centre = if solid.link == 0 { solid.centre } else { frames[solid.link - 1] * solid.centre };
            (centre.coords - origin).norm() + solid.reach
        };
        self.closing.solids.solids.iter().map(far).fold(0.0, f64::max)
    }
}

/// Frames that runs go round: z is the axis.
///
/// Upright axes are in the middle of the object's box one above the other, spread evenly over its height, each rotated
/// on by the same part of the angle between two grasps. Otherwise the axis has any direction, through the middle of the
/// box.
pub fn axes(
    surface: &kernel::contact::ContactSurface,
    uniform: &Uniform,
    runs: u32,
    stream: &mut Stream,
) -> Vec<IsometryMatrix3<f64>> {
    let bounds = surface.bounds();
    let middle = bounds.centre();
    let one = |run: u32| {
        let along = (f64::from(run) + 0.5) / f64::from(runs);
        if uniform.upright {
            let height = bounds.min.z + (bounds.max.z - bounds.min.z) * along;
            let azimuth = TAU * f64::from(run) / f64::from(runs) / f64::from(uniform.grasps);
            let rotation = Rotation3::from_matrix_unchecked(about_z(azimuth));
            return IsometryMatrix3::from_parts(Translation3::new(middle.x, middle.y, height), rotation);
        }
        let z = stream.uniform(-1.0, 1.0);
        let (sin, cos) = libm::sincos(stream.uniform(0.0, TAU));
        let across = (1.0 - z * z).max(0.0).sqrt();
        let rotation = rotation_towards(&Vector3::new(across * cos, across * sin, z), stream.uniform(0.0, TAU));
        IsometryMatrix3::from_parts(Translation3::from(middle.coords), Rotation3::from_matrix_unchecked(rotation))
    };
    (0..runs).map(one).collect()
}

fn about_z(angle: f64) -> Matrix3<f64> {
    let (sin, cos) = libm::sincos(angle);
    Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0)
}
