//! Waypoints of a grasp, from what a run stores: how the hand approaches, closes and lifts.

use nalgebra::{Translation3, Unit, Vector3};

use super::{Grasp, GraspRun};
use kernel::{
    geom::{HandBase, Object, Pose},
    words::FreeWays,
};

/// Height of the lift [m], as in trials.
const LIFT: f64 = 0.1;

/// A state of hand and motors on the path of a grasp.
#[derive(Clone, Debug, PartialEq)]
pub struct Waypoint {
    /// Name of the step that ends here: one of [`Waypoint::NAMES`].
    pub name: &'static str,
    /// The hand's base.
    pub object_from_base: Pose<Object, HandBase>,
    /// Driven joints [rad or m], in the order of the run's names; `None` where the motors close until something stops them.
    pub driven: Option<Vec<f64>>,
    /// All joints [rad or m], in the order of the run's names; `None` for the opened hand, of which only the driven joints are
    /// known.
    pub joints: Option<Vec<f64>>,
}

impl Waypoint {
    /// Names of the waypoints, in their order: opened or in the posture before closing, back along the approach by the method's
    /// `stand_off`; the same where the hand closes; in that posture; closed; closed, 10 cm higher.
    pub const NAMES: [&str; 5] = ["pregrasp", "arrival", "posture", "closed", "lifted"];
}

impl Grasp {
    /// The hand's base, back along the approach by a distance [m].
    pub fn object_from_base_back(&self, distance: f64) -> Pose<Object, HandBase> {
        let approach = self.object_from_approach.isometry().rotation * Vector3::z();
        moved(&self.object_from_base, &(approach * -distance))
    }
}

impl GraspRun {
    /// The waypoints of a grasp of this run: the hand moves straight along its approach, takes its posture, closes, and lifts the
    /// object along `up` (expressed in the object's frame: its z axis in trials in the air, on a table the third row of the
    /// resting pose's rotation). It approaches opened if that way is free, else in its posture; `None` if neither is free.
    /// Obstacles are the object and, if `pose` names a resting pose, the table below it.
    pub fn waypoints(&self, grasp: &Grasp, up: &Unit<Vector3<f64>>, pose: Option<usize>) -> Option<[Waypoint; 5]> {
        let base = &grasp.object_from_base;
        let [back, lifted] =
            [grasp.object_from_base_back(self.method.stand_off), moved(base, &(up.into_inner() * LIFT))];
        let [posture, before] = [&grasp.posture, &grasp.joints_before].map(|values| Some(values.clone()));
        // Only the driven joints of the opened hand are known.
        let coming = match grasp.free_ways(pose) {
            FreeWays::None => return None,
            FreeWays::Opened | FreeWays::Both => (Some(grasp.opening.clone()), None),
            FreeWays::Posture => (posture.clone(), before.clone()),
        };
        let closed = Some(grasp.joints.clone());
        let ways = [
            (back, coming.0.clone(), coming.1.clone()),
            (*base, coming.0, coming.1),
            (*base, posture, before),
            (*base, None, closed.clone()),
            (lifted, None, closed),
        ];
        let mut names = Waypoint::NAMES.into_iter();
        Some(ways.map(|(object_from_base, driven, joints)| {
            let name = names.next().expect("a name for each");
            Waypoint { name, object_from_base, driven, joints }
        }))
    }
}

/// A pose, moved by a vector in the object's frame [m].
fn moved(pose: &Pose<Object, HandBase>, by: &Vector3<f64>) -> Pose<Object, HandBase> {
    Pose::from_isometry(Translation3::from(*by) * pose.isometry())
}
