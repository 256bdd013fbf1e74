//! Pairs of points on opposite sides of an object, between which a gripper may hold it.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Point3, Vector3};

use kernel::{contact::ContactSurface, geom::rotation_towards, seed::Stream};

/// Two points that are nearer make no pair [m].
const MIN: f64 = 0.001;

/// A ray leaves the object where it is this near to the surface [m].
const OUT: f64 = 1e-5;

/// Step by which a ray moves on along the surface [m].
const CREEPS: f64 = 1e-4;

/// Searches along a ray.
const MAX_STEPS: u32 = 1000;

/// Points that are drawn at most until one lies on a side of the object.
const LEVEL_DRAWS: u32 = 8;

/// Two points of a surface that face each other, or face away from each other through the object, within the friction cones of
/// both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pair {
    pub(super) first: Point3<f64>,
    pub(super) second: Point3<f64>,
}

/// A ray into the object from a point of its surface.
struct Ray {
    first: Point3<f64>,
    /// The outward normal there.
    out: Vector3<f64>,
    inward: Vector3<f64>,
}

impl Ray {
    /// Draws a point uniformly over the surface and a ray in its friction cone, and one more number for later choices.
    fn draw(surface: &ContactSurface, friction: f64, stream: &mut Stream) -> (Option<Self>, f64) {
        let [share, u, v, tilt, side, choice] = [(); 6].map(|()| stream.unit());
        let ray = surface.point_at(share, u, v).map(|(first, out)| {
            let axes: Matrix3<f64> = rotation_towards(&-out, 0.0);
            let (sin, cos) = libm::sincos(TAU * side);
            // Uniform over the disc that the cone cuts out of a plane.
            let across = (axes.column(0) * cos + axes.column(1) * sin) * (friction * tilt.sqrt());
            Self { first, out, inward: (across - out).normalize() }
        });
        (ray, choice)
    }
}

/// Cosine of half the angle of a friction cone.
pub(super) fn min_cos(friction: f64) -> f64 {
    1.0 / (1.0 + friction * friction).sqrt()
}

impl Pair {
    /// Draws a point uniformly over the surface and a ray in its friction cone; the second point is one of those where
    /// the ray leaves the object, each with equal probability. `None` if the ray is not within the friction cone there.
    pub(super) fn draw(surface: &ContactSurface, friction: f64, stream: &mut Stream) -> Option<Self> {
        let (ray, choice) = Ray::draw(surface, friction, stream);
        Self::through(surface, friction, &ray?, choice)
    }

    /// Draws a level pair: a point and a ray as [`Pair::draw`] does, the ray's part along `up` taken away, again until the rest
    /// is within the point's friction cone. `None` where it never is, or not within the one of the second point.
    pub(super) fn draw_level(
        surface: &ContactSurface,
        friction: f64,
        up: &Vector3<f64>,
        stream: &mut Stream,
    ) -> Option<Self> {
        for _ in 0..LEVEL_DRAWS {
            let (ray, choice) = Ray::draw(surface, friction, stream);
            let level = ray.and_then(|ray| {
                let inward = (ray.inward - up * ray.inward.dot(up)).try_normalize(MIN)?;
                Some(Ray { inward, ..ray }).filter(|level| -level.out.dot(&level.inward) >= min_cos(friction))
            });
            if let Some(ray) = level {
                return Self::through(surface, friction, &ray, choice);
            }
        }
        None
    }

    /// Follows a ray to one of the points where it leaves the object.
    fn through(surface: &ContactSurface, friction: f64, ray: &Ray, choice: f64) -> Option<Self> {
        let exits = exits(surface, &ray.first, &ray.inward);
        let second = *exits.get((choice * exits.len() as f64) as usize)?;
        let (out, _) = surface.outward(&second);
        (out.dot(&ray.inward) >= min_cos(friction)).then_some(Self { first: ray.first, second })
    }

    /// From the first to the second, of unit length.
    pub(super) fn inward(&self) -> Vector3<f64> {
        (self.second - self.first).normalize()
    }

    /// Between them [m].
    pub(super) fn length(&self) -> f64 {
        (self.second - self.first).norm()
    }

    pub(super) fn middle(&self) -> Point3<f64> {
        nalgebra::center(&self.first, &self.second)
    }
}

/// Where a ray leaves the object, from a point on.
fn exits(surface: &ContactSurface, from: &Point3<f64>, inward: &Vector3<f64>) -> Vec<Point3<f64>> {
    let bounds = surface.bounds();
    let reach = (bounds.max - bounds.min).norm();
    let (mut along, mut was_inside, mut exits) = (MIN, false, Vec::new());
    for _ in 0..MAX_STEPS {
        let at = from + inward * along;
        let distance = surface.signed_distance(&at);
        let inside = distance < -OUT;
        if was_inside && !inside {
            exits.push(at);
        }
        was_inside = inside;
        along += distance.abs().max(CREEPS);
        if along > reach {
            break;
        }
    }
    exits
}
