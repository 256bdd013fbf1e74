//! One pose of any arm: descents from many starts, the first of them near the pose already.
//!
//! Nothing that is not found is proved, but for poses beyond the length of the arm.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::collisions::{Collisions, LastPair};
use crate::{
    collision::Verdict,
    geom::{EndEffector, Pose, PoseLabel, Proof, World},
    kinematics::{JointKind, PlanningGroup, SolverSettings, solve_numeric},
    seed::Stream,
};

/// Configurations whose poses are known.
const KNOWN: usize = 200_000;
/// Side of the cells that they are found by [m].
const CELL: f64 = 0.15;
/// What a radian counts when poses are compared [m].
const METRES_PER_RADIAN: f64 = 0.25;
/// Starts near the pose, and starts anywhere.
const NEAR_STARTS: usize = 12;
const FAR_STARTS: usize = 40;
/// Starts anywhere, once ways were found but all collide.
const FREE_STARTS: usize = 120;

/// An arm without a closed form, and what it may collide with.
pub(super) struct SearchedArm {
    group: PlanningGroup,
    collisions: Option<Collisions>,
    known: Vec<Known>,
    /// Low corner, cells along each axis, and where the configurations of each cell begin in `known`.
    low: Point3<f64>,
    counts: [usize; 3],
    begins: Vec<usize>,
    /// The same starts for every pose.
    starts: Vec<Vec<f64>>,
    /// From the first joint to the end effector, at most [m].
    length: f64,
}

/// A configuration and its pose.
struct Known {
    position: Point3<f64>,
    rotation: UnitQuaternion<f64>,
    q: Vec<f64>,
}

impl SearchedArm {
    pub fn new(group: &PlanningGroup, collisions: Option<Collisions>, seed: u64) -> Self {
        let mut stream = Stream::of_job(seed, b"", "inverse kinematics");
        let mut any = || -> Vec<f64> {
            let range = |joint: &crate::kinematics::Joint| {
                joint.limits.map_or((-std::f64::consts::PI, std::f64::consts::PI), |limits| (limits.low, limits.high))
            };
            group.joints().iter().map(range).map(|(low, high)| stream.uniform(low, high)).collect()
        };
        let starts = (0..FAR_STARTS + FREE_STARTS).map(|_| any()).collect();
        let mut known: Vec<Known> = (0..KNOWN)
            .map(|_| {
                let q = any();
                let pose = group.forward(&q);
                let rotation = UnitQuaternion::from_rotation_matrix(pose.rotation());
                Known { position: Point3::from(*pose.translation()), rotation, q }
            })
            .collect();
        let low = known.iter().fold(Point3::from([f64::INFINITY; 3]), |low, known| low.inf(&known.position));
        let high = known.iter().fold(Point3::from([f64::NEG_INFINITY; 3]), |high, known| high.sup(&known.position));
        let counts = std::array::from_fn(|axis| ((high[axis] - low[axis]) / CELL) as usize + 1);
        let [_, ny, nz] = counts;
        let cell = |position: &Point3<f64>| {
            let at = |axis: usize| (((position[axis] - low[axis]) / CELL) as usize).min(counts[axis] - 1);
            (at(0) * ny + at(1)) * nz + at(2)
        };
        known.sort_by_key(|known| cell(&known.position));
        let mut begins = vec![0; counts.iter().product::<usize>() + 1];
        known.iter().for_each(|known| begins[cell(&known.position) + 1] += 1);
        (1..begins.len()).for_each(|place| begins[place] += begins[place - 1]);
        Self { length: length(group), group: group.clone(), collisions, known, low, counts, begins, starts }
    }

