//! Pairs of points on opposite sides of an object, between which a gripper may hold it.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use super::points::SurfacePoint;
use kernel::{
    contact::ContactSurface,
    geom::{SimdLevel, rotation_towards},
    seed::Stream,
};

/// Two points that are nearer make no pair [m].
const MIN: f64 = 0.001;

/// Rays from one point that are drawn at most until one is level enough.
const LEVEL_DRAWS: u32 = 8;

/// Two points of a surface that face each other, or face away from each other through the object, within the friction cones of
/// both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pair {
    pub(super) first: Point3<f64>,
    pub(super) second: Point3<f64>,
}

/// Why a point has no opposite one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoPair {
    /// None is within the friction cones of both.
    Unopposed,
    /// All are farther away than a hand opens.
    TooWide,
}

/// Conditions of a pair.
#[derive(Clone, Copy)]
pub(super) struct PairRule<'a> {
    pub(super) surface: &'a ContactSurface,
    /// Coefficient of the friction cones.
    pub(super) friction: f64,
    /// The two points are no farther apart [m].
    pub(super) max: f64,
    pub(super) level: SimdLevel,
}

/// A ray into the object from a point of its surface.
struct PairRay {
    first: Point3<f64>,
    /// The outward normal there.
    out: Vector3<f64>,
    inward: Vector3<f64>,
}

impl PairRay {
    /// Draws a ray in the friction cone of a point.
    fn draw(SurfacePoint { point, out }: SurfacePoint, friction: f64, stream: &mut Stream) -> Self {
        let [tilt, side] = [(); 2].map(|()| stream.unit());
        let axes: Matrix3<f64> = rotation_towards(&-out, 0.0);
        let (sin, cos) = libm::sincos(TAU * side);
        // Uniform over the disc that the cone cuts out of a plane.
        let across = (axes.column(0) * cos + axes.column(1) * sin) * (friction * tilt.sqrt());
        Self { first: point, out, inward: (across - out).normalize() }
    }
}

/// Cosine of half the angle of a friction cone.
pub(super) fn min_cos(friction: f64) -> f64 {
    1.0 / (1.0 + friction * friction).sqrt()
}

impl PairRule<'_> {
    /// Largest thickness along the normal of a point from which a ray in its cone may end within the largest distance [m].
    pub(super) fn max_thickness(&self) -> f64 {
        self.max / min_cos(self.friction)
    }

    /// A point uniformly over the surface.
    pub(super) fn point_by_area(&self, stream: &mut Stream) -> Option<SurfacePoint> {
        let [share, u, v] = [(); 3].map(|()| stream.unit());
        self.surface.point_at(share, u, v).map(|(point, out)| SurfacePoint { point, out })
    }

    /// Draws a ray in the friction cone of a point; the second point is one of those where the ray leaves the object within
    /// the largest distance, each as likely.
    pub(super) fn draw(&self, point: Option<SurfacePoint>, stream: &mut Stream) -> Result<Pair, NoPair> {
        let ray = PairRay::draw(point.ok_or(NoPair::TooWide)?, self.friction, stream);
        self.through(&ray, stream.unit())
    }

    /// Draws a level pair: a point and a ray as [`PairRule::draw`] does, the ray's part along `up` taken away, again until the rest
    /// is within the point's friction cone.
    pub(super) fn draw_level(
        &self,
        mut point: impl FnMut(&mut Stream) -> Option<SurfacePoint>,
        up: &Vector3<f64>,
        stream: &mut Stream,
    ) -> Result<Pair, NoPair> {
        for _ in 0..LEVEL_DRAWS {
            let ray = PairRay::draw(point(stream).ok_or(NoPair::TooWide)?, self.friction, stream);
            let inward = (ray.inward - up * ray.inward.dot(up)).try_normalize(MIN);
            let level = inward.filter(|inward| -ray.out.dot(inward) >= min_cos(self.friction));
            if let Some(inward) = level {
                return self.through(&PairRay { inward, ..ray }, stream.unit());
            }
        }
        Err(NoPair::Unopposed)
    }

    /// Follows a ray to one of the points where it leaves the object.
    fn through(&self, ray: &PairRay, choice: f64) -> Result<Pair, NoPair> {
        let along = Unit::new_unchecked(ray.inward);
        let (begin, mut exits) = (ray.first + ray.inward * MIN, Vec::new());
        self.surface.exits(self.level, &begin, &along, f64::INFINITY, &mut exits);
        if exits.is_empty() {
            return Err(NoPair::Unopposed);
        }
        exits.retain(|(exit, _)| exit + MIN <= self.max);
        let (exit, _) = exits.get((choice * exits.len() as f64) as usize).ok_or(NoPair::TooWide)?;
        let second = begin + ray.inward * *exit;
        let (out, _) = self.surface.outward(&second);
        let opposes = out.dot(&ray.inward) >= min_cos(self.friction);
        if opposes { Ok(Pair { first: ray.first, second }) } else { Err(NoPair::Unopposed) }
    }
}

impl Pair {
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
