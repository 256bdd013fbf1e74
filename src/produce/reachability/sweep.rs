//! One pose of an arm that keeps a joint free: is there a way to it without a collision?
//!
//! The ways to a pose form curves over the first joint, one a branch of the closed form. Each is cut at its middle: a
//! configuration there that collides by some depth rules out all of the curve around it on which the two bodies cannot
//! have come apart, since neither has moved far enough; the rest is cut again. A configuration that does not collide ends
//! the search.

use std::{cmp::Ordering, collections::BinaryHeap};

use nalgebra::IsometryMatrix3;

use crate::{
    collision::{Bodies, CollisionChecker, Verdict},
    geom::{EndEffector, Pose, PoseLabel, Proof, World},
    kinematics::{BRANCHES, Extents, PlanningGroup, SelfMotion, Wrist},
};

/// Pieces of a curve that are shorter are not cut again [rad]: nothing is proved of them.
const SHORTEST: f64 = 1e-3;
/// In pieces shorter than this the deepest pair is looked for, in longer ones the first is good enough [rad].
const SHALLOW: f64 = 0.05;
/// Configurations that are looked at for one pose, at most; what is left by then is not proved.
const MOST_CHECKS: usize = 5_000;

/// An arm of seven joints with its free joint, and what it may collide with.
pub(super) struct Arm {
    motion: SelfMotion,
    collisions: Option<Collisions>,
}

struct Collisions {
    checker: CollisionChecker,
    /// Of each body.
    extents: Vec<Extents>,
    /// Pairs of the hand with what stands still: the pose decides them.
    of_the_hand: Vec<usize>,
    /// All other pairs.
    of_the_arm: Vec<usize>,
}

/// What one thread works in.
#[derive(Debug, Default)]
pub(super) struct SweepScratch {
    pieces: BinaryHeap<Piece>,
    /// The pair that collided last.
    last: Option<usize>,
}

/// What was found of a pose.
pub(super) struct Found {
    pub label: PoseLabel,
    pub proof: Proof,
    pub witness: Option<[f64; 7]>,
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

impl Arm {
    pub fn new(motion: SelfMotion, checker: Option<CollisionChecker>) -> Self {
        let last = motion.arm().group().len();
        let collisions = checker.map(|checker| {
            let (of_the_hand, of_the_arm) = checker
                .pairs()
                .enumerate()
                .map(|(pair, links)| (pair, links == [0, last] || links == [last, 0]))
                .partition::<Vec<_>, _>(|(_, of_the_hand)| *of_the_hand);
            let places = |pairs: Vec<(usize, bool)>| pairs.into_iter().map(|(pair, _)| pair).collect();
            let extents = checker.links().enumerate().map(|(body, link)| motion.extents(link, checker.corners(body)));
            Collisions {
                extents: extents.collect(),
                of_the_hand: places(of_the_hand),
                of_the_arm: places(of_the_arm),
                checker,
            }
        });
        Self { motion, collisions }
    }

    pub fn motion(&self) -> &SelfMotion {
        &self.motion
    }

    pub fn joints(&self) -> usize {
        self.motion.arm().group().len()
    }

    /// The two bodies that touch with every joint at 0, or at the limit nearest to it.
    pub fn collision_at_rest(&self, bodies: Option<&Bodies>) -> Option<String> {
        let (collisions, bodies) = (self.collisions.as_ref()?, bodies?);
        let group = self.motion.arm().group();
        let rest = std::array::from_fn(|joint| {
            group.joints()[joint].limits.map_or(0.0, |limits| 0f64.clamp(limits.low, limits.high))
        });
        let pairs = 0..collisions.checker.pairs().count();
        match collisions.checker.check(pairs, &links_at(group, &rest)) {
            Verdict::Free => None,
            Verdict::Collides { pair, .. } => {
                let [a, b] = collisions.checker.bodies_of(pair).map(|body| &bodies.bodies[body].name);
                Some(format!("`{a}` and `{b}`"))
            }
        }
    }

