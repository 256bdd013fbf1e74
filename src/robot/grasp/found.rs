//! Results of a search for grasps.

use std::fmt;

use nalgebra::{IsometryMatrix3, Point3, Unit, Vector3};

use super::table::TableClearance;
use kernel::words::{GraspVerdict, PointScheme, STRETCHES};

/// Two contacts hold an object between them where the cosine of the angle between their normals is below this.
const MAX_OPPOSED: f64 = -0.5;

/// Energies of a state of the hand; lower is better.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energies {
    /// Energy that the annealing minimised, recomputed with exact distances.
    pub total: f64,
    /// The contact energy: mean over the virtual contacts of |distance| [mm] and 50 (1 - cos) of the angle by which each points
    /// past the surface.
    pub contact: f64,
    /// The potential: -epsilon of the wrench space of the virtual contacts, weighted by their distance; 1 if fewer than
    /// three contacts count. Not scaled.
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
pub struct RatedGrasp {
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
    /// Grasp type: the closed joints, binned (thesis, equation 4.1); `None` for a hand without grasp types.
    pub kind: Option<u32>,
    /// Whether it is kept.
    pub verdict: GraspVerdict,
    /// For each pose in which the object rests on a table, how far the hand stays above it; none where the verdict is
    /// [`GraspVerdict::Penetrates`].
    pub clearances: Vec<TableClearance>,
    /// Scheme by which the first point of its pair, or the point of its approach, was drawn; `None` of other samplers.
    pub point_scheme: Option<PointScheme>,
}

impl RatedGrasp {
    /// Whether two links of the closed hand press on the object against each other.
    pub(super) fn presses_from_both_sides(&self) -> bool {
        self.contacts.iter().enumerate().any(|(index, one)| {
            let opposes = |other: &GraspContact| one.link != other.link && one.normal.dot(&other.normal) < MAX_OPPOSED;
            self.contacts[..index].iter().any(opposes)
        })
    }
}

/// A tenth of an annealing run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SearchInterval {
    /// Steps whose neighbour was accepted.
    pub accepted: u32,
    /// Mean energy after each step; NaN before the first legal state.
    pub mean_energy: f64,
}

/// Result of one run of annealing.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchRun {
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
    pub course: [SearchInterval; STRETCHES],
    /// The best states, best first by total energy; no two are duplicates.
    pub grasps: Vec<RatedGrasp>,
    /// Why pairs of points came to no state, where a sampler took them anywhere along the pads.
    pub losses: Option<PairLosses>,
    /// Why approaches came to no state, where a sampler drew them until it had its states.
    pub approach_losses: Option<ApproachLosses>,
}

impl SearchRun {
    /// Whether the budget of draws ended the run before it had its states; `None` of a run with a fixed number of steps.
    pub fn is_budget_spent(&self) -> Option<bool> {
        let of_pairs = self.losses.map(|losses| losses.budget_spent);
        of_pairs.or(self.approach_losses.map(|losses| losses.budget_spent))
    }

    /// Why draws came to no state; `None` of a run with a fixed number of steps.
    pub fn explained_losses(&self) -> Option<String> {
        let of_pairs = self.losses.map(|losses| losses.to_string());
        of_pairs.or(self.approach_losses.map(|losses| losses.to_string()))
    }
}

/// Why pairs of points came to no state, by count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PairLosses {
    /// Pairs that were drawn.
    pub pairs: u32,
    /// No point on the opposite side lies within the friction cones.
    pub unopposed: u32,
    /// Farther apart than the hand opens.
    pub too_wide: u32,
    /// The hand would come nearer to the table than its margin, however it is rolled.
    pub below_table: u32,
    /// The opened hand would be in the object.
    pub in_object: u32,
    /// Closed, the hand does not hold the object from both sides.
    pub open: u32,
    /// Closed, the hand is nearer to the table than its margin.
    pub lowered: u32,
    /// Like a state that the run has already.
    pub known: u32,
    /// The object rests in no pose that is known: there is no table for it.
    pub no_resting_pose: bool,
    /// The object is nowhere as thin as the hand opens: no pair was drawn.
    pub nowhere_thin: bool,
    /// The budget of pairs ended the run before it had its states.
    pub budget_spent: bool,
}

impl fmt::Display for PairLosses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.no_resting_pose {
            return f.write_str("no resting pose of the object is known, so there is no table for it");
        }
        if self.nowhere_thin {
            return f.write_str("the object is nowhere as thin as the hand opens: check its unit and size");
        }
        write!(f, "of {} pairs of points", self.pairs)?;
        let counts = [
            (self.unopposed, "have no opposite point within the friction cones"),
            (self.too_wide, "are farther apart than the hand opens"),
            (self.below_table, "would bring the hand nearer to the table than its margin"),
            (self.in_object, "would have the opened hand in the object"),
            (self.open, "are not held from both sides once closed"),
            (self.lowered, "are nearer to the table than the margin once closed"),
            (self.known, "give a state like one that the run has"),
        ];
        write_counts(f, &counts)
    }
}

/// Counts above 0, each with its meaning.
fn write_counts(f: &mut fmt::Formatter<'_>, counts: &[(u32, &str)]) -> fmt::Result {
    let counted = counts.iter().filter(|(count, _)| *count > 0);
    let parts: Vec<String> = counted.map(|(count, meaning)| format!(" {count} {meaning}")).collect();
    f.write_str(&parts.join(","))
}

/// Why approaches came to no state, by count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ApproachLosses {
    /// Approaches that were drawn.
    pub draws: u32,
    /// No line across the approach meets the two sides of the object within their friction cones.
    pub unopposed: u32,
    /// The object is wider there than the hand opens in any posture.
    pub too_wide: u32,
    /// The preshaped hand would be in the object.
    pub in_object: u32,
    /// The preshaped hand meets the object before its fingers are on both sides.
    pub blocked: u32,
    /// Closed, no two links press on the object against each other.
    pub open: u32,
    /// Like a state that the run has already.
    pub known: u32,
    /// The budget of draws ended the run before it had its states.
    pub budget_spent: bool,
}

impl fmt::Display for ApproachLosses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "of {} approaches", self.draws)?;
        let counts = [
            (self.unopposed, "have no two sides across them within the friction cones"),
            (self.too_wide, "meet a part wider than the hand opens"),
            (self.in_object, "would have the preshaped hand in the object"),
            (self.blocked, "meet the object before the fingers are on both sides"),
            (self.open, "do not press from both sides once closed"),
            (self.known, "give a state like one that the run has"),
        ];
        write_counts(f, &counts)
    }
}
