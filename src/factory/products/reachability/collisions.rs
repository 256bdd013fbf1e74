//! Collision test of a robot, ready for the poses of one planning group.

use nalgebra::IsometryMatrix3;

use kernel::geom::{EndEffector, NoSurface, Pose, SimdLevel, World};
use robot::{
    collision::{Bodies, CollisionChecker, CollisionVerdict, Hit},
    kinematics::PlanningGroup,
};

/// A group's collisions.
pub(super) struct Collisions {
    group: PlanningGroup,
    checker: CollisionChecker,
    /// Pairs of the hand with fixed shapes: the pose decides them.
    of_the_hand: Vec<usize>,
    /// All other pairs.
    of_the_arm: Vec<usize>,
}

/// The pair that collided last is tested first. What it is decides no verdict, but which pair is named, so that it must
/// not outlive a sample.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LastPair(Option<usize>);

/// Test of one thread whether joint values are free by MuJoCo's contacts.
pub(super) type Free<'a> = &'a mut dyn FnMut(&[f64]) -> bool;

impl Collisions {
    /// # Errors
    /// When a shape has no surface.
    pub fn new(group: &PlanningGroup, bodies: &Bodies, level: SimdLevel) -> Result<Self, NoSurface> {
        let checker = CollisionChecker::with_level(bodies, level)?;
        let last = group.len();
        let resting = |links: [usize; 2]| links == [0, last] || links == [last, 0];
        let pairs: Vec<[usize; 2]> = checker.pairs().collect();
        let (of_the_hand, of_the_arm) = (0..pairs.len()).partition(|pair| resting(pairs[*pair]));
        Ok(Self { group: group.clone(), checker, of_the_hand, of_the_arm })
    }

    /// The first pair of bodies that touches at joint values.
    pub fn touching(&self, q: &[f64]) -> Option<[usize; 2]> {
        match self.check_all(&self.links(q), &mut LastPair::default()) {
            CollisionVerdict::Free => None,
            CollisionVerdict::Collides(hit) => Some(self.checker.bodies_of(hit.pair)),
        }
    }

    pub fn checker(&self) -> &CollisionChecker {
        &self.checker
    }

    /// The frames of the links, the world's first.
    pub fn links(&self, q: &[f64]) -> Vec<IsometryMatrix3<f64>> {
        let mut links = vec![IsometryMatrix3::identity(); q.len() + 1];
        self.group.link_frames(q, &mut links[1..]);
        links
    }

    /// Whether the hand touches a fixed shape, with the end effector at a pose: then every solution there collides.
    pub fn hand_collides(&self, target: &Pose<World, EndEffector>) -> bool {
        let mut links = vec![IsometryMatrix3::identity(); self.group.len() + 1];
        links[self.group.len()] = target.isometry() * self.group.end_effector().inverse();
        self.checker.check(self.of_the_hand.iter().copied(), &links) != CollisionVerdict::Free
    }

    /// The arm's own pairs; that which collided last comes first.
    pub fn check(&self, links: &[IsometryMatrix3<f64>], last: &mut LastPair) -> CollisionVerdict {
        let first = last.0;
        let others = self.of_the_arm.iter().copied().filter(|pair| Some(*pair) != first);
        let verdict = self.checker.check(first.into_iter().chain(others), links);
        if let CollisionVerdict::Collides(hit) = verdict {
            last.0 = Some(hit.pair);
        }
        verdict
    }

    /// All pairs; that which collided last comes first.
    pub fn check_all(&self, links: &[IsometryMatrix3<f64>], last: &mut LastPair) -> CollisionVerdict {
        match self.checker.check(self.of_the_hand.iter().copied(), links) {
            CollisionVerdict::Free => self.check(links, last),
            collides => collides,
        }
    }

    /// All touching pairs except one; each is evaluated lazily.
    pub fn others(&self, links: &[IsometryMatrix3<f64>], but: usize) -> impl Iterator<Item = Hit> {
        let others = self.of_the_arm.iter().copied().filter(move |pair| *pair != but);
        self.checker.hits(others, links)
    }
}
