//! All pairs of a robot at a configuration.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{
    Shape,
    body::{Bodies, Body, Geometry},
    curved::Curved,
    solid::{Care, Solid},
    triangle::{self, Triangle},
};
use kernel::geom::{NoSurface, SimdLevel};

/// Verdict on a configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CollisionVerdict {
    /// No pair touches.
    Free,
    /// A pair does.
    Collides(Hit),
}

/// A pair that touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index in [`Bodies::pairs`].
    pub pair: usize,
    meeting: Meeting,
}

/// Two shapes of a pair that meet.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Meeting {
    shapes: Shapes,
    /// Near where, in the frame that the search had.
    near: Point3<f64>,
}

/// Shapes of the first and of the second body of a pair: all that is made of planes, or one curved shape.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shapes {
    Planes,
    PlanesAndCurved(usize),
    CurvedAndPlanes(usize),
    Curved(usize, usize),
}

/// Checks configurations of one robot; built once, used by any thread.
#[derive(Clone)]
pub struct CollisionChecker {
    pub(super) bodies: Vec<Option<PlacedBody>>,
    pub(super) pairs: Vec<Pair>,
    pub(super) links: Vec<usize>,
}

#[derive(Clone, Copy)]
pub(super) struct Pair {
    pub bodies: [usize; 2],
    /// Bound on the squared distance between the centres of balls around two shapes that meet [m^2].
    squared_reach: f64,
}

/// A prepared body, which checkers share, and where this one has it.
#[derive(Clone)]
pub(super) struct PlacedBody {
    pub body: Arc<CheckedBody>,
    pub link: usize,
    /// The body's frame expressed in the link's; `None` where they are the same.
    pub link_from_body: Option<IsometryMatrix3<f64>>,
}

impl PlacedBody {
    /// The body's frame in the world.
    fn frame(&self, links: &LinkFrames) -> IsometryMatrix3<f64> {
        self.link_from_body.map_or(links[self.link], |link_from_body| links[self.link] * link_from_body)
    }
}

/// Shapes of a body in its own frame, prepared for queries.
pub(super) struct CheckedBody {
    pub centre: Point3<f64>,
    pub radius: f64,
    /// Shapes made of planes.
    pub solid: Option<Solid>,
    pub curved: Vec<Curved>,
}

/// By how much less deep two bodies count, so that rounding proves nothing [m].
const MARGIN: f64 = 1e-6;

/// Where the links of a configuration are: what one check needs of it.
pub type LinkFrames = [IsometryMatrix3<f64>];

impl CollisionChecker {
    /// Prepares every body that is part of a pair, for the best instructions of this machine.
    ///
    /// # Errors
    /// When a body has a shape without a surface.
    pub fn new(bodies: &Bodies) -> Result<Self, NoSurface> {
        Self::with_level(bodies, SimdLevel::detect())
    }

    /// [`CollisionChecker::new`] for a level of instructions: each gives the same answers.
    ///
    /// # Errors
    /// Errors of [`CollisionChecker::new`].
    pub fn with_level(bodies: &Bodies, level: SimdLevel) -> Result<Self, NoSurface> {
        Self::prepared(bodies, level, |_| false)
    }

    /// [`CollisionChecker::new`] for a robot among obstacles (see [`CollisionChecker::among`]): every body that moves is
    /// prepared, those of no pair too.
    ///
    /// # Errors
    /// Errors of [`CollisionChecker::new`].
    pub fn for_obstacles(bodies: &Bodies) -> Result<Self, NoSurface> {
        Self::prepared(bodies, SimdLevel::detect(), |body| body.link > 0)
    }

    /// Prepares the bodies that are part of a pair, and those `wanted`.
    fn prepared(bodies: &Bodies, level: SimdLevel, wanted: impl Fn(&Body) -> bool) -> Result<Self, NoSurface> {
        let level = level.usable();
        let used = |index: usize| bodies.pairs.iter().any(|pair| pair.contains(&index));
        let prepared = bodies.bodies.iter().enumerate().map(|(index, body)| {
            if !used(index) && !wanted(body) {
                return Ok(None);
            }
            let checked = Arc::new(CheckedBody::new(&body.geometries, level)?);
            Ok(Some(PlacedBody { body: checked, link: body.link, link_from_body: None }))
        });
        let prepared = prepared.collect::<Result<Vec<_>, NoSurface>>()?;
        let mut checker = Self {
            pairs: Vec::with_capacity(bodies.pairs.len()),
            bodies: prepared,
            links: bodies.bodies.iter().map(|body| body.link).collect(),
        };
        bodies.pairs.iter().for_each(|pair| checker.add_pair(*pair));
        Ok(checker)
    }

