//! Inverse kinematics of an arm for a whole motion: all branches of a pose, and one branch followed along a line.

use super::space::JointSpace;
use kernel::{
    geom::{EndEffector, Pose, World},
    seed::Stream,
};
use robot::kinematics::{BRANCHES, ClosedForm, PlanningGroup, SelfMotion, SolverSettings, descend};

/// Distance of the values of the first joint that are tried within an interval of it [rad].
const FIRST_STEP: f64 = 0.1;
/// Values of the first joint that are tried along a line when its present one has no solution, in this order [rad].
const FIRST_MOVES: [f64; 5] = [0.0, 0.01, -0.01, 0.02, -0.02];
/// Starts of the numeric solver.
const STARTS: usize = 200;
/// Solutions of the numeric solver that differ by less in every joint are one [rad or m].
const SAME: f64 = 1e-3;

/// An arm with the best inverse kinematics that fits it: in closed form for six joints with a spherical wrist and for seven
/// with a spherical elbow, too; else by descents from random starts, which may miss solutions.
pub struct InverseArm {
    group: PlanningGroup,
    space: JointSpace,
    closed: Option<ClosedForm>,
    /// Starts of descents where there is no closed form.
    starts: Vec<Vec<f64>>,
}

/// A solution of a pose, with what is needed to follow it.
#[derive(Clone, Debug, PartialEq)]
pub struct Branch {
    /// Joint values within the limits [rad or m].
    pub q: Vec<f64>,
    /// Index among the solutions with the same first joint, for seven joints.
    index: usize,
}

impl InverseArm {
    /// Analyses the axes of a group. The starts of a numeric solver follow from `seed`.
    pub fn new(group: &PlanningGroup, seed: u64) -> Self {
        let closed = ClosedForm::recognise(group).ok();
        let mut stream = Stream::of_job(seed, b"", "inverse kinematics of a motion");
        let space = JointSpace::new(group);
        let count = if closed.is_some() { 0 } else { STARTS };
        let starts = (0..count).map(|_| space.draw(&mut stream)).collect();
        Self { group: group.clone(), space, closed, starts }
    }

    /// The arm.
    pub fn group(&self) -> &PlanningGroup {
        &self.group
    }

    /// Whether every pose without solutions is proven to have none.
    pub fn is_exact(&self) -> bool {
        self.closed.is_some()
    }

    /// Solutions of a pose within the limits: all of a six-joint arm; for seven joints every branch at values of the first joint
    /// no farther apart than 0.1 rad, and at least one for every interval of it that has a solution.
    pub fn branches(&self, target: &Pose<World, EndEffector>) -> Vec<Branch> {
        match &self.closed {
            Some(ClosedForm::Seven(motion)) => seven(motion, target),
            Some(ClosedForm::Six(arm)) => {
                let solutions = arm.solutions(target).solutions;
                solutions.into_iter().map(|q| Branch { q: q.to_vec(), index: 0 }).collect()
            }
            None => self.numeric(target),
        }
    }

    fn numeric(&self, target: &Pose<World, EndEffector>) -> Vec<Branch> {
        let mut found: Vec<Branch> = Vec::new();
        for start in &self.starts {
            let end = descend(&self.group, target, start, &SolverSettings::default());
            let q = &end.q[..self.group.len()];
            let known = |branch: &Branch| self.space.largest_step(&branch.q, q) < SAME;
            if end.solved && !found.iter().any(known) {
                found.push(Branch { q: q.to_vec(), index: 0 });
            }
        }
        found
    }

    /// The solution of a pose that continues a branch: no joint moves by more than `most` [rad, or m of a joint that slides].
    pub fn follow(&self, branch: &Branch, target: &Pose<World, EndEffector>, most: f64) -> Option<Branch> {
        let near = |q: &[f64]| self.space.largest_step(&branch.q, q) <= most;
        match &self.closed {
            Some(ClosedForm::Seven(motion)) => FIRST_MOVES.into_iter().find_map(|step| {
                let q = motion.arm().branch(target, branch.q[0] + step, branch.index)?;
                near(&q).then(|| Branch { q: q.to_vec(), index: branch.index })
            }),
            Some(ClosedForm::Six(arm)) => {
                let step = |q: &[f64; 6]| self.space.largest_step(&branch.q, q);
                let nearest = arm.solutions(target).solutions.into_iter().min_by(|a, b| step(a).total_cmp(&step(b)))?;
                near(&nearest).then(|| Branch { q: nearest.to_vec(), index: 0 })
            }
            None => {
                let end = descend(&self.group, target, &branch.q, &SolverSettings::default());
                let q = &end.q[..self.group.len()];
                (end.solved && near(q)).then(|| Branch { q: q.to_vec(), index: 0 })
            }
        }
    }

    /// Manipulability (T. Yoshikawa, "Manipulability of robotic mechanisms", 1985): the root of the determinant of J J^T,
    /// with metres and radians as they are; 0 where the end effector cannot move in some direction.
    pub fn manipulability(&self, q: &[f64]) -> f64 {
        let (_, jacobian) = self.group.forward_and_jacobian(q);
        (&jacobian * jacobian.transpose()).determinant().max(0.0).sqrt()
    }
}

/// Every branch at values of the first joint within each interval in which nothing changes.
fn seven(motion: &SelfMotion, target: &Pose<World, EndEffector>) -> Vec<Branch> {
    let wrist = motion.wrist(target);
    if motion.too_far(&wrist) {
        return Vec::new();
    }
    let (mut ends, mut found) = (Vec::new(), Vec::new());
    motion.end_points(&wrist, &mut ends);
    for pair in ends.windows(2) {
        let width = pair[1] - pair[0];
        let count = (width / FIRST_STEP).ceil();
        for part in 0..count as usize {
            let first = pair[0] + width * (part as f64 + 0.5) / count;
            let branches = motion.arm().branches(target, first);
            let solved = (0..BRANCHES).filter_map(|index| Some(Branch { q: branches[index]?.to_vec(), index }));
            found.extend(solved);
        }
    }
    if found.is_empty() {
        // A single value, where two intervals touch.
        found.extend(motion.find(target).and_then(|q| {
            let branches = motion.arm().branches(target, q[0]);
            let index = branches.iter().position(|branch| *branch == Some(q))?;
            Some(Branch { q: q.to_vec(), index })
        }));
    }
    found
}
