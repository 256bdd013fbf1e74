//! Epsilon by an expanding polytope, exact or only as far as a question needs.

use std::{cmp::Reverse, collections::BinaryHeap};

use super::{
    enclose::{CORNERS, Simplex, enclose},
    polytope::{Facet, Polytope},
    set::{FLAT, WrenchSet},
};
use kernel::geom::SimdLevel;

/// Facets that one search makes before it gives up and returns its bounds.
pub const MAX_FACETS: usize = 200_000;
/// A facet is on the hull when its support point lies no higher than this above it, against the largest weight: more than
/// what moving the wrenches makes of a flat facet.
const CLOSED: f64 = 5e-9;

/// Directions that are remembered.
const MAX_WEAKEST: usize = 6;

/// When to stop before epsilon is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EpsilonLimits {
    /// Ends the search as soon as epsilon is known to be larger.
    pub above: f64,
    /// Ends the search as soon as epsilon is known to be smaller.
    pub below: f64,
    /// Ends the search as soon as its bounds are no farther apart.
    pub tolerance: f64,
}

impl EpsilonLimits {
    /// Never: epsilon itself.
    pub const EXACT: Self = Self { above: f64::INFINITY, below: 0.0, tolerance: 0.0 };
}

/// Why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EpsilonEnd {
    /// The bounds are as close as requested.
    Closed,
    /// The origin is not inside the hull, or the hull is flat: both bounds are 0.
    Outside,
    /// The lower bound is above the limit.
    Above,
    /// The upper bound is below the limit.
    Below,
    /// [`MAX_FACETS`] were made. To be counted.
    Capped,
}

/// Bounds known of epsilon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Epsilon {
    /// Lower bound.
    pub lower: f64,
    /// Upper bound; where the search closed exactly, epsilon itself.
    pub upper: f64,
    /// Facets made in between.
    pub facets: usize,
    /// Why the search ended.
    pub end: EpsilonEnd,
}

impl Epsilon {
    const OUTSIDE: Self = Self { lower: 0.0, upper: 0.0, facets: 0, end: EpsilonEnd::Outside };
}

/// Memory for searches of one thread: it allocates nothing after the largest search. It remembers the simplex that each
/// search started from and the directions in which the last hulls were nearest to the origin, and tries them first in
/// the next. This changes the time and, within rounding and the motion of the wrenches, the result: where bits matter,
/// call [`EpsilonSolver::forget`] before.
#[derive(Clone, Debug)]
pub struct EpsilonSolver {
    level: SimdLevel,
    forces: Space<3>,
    wrenches: Space<6>,
}

impl EpsilonSolver {
    /// A solver that uses vector instructions up to a level; results are the same at every level.
    pub fn new(level: SimdLevel) -> Self {
        Self { level: level.usable(), forces: Space::default(), wrenches: Space::default() }
    }

    /// Forgets earlier searches.
    pub fn forget(&mut self) {
        (self.forces.before, self.wrenches.before) = (None, None);
        self.forces.weakest.clear();
        self.wrenches.weakest.clear();
    }

    /// Epsilon of only the forces.
    pub fn of_forces(&mut self, set: &WrenchSet, limits: &EpsilonLimits) -> Epsilon {
        self.forces.search(set, self.level, limits)
    }

    /// Epsilon of the wrenches.
    pub fn of_wrenches(&mut self, set: &WrenchSet, limits: &EpsilonLimits) -> Epsilon {
        self.wrenches.search(set, self.level, limits)
    }

    /// Epsilon of the wrenches, unless that of the forces answers already: it is never smaller, since forces are a projection
    /// of wrenches, and a tenth of the work.
    pub fn of_wrenches_within(&mut self, set: &WrenchSet, limits: &EpsilonLimits) -> Epsilon {
        // Exact enough for the comparison with `below`, which is the only use.
        let forces = EpsilonLimits { above: limits.below.max(0.0), below: limits.below, tolerance: 0.0 };
        let bound = self.forces.search(set, self.level, &forces);
        match bound.end {
            EpsilonEnd::Outside | EpsilonEnd::Below => Epsilon { lower: 0.0, ..bound },
            _ if bound.upper < limits.below => Epsilon { lower: 0.0, end: EpsilonEnd::Below, ..bound },
            _ => self.wrenches.search(set, self.level, limits),
        }
    }

    /// Whether the origin is inside the hull of the forces: whether their epsilon is above 0.
    pub fn forces_enclose(&mut self, set: &WrenchSet) -> bool {
        self.forces.encloses(set, self.level)
    }

    /// Force closure: whether the origin is inside the hull of the wrenches, their epsilon above 0.
    pub fn wrenches_enclose(&mut self, set: &WrenchSet) -> bool {
        self.wrenches.encloses(set, self.level)
    }
}

/// The search in one space.
#[derive(Clone, Debug)]
struct Space<const D: usize> {
    polytope: Polytope<D>,
    /// Facets that may be the nearest: their offsets, ordered as the bits of numbers from 0, and names.
    nearest: BinaryHeap<Reverse<(u64, u32)>>,
    before: Option<[u16; CORNERS]>,
    /// Unit vectors in which the last hulls reached least far, the last one first.
    weakest: Vec<[f64; D]>,
}

