//! Inverse kinematics in closed form for arms of six joints with a spherical wrist: every solution of a pose.
//!
//! Joint by joint as in [`closed_form`](super::closed_form), with the subproblems of Paden (1986) and Kahan, after the order
//! of Pieper (1968): the second and third axes are parallel, so that the first joint alone brings the wrist's centre to its
//! distance from the arm's plane; the third brings it to its distance from the second axis, the second to its position.

use nalgebra::{IsometryMatrix3, Point3};

use super::{
    JointKind, PlanningGroup,
    closed_form::{Line, NoClosedForm, angle, distances, meeting_point, meetings, perpendicular, settle},
};
use kernel::geom::{EndEffector, Pose, World};

/// An arm of six revolute joints whose second and third axes are parallel and whose last three meet.
#[derive(Clone, Debug, PartialEq)]
pub struct SixJointArm {
    group: PlanningGroup,
    lines: [Line; 6],
    wrist: Point3<f64>,
    /// From the end effector's frame to the world with all joints at 0, undone.
    end_effector_from_world: IsometryMatrix3<f64>,
}

/// All solutions of a pose.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solutions {
    /// Joint values within the limits; those that differ only by whole revolutions are listed once.
    pub solutions: Vec<[f64; 6]>,
    /// Whether a solution is one member of a family: two axes of the wrist are aligned.
    pub singular: bool,
}

/// Sines of the fifth joint below this are aligned axes.
const ALIGNED: f64 = 1e-9;

impl SixJointArm {
    /// Analyses the axes with all joints at 0.
    ///
    /// # Errors
    /// Names the axes that prevent a closed form.
    pub fn recognise(group: &PlanningGroup) -> Result<Self, NoClosedForm> {
        if group.len() != 6 {
            return Err(NoClosedForm::Count(group.len()));
        }
        if let Some(joint) = group.joints().iter().find(|joint| joint.kind == JointKind::Prismatic) {
            return Err(NoClosedForm::Slides(joint.name.clone()));
        }
        let lines = Line::of_group(group);
        let lines: [Line; 6] = std::array::from_fn(|joint| lines[joint]);
        let names = |joints: [usize; 2]| joints.map(|joint| group.joints()[joint].name.clone()).join(", ");
        let cross = |a: usize, b: usize| lines[a].along.cross(&lines[b].along).norm();
        if cross(1, 2) > 1e-9 {
            return Err(NoClosedForm::NotParallel { names: names([1, 2]) });
        }
        if cross(0, 1) < 1e-6 {
            return Err(NoClosedForm::Parallel { names: names([0, 1]) });
        }
        let wrist = meeting_point(group, &lines, &[3, 4, 5], "wrist")?;
        let end_effector_from_world = group.forward(&[0.0; 6]).isometry().inverse();
        Ok(Self { group: group.clone(), lines, wrist, end_effector_from_world })
    }

    /// The planning group.
    pub fn group(&self) -> &PlanningGroup {
        &self.group
    }

    /// Every solution that brings the end effector to `target`.
    pub fn solutions(&self, target: &Pose<World, EndEffector>) -> Solutions {
        let mut found = Solutions::default();
        let whole = target.isometry() * self.end_effector_from_world;
        let wrist = whole * self.wrist;
        let [one, two, three] = [&self.lines[0], &self.lines[1], &self.lines[2]];
        // A point of the second axis at the level of the wrist, which the second and third joints do not change.
        let level = two.through + two.along * two.along.dot(&(self.wrist - two.through));
        for first in self.level_angles(&wrist).into_iter().flatten() {
            let Some(first) = settle(&self.group, 0, first) else { continue };
            let rest = one.motion(-first) * whole;
            let to = rest * self.wrist;
            for third in distances(three, &self.wrist, &level, (to - level).norm()).into_iter().flatten() {
                let Some(third) = settle(&self.group, 2, third) else { continue };
                let bent = three.motion(third) * self.wrist;
                let second = angle(&two.along, &(bent - level), &(to - level));
                let Some(second) = settle(&self.group, 1, second) else { continue };
                let rotation = three.motion(-third) * two.motion(-second) * rest;
                self.wrists(&rotation, [first, second, third], &mut found);
            }
        }
        found
    }

    /// Angles of the first joint that bring the wrist's centre from its home to the level of a position: a cos + b sin = c.
    fn level_angles(&self, wrist: &Point3<f64>) -> [Option<f64>; 2] {
        let [one, two] = [&self.lines[0], &self.lines[1]];
        let to = wrist - one.through;
        let along = one.along * one.along.dot(&to);
        let level = two.along.dot(&(self.wrist - one.through)) - two.along.dot(&along);
        let (a, b) = (two.along.dot(&(to - along)), -two.along.dot(&one.along.cross(&to)));
        let swing = libm::hypot(a, b);
        if swing < 1e-12 || level.abs() > swing * (1.0 + 1e-14) {
            return [None, None];
        }
        let (middle, half) = (libm::atan2(b, a), libm::acos((level / swing).clamp(-1.0, 1.0)));
        [Some(middle - half), (half > 0.0).then_some(middle + half)]
    }

    fn wrists(&self, isometry: &IsometryMatrix3<f64>, [first, second, third]: [f64; 3], found: &mut Solutions) {
        let last = self.lines[5].along;
        let ahead = self.wrist + last;
        let pairs = meetings(&self.lines[3], &self.lines[4], &self.wrist, &ahead, &(isometry * ahead));
        for [fourth, fifth] in pairs.into_iter().flatten() {
            let bent = self.lines[4].motion(fifth).rotation * last;
            found.singular |= bent.cross(&self.lines[3].along).norm() < ALIGNED;
            let bare = self.lines[4].motion(-fifth) * self.lines[3].motion(-fourth) * isometry;
            let aside = self.wrist + perpendicular(&last);
            let sixth = angle(&last, &(aside - self.wrist), &(bare * aside - self.wrist));
            let settled = [(3, fourth), (4, fifth), (5, sixth)].map(|(joint, value)| settle(&self.group, joint, value));
            if let [Some(fourth), Some(fifth), Some(sixth)] = settled {
                found.solutions.push([first, second, third, fourth, fifth, sixth]);
            }
        }
    }
}