    /// Adds a pair of bodies to the list of those that are checked.
    pub(super) fn add_pair(&mut self, bodies: [usize; 2]) {
        let radius = |index: &usize| self.bodies[*index].as_ref().map_or(0.0, |placed| placed.body.radius);
        let reach: f64 = bodies.iter().map(radius).sum();
        self.pairs.push(Pair { bodies, squared_reach: reach * reach });
    }

    /// The pairs, and the links that carry their bodies.
    pub fn pairs(&self) -> impl Iterator<Item = [usize; 2]> {
        self.pairs.iter().map(|pair| pair.bodies.map(|body| self.links[body]))
    }

    /// The link that carries each body (see [`Body::link`]).
    pub fn links(&self) -> impl Iterator<Item = usize> {
        self.links.iter().copied()
    }

    /// The two bodies of a pair (indices in [`Bodies::bodies`]).
    pub fn bodies_of(&self, pair: usize) -> [usize; 2] {
        self.pairs[pair].bodies
    }

    /// Points in the frame of a body's link whose hull contains the body; none if it is part of no pair.
    pub fn corners(&self, body: usize) -> impl Iterator<Item = Point3<f64>> {
        self.bodies[body].iter().flat_map(|placed| {
            let corners = placed.body.corners();
            corners.map(|corner| placed.link_from_body.map_or(corner, |link_from_body| link_from_body * corner))
        })
    }

    /// Whether one of the pairs given (indices in [`Bodies::pairs`]) touches, in this order. `links` are the frames of the
    /// links in the world, the world itself first (see [`Body::link`]).
    pub fn check(&self, pairs: impl IntoIterator<Item = usize>, links: &LinkFrames) -> CollisionVerdict {
        self.hits(pairs, links).next().map_or(CollisionVerdict::Free, CollisionVerdict::Collides)
    }

    /// Pairs among the given ones that touch, in this order; each is evaluated when the iterator reaches it.
    pub fn hits(&self, pairs: impl IntoIterator<Item = usize>, links: &LinkFrames) -> impl Iterator<Item = Hit> {
        let centre = |placed: &PlacedBody| placed.frame(links) * placed.body.centre;
        let centres: Vec<_> = self.bodies.iter().map(|body| body.as_ref().map_or(Point3::origin(), centre)).collect();
        let near = move |pair: &usize| {
            let Pair { bodies: [first, second], squared_reach } = self.pairs[*pair];
            (centres[first] - centres[second]).norm_squared() <= squared_reach
        };
        pairs.into_iter().filter(near).filter_map(|pair| self.hit(pair, links))
    }

    /// Whether the two bodies of a pair (its index in [`Bodies::pairs`]) touch.
    pub fn pair(&self, pair: usize, links: &LinkFrames) -> bool {
        self.check([pair], links) != CollisionVerdict::Free
    }

    /// In how many configurations each pair touches; each configuration is the frames of its links (see
    /// [`CollisionChecker::check`]).
    pub fn count(&self, configurations: impl IntoIterator<Item = Vec<IsometryMatrix3<f64>>>) -> Vec<u64> {
        let mut counts = vec![0; self.pairs.len()];
        for links in configurations {
            for hit in self.hits(0..self.pairs.len(), &links) {
                counts[hit.pair] += 1;
            }
        }
        counts
    }

    /// The pair, if it touches.
    fn hit(&self, pair: usize, links: &LinkFrames) -> Option<Hit> {
        let (first, second, here_from_there) = self.relative(pair, links)?;
        let meeting = first.meets(second, &here_from_there)?;
        Some(Hit { pair, meeting })
    }

    /// The bodies of a pair, and the frame of the second expressed in that of the first.
    pub(super) fn relative(
        &self,
        pair: usize,
        links: &LinkFrames,
    ) -> Option<(&CheckedBody, &CheckedBody, IsometryMatrix3<f64>)> {
        let [first, second] = self.bodies_of(pair).map(|index| self.bodies[index].as_ref());
        let (first, second) = (first?, second?);
        Some((&first.body, &second.body, first.frame(links).inv_mul(&second.frame(links))))
    }

    /// Lower bound on the distance that every point of the one body of a pair may move, expressed in the other's frame,
    /// without the two ceasing to overlap [m]; 0 where only their surfaces are known to touch. `links` are those of the
    /// check. The search ends when more than `enough` is known [m].
    pub fn depth(&self, hit: &Hit, links: &LinkFrames, care: Care, enough: f64) -> f64 {
        let Some((first, second, here_from_there)) = self.relative(hit.pair, links) else { return 0.0 };
        let depth = first.depth(second, &here_from_there, &hit.meeting, care, enough + MARGIN);
        (depth - MARGIN).max(0.0)
    }
}

impl CheckedBody {
    /// From shapes in the body's frame.
    fn new(geometries: &[Geometry], level: SimdLevel) -> Result<Self, NoSurface> {
        let curved: Vec<Curved> = geometries.iter().filter_map(Curved::new).collect();
        let triangles = triangles_of(geometries);
        let solid = if triangles.is_empty() && !curved.is_empty() { None } else { Some(Solid::new(triangles, level)?) };
        Ok(Self::of_parts(solid, curved))
    }

