//! One pose of any arm: descents from many starts, the first of them near the pose already.
//!
//! Nothing that is not found is proved, but for poses beyond the length of the arm.

use nalgebra::UnitQuaternion;

use super::collisions::{Collisions, Free, LastPair};
use kernel::{
    geom::{EndEffector, Pose, PoseLabel, Proof, World},
    seed::Stream,
};
use robot::{
    collision::CollisionVerdict,
    kinematics::{JointKind, MAX_JOINTS, PlanningGroup, SolverSettings, descend},
};

/// Configurations whose poses are known.
const KNOWN: usize = 1_000_000;
/// Side of the cells that they are found by [m].
const CELL: f32 = 0.1;
/// Length that a radian counts as when poses are compared [m].
const METRES_PER_RADIAN: f32 = 0.25;
/// Starts at every pose: near it, and anywhere.
const NEAR_STARTS: usize = 12;
const FAR_STARTS: usize = 20;
/// Where no descent ended nearer than this [m, rad together], no more are tried. Of some 60 poses of random arms whose first
/// solution came later than that, none had its best end farther than 0.064.
const HOPELESS: f64 = 0.15;
/// Starts near the best ends: how many ends, how often, and how far away [rad or m].
const ENDS: usize = 4;
const BESIDE_STARTS: usize = 24;
const BESIDE: f64 = 0.4;
/// More starts near the pose and anywhere.
const MORE_NEAR_STARTS: usize = 36;
const MORE_FAR_STARTS: usize = 40;
/// Starts anywhere, once solutions were found but all collide, or where a descent ended as near as this [m, rad together].
const LAST_STARTS: usize = 120;
const CLOSE: f64 = 0.05;
/// Steps of a descent: those that lead to the pose hardly ever take more.
const STEPS: u32 = 50;

/// An arm without a closed form, and what it may collide with.
pub(super) struct SearchedArm {
    group: PlanningGroup,
    collisions: Option<Collisions>,
    known: Vec<Known>,
    /// Joint values of the known configurations.
    values: Vec<f32>,
    /// Low corner, cells along each axis, and where the configurations of each cell begin in `known`.
    low: [f32; 3],
    counts: [usize; 3],
    begins: Vec<usize>,
    /// Starts of the descent for every pose.
    starts: Vec<Vec<f64>>,
    /// Offsets from an end of a descent to a start near it.
    beside: Vec<Vec<f64>>,
    /// From the first joint to the end effector, at most [m].
    length: f64,
}

/// A configuration and its pose, in single precision: a start needs no more.
struct Known {
    position: [f32; 3],
    /// A unit quaternion.
    rotation: [f32; 4],
    /// Where its joint values begin.
    q: u32,
}

impl SearchedArm {
    pub fn new(group: &PlanningGroup, collisions: Option<Collisions>, seed: u64) -> Self {
        let mut stream = Stream::of_job(seed, b"", "inverse kinematics");
        let mut any = || -> Vec<f64> {
            let range = |joint: &robot::kinematics::Joint| {
                joint.limits.map_or((-std::f64::consts::PI, std::f64::consts::PI), |limits| (limits.low, limits.high))
            };
            group.joints().iter().map(range).map(|(low, high)| stream.uniform(low, high)).collect()
        };
        // Starts anywhere: uniform within the joints' limits; one revolution for a joint without limits.
        let starts = (0..FAR_STARTS + MORE_FAR_STARTS + LAST_STARTS).map(|_| any()).collect();
        // Known configurations: joint values from the same stream, and the pose of the end effector at each.
        let mut values = Vec::with_capacity(KNOWN * group.len());
        let mut known: Vec<Known> = (0..KNOWN)
            .map(|_| {
                let q = any();
                let pose = group.forward(&q);
                let (position, rotation) = single(&pose);
                let begins = values.len() as u32;
                values.extend(q.iter().map(|value| *value as f32));
                Known { position, rotation, q: begins }
            })
            .collect();
        // Offsets from an end of a descent to a start near it, from a separate stream.
        let mut stream = Stream::of_job(seed, b"", "inverse kinematics, beside");
        let mut beside = || (0..group.len()).map(|_| stream.uniform(-BESIDE, BESIDE)).collect();
        let beside = (0..BESIDE_STARTS).map(|_| beside()).collect();
        // Bounds of the known positions, and the grid of cells over them.
        let low: [f32; 3] =
            std::array::from_fn(|axis| known.iter().map(|known| known.position[axis]).fold(f32::INFINITY, f32::min));
        let high: [f32; 3] = std::array::from_fn(|axis| {
            known.iter().map(|known| known.position[axis]).fold(f32::NEG_INFINITY, f32::max)
        });
        let counts = std::array::from_fn(|axis| ((high[axis] - low[axis]) / CELL) as usize + 1);
        let [_, ny, nz] = counts;
        let cell = |position: &[f32; 3]| {
            let at = |axis: usize| (((position[axis] - low[axis]) / CELL) as usize).min(counts[axis] - 1);
            (at(0) * ny + at(1)) * nz + at(2)
        };
        // Configurations sorted by cell; prefix sums over the counts give the first index of each cell.
        known.sort_by_cached_key(|known| cell(&known.position));
        let mut begins = vec![0; counts.iter().product::<usize>() + 1];
        known.iter().for_each(|known| begins[cell(&known.position) + 1] += 1);
        (1..begins.len()).for_each(|index| begins[index] += begins[index - 1]);
        let length = length(group);
        Self { group: group.clone(), collisions, known, values, low, counts, begins, starts, beside, length }
    }

