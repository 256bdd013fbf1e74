//! Poses of a gripper about pairs of points of a body.

use std::f64::consts::TAU;

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Translation3, Unit, Vector3};

use super::super::{pads::Grip, pairs::min_cos, points::SurfacePoint, solids::HandSolids};
use kernel::{
    contact::ContactSurface,
    geom::{SimdLevel, rotation_towards},
    words::PointScheme,
};

/// Two points that are nearer make no pair [m].
const MIN: f64 = 0.001;

/// A ray begins so far below the surface [m].
const BELOW: f64 = 1e-6;

/// A direction has no part that is shorter than this.
const TINY: f64 = 1e-6;

/// Openings: full, half way to the pair, and the pair's width and this [m]; each with its share.
const BEYOND_PAIR: f64 = 0.005;
const FULL: f64 = 0.4;
const HALF_WAY: f64 = 0.3;

/// A hand's lowest point stays so far above its bound [m], for rounding.
const ABOVE: f64 = 1e-6;

/// Numbers from 0 to 1 that make one pose. A pose depends on nothing else of the stream.
pub(super) struct Draw {
    /// Scheme, group and place of the first point.
    pub(super) point: [f64; 3],
    /// Tilt of the ray in its cone, and about the normal.
    tilt: f64,
    side: f64,
    level: f64,
    exit: f64,
    flip: f64,
    opening: f64,
    roll: f64,
    depth: f64,
}

/// Two opposite points of a body between which a pad fits.
#[derive(Clone, Copy, Debug)]
pub(super) struct DrawnPair {
    pub(super) scheme: PointScheme,
    /// In `Object` [m]; the first pad takes the first one.
    pub(super) points: [Point3<f64>; 2],
}

/// Reason why a draw makes no pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoPose {
    /// No opposite point within the friction cones.
    Unopposed,
    /// The opposite point is farther away than the hand opens.
    TooWide,
    /// No roll about the pair comes within the half angle of straight down.
    Tilted,
}

/// Limits of a draw.
pub(super) struct Limits {
    /// Coefficient of friction of the cone.
    pub(super) friction: f64,
    /// Cosine of the largest angle between approach and straight down.
    pub(super) cos_half_angle: f64,
    /// Widest pair [m].
    pub(super) widest_pair: f64,
    /// Straight up, in `Object`.
    pub(super) up: Vector3<f64>,
    /// Longest way through the body [m].
    pub(super) far: f64,
}

impl Draw {
    /// The next pose: always the same count of numbers.
    pub(super) fn next(stream: &mut kernel::seed::Stream) -> Self {
        let [scheme, group, place, tilt, side, level, exit, flip, opening, roll, depth] =
            [(); 11].map(|()| stream.unit());
        Self { point: [scheme, group, place], tilt, side, level, exit, flip, opening, roll, depth }
    }

    /// A pair from a point: along a ray in its friction cone, half of the rays level, to one of the points where it leaves the body.
    pub(super) fn pair(
        &self,
        surface: &ContactSurface,
        (scheme, first): (PointScheme, &SurfacePoint),
        limits: &Limits,
        level: SimdLevel,
        exits: &mut Vec<(f64, Vector3<f64>)>,
    ) -> Result<DrawnPair, NoPose> {
        let (SurfacePoint { point, out }, min_cos) = (first, min_cos(limits.friction));
        // Uniform over the disc that the cone cuts out of a plane.
        let axes: Matrix3<f64> = rotation_towards(&-out, 0.0);
        let (sin, cos) = libm::sincos(TAU * self.side);
        let across = (axes.column(0) * cos + axes.column(1) * sin) * (limits.friction * self.tilt.sqrt());
        let mut inward = (across - out).normalize();
        if self.level < 0.5 {
            let level = inward - limits.up * inward.dot(&limits.up);
            inward = level.try_normalize(TINY).ok_or(NoPose::Unopposed)?;
            if -out.dot(&inward) < min_cos {
                return Err(NoPose::Unopposed);
            }
        }
        let inward = Unit::new_unchecked(inward);
        surface.exits(level, &(point + inward.into_inner() * BELOW), &inward, limits.far, exits);
        exits.retain(|(distance, _)| *distance >= MIN);
        let first = exits.first().ok_or(NoPose::Unopposed)?.0;
        if first > limits.widest_pair {
            return Err(NoPose::TooWide);
        }
        exits.retain(|(distance, _)| *distance <= limits.widest_pair);
        let (distance, normal) = exits[((self.exit * exits.len() as f64) as usize).min(exits.len() - 1)];
        if normal.dot(&inward) < min_cos {
            return Err(NoPose::Unopposed);
        }
        let second = point + inward.into_inner() * (distance + BELOW);
        let points = if self.flip < 0.5 { [*point, second] } else { [second, *point] };
        Ok(DrawnPair { scheme, points })
    }

    /// Width of the opened hand for a pair [m], at most `widest`.
    pub(super) fn opening(&self, pair: &DrawnPair, widest: f64) -> f64 {
        match self.opening {
            share if share < FULL => widest,
            share if share < FULL + HALF_WAY => f64::midpoint(pair.width(), widest),
            _ => (pair.width() + BEYOND_PAIR).min(widest),
        }
    }

