//! Inverse kinematics in closed form for arms of seven joints with a spherical wrist, one joint given.
//!
//! The arm is taken as a product of exponentials (Brockett 1984) and undone joint by joint with the subproblems of Paden
//! (1986) and Kahan: with the first joint given, the second brings the elbow to its distance from the wrist's centre
//! (subproblem 3), the third and fourth bring the wrist's centre to its position (subproblem 2), the fifth and sixth the last
//! axis to its direction (subproblem 2), the seventh the rest (subproblem 1).

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{JointKind, PlanningGroup, group::rotation_about};
use kernel::geom::{EndEffector, Pose, World};

/// Largest gap between axes that count as meeting [m]: descriptions are rounded to some micrometres.
const MEETING: f64 = 1e-9;

/// Sets of joint values that bring the end effector to a pose with the first joint given, at most.
pub const BRANCHES: usize = 8;

/// Below this the square of a sine or of a length [m^2] counts as 0: the two solutions have become one.
const TOUCHING: f64 = 1e-14;

/// Why a group has no closed form here.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoClosedForm {
    /// Only six and seven joints are solved.
    #[error("{0} joints; the closed forms are for 6 and 7")]
    Count(usize),
    /// A joint slides.
    #[error("joint {0:?} slides; the closed form is for revolute joints")]
    Slides(String),
    /// Axes that have to meet pass each other.
    #[error(
        "the axes of {names} pass each other by {gap:.1e} m; the closed form requires that they meet at the {crossing}"
    )]
    Apart {
        /// The joints.
        names: String,
        /// Where they should meet.
        crossing: &'static str,
        /// By how much they miss [m].
        gap: f64,
    },
    /// Axes that have to be at right angles are not.
    #[error("the axes of {names} are not at right angles: their cosine is {cosine:.1e}")]
    Oblique {
        /// The joints.
        names: String,
        /// Between the axes.
        cosine: f64,
    },
    /// A joint has limits that are not evaluated.
    #[error("joint {0:?} has limits; the exact test requires a joint without limits")]
    Limited(String),
    /// Two axes that have to be parallel are not.
    #[error("the axes of {names} are not parallel")]
    NotParallel {
        /// The joints.
        names: String,
    },
    /// Two axes that follow each other are parallel.
    #[error("the axes of {names} are parallel")]
    Parallel {
        /// The joints.
        names: String,
    },
}

/// A joint's axis with all joints at 0, in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    pub through: Point3<f64>,
    pub along: Vector3<f64>,
}

impl Line {
    /// The axes of a group's joints, all at 0.
    pub fn of_group(group: &PlanningGroup) -> Vec<Self> {
        let mut frame = IsometryMatrix3::identity();
        let line = |joint: &super::Joint| {
            frame *= joint.origin;
            Self { through: frame.translation.vector.into(), along: frame.rotation * joint.axis.into_inner() }
        };
        group.joints().iter().map(line).collect()
    }

    /// The motion of the world by a rotation about this axis.
    pub fn motion(&self, value: f64) -> IsometryMatrix3<f64> {
        let rotation = rotation_about(&self.along, value);
        IsometryMatrix3::from_parts((self.through.coords - rotation * self.through.coords).into(), rotation)
    }
}

/// An arm of seven revolute joints whose third and fourth axes meet at the elbow and whose last three meet at the
/// wrist's centre, like the arms of the Fetch and many others.
#[derive(Clone, Debug, PartialEq)]
pub struct SphericalWristArm {
    group: PlanningGroup,
    lines: [Line; 7],
    elbow: Point3<f64>,
    wrist: Point3<f64>,
    /// The frames that the joints move, in the world, with all joints at 0.
    links_at_home: [IsometryMatrix3<f64>; 7],
    /// From the end effector's frame to the world with all joints at 0, undone.
    end_effector_from_world: IsometryMatrix3<f64>,
}