    /// The label of a pose; the witness of a reachable one is appended. `contacts` decides what is free where it is there.
    pub fn solve(
        &self,
        target: &Pose<World, EndEffector>,
        last: &mut LastPair,
        mut contacts: Option<Free>,
        witness: &mut Vec<f64>,
    ) -> (PoseLabel, Proof) {
        let base = self.group.joints()[0].origin.translation.vector;
        if (target.translation() - base).norm() > self.length {
            return (PoseLabel::NoSolution, Proof::Bound);
        }
        let mut search =
            Search { arm: self, target, near: self.near(target), index: 0, ends: Vec::new(), found: false };
        if self.collisions.as_ref().is_some_and(|collisions| collisions.hand_collides(target)) {
            // Only the existence of a solution matters: none is free.
            return match search.next() {
                Some(_) => (PoseLabel::Colliding, Proof::Swept),
                None => (PoseLabel::NoSolution, Proof::Searched),
            };
        }
        let free = search.find(|q| {
            let q = &q[..self.group.len()];
            match (&mut contacts, &self.collisions) {
                (Some(free), _) => free(q),
                (None, Some(collisions)) => collisions.check(&collisions.links(q), last) == CollisionVerdict::Free,
                (None, None) => true,
            }
        });
        match free {
            Some(q) => {
                witness.extend(&q[..self.group.len()]);
                (PoseLabel::Reachable, Proof::Witness)
            }
            None if search.found => (PoseLabel::Colliding, Proof::Searched),
            None => (PoseLabel::NoSolution, Proof::Searched),
        }
    }

    /// Known configurations whose poses are nearest, nearest first: where their joint values begin.
    fn near(&self, target: &Pose<World, EndEffector>) -> Vec<u32> {
        const COUNT: usize = NEAR_STARTS + MORE_NEAR_STARTS;
        let (position, rotation) = single(target);
        // Range of the target's cell and its neighbours along an axis, clamped to the grid.
        let range = |axis: usize| {
            let at = ((position[axis] - self.low[axis]) / CELL).floor();
            let last = self.counts[axis] as f32 - 1.0;
            (at - 1.0).clamp(0.0, last) as usize..=(at + 1.0).clamp(0.0, last) as usize
        };
        let mut best: Vec<(f32, u32)> = Vec::with_capacity(COUNT + 1);
        for x in range(0) {
            for y in range(1) {
                let row = (x * self.counts[1] + y) * self.counts[2];
                let cells = range(2);
                // Cells of a row follow each other in memory: one slice for the whole range along z.
                for known in &self.known[self.begins[row + cells.start()]..self.begins[row + cells.end() + 1]] {
                    let offset = [0, 1, 2].map(|axis| known.position[axis] - position[axis]);
                    let apart = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
                    // Twice the sine of half the angle between the rotations, squared.
                    let [a, b] = [&known.rotation, &rotation];
                    let cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
                    let angle_squared = 4.0 * (1.0 - cosine * cosine);
                    // Weighted squared distance of poses; the nearest ones are kept sorted by insertion.
                    let apart = apart + METRES_PER_RADIAN * METRES_PER_RADIAN * angle_squared;
                    if best.len() < COUNT || apart < best[COUNT - 1].0 {
                        let index = best.partition_point(|(other, _)| *other <= apart);
                        best.insert(index, (apart, known.q));
                        best.truncate(COUNT);
                    }
                }
            }
        }
        best.into_iter().map(|(_, q)| q).collect()
    }
}

