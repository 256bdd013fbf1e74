//! Surroundings of an object in a scene, as touch and lines of sight meet them.

use nalgebra::{Point3, Unit, Vector3};

use super::surface::TouchSurface;
use kernel::geom::{CameraCv, Object, Pose, Ray, World};

/// Surroundings of an object in a scene; nothing by default.
#[derive(Default)]
pub struct TouchObstacles<'a> {
    things: Vec<Obstacle<'a>>,
    table: Option<Table<'a>>,
}

/// A thing with a surface.
struct Obstacle<'a> {
    number: u8,
    surface: &'a TouchSurface,
    /// Closed and wound outward: what a ray leaves first is what it starts in.
    is_solid: bool,
    thing_from_camera: Pose<Object, CameraCv>,
}

/// The table: all below its height is solid, its top is what hides.
struct Table<'a> {
    number: u8,
    top: &'a TouchSurface,
    /// Height of the top [m].
    height: f64,
    world_from_camera: &'a Pose<World, CameraCv>,
}

/// Obstacle of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Met {
    /// Number of the thing.
    pub number: u8,
    /// From the ray's start [m]; 0 where it starts inside.
    pub distance: f64,
}

impl<'a> TouchObstacles<'a> {
    /// Adds a thing by its number. `is_solid`: its surface is closed and wound outward.
    pub fn add(
        &mut self,
        number: u8,
        surface: &'a TouchSurface,
        is_solid: bool,
        camera_from_thing: &Pose<CameraCv, Object>,
    ) {
        self.things.push(Obstacle { number, surface, is_solid, thing_from_camera: camera_from_thing.inverse() });
    }

    /// Sets the table, whose top has this height in the world [m].
    pub fn set_table(
        &mut self,
        number: u8,
        top: &'a TouchSurface,
        height: f64,
        world_from_camera: &'a Pose<World, CameraCv>,
    ) {
        self.table = Some(Table { number, top, height, world_from_camera });
    }

    /// The first thing that a ray from a point meets, nearer than `reach` [m]; of things at the same distance the one with the lowest
    /// number. A ray that starts inside of something meets that at once.
    pub(super) fn first_met(&self, start: &Point3<f64>, direction: &Unit<Vector3<f64>>, reach: f64) -> Option<Met> {
        let met = self.things.iter().filter_map(|thing| thing.met(start, direction));
        let met = met.chain(self.table.iter().filter_map(|table| table.met(start, direction)));
        met.filter(|met| met.distance < reach)
            .min_by(|one, other| one.distance.total_cmp(&other.distance).then(one.number.cmp(&other.number)))
    }

    /// Whether an obstacle is between a point and the camera, less than `length` along the line to it [m].
    pub(super) fn hides(&self, start: &Point3<f64>, towards_camera: &Unit<Vector3<f64>>, length: f64) -> bool {
        let table_hides = |table: &Table| {
            let [start, way] = [table.world_from_camera.point(start).coords, table.rotated(towards_camera)];
            table.top.blocks(&Ray::new(&start.into(), &Unit::new_unchecked(way)), length)
        };
        self.things.iter().any(|thing| thing.surface.blocks(&thing.ray(start, towards_camera), length))
            || self.table.as_ref().is_some_and(table_hides)
    }
}

impl Obstacle<'_> {
    /// A ray, expressed in the frame of the thing.
    fn ray(&self, start: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> Ray {
        Ray::new(&self.thing_from_camera.point(start), &self.direction(direction))
    }

    fn direction(&self, direction: &Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
        Unit::new_normalize(self.thing_from_camera.rotation() * direction.into_inner())
    }

    fn met(&self, start: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> Option<Met> {
        let (distance, normal) = self.surface.first_hit(&self.ray(start, direction))?;
        let leaves = self.is_solid && normal.dot(&self.direction(direction)) > 0.0;
        Some(Met { number: self.number, distance: if leaves { 0.0 } else { distance } })
    }
}

impl Table<'_> {
    /// A direction, expressed in the world.
    fn rotated(&self, direction: &Unit<Vector3<f64>>) -> Vector3<f64> {
        self.world_from_camera.rotation() * direction.into_inner()
    }

    fn met(&self, start: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> Option<Met> {
        let above = self.world_from_camera.point(start).z - self.height;
        let down = -self.rotated(direction).z;
        let distance = match above {
            above if above < 0.0 => Some(0.0),
            above => (down > 0.0).then(|| above / down),
        };
        distance.map(|distance| Met { number: self.number, distance })
    }
}
