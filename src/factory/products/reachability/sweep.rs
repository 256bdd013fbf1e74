//! One pose of an arm that keeps a joint free: does it have a solution without collision?
//!
//! The solutions of a pose form curves over the first joint, one per branch of the closed form. Each is cut at its middle: a
//! configuration there that collides by some depth rules out all of the curve around it on which the two bodies cannot
//! have come apart, since neither has moved far enough; the rest is cut again. A configuration that does not collide ends
//! the search.

use std::{cmp::Ordering, collections::BinaryHeap};

use super::collisions::{Collisions, Free, LastPair};
use kernel::geom::{EndEffector, Pose, PoseLabel, Proof, World};
use robot::{
    collision::{Care, CollisionChecker, CollisionVerdict, Hit, LinkFrames},
    kinematics::{BRANCHES, Extents, SelfMotion, Stance, Wrist},
};

/// Pieces of a curve that are shorter are not cut again [rad]: nothing is proved of them.
const SHORTEST: f64 = 1e-3;
/// In pieces shorter than this the deepest pair is searched, in longer ones the first is good enough [rad].
const SHALLOW: f64 = 0.05;
/// Number of vain careful searches for a depth before they are left off for the pose.
const PATIENCE: u32 = 32;
/// Smallest interval to both sides that counts as ruled out [rad].
const NOTHING: f64 = 1e-5;
/// Configurations that are evaluated for one pose, at most; what is left by then is not proved.
const MAX_CHECKS: usize = 1_200;

/// Largest distance in the first joint between configurations that MuJoCo checks [rad].
const STEP: f64 = 0.02;

/// An arm of seven joints with its free joint, and what it may collide with.
pub(super) struct RedundantArm {
    motion: SelfMotion,
    collisions: Option<Collisions>,
    /// Extents of each body.
    extents: Vec<Extents>,
}

/// Working memory of one thread.
#[derive(Debug, Default)]
pub(super) struct SweepScratch {
    pieces: BinaryHeap<Piece>,
    pub ends: Vec<f64>,
}

/// Hopes that are left for one pose.
struct Hope {
    /// Whether all of it can be ruled out: not where two surfaces only touch and no other pair overlaps. Then nothing
    /// around is ever proved, and all that is left is to search for a solution.
    provable: bool,
    /// Number of careful searches that may still find nothing.
    patience: u32,
}

/// A configuration that collides, in the middle of a piece.
struct Middle<'a> {
    arm: &'a RedundantArm,
    checker: &'a CollisionChecker,
    links: &'a LinkFrames,
    stance: Stance<'a>,
    piece: Piece,
}

/// A piece of one branch's curve, in values of the first joint [rad]. The widest comes first.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    low: f64,
    high: f64,
    branch: usize,
}

impl Eq for Piece {}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Piece {
    fn cmp(&self, other: &Self) -> Ordering {
        let width = |piece: &Self| piece.high - piece.low;
        width(self)
            .total_cmp(&width(other))
            .then_with(|| other.branch.cmp(&self.branch))
            .then_with(|| other.low.total_cmp(&self.low))
    }
}

impl RedundantArm {
    pub fn new(motion: SelfMotion, collisions: Option<Collisions>) -> Self {
        let extents = collisions.iter().flat_map(|collisions| {
            let checker = collisions.checker();
            checker.links().enumerate().map(|(body, link)| motion.extents(link, checker.corners(body)))
        });
        Self { extents: extents.collect(), motion, collisions }
    }

    pub fn motion(&self) -> &SelfMotion {
        &self.motion
    }

    /// Searches for a solution of a pose that has one with the first joint at `first`; `ends` is scratch.
    pub fn solve(
        &self,
        target: &Pose<World, EndEffector>,
        wrist: &Wrist,
        first: f64,
        last: &mut LastPair,
        scratch: &mut SweepScratch,
        witness: &mut Vec<f64>,
    ) -> (PoseLabel, Proof) {
        let arm = self.motion.arm();
        let mut reachable = |q: [f64; 7]| {
            witness.extend(q);
            (PoseLabel::Reachable, Proof::Witness)
        };
        let Some(collisions) = &self.collisions else {
            let solution = arm.find_branch(target, first, Some);
            return solution.map_or((PoseLabel::NoSolution, Proof::Searched), reachable);
        };
        if collisions.hand_collides(target) {
            return (PoseLabel::Colliding, Proof::Swept);
        }
        let mut free =
            |q: [f64; 7]| (collisions.check(&collisions.links(&q), last) == CollisionVerdict::Free).then_some(q);
        if let Some(q) = arm.find_branch(target, first, &mut free) {
            return reachable(q);
        }
        let SweepScratch { pieces, ends } = scratch;
        self.motion.end_points(wrist, ends);
        pieces.clear();
        for pair in ends.windows(2).filter(|pair| pair[1] > pair[0]) {
            let middle = arm.branches(target, 0.5 * (pair[0] + pair[1]));
            let open = (0..BRANCHES).filter(|branch| middle[*branch].is_some());
            pieces.extend(open.map(|branch| Piece { low: pair[0], high: pair[1], branch }));
        }
        if pieces.is_empty() && arm.find_branch(target, first, Some).is_none() {
            // A single value of the first joint, lost to rounding.
            return (PoseLabel::NoSolution, Proof::IntervalEnds);
        }
        let (mut checks, mut proved, mut hope) = (0, true, Hope { provable: true, patience: PATIENCE });
        while let Some(piece) = pieces.pop() {
            let Piece { low, high, branch } = piece;
            checks += 1;
            if checks > MAX_CHECKS {
                return (PoseLabel::Colliding, Proof::Searched);
            }
            let Some(q) = arm.branch(target, piece.middle(), branch) else {
                proved &= high - low < SHORTEST;
                continue;
            };
            let links = collisions.links(&q);
            let CollisionVerdict::Collides(hit) = collisions.check(&links, last) else { return reachable(q) };
            let stance = self.motion.stance(wrist, &q);
            let middle = Middle { arm: self, checker: collisions.checker(), links: &links, stance, piece };
            let half = middle.ruled_out_by_any(&hit, collisions, &mut hope);
            if half >= piece.half() {
                continue;
            }
            if high - low < SHORTEST {
                proved = false;
                continue;
            }
            pieces.push(Piece { low, high: piece.middle() - half, branch });
            pieces.push(Piece { low: piece.middle() + half, high, branch });
        }
        (PoseLabel::Colliding, if proved { Proof::Swept } else { Proof::Searched })
    }