    /// Looks for a way to a pose that has one with the first joint at `first`; `ends` is scratch.
    pub fn solve(
        &self,
        target: &Pose<World, EndEffector>,
        wrist: &Wrist,
        first: f64,
        ends: &mut Vec<f64>,
        scratch: &mut SweepScratch,
    ) -> Found {
        let arm = self.motion.arm();
        let reachable = |q| Found { label: PoseLabel::Reachable, proof: Proof::Witness, witness: Some(q) };
        let colliding = |proof| Found { label: PoseLabel::Colliding, proof, witness: None };
        let Some(collisions) = &self.collisions else {
            let way = arm.branches(target, first).into_iter().flatten().next();
            return way
                .map_or(Found { label: PoseLabel::NoSolution, proof: Proof::Searched, witness: None }, reachable);
        };
        let mut links = [IsometryMatrix3::identity(); 8];
        links[7] = target.isometry() * arm.group().end_effector().inverse();
        if collisions.checker.check(collisions.of_the_hand.iter().copied(), &links) != Verdict::Free {
            return colliding(Proof::Swept);
        }
        for q in arm.branches(target, first).into_iter().flatten() {
            if collisions.check(&links_at(arm.group(), &q), scratch) == Verdict::Free {
                return reachable(q);
            }
        }
        self.motion.end_points(wrist, ends);
        scratch.pieces.clear();
        for pair in ends.windows(2).filter(|pair| pair[1] > pair[0]) {
            let middle = arm.branches(target, 0.5 * (pair[0] + pair[1]));
            let open = (0..BRANCHES).filter(|branch| middle[*branch].is_some());
            scratch.pieces.extend(open.map(|branch| Piece { low: pair[0], high: pair[1], branch }));
        }
        if scratch.pieces.is_empty() && arm.branches(target, first) == [None; BRANCHES] {
            // A single value of the first joint, lost to rounding.
            return Found { label: PoseLabel::NoSolution, proof: Proof::IntervalEnds, witness: None };
        }
        let (mut checks, mut proved) = (0, true);
        while let Some(piece) = scratch.pieces.pop() {
            let Piece { low, high, branch } = piece;
            checks += 1;
            if checks > MOST_CHECKS {
                return colliding(Proof::Searched);
            }
            let middle = 0.5 * (low + high);
            let Some(q) = arm.branch(target, middle, branch) else {
                proved &= high - low < SHORTEST;
                continue;
            };
            let links = links_at(arm.group(), &q);
            let Verdict::Collides { pair, depth } = collisions.check(&links, scratch) else { return reachable(q) };
            let mut half = self.ruled_out(wrist, &q, [low, high], pair, depth, collisions);
            let whole = 0.5 * (high - low);
            if half < whole && high - low < SHALLOW {
                // Perhaps another pair overlaps by more.
                for (pair, depth) in collisions.overlaps(&links, pair) {
                    half = half.max(self.ruled_out(wrist, &q, [low, high], pair, depth, collisions));
                    if half >= whole {
                        break;
                    }
                }
            }
            if half >= whole {
                continue;
            }
            if high - low < SHORTEST {
                proved = false;
                continue;
            }
            scratch.pieces.push(Piece { low, high: middle - half, branch });
            scratch.pieces.push(Piece { low: middle + half, high, branch });
        }
        colliding(if proved { Proof::Swept } else { Proof::Searched })
    }

    /// How far from `q` to both sides the two bodies of a pair, which overlap by `depth`, still do [rad].
    fn ruled_out(
        &self,
        wrist: &Wrist,
        q: &[f64; 7],
        [low, high]: [f64; 2],
        pair: usize,
        depth: f64,
        collisions: &Collisions,
    ) -> f64 {
        if depth <= 0.0 {
            return 0.0;
        }
        let bodies = collisions.checker.bodies_of(pair).map(|body| &collisions.extents[body]);
        let holds = |half: f64| {
            let range = [(q[0] - half).max(low), (q[0] + half).min(high)];
            let travel = self.motion.travel(wrist, q, range);
            bodies.iter().map(|body| travel.of(body)).sum::<f64>() < depth
        };
        let whole = 0.5 * (high - low);
        let mut half = whole;
        // The bound is tried at halves only: a little more may hold.
        while !holds(half) {
            half *= 0.5;
            if half < 0.01 * SHORTEST {
                return 0.0;
            }
        }
        if half < whole && holds(1.5 * half) { 1.5 * half } else { half }
    }
}

impl Collisions {
    /// The arm's own pairs; that which collided last comes first.
    fn check(&self, links: &[IsometryMatrix3<f64>; 8], scratch: &mut SweepScratch) -> Verdict {
        let first = scratch.last;
        let others = self.of_the_arm.iter().copied().filter(|pair| Some(*pair) != first);
        let verdict = self.checker.check(first.into_iter().chain(others), links);
        if let Verdict::Collides { pair, .. } = verdict {
            scratch.last = Some(pair);
        }
        verdict
    }

    /// All pairs but one that overlap, and by how much [m].
    fn overlaps(&self, links: &[IsometryMatrix3<f64>; 8], but: usize) -> impl Iterator<Item = (usize, f64)> {
        self.of_the_arm.iter().copied().filter(move |pair| *pair != but).filter_map(|pair| {
            match self.checker.check([pair], links) {
                Verdict::Collides { depth, .. } if depth > 0.0 => Some((pair, depth)),
                _ => None,
            }
        })
    }
}

/// The frames of the links, the world's first.
fn links_at(group: &PlanningGroup, q: &[f64; 7]) -> [IsometryMatrix3<f64>; 8] {
    let mut links = [IsometryMatrix3::identity(); 8];
    group.link_frames(q, &mut links[1..]);
    links
}
