//! Boxes inside of a hand's solids, swept along a straight approach.
//!
//! A convex solid sweeps the hull of its two ends; a box with an edge along the approach sweeps a longer box, so that one test
//! decides the whole way. The boxes lie inside of what the exact path keeps clear: a box that meets something is blocked for sure.

use nalgebra::{IsometryMatrix3, Matrix3, Translation3, Vector3};

use super::super::{
    passage::Passage,
    solids::{ALLOWED_OVERLAP, HandSolids, Solid},
    table::STAND_OFF,
};
use kernel::{contact::EDGE_RADIUS, geom::Shape};

/// The exact path may report a distance that is too large by its tolerance, and counts as free what is nearer than its margin by
/// less [m].
const SLACK: f64 = 2.0 * Passage::TOLERANCE;

/// The exact path allows an overlap with the body itself, and resolves a deeper one to this [m].
const RESOLVED: f64 = 1e-4;

/// A box's axis is parallel to the approach where the cosine of the angle between them is at least this.
const PARALLEL: f64 = 1.0 - 1e-12;

/// A hand's solid as boxes inside of it, before the hand is placed.
#[derive(Clone, Copy, Debug)]
pub(super) struct InnerBox {
    /// Index of the solid.
    solid: usize,
    /// Half the sides of a box in everything that keeps the margin from obstacles [m].
    margin: Vector3<f64>,
    /// Half the sides of a box in the solid, shrunk by the overlap with the body that is allowed; none if nothing is left [m].
    own: Option<Vector3<f64>>,
    /// Whether a link that the motor moves carries it.
    pub(super) is_finger: bool,
}

/// A box that a solid sweeps on its way.
#[derive(Clone, Copy, Debug)]
pub(super) struct SweptBox {
    /// Middle and axes, expressed in the base frame.
    pub(super) base_from_box: IsometryMatrix3<f64>,
    /// Half its sides against obstacles [m].
    pub(super) half: Vector3<f64>,
    /// The middle and half the sides of the box against the body itself.
    pub(super) own: Option<(IsometryMatrix3<f64>, Vector3<f64>)>,
    /// Axis along the approach, and whether it points along it; `None` where the box is not swept.
    pub(super) along: Option<(usize, f64)>,
    pub(super) is_finger: bool,
}

impl InnerBox {
    /// The boxes of a hand's solids, fingers first. `side` tells how a link goes along the closing line; `margin` is the distance
    /// that the hand keeps from everything but the body [m].
    pub(super) fn all(solids: &HandSolids, side: impl Fn(usize) -> f64, margin: f64) -> Vec<Self> {
        let of = |(index, solid): (usize, &Solid)| Self::of(index, solid, margin, side(solid.link) != 0.0);
        let mut boxes: Vec<Self> = solids.solids.iter().enumerate().filter_map(of).collect();
        boxes.sort_by_key(|inner| !inner.is_finger);
        boxes
    }

    fn of(solid: usize, shape: &Solid, margin: f64, is_finger: bool) -> Option<Self> {
        let allowed = ALLOWED_OVERLAP + RESOLVED + SLACK;
        let (margin, own) = match &shape.shape {
            Shape::Box { half } => {
                // A core rounded by a radius: a ball of the radius holds a cube of radius / sqrt 3.
                let half = Vector3::from(*half);
                let rounded = EDGE_RADIUS.min(half.min() / 2.0);
                let inner = |radius: f64| half.map(|side| side - rounded + radius.max(0.0) / 3f64.sqrt());
                let shrunk = half.map(|side| side - allowed).inf(&inner(rounded - allowed));
                (inner(rounded + margin - SLACK), shrunk)
            }
            other => {
                let inside = inscribed(other)?;
                (inside, inside.map(|side| side - allowed))
            }
        };
        Some(Self { solid, margin, own: (own.min() > 0.0).then_some(own), is_finger })
    }

    /// The box on the way of a hand along an approach, whose links have these frames; both expressed in the base frame.
    pub(super) fn swept(
        &self,
        solids: &HandSolids,
        frames: &[IsometryMatrix3<f64>],
        approach: &Vector3<f64>,
    ) -> SweptBox {
        let base_from_shape = solids.solids[self.solid].base_from_shape(frames);
        let axes: Matrix3<f64> = *base_from_shape.rotation.matrix();
        let along = (0..3).find_map(|axis| {
            let cos = axes.column(axis).dot(approach);
            (cos.abs() >= PARALLEL).then(|| (axis, cos.signum()))
        });
        let back = Translation3::from(approach * (-STAND_OFF / 2.0));
        let swept = |half: Vector3<f64>| match along {
            None => (base_from_shape, half),
            Some((axis, _)) => {
                let mut half = half;
                half[axis] += STAND_OFF / 2.0;
                (back * base_from_shape, half)
            }
        };
        let (base_from_box, half) = swept(self.margin);
        SweptBox { base_from_box, half, own: self.own.map(swept), along, is_finger: self.is_finger }
    }
}

/// Half the sides of a box in a shape other than a box, well inside of its rounded edges [m].
fn inscribed(shape: &Shape) -> Option<Vector3<f64>> {
    let half = match shape {
        Shape::Sphere { radius } => Vector3::repeat(radius / 3f64.sqrt()),
        Shape::Capsule { radius, half } => Vector3::new(radius / 2f64.sqrt(), radius / 2f64.sqrt(), *half),
        Shape::Cylinder { radius, half } => {
            let inset = EDGE_RADIUS.min(radius / 2.0).min(half / 2.0);
            let across = (radius - inset) / 2f64.sqrt();
            Vector3::new(across, across, half - inset)
        }
        Shape::Box { .. } | Shape::Mesh(_) => return None,
    };
    let half = half.map(|side| side - SLACK);
    (half.min() > 0.0).then_some(half)
}