impl<const D: usize> Default for Space<D> {
    fn default() -> Self {
        Self { polytope: Polytope::default(), nearest: BinaryHeap::new(), before: None, weakest: Vec::new() }
    }
}

/// An offset's position in the order. Below 0 there is only rounding.
fn order<const D: usize>(facet: &Facet<D>) -> u64 {
    facet.offset.max(0.0).to_bits()
}

impl<const D: usize> Space<D> {
    /// The linear programme alone would not show the border case: two opposed contacts have the origin in the middle of
    /// a flat hull, and the other contacts decide whether it is inside.
    fn encloses(&mut self, set: &WrenchSet, level: SimdLevel) -> bool {
        let limits = EpsilonLimits { above: FLAT * set.scale(), ..EpsilonLimits::EXACT };
        self.search(set, level, &limits).upper > 0.0
    }

    fn search(&mut self, set: &WrenchSet, level: SimdLevel, limits: &EpsilonLimits) -> Epsilon {
        let flat = FLAT * set.scale();
        let mut upper = f64::INFINITY;
        // The hull reaches no farther than along any direction: where the last one was weakest this one may be, too.
        if !set.is_empty() {
            for (index, direction) in self.weakest.iter().enumerate() {
                let (_, height) = set.support(level, direction);
                upper = upper.min(height);
                if upper <= flat || upper < limits.below {
                    self.weakest[..=index].rotate_right(1);
                    let end = if upper <= flat { EpsilonEnd::Outside } else { EpsilonEnd::Below };
                    return Epsilon { upper: upper.max(0.0), end, ..Epsilon::OUTSIDE };
                }
            }
        }
        let simplex = match enclose::<D>(set, level, self.before.as_ref()) {
            Ok(simplex) => simplex,
            Err(apart) => {
                apart.into_iter().for_each(|direction| self.remember(&direction));
                return Epsilon::OUTSIDE;
            }
        };
        self.before = Some(simplex.corners);
        self.expand(set, level, limits, &simplex, upper)
    }

    /// The facet nearest to the origin is pushed out to its support point until it lies on the hull, or a limit is passed.
    fn expand(
        &mut self,
        set: &WrenchSet,
        level: SimdLevel,
        limits: &EpsilonLimits,
        simplex: &Simplex<D>,
        mut upper: f64,
    ) -> Epsilon {
        let (flat, closed) = (FLAT * set.scale(), limits.tolerance.max(CLOSED * set.scale()));
        // Start from the simplex around the origin, with its facets in a queue by distance.
        self.nearest.clear();
        self.polytope.start(simplex, set.len());
        self.nearest.extend(self.polytope.alive().map(|(name, facet)| Reverse((order(facet), name))));
        let (mut facets, mut weakest) = (D + 1, None);
        let end = loop {
            let Some(Reverse((bits, name))) = self.nearest.pop() else {
                // All facets are at the upper bound.
                break (EpsilonEnd::Closed, upper);
            };
            // Entries of facets that were removed or reused are skipped.
            let facet = self.polytope.facets[name as usize];
            if facet.offset.is_nan() || order(&facet) != bits {
                continue;
            }
            // The nearest facet bounds epsilon from below: test the lower limits.
            let lower = facet.offset.max(0.0);
            if lower >= upper - closed {
                break (EpsilonEnd::Closed, lower);
            }
            if lower > limits.above {
                break (EpsilonEnd::Above, lower);
            }
            // The support point along its normal bounds epsilon from above: test the upper limits.
            let (index, height) = set.support(level, &facet.normal);
            if height < upper {
                (upper, weakest) = (height, Some(facet.normal));
            }
            if upper <= flat {
                break (EpsilonEnd::Outside, 0.0);
            }
            if upper < limits.below {
                break (EpsilonEnd::Below, lower);
            }
            // The support point is on the facet: the facet belongs to the hull.
            if height - facet.offset <= closed {
                break (EpsilonEnd::Closed, lower);
            }
            if facets > MAX_FACETS {
                break (EpsilonEnd::Capped, lower);
            }
            let nearest = &mut self.nearest;
            // Facets farther away than the upper bound are never the nearest.
            facets += self.polytope.add(index, &set.point(index), name, |name, facet| {
                if facet.offset < upper {
                    nearest.push(Reverse((order(facet), name)));
                }
            });
        };
        // Directions that decided are tried first on the next set.
        weakest.into_iter().for_each(|direction| self.remember(&direction));
        match end {
            (EpsilonEnd::Outside, _) => Epsilon { facets, ..Epsilon::OUTSIDE },
            (end, lower) => Epsilon { lower, upper, facets, end },
        }
    }

    fn remember(&mut self, direction: &[f64; D]) {
        let length = libm::sqrt(direction.iter().map(|part| part * part).sum());
        if length > 0.0 {
            self.weakest.truncate(MAX_WEAKEST - 1);
            self.weakest.insert(0, direction.map(|part| part / length));
        }
    }
}