    /// The rotation of the hand's base about a pair, expressed in `Object`: uniform over the rolls at which the approach is within the
    /// half angle of straight down.
    pub(super) fn rotation(
        &self,
        pair: &DrawnPair,
        grip: &Grip,
        approach: &Vector3<f64>,
        limits: &Limits,
    ) -> Result<Rotation3<f64>, NoPose> {
        let line = pair.line();
        // The approach in the frame of the line: a part along it, and a part across.
        let line_from_base = grip.base_from_line.rotation.inverse();
        let seen = line_from_base * approach;
        let (along, across) = (seen.z, seen.xy().norm());
        let towards = Vector3::new(seen.x, seen.y, 0.0).try_normalize(TINY).ok_or(NoPose::Tilted)?;
        // Across the line, the direction nearest to straight down.
        let down = -limits.up;
        let lowest = down - line * down.dot(&line);
        let sine = lowest.norm();
        let lowest = lowest.try_normalize(TINY).ok_or(NoPose::Tilted)?;
        // Rolled by an angle from there, the cosine to straight down is along * (down . line) + across * sine * cos(angle).
        let least = (limits.cos_half_angle - along * down.dot(&line)) / (across * sine);
        if least > 1.0 {
            return Err(NoPose::Tilted);
        }
        let most = libm::acos(least.max(-1.0));
        let (sin, cos) = libm::sincos((2.0 * self.roll - 1.0) * most);
        let to = lowest * cos + line.cross(&lowest) * sin;
        let axes =
            |across: &Vector3<f64>, line: &Vector3<f64>| Matrix3::from_columns(&[*across, line.cross(across), *line]);
        let object_from_line = axes(&to, &line) * axes(&towards, &Vector3::z()).transpose();
        Ok(Rotation3::from_matrix_unchecked(object_from_line) * line_from_base)
    }

    /// Distance that the hand comes forward from where its tips are 3 mm past the pair [m], within a room: denser where short.
    pub(super) fn forward(&self, room: f64) -> f64 {
        self.depth * self.depth * room
    }
}

impl DrawnPair {
    /// Between the points [m].
    pub(super) fn width(&self) -> f64 {
        (self.points[1] - self.points[0]).norm()
    }

    /// From the first to the second, of unit length.
    fn line(&self) -> Vector3<f64> {
        (self.points[1] - self.points[0]).normalize()
    }

    pub(super) fn middle(&self) -> Point3<f64> {
        nalgebra::center(&self.points[0], &self.points[1])
    }
}

/// The hand about a pair, its tips 3 mm past it, with what it needs to come forward.
pub(super) struct Backmost {
    /// The base at that depth, expressed in the scene.
    pub(super) scene_from_base: IsometryMatrix3<f64>,
    /// The approach in the scene.
    pub(super) approach: Vector3<f64>,
    /// Longest way forward [m].
    pub(super) length: f64,
}

/// Heights below which no part of a hand may be [m].
pub(super) struct Floor {
    /// For the tips of the fingers: the floor among the walls.
    pub(super) tips: f64,
    /// For all of the hand.
    pub(super) ground: f64,
}

impl Backmost {
    /// Around the pair's middle in the scene.
    pub(super) fn new(
        grip: &Grip,
        approach: &Vector3<f64>,
        scene_from_base: Rotation3<f64>,
        middle: &Point3<f64>,
    ) -> Self {
        let [inner, outer] = grip.extent;
        // The pair is at the end of the extent.
        let pair_in_base = grip.base_from_line.translation.vector + approach * outer;
        let shift = middle.coords - scene_from_base * pair_in_base;
        Self {
            scene_from_base: IsometryMatrix3::from_parts(Translation3::from(shift), scene_from_base),
            approach: scene_from_base * approach,
            length: outer - inner,
        }
    }

    /// The lowest points of the fingers and of the rest of the hand, in the scene [m].
    pub(super) fn lowest(&self, solids: &HandSolids, frames: &[IsometryMatrix3<f64>], is_finger: &[bool]) -> [f64; 2] {
        let down = self.scene_from_base.rotation.inverse() * -Vector3::z();
        let mut lowest = [f64::INFINITY; 2];
        for (solid, is_finger) in solids.solids.iter().zip(is_finger) {
            let height = self.scene_from_base.translation.z - solid.reach_along(&down, frames);
            let part = &mut lowest[usize::from(!is_finger)];
            *part = part.min(height);
        }
        lowest
    }

    /// The room in front of the hand until a part that is `lowest` reaches a height [m]; below 0 where it is lower.
    pub(super) fn room(&self, lowest: f64, height: f64) -> f64 {
        let spare = lowest - height - ABOVE;
        match -self.approach.z {
            _ if spare < 0.0 => spare,
            sinks if sinks <= TINY => self.length,
            sinks => (spare / sinks).min(self.length),
        }
    }

    /// The base after the hand has come forward [m].
    pub(super) fn at(&self, forward: f64) -> IsometryMatrix3<f64> {
        Translation3::from(self.approach * forward) * self.scene_from_base
    }
}
