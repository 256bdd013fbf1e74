//! Contacts and what friction lets them push.

use std::f64::consts::TAU;

use nalgebra::{Point3, Unit, Vector3};

/// Cosine of the latitude on the friction ellipsoid at which a soft contact has edges with force and torsion.
pub const SOFT_LATITUDE_COSINE: f64 = 0.854;

/// A point where a hand pushes on an object. All in one frame of the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Where [m].
    pub point: Point3<f64>,
    /// Into the object: the direction in which the contact pushes.
    pub normal: Unit<Vector3<f64>>,
    /// Where the first edge of the friction cone leans to, at right angles to the normal.
    pub tangent: Unit<Vector3<f64>>,
    /// Factor of the contact's wrenches; contacts of no weight do not count.
    pub weight: f64,
}

impl Contact {
    /// A contact of weight 1, its tangent across the coordinate axis that is farthest from the normal.
    pub fn new(point: Point3<f64>, normal: Unit<Vector3<f64>>) -> Self {
        let axis = normal.iamin();
        let tangent = Unit::new_normalize(normal.cross(&Vector3::ith(axis, 1.0)));
        Self { point, normal, tangent, weight: 1.0 }
    }

    /// Returns the contact with another weight.
    #[must_use]
    pub fn with_weight(self, weight: f64) -> Self {
        Self { weight, ..self }
    }

    /// Returns the contact with its friction cone rotated so that its first edge leans towards `direction`, which must
    /// not be along the normal.
    #[must_use]
    pub fn with_tangent(self, direction: &Vector3<f64>) -> Self {
        let across = direction - self.normal.into_inner() * self.normal.dot(direction);
        Self { tangent: Unit::new_normalize(across), ..self }
    }
}

/// Reference of torques.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassFrame {
    /// The solid's centre of mass [m].
    pub centre: Point3<f64>,
    /// The largest distance from it to the surface [m]: torques are divided by it.
    pub radius: f64,
}

/// Wrenches of a contact besides its unit normal force, as edges of a cone.
#[derive(Clone, Debug, PartialEq)]
pub struct FrictionCone {
    /// Forces along the tangent and across it, and torsion about the normal [m].
    pub(super) edges: Vec<[f64; 3]>,
}

impl FrictionCone {
    /// A hard point: a pyramid of `edges` edges in a circular cone of friction coefficient `friction`. It is inscribed:
    /// its smallest friction is cos(pi / edges) of the circle's.
    ///
    /// # Panics
    /// When friction is not a number from 0, or has fewer than three edges.
    pub fn hard(friction: f64, edges: usize) -> Self {
        assert!(friction >= 0.0 && friction.is_finite(), "a friction coefficient of {friction}");
        assert!(edges >= 3, "a friction cone of {edges} edges");
        if friction == 0.0 {
            return Self { edges: vec![[0.0; 3]] };
        }
        let mut cone = Self { edges: Vec::with_capacity(edges) };
        cone.ring([friction, 0.0], edges, 0.0);
        cone
    }

    /// A soft finger: friction and torsion together within an ellipsoid, (force / friction)^2 + (torsion / torsional)^2 <= 1
    /// (Ciocarlie et al. 2007, "Soft finger model with adaptive contact geometry"). `torsional` [m] is the greatest torsion of
    /// a unit normal force.
    ///
    /// 20 edges: 8 around the equator, pure friction; 5 on each of two circles of latitude with the cosine
    /// [`SOFT_LATITUDE_COSINE`], those below between those above; and the two poles, pure torsion. In the space of forces only
    /// the 8 count: the others lie inside their octagon.
    ///
    /// # Panics
    /// When a coefficient is not a number above 0.
    pub fn soft(friction: f64, torsional: f64) -> Self {
        let sound = |value: f64| value > 0.0 && value.is_finite();
        assert!(sound(friction) && sound(torsional), "coefficients {friction} and {torsional} m");
        let (cos, sin) = (SOFT_LATITUDE_COSINE, libm::sqrt(1.0 - SOFT_LATITUDE_COSINE * SOFT_LATITUDE_COSINE));
        let mut cone = Self { edges: Vec::with_capacity(20) };
        cone.ring([friction, 0.0], 8, 0.0);
        cone.ring([cos * friction, sin * torsional], 5, 0.0);
        cone.ring([cos * friction, -sin * torsional], 5, 0.5);
        cone.edges.extend([[0.0, 0.0, torsional], [0.0, 0.0, -torsional]]);
        cone
    }

    /// Edges around a circle of some force and torsion, `shift` of a step on.
    fn ring(&mut self, [force, torsion]: [f64; 2], count: usize, shift: f64) {
        self.edges.extend((0..count).map(|edge| {
            let (sin, cos) = libm::sincos(TAU * (edge as f64 + shift) / count as f64);
            [force * cos, force * sin, torsion]
        }));
    }

    /// Number of edges.
    pub fn edges(&self) -> usize {
        self.edges.len()
    }
}