    /// [`RedundantArm::solve`] by a verdict without depth: nothing is proved between the configurations that are
    /// evaluated, one every [`STEP`] of the first joint on every branch, and at least one in each of its intervals.
    pub fn solve_in_steps(
        &self,
        target: &Pose<World, EndEffector>,
        wrist: &Wrist,
        first: f64,
        free: Free,
        ends: &mut Vec<f64>,
        witness: &mut Vec<f64>,
    ) -> (PoseLabel, Proof) {
        self.motion.end_points(wrist, ends);
        let steps = ends.windows(2).flat_map(|pair| {
            let [low, wide] = [pair[0], pair[1] - pair[0]];
            let count = libm::ceil(wide / STEP) as usize;
            (0..count).map(move |index| low + wide * (index as f64 + 0.5) / count as f64)
        });
        let mut found = false;
        for value in [first].into_iter().chain(steps) {
            for q in self.motion.arm().branches(target, value).into_iter().flatten() {
                found = true;
                if free(&q) {
                    witness.extend(q);
                    return (PoseLabel::Reachable, Proof::Witness);
                }
            }
        }
        // Without a solution: a single value of the first joint, lost to rounding.
        if found { (PoseLabel::Colliding, Proof::Searched) } else { (PoseLabel::NoSolution, Proof::IntervalEnds) }
    }
}

impl Piece {
    fn middle(&self) -> f64 {
        0.5 * (self.low + self.high)
    }

    fn half(&self) -> f64 {
        0.5 * (self.high - self.low)
    }
}

impl Middle<'_> {
    /// Interval from the middle to both sides in which everything is ruled out [rad]: by the pair that was found, and
    /// in short pieces by whichever pair rules out most.
    fn ruled_out_by_any(&self, hit: &Hit, collisions: &Collisions, hope: &mut Hope) -> f64 {
        let whole = self.piece.half();
        let mut half = self.ruled_out(hit, Care::Short);
        if !hope.provable || 2.0 * whole >= SHALLOW {
            return half;
        }
        let mut others = collisions.others(self.links, hit.pair);
        while half < whole
            && let Some(other) = others.next()
        {
            half = half.max(self.ruled_out(&other, Care::Short));
        }
        if half < whole && hope.patience > 0 {
            let longer = self.ruled_out(hit, Care::Long);
            // Where two surfaces only graze each other care finds nothing, again and again.
            hope.patience -= u32::from(longer <= half);
            half = half.max(longer);
            hope.provable = half > 0.0;
        }
        half
    }

    /// Interval from the middle to both sides in which a pair that touches in the middle still does [rad]; all of the
    /// piece's half is enough.
    fn ruled_out(&self, hit: &Hit, care: Care) -> f64 {
        let whole = self.piece.half();
        let all = self.travel(hit, whole);
        let depth = self.checker.depth(hit, self.links, care, all);
        if all < depth {
            return whole;
        }
        // The bound is tried at halves only: a little more may hold.
        let mut half = if depth > 0.0 { 0.5 * whole } else { 0.0 };
        while half >= NOTHING {
            if self.travel(hit, half) < depth {
                let more = 1.5 * half;
                return if self.travel(hit, more) < depth { more } else { half };
            }
            half *= 0.5;
        }
        0.0
    }

    /// Bound on the joint travel of the bodies of a pair, up to `half` from the middle to both sides [m].
    fn travel(&self, hit: &Hit, half: f64) -> f64 {
        let (Piece { low, high, .. }, middle) = (self.piece, self.piece.middle());
        let travel = self.stance.travel([(middle - half).max(low), (middle + half).min(high)]);
        self.checker.bodies_of(hit.pair).map(|body| travel.bound_for(&self.arm.extents[body])).iter().sum()
    }
}
