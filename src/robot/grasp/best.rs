//! The best states of a run, each far from the others.

use super::{frame::Frame, variables::State};

/// Two states that are nearer are duplicates.
const APART: f64 = 0.2;

/// A state of the best list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    pub(super) energy: f64,
    pub(super) object_from_approach: Frame,
    pub(super) state: State,
}

/// The best list: best first.
pub(super) struct BestList {
    max: usize,
    /// The object's, by which distances are measured [m].
    radius: f64,
    list: Vec<Candidate>,
}

impl BestList {
    pub(super) fn new(max: usize) -> Self {
        Self { max, radius: 1.0, list: Vec::with_capacity(max + 1) }
    }

    pub(super) fn clear(&mut self, radius: f64) {
        self.radius = radius;
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
        let is_same = |known: &Candidate| is_duplicate(&known.object_from_approach, object_from_approach, self.radius);
        if self.list.iter().take_while(|known| known.energy <= energy).any(is_same) {
            return;
        }
        let radius = self.radius;
        self.list.retain(|known| {
            known.energy <= energy || !is_duplicate(&known.object_from_approach, object_from_approach, radius)
        });
        let index = self.list.partition_point(|known| known.energy <= energy);
        self.list.insert(index, Candidate { energy, object_from_approach: *object_from_approach, state: *state });
        self.list.truncate(self.max);
    }
}

/// Whether max(|between their positions| / radius, angle between their rotations / 2 pi) is below [`APART`].
fn is_duplicate(one: &Frame, other: &Frame, radius: f64) -> bool {
    let max = APART * radius;
    if (one.origin - other.origin).norm_squared() >= max * max {
        return false;
    }
    // trace = 1 + 2 cos(angle); the angle is below 2 pi APART.
    let trace = one.rotation.component_mul(&other.rotation).sum();
    trace > 1.0 + 2.0 * COS_APART
}

/// cos(0.4 pi).
const COS_APART: f64 = 0.309_016_994_374_947_45;
