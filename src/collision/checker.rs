//! All pairs of a robot at a configuration.

use nalgebra::{IsometryMatrix3, Point3};

use super::{
    Shape,
    body::{Bodies, Body},
    solid::{Contact, Solid},
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
    links: Vec<usize>,
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
        Self {
            bodies: prepared.collect(),
            pairs: bodies.pairs.clone(),
            links: bodies.bodies.iter().map(|body| body.link).collect(),
        }
    }

    /// The pairs, and the links that carry their bodies.
    pub fn pairs(&self) -> impl Iterator<Item = [usize; 2]> {
        self.pairs.iter().map(|pair| pair.map(|body| self.links[body]))
    }

    /// The link that carries each body (see [`Body::link`]).
    pub fn links(&self) -> impl Iterator<Item = usize> {
        self.links.iter().copied()
    }

    /// The two bodies of a pair (places in [`Bodies::bodies`]).
    pub fn bodies_of(&self, pair: usize) -> [usize; 2] {
        self.pairs[pair]
    }

    /// Points in the frame of a body's link whose hull holds the body; none where it stands in no pair.
    pub fn corners(&self, body: usize) -> impl Iterator<Item = &Point3<f64>> {
        self.bodies[body].iter().flat_map(|body| body.solid.corners())
    }

    /// Whether one of the pairs given (places in [`Bodies::pairs`]) touches, in this order. `links` are the frames of the
    /// links in the world, the world itself first (see [`Body::link`]).
    pub fn check(&self, pairs: impl IntoIterator<Item = usize>, links: &LinkFrames) -> Verdict {
        for pair in pairs {
            match self.contact(pair, links) {
                Contact::Apart => {}
                Contact::Touch => return Verdict::Collides { pair, depth: 0.0 },
                Contact::Overlap(depth) => return Verdict::Collides { pair, depth },
            }
        }
        Verdict::Free
    }

    /// Whether the two bodies of a pair (its place in [`Bodies::pairs`]) touch.
    pub fn pair(&self, pair: usize, links: &LinkFrames) -> bool {
        self.contact(pair, links) != Contact::Apart
    }

    fn contact(&self, pair: usize, links: &LinkFrames) -> Contact {
        match self.near(pair, links) {
            None => Contact::Apart,
            Some((low, high)) => low.solid.contact(&high.solid, &links[low.link].inv_mul(&links[high.link])),
        }
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
