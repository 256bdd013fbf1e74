//! Fixed obstacles around an object that a hand explores.

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use sim::{StillShape, StillThing};

/// Fixed obstacles around an object that a hand explores; empty by default.
#[derive(Default)]
pub struct StillAround {
    pub(super) things: Vec<StillThing>,
    /// Number of each thing, by which rows of blocked probes name it.
    pub(super) numbers: Vec<u8>,
    /// Direction of gravity in the object's frame, of unit length; `None` of a lone object.
    pub(super) down: Option<Vector3<f64>>,
}

impl StillAround {
    /// No obstacles yet, in a scene where an object has a pose; z of the scene is up.
    pub fn in_scene(object_from_scene: &IsometryMatrix3<f64>) -> Self {
        Self { down: Some(object_from_scene.rotation * -Vector3::z()), ..Self::default() }
    }

    /// Adds a thing by its number, at a pose expressed in the object's frame.
    pub fn add(&mut self, number: u8, shape: StillShape, object_from_thing: IsometryMatrix3<f64>) {
        self.things.push(StillThing { shape, object_from_thing });
        self.numbers.push(number);
    }

    /// About the distance from everything to a point in the object's frame [m], negative inside.
    pub(super) fn approximate_distance(&self, point: &Point3<f64>) -> f64 {
        let distance = |thing: &StillThing| {
            let local = thing.object_from_thing.inverse_transform_point(point);
            match &thing.shape {
                StillShape::Mesh(surface) => surface.approximate_distance(&local),
                StillShape::Ground => local.z,
            }
        };
        self.things.iter().map(distance).fold(f64::INFINITY, f64::min)
    }
}
