//! All pairs of a robot at a configuration.

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{
    Shape,
    body::{Bodies, Body},
    curved::Curved,
    solid::{Contact, Solid},
    triangle::{self, Triangle},
};
use crate::geom::NoSurface;

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
pub struct CollisionChecker {
    bodies: Vec<Option<CheckedBody>>,
    pairs: Vec<[usize; 2]>,
    links: Vec<usize>,
}

struct CheckedBody {
    link: usize,
    centre: Point3<f64>,
    radius: f64,
    /// What is made of planes.
    solid: Option<Solid>,
    curved: Vec<Curved>,
}

/// Where the links of a configuration are: what one check needs of it.
pub type LinkFrames = [IsometryMatrix3<f64>];

impl CollisionChecker {
    /// Prepares every body that stands in a pair.
    ///
    /// # Errors
    /// When a body has a shape without a surface.
    pub fn new(bodies: &Bodies) -> Result<Self, NoSurface> {
        let used = |place: usize| bodies.pairs.iter().any(|pair| pair.contains(&place));
        let prepared = bodies.bodies.iter().enumerate();
        let prepared = prepared.map(|(place, body)| used(place).then(|| CheckedBody::new(body)).transpose());
        Ok(Self {
            bodies: prepared.collect::<Result<_, _>>()?,
            pairs: bodies.pairs.clone(),
            links: bodies.bodies.iter().map(|body| body.link).collect(),
        })
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
    pub fn corners(&self, body: usize) -> impl Iterator<Item = Point3<f64>> {
        self.bodies[body].iter().flat_map(CheckedBody::corners)
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
            Some((low, high)) => low.contact(high, &links[low.link].inv_mul(&links[high.link])),
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

impl CheckedBody {
    fn new(body: &Body) -> Result<Self, NoSurface> {
        let curved: Vec<Curved> = body.geometries.iter().filter_map(Curved::new).collect();
        let triangles = triangles_of(body);
        let solid = if triangles.is_empty() && !curved.is_empty() { None } else { Some(Solid::new(triangles)?) };
        let balls = solid.iter().map(Solid::ball).chain(curved.iter().map(Curved::ball));
        // A ball around the middle of all: not the smallest, but for one shape.
        let balls: Vec<_> = balls.collect();
        let sum: Vector3<f64> = balls.iter().map(|(centre, _)| centre.coords).sum();
        let centre = Point3::from(sum / balls.len() as f64);
        let radius = balls.iter().map(|(other, radius)| (other - centre).norm() + radius).fold(0.0, f64::max);
        Ok(Self { link: body.link, centre, radius, solid, curved })
    }

    fn corners(&self) -> impl Iterator<Item = Point3<f64>> {
        let planes = self.solid.iter().flat_map(|solid| solid.corners().copied());
        planes.chain(self.curved.iter().flat_map(Curved::corners))
    }

    /// How this body stands to another, whose link's frame is seen from this one's.
    fn contact(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>) -> Contact {
        let planes = self.solid.iter().zip(&other.solid).map(|(one, two)| one.contact(two, here_from_there));
        let mixed = self.solid.iter().flat_map(|solid| {
            other.curved.iter().map(move |curved| solid.contact_with_curved(curved, here_from_there))
        });
        let there_from_here = here_from_there.inverse();
        let mixed_back = other.solid.iter().flat_map(|solid| {
            self.curved.iter().map(move |curved| solid.contact_with_curved(curved, &there_from_here))
        });
        let round =
            self.curved.iter().flat_map(|one| other.curved.iter().map(move |two| one.contact(two, here_from_there)));
        let mut touch = Contact::Apart;
        for contact in planes.chain(mixed).chain(mixed_back).chain(round) {
            match contact {
                Contact::Overlap(_) => return contact,
                Contact::Touch => touch = contact,
                Contact::Apart => {}
            }
        }
        touch
    }
}

/// A body's surface in the frame of its link, without its round shapes.
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
