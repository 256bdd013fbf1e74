//! Results of a search for grasps.

use nalgebra::{IsometryMatrix3, Point3, Unit, Vector3};

use super::table::TableClearance;
use kernel::words::{GraspVerdict, STRETCHES};

/// Energies of a state of the hand; lower is better.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energies {
    /// Energy that the annealing minimised, recomputed with exact distances.
    pub total: f64,
    /// The contact energy: mean over the virtual contacts of |distance| [mm] and 50 (1 - cos) of the angle by which each points
    /// past the surface.
    pub contact: f64,
    /// The potential: -epsilon of the wrench space of the virtual contacts, weighted by their distance; 1 where fewer than
    /// three of them count. Not scaled.
    pub potential: f64,
}

/// A point where the closed hand touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraspContact {
    /// The link; 0 is the base.
    pub link: usize,
    /// On the object's surface, in `Object` [m].
    pub point: Point3<f64>,
    /// Out of the object, in `Object`.
    pub normal: Unit<Vector3<f64>>,
    /// From the object to the link [m], exact.
    pub distance: f64,
}

/// Wrench-space quality of the contacts of the closed hand, unweighted; 0 where the origin is not inside.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Epsilon of the space of forces (Ferrari and Canny 1992): radius of the largest ball in the hull.
    pub epsilon_force: f64,
    /// Epsilon of the space of forces and torques, torques divided by the object's radius about its centre of mass.
    pub epsilon_wrench: f64,
    /// Volume of the hull of forces and torques.
    pub volume: f64,
}

/// One state of the best list, closed and rated.
#[derive(Clone, Debug, PartialEq)]
pub struct Grasp {
    /// The approach frame expressed in the object's frame: origin on the palm, z towards the object [m]. Here the hand closes.
    pub object_from_approach: IsometryMatrix3<f64>,
    /// Distance that the hand came along its approach until it met the object, from the state that was annealed [m]; 0
    /// where it does not meet it.
    pub advance: f64,
    /// Translation by which a gripper gave way so that both pads hold the object, expressed in its approach frame
    /// before that [m]; `None` where it did not.
    pub shift: Option<Vector3<f64>>,
    /// Rotation by which it gave way, likewise: an axis times an angle [rad].
    pub turn: Option<Vector3<f64>>,
    /// Amplitudes of the hand's eigengrasps before closing.
    pub amplitudes: Vec<f64>,
    /// The posture of these amplitudes, one value per driven joint [rad or m].
    pub posture: Vec<f64>,
    /// Penetration of the object by the hand in the state that was annealed [m], exact; 0 where it is clear.
    pub penetration: f64,
    /// Energies of the state that was annealed.
    pub energies: Energies,
    /// All joints of the closed hand [rad or m], in the order of its tree; as the posture has them where the verdict is
    /// [`GraspVerdict::Penetrates`].
    pub joints: Vec<f64>,
    /// Where the closed hand touches.
    pub contacts: Vec<GraspContact>,
    /// Quality of these contacts.
    pub quality: Quality,
    /// Grasp type: the closed joints, binned (thesis, equation 4.1); `None` for a hand of which it is not defined.
    pub kind: Option<u32>,
    /// Whether it is kept.
    pub verdict: GraspVerdict,
    /// For each pose in which the object rests on a table, how far the hand stays above it; none where the verdict is
    /// [`GraspVerdict::Penetrates`].
    pub clearances: Vec<TableClearance>,
}

/// A tenth of an annealing run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stretch {
    /// Steps whose neighbour was accepted.
    pub accepted: u32,
    /// Mean energy after each step; NaN before the first legal state.
    pub mean_energy: f64,
}

/// Result of one run of annealing.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspRun {
    /// Where the search began: the seed's frame expressed in the object's frame; its origin is on the surface, z is the inward
    /// normal.
    pub object_from_seed: IsometryMatrix3<f64>,
    /// Steps of the run, at most the job's: a seed may be given up.
    pub steps: u32,
    /// Steps that found no legal neighbour.
    pub failed: u32,
    /// Neighbours that were evaluated.
    pub tries: u64,
    /// Neighbours whose wrench space was evaluated.
    pub potentials: u64,
    /// Ten tenths of the run.
    pub course: [Stretch; STRETCHES],
    /// The best states, best first by total energy; no two are duplicates.
    pub grasps: Vec<Grasp>,
}