/// A pose's position [m] and unit quaternion in single precision.
fn single(pose: &Pose<World, EndEffector>) -> ([f32; 3], [f32; 4]) {
    let rotation = UnitQuaternion::from_rotation_matrix(pose.rotation()).coords;
    ((*pose.translation()).map(|value| value as f32).into(), rotation.map(|value| value as f32).into())
}

/// The solutions of one pose, one descent after the other. The number of descents depends on the previous ones: it is
/// small where no descent ended near the pose.
struct Search<'a> {
    arm: &'a SearchedArm,
    target: &'a Pose<World, EndEffector>,
    near: Vec<u32>,
    /// Starts tried.
    index: usize,
    /// The best ends [m, rad together] that are no solutions, best first.
    ends: Vec<(f64, [f64; MAX_JOINTS])>,
    found: bool,
}

impl Search<'_> {
    /// The start of that index; `None` when enough were tried.
    fn start(&self, index: usize) -> Option<[f64; MAX_JOINTS]> {
        let arm = self.arm;
        let (near, more_near) = self.near.split_at(NEAR_STARTS.min(self.near.len()));
        let (far, more_far) = arm.starts.split_at(FAR_STARTS);
        let mut start = [0.0; MAX_JOINTS];
        let mut index = index;
        let mut known = |begins_of: &[u32], index: usize| {
            let begins = begins_of[index] as usize;
            let values = &arm.values[begins..begins + arm.group.len()];
            start.iter_mut().zip(values).for_each(|(to, from)| *to = f64::from(*from));
            Some(start)
        };
        // Each stage takes its places off.
        if index < near.len() {
            return known(near, index);
        }
        index -= near.len();
        if index < FAR_STARTS {
            return Some(padded(&far[index]));
        }
        index -= FAR_STARTS;
        let off = if self.found { 0.0 } else { self.ends.first().map_or(f64::INFINITY, |(off, _)| *off) };
        if off > HOPELESS {
            return None;
        }
        if index < more_near.len() {
            return known(more_near, index);
        }
        index -= more_near.len();
        if index < BESIDE_STARTS && !self.ends.is_empty() {
            let (_, end) = &self.ends[index % self.ends.len()];
            let beside = padded(&arm.beside[index]);
            return Some(std::array::from_fn(|joint| end[joint] + beside[joint]));
        }
        index = index.saturating_sub(BESIDE_STARTS);
        if index >= MORE_FAR_STARTS && off > CLOSE {
            return None;
        }
        more_far.get(index).map(|values| padded(values))
    }
}

impl Iterator for Search<'_> {
    type Item = [f64; MAX_JOINTS];

    fn next(&mut self) -> Option<Self::Item> {
        let settings = SolverSettings { steps: STEPS, ..SolverSettings::default() };
        loop {
            let start = self.start(self.index)?;
            self.index += 1;
            let end = descend(&self.arm.group, self.target, &start[..self.arm.group.len()], &settings);
            if end.solved {
                self.found = true;
                return Some(end.q);
            }
            let off = end.position + end.orientation;
            let index = self.ends.partition_point(|(other, _)| *other <= off);
            if index < ENDS {
                self.ends.insert(index, (off, end.q));
                self.ends.truncate(ENDS);
            }
        }
    }
}

fn padded(values: &[f64]) -> [f64; MAX_JOINTS] {
    std::array::from_fn(|joint| values.get(joint).copied().unwrap_or(0.0))
}

/// From the first joint's origin to the end effector, at most [m]: all links in one line.
fn length(group: &PlanningGroup) -> f64 {
    let links = group.joints().iter().enumerate().map(|(index, joint)| {
        let link = if index == 0 { 0.0 } else { joint.origin.translation.vector.norm() };
        let slide = match (joint.kind, joint.limits) {
            (JointKind::Prismatic, Some(limits)) => limits.low.abs().max(limits.high.abs()),
            _ => 0.0,
        };
        link + slide
    });
    links.sum::<f64>() + group.end_effector().translation.vector.norm() + 1e-9
}
