//! A proof that nothing touches anywhere along an edge, not only at samples of it.
//!
//! Two bodies that are farther apart than they can move within an interval do not touch in it (F. Schwarzer, M. Saha,
//! J.-C. Latombe, "Adaptive dynamic collision checking for single and multiple articulated robots in complex environments",
//! IEEE Transactions on Robotics 21(3), 2005). Intervals in which that is not known are cut in half, for the pairs of bodies
//! that are still open.

use super::scene::{ArmScene, Touch};

/// Shortest interval of an edge, as a share of it.
const SHORTEST: f64 = 1e-7;

/// An edge that was not proven free of contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncertified {
    /// The bodies that touch there, or come nearer than a few micrometres.
    pub by: Touch,
    /// Share of the edge up to that configuration.
    pub at: f64,
}

/// Work spent on certificates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CertificateWork {
    /// Configurations at which distances were computed.
    pub configurations: u64,
    /// Distances of pairs of bodies.
    pub distances: u64,
}

impl ArmScene {
    /// Proves that no bodies touch along the straight edge from the configuration `from` that moves the joints by
    /// `difference` [rad or m], its ends included. The configuration `from` must be free of contact.
    ///
    /// Every step from there is continuous, so that no body can get inside another without a contact of surfaces.
    ///
    /// # Errors
    /// A configuration where two bodies touch, or are too near each other to decide.
    ///
    /// # Example
    /// ```
    /// use graspmill_planner::motion::{ArmScene, CertificateWork};
    /// use robot::{
    ///     collision::{Bodies, Body, CollisionChecker, Geometry, Obstacle, Shape},
    ///     kinematics::{Joint, JointKind, PlanningGroup, PlanningGroupParts},
    /// };
    /// use nalgebra::{IsometryMatrix3, Vector3};
    ///
    /// // A rod of 1 m that rotates about the vertical axis.
    /// let joint = Joint {
    ///     name: "pan".to_owned(),
    ///     kind: JointKind::Revolute,
    ///     origin: IsometryMatrix3::identity(),
    ///     axis: Vector3::z_axis(),
    ///     limits: None,
    /// };
    /// let group = PlanningGroup::new(PlanningGroupParts {
    ///     joints: vec![joint],
    ///     end_effector: IsometryMatrix3::translation(1.0, 0.0, 0.0),
    /// })?;
    /// let rod = Geometry {
    ///     shape: Shape::Box { half: [0.5, 0.001, 0.001] },
    ///     link_from_shape: IsometryMatrix3::translation(0.5, 0.0, 0.0),
    /// };
    /// let bodies = vec![Body { name: "rod".to_owned(), link: 1, geometries: vec![rod] }];
    /// let robot = CollisionChecker::for_obstacles(&Bodies { bodies, pairs: Vec::new() })?;
    /// // A wall of 1 mm, 0.8 m away at 0.81 rad: between two samples of a coarse check.
    /// let wall = Geometry {
    ///     shape: Shape::Box { half: [0.01, 0.0005, 0.1] },
    ///     link_from_shape: IsometryMatrix3::rotation(Vector3::z() * 0.81) * IsometryMatrix3::translation(0.8, 0.0, 0.0),
    /// };
    /// let wall = Obstacle::new(&[wall])?.at(IsometryMatrix3::identity());
    /// let scene = ArmScene::new(&group, robot.among(&[wall], |_| true));
    /// assert!(scene.samples_free(&[0.0], &[1.0], 0.05, &mut Default::default()));
    /// let refused = scene.certify(&[0.0], &[1.0], &mut CertificateWork::default()).unwrap_err();
    /// assert!((refused.at - 0.81).abs() < 0.01);
    /// assert!(scene.certify(&[0.0], &[0.8], &mut CertificateWork::default()).is_ok());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn certify(&self, from: &[f64], difference: &[f64], work: &mut CertificateWork) -> Result<(), Uncertified> {
        let all: Vec<usize> = (0..self.pairs()).collect();
        let moves = |pair: &usize| self.travel(*pair, difference) > 0.0;
        let open: Vec<usize> = all.into_iter().filter(moves).collect();
        self.certify_interval(from, difference, [0.0, 1.0], &open, work)
    }

    /// Proves that no bodies touch along a path, straight between its configurations; the index of the first edge that fails is
    /// returned with the reason.
    ///
    /// # Errors
    /// Errors of [`ArmScene::certify`].
    pub fn certify_path(&self, path: &[Vec<f64>], work: &mut CertificateWork) -> Result<(), (usize, Uncertified)> {
        let mut edges = path.windows(2).enumerate();
        edges.try_for_each(|(index, edge)| {
            let difference = self.space().difference(&edge[0], &edge[1]);
            self.certify(&edge[0], &difference, work).map_err(|refused| (index, refused))
        })
    }

    fn certify_interval(
        &self,
        from: &[f64],
        difference: &[f64],
        [low, high]: [f64; 2],
        open: &[usize],
        work: &mut CertificateWork,
    ) -> Result<(), Uncertified> {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let links = self.links(&self.space().along(from, difference, middle));
        work.configurations += 1;
        work.distances += open.len() as u64;
        let near = |pair: &usize| {
            let travel = half * self.travel(*pair, difference);
            !self.checker().clearance_at_least(*pair, &links, travel)
        };
        let near: Vec<usize> = open.iter().copied().filter(near).collect();
        let Some(first) = near.first() else { return Ok(()) };
        if high - low < SHORTEST {
            return Err(Uncertified { by: self.touch_of(*first), at: middle });
        }
        self.certify_interval(from, difference, [low, middle], &near, work)?;
        self.certify_interval(from, difference, [middle, high], &near, work)
    }
}
