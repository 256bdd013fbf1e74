//! Solids as a core with a thickness.

use nalgebra::{Point3, Vector3};

use crate::geom::Shape;

/// The edges of boxes and cylinders are rounded by this [m]: deeper than any intended contact, so that the core stays
/// outside of the touched surface.
pub const EDGE_RADIUS: f64 = 0.001;

/// A solid whose contacts are searched, in its own frame: all points within `thickness` of a core.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// Half the sides of the core's box [m].
    pub(super) half: [f64; 3],
    /// Whether the core is the cylinder in that box, about z.
    round: bool,
    /// From the core to the solid's surface [m].
    pub(super) thickness: f64,
}

impl Probe {
    /// A ball or a capsule unchanged; a box or a cylinder with its edges rounded by [`EDGE_RADIUS`], or by half of its
    /// smallest half side if that is less. `None` for a mesh.
    pub fn new(shape: &Shape) -> Option<Self> {
        Some(match shape {
            Shape::Sphere { radius } => Self { half: [0.0; 3], round: false, thickness: *radius },
            Shape::Capsule { radius, half } => Self { half: [0.0, 0.0, *half], round: false, thickness: *radius },
            Shape::Box { half } => {
                let thickness = half.iter().fold(EDGE_RADIUS, |min, side| min.min(side / 2.0));
                Self { half: half.map(|side| side - thickness), round: false, thickness }
            }
            Shape::Cylinder { radius, half } => {
                let thickness = EDGE_RADIUS.min(radius / 2.0).min(half / 2.0);
                let [across, along] = [radius - thickness, half - thickness];
                Self { half: [across, across, along], round: true, thickness }
            }
            Shape::Mesh(_) => return None,
        })
    }

    /// A box or a cylinder with sharp edges, a ball or a capsule: for distances, where a contact needs no direction.
    /// The distance to a surface that cuts such a box may be too large: also query with [rounded](Self::new) edges and
    /// use the smaller distance. `None` for a mesh.
    pub fn sharp(shape: &Shape) -> Option<Self> {
        match shape {
            Shape::Box { half } => Some(Self { half: *half, round: false, thickness: 0.0 }),
            Shape::Cylinder { radius, half } => {
                Some(Self { half: [*radius, *radius, *half], round: true, thickness: 0.0 })
            }
            _ => Self::new(shape),
        }
    }

    /// The solid with its surface shrunk by a length all around [m]; a part thinner than that becomes a rectangle, a
    /// disc, a line or a point.
    #[must_use]
    pub fn drawn_in(&self, by: f64) -> Self {
        // What is thicker is drawn in first.
        let of_core = (by - self.thickness).max(0.0);
        let half = self.half.map(|side| (side - of_core).max(0.0));
        Self { half, round: self.round, thickness: (self.thickness - by).max(0.0) }
    }

    /// Widens its faces to those of a box or cylinder with sharp edges: a surface that touches a face next to its edge
    /// is pressed along the face's normal, not outward. Keeps its thickness, the smallest of its sides.
    #[must_use]
    pub fn with_wide_faces(&self) -> Self {
        let least = self.half.iter().copied().fold(f64::INFINITY, f64::min);
        // A line and a point have no faces.
        let has_faces = self.half.iter().filter(|side| **side > 0.0).count() > 1;
        let widened = |side: f64| if has_faces && side > least { side + self.thickness } else { side };
        Self { half: self.half.map(widened), ..*self }
    }

    /// Whether the core is a cylinder about z, not a box.
    pub(super) fn is_round(&self) -> bool {
        self.round
    }

    /// From the origin of its frame to its farthest point at most [m].
    pub fn radius(&self) -> f64 {
        self.core_radius() + self.thickness
    }

    /// Radius of the core's bounding ball [m].
    pub(super) fn core_radius(&self) -> f64 {
        self.half.iter().map(|side| side * side).sum::<f64>().sqrt()
    }

    /// Most contacts that it is given: as MuJoCo has room for a pair of geoms.
    pub fn max_contacts(&self) -> usize {
        match self.half.iter().filter(|side| **side > 0.0).count() {
            0 => 1,
            1 => 2,
            _ => 4,
        }
    }

    /// The solid's farthest point in a direction of unit length, in its frame.
    pub fn support(&self, direction: &Vector3<f64>) -> Point3<f64> {
        self.farthest(direction) + direction * self.thickness
    }

    /// The core's farthest point in a direction.
    pub(super) fn farthest(&self, direction: &Vector3<f64>) -> Point3<f64> {
        let mut farthest =
            Point3::from_slice(&std::array::from_fn::<_, 3, _>(|axis| self.half[axis].copysign(direction[axis])));
        let across = direction.xy().norm();
        if self.round && across > 0.0 {
            let scale = self.half[0] / across;
            (farthest.x, farthest.y) = (direction.x * scale, direction.y * scale);
        }
        farthest
    }

    /// The point of the core next to a point.
    pub(super) fn nearest(&self, point: &Point3<f64>) -> Point3<f64> {
        let mut nearest = Point3::from_slice(&std::array::from_fn::<_, 3, _>(|axis| {
            point[axis].clamp(-self.half[axis], self.half[axis])
        }));
        if self.round {
            let away = point.coords.xy().norm();
            let scale = if away > self.half[0] { self.half[0] / away } else { 1.0 };
            (nearest.x, nearest.y) = (point.x * scale, point.y * scale);
        }
        nearest
    }
}
