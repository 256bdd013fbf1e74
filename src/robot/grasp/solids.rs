//! The solids of a hand, as annealing tests them for overlap with the object and with each other.

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::unsearchable::UnsearchableHand;
use crate::collision::Bodies;
use kernel::{contact::EDGE_RADIUS, geom::Shape};

/// Spacing of the points at which a solid is tested [m]: between two of them, a sharp corner enters a capsule as thick
/// as a finger by 0.2 mm.
pub(super) const SPACING: f64 = 0.004;

/// Overlap of hand and object, or of two links, that is still legal [m].
pub const ALLOWED_OVERLAP: f64 = 1e-4;

/// Solids, balls or virtual contacts that a kernel tests together.
pub(super) const LANES: usize = 16;

/// Sixteen balls in the frame of a link [m]; of fewer the last one is repeated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Balls {
    pub(super) x: [f32; 16],
    pub(super) y: [f32; 16],
    pub(super) z: [f32; 16],
    pub(super) radius: [f32; 16],
}

/// One solid of the hand.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Solid {
    /// Index of the body that it is part of.
    pub(super) body: usize,
    /// Link that carries the solid; 0 is the base.
    pub(super) link: usize,
    pub(super) shape: Shape,
    pub(super) link_from_shape: IsometryMatrix3<f64>,
    /// Centre, in the link's frame.
    pub(super) centre: Point3<f64>,
    /// A ball around its middle holds it.
    pub(super) reach: f64,
    /// A ball around its middle that lies in it.
    pub(super) inner: f64,
    /// Balls around pieces of it: ball i of block j contains block 16 j + i of `balls`.
    pub(super) covers: Vec<Balls>,
    /// Balls in it, from one to the next at most [`SPACING`].
    pub(super) balls: Vec<Balls>,
}

/// The solids of a hand and which of them may meet.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HandSolids {
    pub(super) solids: Vec<Solid>,
    /// Pairs of solids that are kept apart.
    pub(super) pairs: Vec<[usize; 2]>,
}

impl HandSolids {
    /// Solids of a hand that can collide.
    pub(super) fn new(bodies: &Bodies) -> Result<Self, UnsearchableHand> {
        let (mut solids, mut of_body) = (Vec::new(), Vec::new());
        for (index, body) in bodies.bodies.iter().enumerate() {
            let first = solids.len();
            for geometry in &body.geometries {
                let solid = Solid::new([index, body.link], &geometry.shape, geometry.link_from_shape);
                solids.push(solid.ok_or_else(|| UnsearchableHand::Mesh { body: body.name.clone() })?);
            }
            of_body.push(first..solids.len());
        }
        let all = |[one, other]: &[usize; 2]| {
            let (one, other) = (of_body[*one].clone(), of_body[*other].clone());
            one.flat_map(move |one| other.clone().map(move |other| [one, other])).collect::<Vec<_>>()
        };
        let pairs = bodies.pairs.iter().flat_map(all).collect();
        Ok(Self { solids, pairs })
    }

