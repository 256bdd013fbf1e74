//! The surface around points that are followed step by step.

use nalgebra::Point3;

use crate::voxel::channels::{Closest, Neighbourhood, Surface};

/// The surface's triangles are gathered within this distance of a point [m] once the point moves by less than the
/// `SLOW` share of it at a time.
const NEARBY: f64 = 2e-4;
const SLOW: f64 = 0.1;

/// Cache of the surface around one point that is followed step by step: the point moves micrometres per step.
pub(super) struct Trail {
    pub(super) near: Nearby,
    /// Cache around the point from which another wall is searched.
    pub(super) beyond: Nearby,
}

impl Trail {
    /// Creates a trail that caches the surface, or one that queries it each time.
    pub(super) fn new(remembers: bool) -> Self {
        let nearby = || Nearby { remembers, around: Neighbourhood::default(), asked: Point3::origin() };
        Self { near: nearby(), beyond: nearby() }
    }

    /// Begins again.
    pub(super) fn forget(&mut self) {
        for nearby in [&mut self.near, &mut self.beyond] {
            nearby.around.forget();
            nearby.asked = Point3::origin();
        }
    }
}

/// The surface around a point that moves.
pub(super) struct Nearby {
    /// Whether it is gathered.
    pub(super) remembers: bool,
    around: Neighbourhood,
    /// Position of the last query that the neighbourhood did not answer.
    asked: Point3<f64>,
}

impl Nearby {
    /// [`Surface::closest_from`], from the neighbourhood if it can answer; a neighbourhood is gathered for slow motion.
    pub(super) fn closest(
        &mut self,
        surface: &Surface,
        point: &Point3<f64>,
        reach: f64,
        hint: Option<&Closest>,
    ) -> Option<Closest> {
        if self.around.holds(point) {
            let found = surface.closest_among(point, &self.around);
            return found.filter(|closest| closest.distance_squared < reach * reach);
        }
        let found = surface.closest_from(point, reach, hint);
        let slow = self.remembers && (point - self.asked).norm_squared() < (NEARBY * SLOW).powi(2);
        self.asked = *point;
        if slow {
            let far = found.map_or(reach + NEARBY, |closest| closest.distance_squared.sqrt() + 2.0 * NEARBY);
            surface.gather(point, NEARBY, far, &mut self.around);
        }
        found
    }
}