    /// From its solid and its other shapes, at least one of them.
    pub fn of_parts(solid: Option<Solid>, curved: Vec<Curved>) -> Self {
        let balls = solid.iter().map(Solid::ball).chain(curved.iter().map(Curved::ball));
        // A ball around the middle of all: not the smallest, but for one shape.
        let balls: Vec<_> = balls.collect();
        let sum: Vector3<f64> = balls.iter().map(|(centre, _)| centre.coords).sum();
        let centre = Point3::from(sum / balls.len() as f64);
        let radius = balls.iter().map(|(other, radius)| (other - centre).norm() + radius).fold(0.0, f64::max);
        Self { centre, radius, solid, curved }
    }

    fn corners(&self) -> impl Iterator<Item = Point3<f64>> {
        let planes = self.solid.iter().flat_map(|solid| solid.corners().copied());
        planes.chain(self.curved.iter().flat_map(Curved::corners))
    }

    /// Where this body meets another, whose link's frame is expressed in this one's.
    fn meets(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>) -> Option<Meeting> {
        let found = |shapes: Shapes| move |near: Point3<f64>| Meeting { shapes, near };
        // Polyhedra first, then polyhedra and curved shapes, then pairs of curved shapes.
        if let (Some(one), Some(two)) = (&self.solid, &other.solid)
            && let Some(near) = one.meets(two, here_from_there)
        {
            return Some(found(Shapes::Planes)(near));
        }
        if let Some(solid) = &self.solid {
            for (index, curved) in other.curved.iter().enumerate() {
                if self.may_meet(curved, here_from_there)
                    && let Some(near) = solid.meets_curved(curved, here_from_there)
                {
                    return Some(found(Shapes::PlanesAndCurved(index))(near));
                }
            }
        }
        if let (Some(solid), false) = (&other.solid, self.curved.is_empty()) {
            let there_from_here = here_from_there.inverse();
            for (index, curved) in self.curved.iter().enumerate() {
                if other.may_meet(curved, &there_from_here)
                    && let Some(near) = solid.meets_curved(curved, &there_from_here)
                {
                    return Some(found(Shapes::CurvedAndPlanes(index))(near));
                }
            }
        }
        let pairs = self.curved.iter().enumerate();
        pairs
            .flat_map(|one| other.curved.iter().enumerate().map(move |two| (one, two)))
            .find_map(|((i, one), (j, two))| one.meets(two, here_from_there).map(found(Shapes::Curved(i, j))))
    }

    /// Whether a curved shape's ball meets that of this body.
    fn may_meet(&self, curved: &Curved, here_from_there: &IsometryMatrix3<f64>) -> bool {
        let (centre, radius) = curved.ball();
        let reach = self.radius + radius;
        (here_from_there * centre - self.centre).norm_squared() <= reach * reach
    }

    /// Overlap depth of the two where they meet [m]; not above 0 where nothing is known.
    fn depth(
        &self,
        other: &Self,
        here_from_there: &IsometryMatrix3<f64>,
        meeting: &Meeting,
        care: Care,
        enough: f64,
    ) -> f64 {
        let near = &meeting.near;
        match (meeting.shapes, &self.solid, &other.solid) {
            (Shapes::Planes, Some(one), Some(two)) => one.depth(two, here_from_there, near, care, enough),
            (Shapes::PlanesAndCurved(two), Some(one), _) => {
                one.depth_with_curved(&other.curved[two], here_from_there, near, care, enough)
            }
            (Shapes::CurvedAndPlanes(one), _, Some(two)) => {
                two.depth_with_curved(&self.curved[one], &here_from_there.inverse(), near, care, enough)
            }
            (Shapes::Curved(one, two), ..) => self.curved[one].depth(&other.curved[two], here_from_there, near, enough),
            _ => 0.0,
        }
    }
}

/// A body's surface in its own frame, without its round shapes.
pub(super) fn triangles_of(geometries: &[Geometry]) -> Vec<Triangle> {
    let mut all = Vec::new();
    for geometry in geometries {
        let in_link = |point: Point3<f64>| geometry.link_from_shape * point;
        match &geometry.shape {
            Shape::Box { half } => all.extend(box_triangles(*half).map(|triangle| triangle.map(in_link))),
            Shape::Mesh(mesh) => all.extend(
                mesh.triangles.iter().map(|triangle| triangle.map(|corner| in_link(mesh.corners[corner as usize]))),
            ),
            Shape::Sphere { .. } | Shape::Capsule { .. } | Shape::Cylinder { .. } => {}
        }
    }
    all.retain(triangle::has_area);
    all
}

/// The twelve triangles of a box around the origin.
pub(super) fn box_triangles(half: [f64; 3]) -> [Triangle; 12] {
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