impl SphericalWristArm {
    /// Analyses the axes with all joints at 0.
    ///
    /// # Errors
    /// Names the axes that prevent a closed form.
    pub fn recognise(group: &PlanningGroup) -> Result<Self, NoClosedForm> {
        if group.len() != 7 {
            return Err(NoClosedForm::Count(group.len()));
        }
        if let Some(joint) = group.joints().iter().find(|joint| joint.kind == JointKind::Prismatic) {
            return Err(NoClosedForm::Slides(joint.name.clone()));
        }
        let lines = Line::of_group(group);
        let lines: [Line; 7] = std::array::from_fn(|joint| lines[joint]);
        let meet = |joints: &[usize], crossing| meeting_point(group, &lines, joints, crossing);
        let elbow = meet(&[2, 3], "elbow")?;
        let wrist = meet(&[4, 5, 6], "wrist")?;
        let end_effector_from_world = group.forward(&[0.0; 7]).isometry().inverse();
        let mut links_at_home = [IsometryMatrix3::identity(); 7];
        group.link_frames(&[0.0; 7], &mut links_at_home);
        Ok(Self { group: group.clone(), lines, elbow, wrist, links_at_home, end_effector_from_world })
    }

    /// The planning group.
    pub fn group(&self) -> &PlanningGroup {
        &self.group
    }

    /// Where the axes of these joints meet, with all joints at 0.
    pub(super) fn meet(&self, joints: &[usize], crossing: &'static str) -> Result<Point3<f64>, NoClosedForm> {
        meeting_point(&self.group, &self.lines, joints, crossing)
    }

    pub(super) fn elbow(&self) -> Point3<f64> {
        self.elbow
    }

    pub(super) fn wrist(&self) -> Point3<f64> {
        self.wrist
    }

    pub(super) fn along(&self, joint: usize) -> Vector3<f64> {
        self.lines[joint].along
    }

    pub(super) fn through(&self, joint: usize) -> Point3<f64> {
        self.lines[joint].through
    }

    /// From a joint's axis to a point [m].
    pub(super) fn distance(&self, joint: usize, point: &Point3<f64>) -> f64 {
        (point - self.lines[joint].through).cross(&self.lines[joint].along).norm()
    }

    /// The wrist's centre and the direction of the last axis at a pose of the end effector.
    pub(super) fn wrist_of(&self, target: &Pose<World, EndEffector>) -> (Point3<f64>, Vector3<f64>) {
        let whole = target.isometry() * self.end_effector_from_world;
        (whole * self.wrist, whole.rotation * self.lines[6].along)
    }

    /// Every set of joint values within the limits whose first is `first` [rad] and that brings the end effector to
    /// `target`, up to whole revolutions. Joints without limits come out within (-pi, pi].
    ///
    /// Sets of one index in the array hang together as `first` changes. Where a whole family of values does it, as with
    /// aligned roll axes, one of the family is found.
    pub fn branches(&self, target: &Pose<World, EndEffector>, first: f64) -> [Option<[f64; 7]>; BRANCHES] {
        let mut found = [None; BRANCHES];
        self.visit(
            target,
            first,
            |_| true,
            |branch, solution| {
                found[branch] = Some(solution);
                None::<()>
            },
        );
        found
    }

    /// Result of `found` for the first of [`SphericalWristArm::branches`] for which it returns one; no branch after
    /// that is solved.
    pub fn find_branch<T>(
        &self,
        target: &Pose<World, EndEffector>,
        first: f64,
        mut found: impl FnMut([f64; 7]) -> Option<T>,
    ) -> Option<T> {
        self.visit(target, first, |_| true, |_, solution| found(solution))
    }

    /// One of [`SphericalWristArm::branches`], by its index.
    pub fn branch(&self, target: &Pose<World, EndEffector>, first: f64, branch: usize) -> Option<[f64; 7]> {
        // Each bit of the index is one choice.
        let wanted = |bit: (usize, usize)| branch & bit.0 == bit.1;
        self.visit(target, first, wanted, |index, solution| (index == branch).then_some(solution))
    }

