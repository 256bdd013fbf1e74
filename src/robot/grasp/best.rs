//! The best states of a run, each far from the others.

use super::{frame::Frame, variables::State};

/// Two states of a search that are nearer are duplicates.
const APART: f64 = 0.2;

/// Grasps whose positions and rotations differ by less than these count as alike, for every object [m, rad].
const ALIKE: [f64; 2] = [0.02, std::f64::consts::PI / 12.0];

/// A state of the best list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    pub(super) energy: f64,
    pub(super) object_from_approach: Frame,
    pub(super) state: State,
}

/// Nearness at which two approach frames count as one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Likeness {
    /// Between their positions, below this [m].
    distance: f64,
    /// Cosine of the angle between their rotations, above this.
    cos: f64,
}

impl Likeness {
    /// Duplicates of a search on an object of this radius [m]: max(|between their positions| / radius, angle between their
    /// rotations / 2 pi) is below [`APART`].
    pub(super) fn of_search(radius: f64) -> Self {
        Self { distance: APART * radius, cos: COS_APART }
    }

    /// Grasps that are alike by [`ALIKE`].
    pub(super) fn of_grasps() -> Self {
        Self { distance: ALIKE[0], cos: libm::cos(ALIKE[1]) }
    }

    /// Whether two approach frames count as one.
    pub(super) fn joins(&self, one: &Frame, other: &Frame) -> bool {
        if (one.origin - other.origin).norm_squared() >= self.distance * self.distance {
            return false;
        }
        // trace = 1 + 2 cos(angle); the angle is below half a turn.
        let trace = one.rotation.component_mul(&other.rotation).sum();
        trace > 1.0 + 2.0 * self.cos
    }
}

/// cos(0.4 pi).
const COS_APART: f64 = 0.309_016_994_374_947_45;

/// The best list: best first.
pub(super) struct BestList {
    max: usize,
    likeness: Likeness,
    list: Vec<Candidate>,
}

impl BestList {
    pub(super) fn new(max: usize) -> Self {
        Self { max, likeness: Likeness::of_search(1.0), list: Vec::with_capacity(max + 1) }
    }

    /// Begins again, on an object of this radius [m].
    pub(super) fn clear(&mut self, radius: f64) {
        self.likeness = Likeness::of_search(radius);
        self.list.clear();
    }

    pub(super) fn list(&self) -> &[Candidate] {
        &self.list
    }

    /// Takes a state in where it is good enough; of duplicates the better stays.
    pub(super) fn offer(&mut self, energy: f64, object_from_approach: &Frame, state: &State) {
        if self.list.len() == self.max && self.list.last().is_some_and(|worst| energy >= worst.energy) {
            return;
        }
        let likeness = self.likeness;
        let is_same = |known: &Candidate| likeness.joins(&known.object_from_approach, object_from_approach);
        if self.list.iter().take_while(|known| known.energy <= energy).any(is_same) {
            return;
        }
        self.list.retain(|known| known.energy <= energy || !is_same(known));
        let index = self.list.partition_point(|known| known.energy <= energy);
        self.list.insert(index, Candidate { energy, object_from_approach: *object_from_approach, state: *state });
        self.list.truncate(self.max);
    }
}
