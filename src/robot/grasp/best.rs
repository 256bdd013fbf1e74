//! The best states of a run, each far from the others.

use super::{alike::Likeness, frame::Frame, variables::State};

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
        let is_same = |known: &Candidate| likeness.are_alike(&known.object_from_approach, object_from_approach);
        if self.list.iter().take_while(|known| known.energy <= energy).any(is_same) {
            return;
        }
        self.list.retain(|known| known.energy <= energy || !is_same(known));
        let index = self.list.partition_point(|known| known.energy <= energy);
        self.list.insert(index, Candidate { energy, object_from_approach: *object_from_approach, state: *state });
        self.list.truncate(self.max);
    }
}