    /// Visits, by their indices, the branches with the required choices (a bit of the index, and its value there),
    /// until one visit returns a result.
    fn visit<T>(
        &self,
        target: &Pose<World, EndEffector>,
        first: f64,
        wanted: impl Fn((usize, usize)) -> bool,
        mut visit: impl FnMut(usize, [f64; 7]) -> Option<T>,
    ) -> Option<T> {
        let first = self.settle(0, first)?;
        let whole = target.isometry() * self.end_effector_from_world;
        // What joints 2 to 7 have to do.
        let rest = self.motion(0, -first) * whole;
        let wrist = rest * self.wrist;
        let reach = (self.wrist - self.elbow).norm();
        // Paden-Kahan subproblem 3: the second joint brings the elbow to its distance from the wrist's centre.
        for (elbow_index, second) in distances(&self.lines[1], &self.elbow, &wrist, reach).into_iter().enumerate() {
            let Some(second) = second.filter(|_| wanted((4, 4 * elbow_index))) else { continue };
            let Some(second) = self.settle(1, second) else { continue };
            // Paden-Kahan subproblem 2: the third and fourth joints bring the wrist's centre to its position.
            let after_second = self.motion(1, -second) * rest;
            let wrist = after_second * self.wrist;
            let pairs = meetings(&self.lines[2], &self.lines[3], &self.elbow, &self.wrist, &wrist);
            for (pair_index, pair) in pairs.into_iter().enumerate() {
                let Some([third, fourth]) = pair.filter(|_| wanted((2, 2 * pair_index))) else { continue };
                let [Some(third), Some(fourth)] = [self.settle(2, third), self.settle(3, fourth)] else { continue };
                // Remaining rotation about the wrist's centre: joints 5 to 7.
                let isometry = self.motion(3, -fourth) * self.motion(2, -third) * after_second;
                let wrists = self.solve_wrist(&isometry);
                for (wrist_index, wrist) in wrists.into_iter().enumerate() {
                    let Some([fifth, sixth, seventh]) = wrist else { continue };
                    // Index of the branch: one bit per choice of elbow, pair and wrist.
                    let solution = [first, second, third, fourth, fifth, sixth, seventh];
                    let result = visit(4 * elbow_index + 2 * pair_index + wrist_index, solution);
                    if result.is_some() {
                        return result;
                    }
                }
            }
        }
        None
    }

    /// The last three joints: a rotation about the wrist's centre.
    fn solve_wrist(&self, isometry: &IsometryMatrix3<f64>) -> [Option<[f64; 3]>; 2] {
        let ahead = self.wrist + self.lines[6].along;
        meetings(&self.lines[4], &self.lines[5], &self.wrist, &ahead, &(isometry * ahead)).map(|pair| {
            let [fifth, sixth] = pair?;
            let (fifth, sixth) = (self.settle(4, fifth)?, self.settle(5, sixth)?);
            let last = self.motion(5, -sixth) * self.motion(4, -fifth) * isometry;
            // Any point off the last axis shows how far it has rotated.
            let aside = self.wrist + perpendicular(&self.lines[6].along);
            let seventh = angle(&self.lines[6].along, &(aside - self.wrist), &(last * aside - self.wrist));
            Some([fifth, sixth, self.settle(6, seventh)?])
        })
    }

    /// A point that is given with all joints at 0, in the frame that a joint moves.
    pub(super) fn home_in_link(&self, joint: usize, point: &Point3<f64>) -> Point3<f64> {
        self.links_at_home[joint].inverse_transform_point(point)
    }

    /// The motion of the world that a joint makes, all others at 0.
    pub(super) fn motion(&self, joint: usize, value: f64) -> IsometryMatrix3<f64> {
        self.lines[joint].motion(value)
    }

    fn settle(&self, joint: usize, value: f64) -> Option<f64> {
        settle(&self.group, joint, value)
    }
}

/// The value, moved by whole revolutions into the joint's limits, where that is possible.
pub(super) fn settle(group: &PlanningGroup, joint: usize, value: f64) -> Option<f64> {
    const FULL_TURN: f64 = 2.0 * std::f64::consts::PI;
    let within = value - FULL_TURN * ((value - std::f64::consts::PI) / FULL_TURN).ceil();
    match group.joints()[joint].limits {
        None => Some(within),
        Some(limits) => [within, within - FULL_TURN, within + FULL_TURN]
            .into_iter()
            .find(|value| (limits.low..=limits.high).contains(value)),
    }
}

