//! All pairs of a robot at a configuration.

use nalgebra::{IsometryMatrix3, Point3};

use super::{
    Shape,
    body::{Bodies, Body},
    solid::Solid,
    triangle::{self, Triangle},
};

/// What a configuration does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// No pair touches.
    Free,
    /// A pair does.
    Collides {
        /// Its place in [`Bodies::pairs`].
        pair: usize,
        /// How far every point of the one body may move, seen from the other, without the two ceasing to overlap [m]: a
        /// lower bound; 0 where only their surfaces are known to touch.
        depth: f64,
    },
}

/// Checks configurations of one robot; built once, used by any thread.
#[derive(Clone, Debug)]
pub struct CollisionChecker {
    bodies: Vec<Option<CheckedBody>>,
    pairs: Vec<[usize; 2]>,
}

#[derive(Clone, Debug)]
struct CheckedBody {
    link: usize,
    centre: Point3<f64>,
    radius: f64,
    solid: Solid,
}

/// Where the links of a configuration are: what one check needs of it.
pub type LinkFrames = [IsometryMatrix3<f64>];

impl CollisionChecker {
    /// Prepares every body that stands in a pair.
    pub fn new(bodies: &Bodies) -> Self {
        let used = |place: usize| bodies.pairs.iter().any(|pair| pair.contains(&place));
        let prepared = bodies.bodies.iter().enumerate().map(|(place, body)| {
            let triangles = if used(place) { triangles_of(body) } else { Vec::new() };
            (!triangles.is_empty()).then(|| {
                let solid = Solid::new(triangles);
                let (centre, radius) = solid.ball();
                CheckedBody { link: body.link, centre, radius, solid }
            })
        });
        Self { bodies: prepared.collect(), pairs: bodies.pairs.clone() }
    }

    /// Whether any pair touches. `links` are the frames of the links in the world, the world itself first (see
    /// [`Body::link`]); `first` is the pair to look at first, such as the one that touched a moment ago.
    pub fn check(&self, links: &LinkFrames, first: usize) -> Verdict {
        let order = [first].into_iter().chain((0..self.pairs.len()).filter(|pair| *pair != first));
        let mut near = Vec::new();
        for pair in order.filter(|pair| *pair < self.pairs.len()) {
            let Some((low, high)) = self.near(pair, links) else { continue };
            let low_from_high = links[low.link].inv_mul(&links[high.link]);
            if let Some(depth) = low.solid.overlap(&high.solid, &low_from_high) {
                return Verdict::Collides { pair, depth };
            }
            near.push((pair, low_from_high));
        }
        for (pair, low_from_high) in near {
            let [low, high] = self.pairs[pair].map(|place| self.bodies[place].as_ref());
            if let (Some(low), Some(high)) = (low, high)
                && low.solid.touches(&high.solid, &low_from_high)
            {
                return Verdict::Collides { pair, depth: 0.0 };
            }
        }
        Verdict::Free
    }

    /// The bodies of a pair whose balls meet.
    fn near(&self, pair: usize, links: &LinkFrames) -> Option<(&CheckedBody, &CheckedBody)> {
        let [low, high] = self.pairs[pair].map(|place| self.bodies[place].as_ref());
        let (low, high) = (low?, high?);
        let between = links[low.link] * low.centre - links[high.link] * high.centre;
        let reach = low.radius + high.radius;
        (between.norm_squared() <= reach * reach).then_some((low, high))
    }
}

/// A body's surface in the frame of its link.
fn triangles_of(body: &Body) -> Vec<Triangle> {
    let mut all = Vec::new();
    for geometry in &body.geometries {
        let place = |point: Point3<f64>| geometry.link_from_shape * point;
        match &geometry.shape {
            Shape::Box { half } => all.extend(box_triangles(*half).map(|triangle| triangle.map(place))),
            Shape::Mesh(mesh) => all.extend(
                mesh.triangles.iter().map(|triangle| triangle.map(|corner| place(mesh.corners[corner as usize]))),
            ),
            Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Cylinder { .. } => {}
        }
    }
    all.retain(triangle::has_area);
    all
}

/// The twelve triangles of a box around the origin.
fn box_triangles(half: [f64; 3]) -> [Triangle; 12] {
    let corner = |bits: u8| {
        Point3::from(std::array::from_fn(|axis| if bits >> axis & 1 == 0 { -half[axis] } else { half[axis] }))
    };
    const SIDES: [[u8; 3]; 12] = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    SIDES.map(|side| side.map(corner))
}