    /// Farthest extent of a link's solids along a direction of unit length in the base frame, from the base frame's origin
    /// [m]; minus infinity where the link has none.
    pub(super) fn reach_along(&self, link: usize, direction: &Vector3<f64>, frames: &[IsometryMatrix3<f64>]) -> f64 {
        let of_link = self.solids.iter().filter(|solid| solid.link == link);
        of_link.map(|solid| solid.reach_along(direction, frames)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The ball in a link's solids that ends farthest along a direction of unit length in the base frame: its centre in
    /// that frame, and its radius [m]; `None` if the link has none.
    pub(super) fn farthest_ball(
        &self,
        link: usize,
        direction: &Vector3<f64>,
        frames: &[IsometryMatrix3<f64>],
    ) -> Option<(Point3<f64>, f64)> {
        let base_from_link = |point: Point3<f64>| if link == 0 { point } else { frames[link - 1] * point };
        let balls = self.solids.iter().filter(|solid| solid.link == link).flat_map(|solid| &solid.balls);
        let each = balls.flat_map(|block| {
            (0..LANES).map(|lane| {
                let centre = Point3::new(block.x[lane], block.y[lane], block.z[lane]).map(f64::from);
                (base_from_link(centre), f64::from(block.radius[lane]))
            })
        });
        let end = |(centre, radius): &(Point3<f64>, f64)| centre.coords.dot(direction) + radius;
        each.max_by(|one, other| end(one).total_cmp(&end(other)))
    }
}

impl Solid {
    /// A shape of a body, given by its index and its link.
    fn new([body, link]: [usize; 2], shape: &Shape, link_from_shape: IsometryMatrix3<f64>) -> Option<Self> {
        let (reach, inner) = match shape {
            Shape::Sphere { radius } => (*radius, *radius),
            Shape::Capsule { radius, half } => (radius + half, *radius),
            Shape::Box { half } => (Vector3::from(*half).norm(), half.iter().fold(f64::INFINITY, |a, b| a.min(*b))),
            Shape::Cylinder { radius, half } => ((radius * radius + half * half).sqrt(), radius.min(*half)),
            Shape::Mesh(_) => return None,
        };
        let (mut covers, mut balls) = (Vec::new(), Vec::new());
        for piece in pieces(shape)? {
            let placed: Vec<_> = piece.iter().map(|(at, radius)| (link_from_shape * at, *radius)).collect();
            let middle = placed.iter().fold(Vector3::zeros(), |sum, (at, _)| sum + at.coords) / placed.len() as f64;
            let middle = Point3::from(middle);
            let far = placed.iter().map(|(at, radius)| (at - middle).norm() + radius).fold(0.0, f64::max);
            covers.push((middle, far));
            balls.push(Balls::of(&placed));
        }
        let covers = covers.chunks(16).map(Balls::of).collect();
        let centre = link_from_shape * Point3::origin();
        Some(Self { body, link, shape: shape.clone(), link_from_shape, centre, reach, inner, covers, balls })
    }

    /// The solid's own frame expressed in the hand's base frame; `frames` are those of the links.
    pub(super) fn base_from_shape(&self, frames: &[IsometryMatrix3<f64>]) -> IsometryMatrix3<f64> {
        match self.link.checked_sub(1) {
            Some(link) => frames[link] * self.link_from_shape,
            None => self.link_from_shape,
        }
    }

    /// Extent along a direction of unit length in the base frame, from the base frame's origin [m].
    pub(super) fn reach_along(&self, direction: &Vector3<f64>, frames: &[IsometryMatrix3<f64>]) -> f64 {
        let base_from_shape = self.base_from_shape(frames);
        let along = base_from_shape.rotation.inverse() * direction;
        base_from_shape.translation.vector.dot(direction) + self.shape.reach_along(&along)
    }
}

impl Balls {
    /// Block of one to sixteen balls.
    fn of(balls: &[(Point3<f64>, f64)]) -> Self {
        let one = |lane: usize| balls[lane.min(balls.len() - 1)];
        Self {
            x: std::array::from_fn(|lane| one(lane).0.x as f32),
            y: std::array::from_fn(|lane| one(lane).0.y as f32),
            z: std::array::from_fn(|lane| one(lane).0.z as f32),
            radius: std::array::from_fn(|lane| one(lane).1 as f32),
        }
    }
}

/// Balls that lie together: centres and radii [m].
type Piece = Vec<(Point3<f64>, f64)>;

/// Balls in a shape, its own frame, in groups of at most sixteen that lie together. Edges of boxes and cylinders are rounded,
/// as those of [`Probe`](kernel::contact::Probe)s are. `None` for a mesh.
fn pieces(shape: &Shape) -> Option<Vec<Piece>> {
    Some(match shape {
        Shape::Sphere { radius } => vec![vec![(Point3::origin(), *radius)]],
        // Capsules: balls along the axis.
        Shape::Capsule { radius, half } => {
            let axis: Vec<_> = along(*half).map(|z| (Point3::new(0.0, 0.0, z), *radius)).collect();
            axis.chunks(16).map(<[_]>::to_vec).collect()
        }
        // Boxes: balls of the edge's radius, inset from the six faces.
        Shape::Box { half } => {
            let inset = half.iter().fold(EDGE_RADIUS, |min, side| min.min(side / 2.0));
            let core = half.map(|side| side - inset);
            let mut patches = Vec::new();
            for axis in 0..3 {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                for side in [-core[axis], core[axis]] {
                    let point = |a: f64, b: f64| {
                        let mut at = Point3::origin();
                        (at[axis], at[u], at[v]) = (side, a, b);
                        at
                    };
                    patches.extend(patch(core[u], core[v], inset, point));
                }
            }
            patches
        }
        // Cylinders: mantle unrolled to a rectangle of arc length by height, and two discs.
        Shape::Cylinder { radius, half } => {
            let inset = EDGE_RADIUS.min(radius / 2.0).min(half / 2.0);
            let [across, height] = [radius - inset, half - inset];
            let girth = std::f64::consts::PI * across;
            let mantle = patch(girth, height, inset, |arc, z| {
                let (sin, cos) = libm::sincos(arc / across);
                Point3::new(across * cos, across * sin, z)
            });
            let disc = |z: f64| {
                patch(across, across, inset, move |x, y| {
                    // Corners of the square fall onto the rim.
                    let away = (x * x + y * y).sqrt();
                    let scale = if away > across { across / away } else { 1.0 };
                    Point3::new(x * scale, y * scale, z)
                })
            };
            [mantle, disc(-height), disc(height)].concat()
        }
        Shape::Mesh(_) => return None,
    })
}

/// From -half to half, both with.
fn along(half: f64) -> impl Iterator<Item = f64> + Clone {
    let steps = ((2.0 * half / SPACING).ceil() as usize).max(1);
    (0..=steps).map(move |step| half * (2.0 * step as f64 / steps as f64 - 1.0))
}

/// A rectangle of balls of one radius, four by four together.
fn patch(half_u: f64, half_v: f64, radius: f64, point: impl Fn(f64, f64) -> Point3<f64>) -> Vec<Piece> {
    let [us, vs]: [Vec<f64>; 2] = [along(half_u).collect(), along(half_v).collect()];
    let square = |us: &[f64], vs: &[f64]| {
        us.iter().flat_map(|u| vs.iter().map(|v| (point(*u, *v), radius)).collect::<Vec<_>>()).collect()
    };
    us.chunks(4).flat_map(|us| vs.chunks(4).map(|vs| square(us, vs)).collect::<Vec<_>>()).collect()
}

/// Signed distance from a solid to a point in its own frame [m]; of a box and a cylinder without rounded edges.
pub(super) fn distance_to(shape: &Shape, point: &Point3<f64>) -> f64 {
    let beyond_box = |beyond: Vector3<f64>| beyond.map(|part| part.max(0.0)).norm() + beyond.max().min(0.0);
    match shape {
        Shape::Sphere { radius } => point.coords.norm() - radius,
        Shape::Capsule { radius, half } => {
            let aside = Vector3::new(point.x, point.y, point.z - point.z.clamp(-half, *half));
            aside.norm() - radius
        }
        Shape::Box { half } => beyond_box(point.coords.abs() - Vector3::from(*half)),
        Shape::Cylinder { radius, half } => {
            let away = (point.x * point.x + point.y * point.y).sqrt();
            beyond_box(Vector3::new(away - radius, point.z.abs() - half, f64::NEG_INFINITY))
        }
        Shape::Mesh(_) => f64::INFINITY,
    }
}