/// Where lines meet: the middle of the closest points of the first two, which all others must pass.
pub(super) fn meeting_point(
    group: &PlanningGroup,
    lines: &[Line],
    joints: &[usize],
    crossing: &'static str,
) -> Result<Point3<f64>, NoClosedForm> {
    let names = || joints.iter().map(|joint| group.joints()[*joint].name.as_str()).collect::<Vec<_>>().join(", ");
    let [a, b] = [&lines[joints[0]], &lines[joints[1]]];
    if joints.windows(2).any(|pair| lines[pair[0]].along.cross(&lines[pair[1]].along).norm() < 1e-6) {
        return Err(NoClosedForm::Parallel { names: names() });
    }
    let (between, slope) = (b.through - a.through, a.along.dot(&b.along));
    let along_a = (between.dot(&a.along) - slope * between.dot(&b.along)) / (1.0 - slope * slope);
    let along_b = (slope * between.dot(&a.along) - between.dot(&b.along)) / (1.0 - slope * slope);
    let (on_a, on_b) = (a.through + a.along * along_a, b.through + b.along * along_b);
    let point = nalgebra::center(&on_a, &on_b);
    let gap = joints.iter().map(|joint| (point - lines[*joint].through).cross(&lines[*joint].along).norm());
    let gap = gap.fold(0.0, f64::max);
    if gap > MEETING { Err(NoClosedForm::Apart { names: names(), crossing, gap }) } else { Ok(point) }
}

/// Any unit vector across another.
pub(super) fn perpendicular(along: &Vector3<f64>) -> Vector3<f64> {
    let axis = along.iamin();
    along.cross(&Vector3::ith(axis, 1.0)).normalize()
}

/// Subproblem 1: the angle by which `from` has to rotate about `axis` to lie in the half-plane of `to` [rad].
pub(super) fn angle(axis: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    let (from, to) = (from - axis * axis.dot(from), to - axis * axis.dot(to));
    libm::atan2(axis.dot(&from.cross(&to)), from.dot(&to))
}

/// Subproblem 3: rotations about a line that bring `moved` to a distance from `still`.
pub(super) fn distances(line: &Line, moved: &Point3<f64>, still: &Point3<f64>, distance: f64) -> [Option<f64>; 2] {
    let across = |point: &Point3<f64>| {
        let to = point - line.through;
        to - line.along * line.along.dot(&to)
    };
    let (from, to) = (across(moved), across(still));
    let (near, far) = (from.norm(), to.norm());
    let height = line.along.dot(&(moved - still));
    let product = 2.0 * near * far;
    if product < TOUCHING {
        return [None, None];
    }
    let cosine = (near * near + far * far + height * height - distance * distance) / product;
    if cosine.abs() > 1.0 + TOUCHING {
        return [None, None];
    }
    let middle = libm::atan2(line.along.dot(&from.cross(&to)), from.dot(&to));
    let half = libm::acos(cosine.clamp(-1.0, 1.0));
    [Some(middle - half), (half > 0.0).then_some(middle + half)]
}

/// Subproblem 2: rotations about two lines that meet in `centre` which, the second first, bring `moved` to `goal`.
pub(super) fn meetings(
    outer: &Line,
    inner: &Line,
    centre: &Point3<f64>,
    moved: &Point3<f64>,
    goal: &Point3<f64>,
) -> [Option<[f64; 2]>; 2] {
    let (from, to) = (moved - centre, goal - centre);
    let slope = outer.along.dot(&inner.along);
    let normal = outer.along.cross(&inner.along);
    let (on_inner, on_outer) = (inner.along.dot(&from), outer.along.dot(&to));
    let alpha = (on_outer - slope * on_inner) / (1.0 - slope * slope);
    let beta = (on_inner - slope * on_outer) / (1.0 - slope * slope);
    let rest = from.norm_squared() - alpha * alpha - beta * beta - 2.0 * alpha * beta * slope;
    let gamma_squared = rest / normal.norm_squared();
    if gamma_squared < -TOUCHING {
        return [None, None];
    }
    let gamma = gamma_squared.max(0.0).sqrt();
    let by = |gamma: f64| {
        let between = outer.along * alpha + inner.along * beta + normal * gamma;
        [angle(&outer.along, &between, &to), angle(&inner.along, &from, &between)]
    };
    [Some(by(gamma)), (gamma > 0.0).then(|| by(-gamma))]
}
