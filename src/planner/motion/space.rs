//! Joint values of an arm as points of a space: differences round the circle, lengths, straight edges.

use std::f64::consts::{PI, TAU};

use kernel::seed::Stream;
use robot::kinematics::{JointKind, PlanningGroup};

/// Radians that count as much as a metre of a sliding joint.
pub const RADIANS_PER_METRE: f64 = 4.0;

/// Joint values [rad or m] with a length: the root of the sum of squares over all joints, a metre counting as
/// [`RADIANS_PER_METRE`]. Joints without limits are measured round the circle.
#[derive(Clone, Debug, PartialEq)]
pub struct JointSpace {
    /// Lowest and highest value of each joint, and whether the two are the same: of a joint that rotates without limits.
    ranges: Vec<(f64, f64, bool)>,
    /// Radians that a unit of each joint counts as.
    weights: Vec<f64>,
}

impl JointSpace {
    /// The joints of a group.
    pub fn new(group: &PlanningGroup) -> Self {
        let range = |joint: &robot::kinematics::Joint| {
            let round = joint.kind == JointKind::Revolute;
            joint.limits.map_or((-PI, PI, round), |limits| (limits.low, limits.high, false))
        };
        let weight = |joint: &robot::kinematics::Joint| match joint.kind {
            JointKind::Revolute => 1.0,
            JointKind::Prismatic => RADIANS_PER_METRE,
        };
        Self {
            ranges: group.joints().iter().map(range).collect(),
            weights: group.joints().iter().map(weight).collect(),
        }
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.ranges.len()
    }

    /// Shortest way from one configuration to another, by joint [rad or m].
    pub fn difference(&self, from: &[f64], to: &[f64]) -> Vec<f64> {
        let joint = |index: usize| self.joint_difference(index, from[index], to[index]);
        (0..self.joints()).map(joint).collect()
    }

    #[inline]
    fn joint_difference(&self, joint: usize, from: f64, to: f64) -> f64 {
        let difference = to - from;
        if self.ranges[joint].2 { difference - TAU * (difference / TAU).round() } else { difference }
    }

    /// Largest motion of a joint on the shortest way between two configurations [rad or m].
    pub fn largest_step(&self, from: &[f64], to: &[f64]) -> f64 {
        (0..self.joints()).map(|joint| self.joint_difference(joint, from[joint], to[joint]).abs()).fold(0.0, f64::max)
    }

    /// Length of a difference [rad].
    pub fn length(&self, difference: &[f64]) -> f64 {
        let squared = difference.iter().zip(&self.weights).map(|(value, weight)| (value * weight) * (value * weight));
        squared.sum::<f64>().sqrt()
    }

    /// Squared length of the shortest way between two configurations [rad^2]; `limit` once it is known to exceed that.
    pub fn squared_distance(&self, from: &[f64], to: &[f64], limit: f64) -> f64 {
        let mut sum = 0.0;
        for joint in 0..self.joints() {
            let value = self.weights[joint] * self.joint_difference(joint, from[joint], to[joint]);
            sum += value * value;
            if sum >= limit {
                return limit;
            }
        }
        sum
    }

    /// The configuration at a share of the way along a difference.
    pub fn along(&self, from: &[f64], difference: &[f64], share: f64) -> Vec<f64> {
        from.iter().zip(difference).map(|(value, step)| value + step * share).collect()
    }

    /// A configuration drawn uniformly within the limits, within half a revolution of 0 for joints without.
    pub fn draw(&self, stream: &mut Stream) -> Vec<f64> {
        self.ranges.iter().map(|(low, high, _)| stream.uniform(*low, *high)).collect()
    }

    /// Rewrites the values of joints without limits so that each configuration of a path is next to the one before it: then the
    /// path is straight between them.
    pub fn unwind(&self, path: &mut [Vec<f64>]) {
        for index in 1..path.len() {
            let difference = self.difference(&path[index - 1], &path[index]);
            path[index] = self.along(&path[index - 1], &difference, 1.0);
        }
    }

    /// Length of a path [rad].
    pub fn path_length(&self, path: &[Vec<f64>]) -> f64 {
        path.windows(2).map(|pair| self.length(&self.difference(&pair[0], &pair[1]))).sum()
    }
}
