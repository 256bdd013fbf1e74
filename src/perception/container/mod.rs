//! Bins and totes: walls around a floor that objects lie on.
//!
//! A container is found by its walls: planes perpendicular to the support plane that meet in a concave corner, of equal height.
//! Points on walls, and those outside of the container below its rim, belong to no object.

mod coarse;
mod find;
mod panel;

use nalgebra::{Point3, UnitQuaternion, Vector3};

pub(crate) use self::find::container_of;
use crate::plane::Plane;

/// Points up to this far in front of a wall belong to it, at a depth of 0 [m].
const WALL: f64 = 0.006;
/// Increase of this distance with the square of the depth, as the noise of a structured-light sensor [1/m].
const WALL_NOISE: f64 = 0.003;
/// Thickest wall [m].
const THICKNESS: f64 = 0.06;
/// Points up to this far below and above the rim belong to the rim, where they lie near a wall [m].
const RIM: f64 = 0.015;
/// Points as near as this to a wall can lie on a rim that bends inwards [m].
const RIM_WIDTH: f64 = 0.02;

/// Source of the container.
#[derive(Clone, Debug, PartialEq)]
pub enum ContainerChoice {
    /// Found in the picture, if there is one.
    Find,
    /// Known before.
    Given(Container),
    /// There is none: all points above the plane belong to objects.
    Without,
}

/// A wall's inner face in `CameraCv`: points with `normal . point + offset = 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Unit normal into the container.
    pub normal: Vector3<f64>,
    /// Distance of the camera from the face, positive on the container's side [m].
    pub offset: f64,
    /// Whether the picture shows the face; the position of others follows from the walls beside them.
    pub is_seen: bool,
}

/// A container in `CameraCv`: a floor and the inner faces of its walls.
#[derive(Clone, Debug, PartialEq)]
pub struct Container {
    /// Plane of the floor, the objects' support plane.
    pub floor: Plane,
    /// Height of the rim above the floor [m].
    pub rim: f64,
    /// Inner faces; up to four.
    pub walls: Vec<Wall>,
}

/// Part of a container that a point lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Region {
    /// Inside, in front of all walls, or above the rim.
    Inside,
    /// On a wall or the rim.
    Wall,
    /// Outside, behind a wall.
    Outside,
}

impl Wall {
    /// Distance of a point from the face [m]; positive inside the container.
    pub fn distance(&self, point: &Point3<f64>) -> f64 {
        self.normal.dot(&point.coords) + self.offset
    }
}

impl Container {
    /// A box whose inner size along its x, y and z is known [m], by the pose of its frame in `CameraCv`: the origin is the middle
    /// of the floor, z points out of the opening. `None` if a length is not positive.
    pub fn from_size(size: [f64; 3], position: Point3<f64>, rotation: UnitQuaternion<f64>) -> Option<Self> {
        if size.iter().any(|length| !(*length > 0.0 && length.is_finite())) {
            return None;
        }
        let floor = Plane::through(rotation * Vector3::z(), &position.coords)?;
        let wall = |(axis, sign): (Vector3<f64>, f64)| {
            let normal = rotation * axis * -sign;
            let half = 0.5 * if axis.x > 0.0 { size[0] } else { size[1] };
            Wall { normal, offset: half - normal.dot(&position.coords), is_seen: true }
        };
        let sides = [(Vector3::x(), 1.0), (Vector3::x(), -1.0), (Vector3::y(), 1.0), (Vector3::y(), -1.0)];
        Some(Self { floor, rim: size[2], walls: sides.map(wall).to_vec() })
    }

    /// Part of the container that a point lies in.
    pub(crate) fn region(&self, point: &Point3<f64>) -> Region {
        let height = self.floor.height(point);
        let reach = WALL + WALL_NOISE * point.z * point.z;
        let nearest = self.walls.iter().map(|wall| wall.distance(point)).fold(f64::INFINITY, f64::min);
        if nearest > RIM_WIDTH || nearest > reach && (height - self.rim).abs() > RIM {
            return Region::Inside;
        }
        // An object that reaches over a wall is above its rim.
        if height > self.rim + RIM {
            return if nearest > -THICKNESS { Region::Inside } else { Region::Outside };
        }
        if nearest > -THICKNESS && height > -THICKNESS { Region::Wall } else { Region::Outside }
    }
}

#[cfg(test)]
mod tests;