    /// The label of a pose; the witness of a reachable one is appended.
    pub fn solve(
        &self,
        target: &Pose<World, EndEffector>,
        last: &mut LastPair,
        witness: &mut Vec<f64>,
    ) -> (PoseLabel, Proof) {
        let base = self.group.joints()[0].origin.translation.vector;
        if (target.translation() - base).norm() > self.length {
            return (PoseLabel::NoSolution, Proof::Bound);
        }
        if self.collisions.as_ref().is_some_and(|collisions| collisions.hand_collides(target)) {
            // Whether there is a way at all is asked of fewer starts: none is free.
            let found =
                self.near(target).into_iter().chain(self.far()).any(|start| self.descend(target, start).is_some());
            return if found { (PoseLabel::Colliding, Proof::Swept) } else { (PoseLabel::NoSolution, Proof::Searched) };
        }
        let mut found = false;
        let more = self.starts[FAR_STARTS..].iter().map(Vec::as_slice);
        for (place, start) in self.near(target).into_iter().chain(self.far()).chain(more).enumerate() {
            if place >= NEAR_STARTS + FAR_STARTS && !found {
                break;
            }
            let Some(q) = self.descend(target, start) else { continue };
            found = true;
            let free = self
                .collisions
                .as_ref()
                .is_none_or(|collisions| collisions.check(&collisions.links(&q), last) == Verdict::Free);
            if free {
                witness.extend(q);
                return (PoseLabel::Reachable, Proof::Witness);
            }
        }
        (if found { PoseLabel::Colliding } else { PoseLabel::NoSolution }, Proof::Searched)
    }

    fn descend(&self, target: &Pose<World, EndEffector>, start: &[f64]) -> Option<Vec<f64>> {
        solve_numeric(&self.group, target, start, &SolverSettings::default()).map(|solution| solution.q)
    }

    fn far(&self) -> impl Iterator<Item = &[f64]> {
        self.starts[..FAR_STARTS].iter().map(Vec::as_slice)
    }

    /// Known configurations whose poses are nearest, nearest first.
    fn near(&self, target: &Pose<World, EndEffector>) -> Vec<&[f64]> {
        let position = Point3::from(*target.translation());
        let rotation = UnitQuaternion::from_rotation_matrix(target.rotation());
        let range = |axis: usize| {
            let at = ((position[axis] - self.low[axis]) / CELL).floor();
            let last = self.counts[axis] as f64 - 1.0;
            (at - 1.0).clamp(0.0, last) as usize..=(at + 1.0).clamp(0.0, last) as usize
        };
        let mut best: Vec<(f64, &Known)> = Vec::with_capacity(NEAR_STARTS + 1);
        for x in range(0) {
            for y in range(1) {
                for z in range(2) {
                    let cell = (x * self.counts[1] + y) * self.counts[2] + z;
                    for known in &self.known[self.begins[cell]..self.begins[cell + 1]] {
                        let way: Vector3<f64> = known.position - position;
                        // Twice the sine of half the angle between the rotations, squared.
                        let cosine = known.rotation.coords.dot(&rotation.coords).abs().min(1.0);
                        let turn = 4.0 * (1.0 - cosine * cosine);
                        let apart = way.norm_squared() + METRES_PER_RADIAN * METRES_PER_RADIAN * turn;
                        if best.len() < NEAR_STARTS || apart < best[NEAR_STARTS - 1].0 {
                            let place = best.partition_point(|(other, _)| *other <= apart);
                            best.insert(place, (apart, known));
                            best.truncate(NEAR_STARTS);
                        }
                    }
                }
            }
        }
        best.into_iter().map(|(_, known)| known.q.as_slice()).collect()
    }
}

/// From the first joint's origin to the end effector, at most [m]: all links in one line.
fn length(group: &PlanningGroup) -> f64 {
    let links = group.joints().iter().enumerate().map(|(place, joint)| {
        let link = if place == 0 { 0.0 } else { joint.origin.translation.vector.norm() };
        let slide = match (joint.kind, joint.limits) {
            (JointKind::Prismatic, Some(limits)) => limits.low.abs().max(limits.high.abs()),
            _ => 0.0,
        };
        link + slide
    });
    links.sum::<f64>() + group.end_effector().translation.vector.norm() + 1e-9
}
