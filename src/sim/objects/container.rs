//! Containers that bodies settle in.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3};

use kernel::{
    contact::ContactBody,
    geom::{Aabb, TriMesh},
};

/// Thickness of the box that represents the plane, and half its sides [m].
const GROUND: [f64; 2] = [2.0, 1e3];

/// Container of a scene, fixed in the world.
#[derive(Clone)]
pub enum Container {
    /// The plane z = 0. A body whose centre of mass ends outside of a rectangle around the origin is gone.
    Plane {
        /// Sides of the rectangle [m].
        size: [f64; 2],
    },
    /// A box without a lid, or another vessel. A body whose centre of mass ends outside of its walls is gone.
    Bin(Vessel),
}

/// An open container in the world, possibly tilted. The origin of its own frame is the middle of its floor, z out of
/// it.
#[derive(Clone)]
pub struct Vessel {
    /// Mesh of walls and floor, in the world.
    pub body: Arc<ContactBody>,
    /// Room inside along x, y and z, around the middle of the floor [m].
    pub inner: [f64; 3],
    /// Where a body belongs to it, along x and y of the own frame, around the middle of the floor [m].
    pub reach: [f64; 2],
    /// Boxes of the own frame that hands touch [m]; without any they touch the mesh.
    pub boxes: Vec<Aabb>,
    /// Pose of the own frame.
    pub world_from_vessel: IsometryMatrix3<f64>,
}

/// Room that bodies are dropped into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DropRoom {
    /// Where the floor is and nothing above it, along x and y [m]: a tilted wall hangs over a part of it.
    pub sides: [[f64; 2]; 2],
    /// Where the mouth is, along x and y [m].
    pub mouth: [[f64; 2]; 2],
    /// Height of the floor, where it is highest [m].
    pub floor: f64,
    /// Height of the rim, where it is highest [m].
    pub rim: f64,
}

impl DropRoom {
    /// The room between upright walls around the origin.
    pub fn upright([x, y]: [f64; 2], rim: f64) -> Self {
        let sides = [x, y].map(|side| [-side / 2.0, side / 2.0]);
        Self { sides, mouth: sides, floor: 0.0, rim }
    }
}

impl Vessel {
    /// A box of this room inside and walls this thick [m]; `body` is its mesh in the world.
    pub fn open_box(
        body: Arc<ContactBody>,
        inner: [f64; 3],
        wall: f64,
        world_from_vessel: IsometryMatrix3<f64>,
    ) -> Self {
        let [x, y] = [inner[0] / 2.0, inner[1] / 2.0];
        let outer = TriMesh::open_box(inner, wall).aabb().expect("a box has walls");
        let (min, max) = (outer.min, outer.max);
        let part = |low: [f64; 2], high: [f64; 2], top: f64| Aabb {
            min: Point3::new(low[0], low[1], min.z),
            max: Point3::new(high[0], high[1], top),
        };
        let boxes = vec![
            part([min.x, min.y], [max.x, max.y], 0.0),
            part([min.x, min.y], [-x, max.y], max.z),
            part([x, min.y], [max.x, max.y], max.z),
            part([-x, min.y], [x, -y], max.z),
            part([-x, y], [x, max.y], max.z),
        ];
        Self { body, inner, reach: [inner[0], inner[1]], boxes, world_from_vessel }
    }

    /// A vessel of any shape: `own` is its mesh in its own frame, `body` in the world, `inner` the room inside that is free of
    /// it [m]. Its walls may lean outward, so that a body belongs to it within the mesh's bounds.
    pub fn of_mesh(
        own: &TriMesh,
        body: Arc<ContactBody>,
        inner: [f64; 3],
        world_from_vessel: IsometryMatrix3<f64>,
    ) -> Self {
        let bounds = own.aabb().expect("a vessel has walls");
        let reach = [0, 1].map(|axis| 2.0 * bounds.max[axis].max(-bounds.min[axis]));
        Self { body, inner, reach, boxes: Vec::new(), world_from_vessel }
    }

    /// Room that bodies are dropped into.
    fn drop_room(&self) -> DropRoom {
        let [x, y, z] = self.inner;
        let level = |height: f64| {
            let [x, y] = [x / 2.0, y / 2.0];
            let corners = [[-x, -y], [x, -y], [x, y], [-x, y]];
            let around = Aabb { min: Point3::from([f64::MAX; 3]), max: Point3::from([f64::MIN; 3]) };
            corners.into_iter().fold(around, |Aabb { min, max }, [x, y]| {
                let corner = self.world_from_vessel * Point3::new(x, y, height);
                Aabb { min: min.inf(&corner), max: max.sup(&corner) }
            })
        };
        let (floor, mouth) = (level(0.0), level(z));
        let along = |axis: usize| [floor.min[axis].max(mouth.min[axis]), floor.max[axis].min(mouth.max[axis])];
        let of_mouth = |axis: usize| [mouth.min[axis], mouth.max[axis]];
        DropRoom { sides: [0, 1].map(along), mouth: [0, 1].map(of_mouth), floor: floor.max.z, rim: mouth.max.z }
    }

    fn contains(&self, point: &Point3<f64>) -> bool {
        let [x, y] = self.reach;
        let own = self.world_from_vessel.inverse_transform_point(point);
        own.x.abs() <= x / 2.0 && own.y.abs() <= y / 2.0 && own.z > 0.0
    }
}

impl Container {
    /// Room that bodies are dropped into.
    pub(crate) fn drop_room(&self) -> DropRoom {
        match self {
            Self::Plane { size } => DropRoom::upright(*size, 0.0),
            Self::Bin(bin) => bin.drop_room(),
        }
    }

    /// Whether a point is in the room of a bin, or over the rectangle of a plane.
    pub(crate) fn contains(&self, point: &Point3<f64>) -> bool {
        match self {
            Self::Plane { size: [x, y] } => point.x.abs() <= x / 2.0 && point.y.abs() <= y / 2.0 && point.z > 0.0,
            Self::Bin(bin) => bin.contains(point),
        }
    }

    /// Box around the container, in the world [m]; a plane is the top of a wide one.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Plane { .. } => {
                let [thickness, half] = GROUND;
                Aabb { min: Point3::new(-half, -half, -thickness), max: Point3::new(half, half, 0.0) }
            }
            Self::Bin(Vessel { body, .. }) => *body.surface().bounds(),
        }
    }
}
