//! Whether a gripper is the same after 180 degrees about its approach: then a grasp and the one rotated so count as one.

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3};

use super::solids::{HandSolids, Solid};
use crate::hand::Hand;
use kernel::geom::Shape;

/// Largest distances between corners of solids that coincide [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SolidTolerances {
    /// Solids of links that close.
    pub(super) fingers: f64,
    /// Solids that hold nothing, such as those of the palm.
    pub(super) others: f64,
}

impl SolidTolerances {
    /// For grasps that count as one: fingers within 0.1 mm, since they determine the contacts, the others within 4 mm, a fifth of the
    /// distance at which two grasps are unlike.
    pub(super) const GRASPS: Self = Self { fingers: 1e-4, others: 0.004 };
}

/// Whether the solids of a hand with a [`Hand::closing_line`] are the same after 180 degrees about the approach, opened and
/// closed, within tolerances. `false` of every other hand.
pub(super) fn is_half_turn_symmetric(hand: &Hand, solids: &HandSolids, tolerances: SolidTolerances) -> bool {
    let half_turn = Rotation3::from_matrix_unchecked(Matrix3::from_diagonal(&[-1.0, -1.0, 1.0].into()));
    let is_same = |posture: &[f64]| {
        let frames = hand.link_frames(&hand.posture_values(posture));
        let approach_from_base = hand.approach_pose(&frames).isometry().inverse();
        let outline = |solid: &Solid| {
            let holds = hand.closing_side(solid.link) != 0.0;
            let tolerance = if holds { tolerances.fingers } else { tolerances.others };
            Outline::of(solid, &(approach_from_base * solid.base_from_shape(&frames)), tolerance)
        };
        let outlines: Vec<Outline> = solids.solids.iter().map(outline).collect();
        // Each rotated solid takes the place of another one, two equal ones of two.
        let mut left: Vec<&Outline> = outlines.iter().collect();
        outlines.iter().all(|outline| {
            let rotated = outline.rotated(&half_turn);
            let other = left.iter().position(|other| rotated.coincides(other));
            other.map(|index| left.swap_remove(index)).is_some()
        })
    };
    hand.closing_line().is_some() && [hand.opened(), hand.closed()].iter().all(|posture| is_same(posture))
}

/// Points that define a solid with its kind and radius.
struct Outline {
    /// Largest distance of corners that coincide [m].
    tolerance: f64,
    shape: u8,
    radius: f64,
    points: Vec<Point3<f64>>,
}

impl Outline {
    /// A solid in a frame.
    fn of(solid: &Solid, frame_from_shape: &IsometryMatrix3<f64>, tolerance: f64) -> Self {
        let ends = |half: f64| vec![Point3::new(0.0, 0.0, -half), Point3::new(0.0, 0.0, half)];
        let (shape, radius, points) = match &solid.shape {
            Shape::Sphere { radius } => (0, *radius, vec![Point3::origin()]),
            Shape::Capsule { radius, half } => (1, *radius, ends(*half)),
            Shape::Cylinder { radius, half } => (2, *radius, ends(*half)),
            Shape::Box { half } => {
                let corner = |index: usize| {
                    Point3::from([0, 1, 2].map(|axis| if index >> axis & 1 == 0 { -half[axis] } else { half[axis] }))
                };
                (3, 0.0, (0..8).map(corner).collect())
            }
            Shape::Mesh(_) => (4, 0.0, Vec::new()),
        };
        Self { tolerance, shape, radius, points: points.into_iter().map(|point| frame_from_shape * point).collect() }
    }

    fn rotated(&self, rotation: &Rotation3<f64>) -> Self {
        Self { points: self.points.iter().map(|point| rotation * point).collect(), ..*self }
    }

    /// Whether another one is the same solid at the same position.
    fn coincides(&self, other: &Self) -> bool {
        let near = |one: &Point3<f64>, other: &Point3<f64>| (one - other).norm() < self.tolerance;
        // No mesh is a solid of a hand.
        (self.shape, self.tolerance) == (other.shape, other.tolerance)
            && !self.points.is_empty()
            && (self.radius - other.radius).abs() < self.tolerance
            && self.points.iter().all(|one| other.points.iter().any(|other| near(one, other)))
    }
}
