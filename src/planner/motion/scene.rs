//! An arm among obstacles: checks of configurations and edges, and how far bodies move along an edge.

use nalgebra::IsometryMatrix3;

use super::space::JointSpace;
use robot::{
    collision::{CollisionChecker, CollisionVerdict, PlacedObstacle},
    kinematics::{Joint, JointKind, MAX_JOINTS, PlanningGroup},
};

/// An arm among obstacles.
pub struct ArmScene {
    group: PlanningGroup,
    checker: CollisionChecker,
    space: JointSpace,
    extents: Vec<Extent>,
    /// Bound on the motion of a pair's bodies relative to each other per unit of each joint [m/rad or 1].
    sweeps: Vec<[f64; MAX_JOINTS]>,
}

/// Two bodies that touch, as indices in the list of the robot's bodies followed by its obstacles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Touch {
    /// The lower index first.
    pub bodies: [usize; 2],
}

/// Checks made, with the pair that touched last: it is tested first, which changes no verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Checks {
    /// Configurations checked.
    pub count: u64,
    last: Option<usize>,
}

impl ArmScene {
    /// An arm with a checker of its bodies (see [`CollisionChecker::for_obstacles`]), and of obstacles it already has.
    ///
    /// # Panics
    /// When the group has more than [`MAX_JOINTS`] joints.
    pub fn new(group: &PlanningGroup, checker: CollisionChecker) -> Self {
        assert!(group.len() <= MAX_JOINTS, "{} joints", group.len());
        let bodies = checker.links().enumerate();
        let extents = bodies.map(|(body, link)| Extent::new(group, &checker, body, link)).collect();
        Self::of_parts(group, checker, extents)
    }

    /// Adds obstacles to a copy of the scene, in microseconds: the robot's shapes are shared. Arguments are those of
    /// [`CollisionChecker::among`].
    #[must_use]
    pub fn among(&self, obstacles: &[PlacedObstacle], meets: impl Fn([usize; 2]) -> bool) -> Self {
        let checker = self.checker.among(obstacles, meets);
        let mut extents = self.extents.clone();
        let added = checker.links().enumerate().skip(extents.len());
        extents.extend(added.map(|(body, link)| Extent::new(&self.group, &checker, body, link)));
        Self::of_parts(&self.group, checker, extents)
    }

    fn of_parts(group: &PlanningGroup, checker: CollisionChecker, extents: Vec<Extent>) -> Self {
        let pairs = checker.pairs().count();
        let sweeps = (0..pairs).map(|pair| sweep(group, checker.bodies_of(pair).map(|body| &extents[body])));
        Self { sweeps: sweeps.collect(), space: JointSpace::new(group), group: group.clone(), checker, extents }
    }

    /// The arm.
    pub fn group(&self) -> &PlanningGroup {
        &self.group
    }

    /// The checker of the arm and its obstacles.
    pub fn checker(&self) -> &CollisionChecker {
        &self.checker
    }

    /// Joint values of the arm with their metric.
    pub fn space(&self) -> &JointSpace {
        &self.space
    }

    /// Number of pairs of bodies that are checked.
    pub fn pairs(&self) -> usize {
        self.sweeps.len()
    }

    /// Frames of the links at joint values, the world first.
    pub fn links(&self, q: &[f64]) -> Vec<IsometryMatrix3<f64>> {
        let mut links = vec![IsometryMatrix3::identity(); q.len() + 1];
        self.group.link_frames(q, &mut links[1..]);
        links
    }

    /// A pair of bodies that touches at joint values.
    pub fn touch(&self, q: &[f64], checks: &mut Checks) -> Option<Touch> {
        checks.count += 1;
        let first = checks.last;
        let others = (0..self.pairs()).filter(|pair| Some(*pair) != first);
        match self.checker.check(first.into_iter().chain(others), &self.links(q)) {
            CollisionVerdict::Free => None,
            CollisionVerdict::Collides(hit) => {
                checks.last = Some(hit.pair);
                Some(self.touch_of(hit.pair))
            }
        }
    }

    /// The bodies of a pair.
    pub fn touch_of(&self, pair: usize) -> Touch {
        Touch { bodies: self.checker.bodies_of(pair) }
    }

    /// Whether configurations along an edge, no farther apart than `resolution` [rad], are free of contact: its end first, then
    /// the middle, the quarters, and so on. The start is not checked.
    pub fn samples_free(&self, from: &[f64], difference: &[f64], resolution: f64, checks: &mut Checks) -> bool {
        let count = (self.space.length(difference) / resolution).ceil().max(1.0) as usize;
        let mut free =
            |step: usize| self.touch(&self.space.along(from, difference, step as f64 / count as f64), checks).is_none();
        if !free(count) {
            return false;
        }
        let mut stride = count.next_power_of_two() / 2;
        while stride > 0 {
            if !(stride..count).step_by(2 * stride).all(&mut free) {
                return false;
            }
            stride /= 2;
        }
        true
    }

    /// Bound on the motion of a pair's bodies relative to each other while the joints move by `difference` [m].
    pub(super) fn travel(&self, pair: usize, difference: &[f64]) -> f64 {
        difference.iter().zip(&self.sweeps[pair]).map(|(step, reach)| step.abs() * reach).sum()
    }

    /// Whether no body of the scene is nearer to another than `clearance` [m].
    pub fn clear_by(&self, q: &[f64], clearance: f64) -> bool {
        let links = self.links(q);
        (0..self.pairs()).all(|pair| self.checker.clearance_at_least(pair, &links, clearance))
    }
}

/// Reach of a body from the joints that move it.
#[derive(Clone, Copy)]
struct Extent {
    link: usize,
    /// Farthest point from the origin of the link's frame, and from its joint's axis [m].
    far: f64,
    beside_axis: f64,
}

impl Extent {
    fn new(group: &PlanningGroup, checker: &CollisionChecker, body: usize, link: usize) -> Self {
        let mut extent = Self { link, far: 0.0, beside_axis: 0.0 };
        // No joint moves what is fixed in the world.
        let Some(joint) = link.checked_sub(1) else { return extent };
        let axis = group.joints()[joint].axis.into_inner();
        for corner in checker.corners(body).map(|corner| corner.coords) {
            extent.far = extent.far.max(corner.norm());
            extent.beside_axis = extent.beside_axis.max((corner - axis * axis.dot(&corner)).norm());
        }
        extent
    }
}

/// Bounds on the motion of the outer body of a pair relative to the inner one, per unit of each joint between them: a joint
/// that slides moves it by as much, and one that rotates by its distance from the joint's origin, which is at most the
/// length of all links between, outstretched, and the body's own extent.
fn sweep(group: &PlanningGroup, bodies: [&Extent; 2]) -> [f64; MAX_JOINTS] {
    let mut sweep = [0.0; MAX_JOINTS];
    let (inner, outer) = if bodies[0].link < bodies[1].link { (bodies[0], bodies[1]) } else { (bodies[1], bodies[0]) };
    let mut reach = outer.far;
    for joint in (inner.link..outer.link).rev() {
        let Joint { kind, origin, limits, .. } = &group.joints()[joint];
        sweep[joint] = match kind {
            JointKind::Prismatic => 1.0,
            JointKind::Revolute if joint + 1 == outer.link => outer.beside_axis,
            JointKind::Revolute => reach,
        };
        let slide = match (kind, limits) {
            (JointKind::Prismatic, Some(limits)) => limits.low.abs().max(limits.high.abs()),
            _ => 0.0,
        };
        reach += origin.translation.vector.norm() + slide;
    }
    sweep
}
