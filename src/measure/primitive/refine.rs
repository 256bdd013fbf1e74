//! A shape fitted anew to all points near its surface.

use nalgebra::{Matrix3, Point3, SMatrix, SVector, Vector3};

use super::{
    draw::{cuboid_between, cylinder},
    evidence::TOLERANCE,
    shape::Primitive,
};
use crate::seen_cells::SeenPoint;

/// Cosine of the angle between a normal and an axis of a box from which on the point lies on the side there: 26 degrees.
const ON_SIDE: f64 = 0.9;
/// Cosine below which a point is on the round side of a cylinder: 60 degrees from the axis.
const ON_ROUND: f64 = 0.5;
/// Share of the points near a box that must be on a side to determine its position.
const SIDE_SHARE: f64 = 0.05;

/// The shape of the same kind that fits the points near its surface best; `None` if they do not determine it.
pub(super) fn refined(shape: &Primitive, points: &[SeenPoint]) -> Option<Primitive> {
    let is_near = |point: &&SeenPoint| shape.signed_distance(&point.position).abs() <= TOLERANCE;
    let near: Vec<SeenPoint> = points.iter().filter(is_near).copied().collect();
    match shape {
        Primitive::Ball { .. } => {
            let positions: Vec<Vector3<f64>> = near.iter().map(|point| point.position.coords).collect();
            let (centre, radius) = fitted_round(&positions)?;
            Some(Primitive::Ball { centre: centre.into(), radius })
        }
        Primitive::Cylinder { axis, .. } => refined_cylinder(axis, &near, points),
        Primitive::Cuboid { centre, axes, half_sides } => refined_cuboid((centre, axes, half_sides), &near),
    }
}

/// Centre and radius of the circle or sphere that fits points best, by least squares of the powers of the points (Kåsa 1976, "A
/// circle fitting procedure and its error analysis").
fn fitted_round<const D: usize>(points: &[SVector<f64, D>]) -> Option<(SVector<f64, D>, f64)> {
    if points.len() <= D {
        return None;
    }
    let mean = points.iter().sum::<SVector<f64, D>>() / points.len() as f64;
    let (mut squares, mut moments, mut power) = (SMatrix::<f64, D, D>::zeros(), SVector::<f64, D>::zeros(), 0.0);
    for offset in points.iter().map(|point| point - mean) {
        let square = offset.norm_squared();
        squares += offset * offset.transpose();
        moments += offset * square;
        power += square;
    }
    let offset = squares.try_inverse()? * moments * 0.5;
    let radius = (power / points.len() as f64 + offset.norm_squared()).sqrt();
    radius.is_finite().then_some((mean + offset, radius))
}

/// Normals of the round side lie across the axis: it is the direction in which they have the smallest moment.
fn refined_cylinder(axis: &Vector3<f64>, near: &[SeenPoint], points: &[SeenPoint]) -> Option<Primitive> {
    let round: Vec<&SeenPoint> = near.iter().filter(|point| point.normal.dot(axis).abs() < ON_ROUND).collect();
    if round.len() <= 3 {
        return None;
    }
    let moments: Matrix3<f64> = round.iter().map(|point| point.normal * point.normal.transpose()).sum();
    let eigen = moments.symmetric_eigen();
    let smallest = eigen.eigenvalues.imin();
    let axis: Vector3<f64> = eigen.eigenvectors.column(smallest).normalize();
    // Two directions across it.
    let one = Vector3::ith(axis.iamin(), 1.0).cross(&axis).normalize();
    let other = axis.cross(&one);
    let flat: Vec<SVector<f64, 2>> = round
        .iter()
        .map(|point| SVector::from([point.position.coords.dot(&one), point.position.coords.dot(&other)]))
        .collect();
    let (middle, radius) = fitted_round(&flat)?;
    let point = Point3::from(one * middle.x + other * middle.y);
    Some(cylinder(point, axis, radius, points))
}

/// Each seen side turns the box and lies where its points do; sides that were not seen stay.
fn refined_cuboid(
    (centre, axes, half_sides): (&Point3<f64>, &[Vector3<f64>; 3], &[f64; 3]),
    near: &[SeenPoint],
) -> Option<Primitive> {
    let of_side = |axis: &Vector3<f64>| -> Vec<&SeenPoint> {
        near.iter().filter(|point| point.normal.dot(axis).abs() >= ON_SIDE).collect()
    };
    // Normals of both sides along an axis, as if they were those of one; the axis with the most points first.
    let mut supported: Vec<(usize, usize, Vector3<f64>)> = (0..3)
        .map(|side| {
            let members = of_side(&axes[side]);
            let sum = members.iter().map(|point| point.normal * point.normal.dot(&axes[side]).signum());
            (side, members.len(), sum.sum::<Vector3<f64>>())
        })
        .collect();
    supported.sort_by_key(|(_, count, _)| std::cmp::Reverse(*count));
    let first = supported[0].2.try_normalize(1e-9)?;
    let second = if supported[1].1 > 0 { supported[1].2 } else { axes[supported[1].0] };
    let second = (second - first * second.dot(&first)).try_normalize(1e-9)?;
    let mut turned = *axes;
    turned[supported[0].0] = first;
    turned[supported[1].0] = second;
    let third = first.cross(&second);
    turned[supported[2].0] = third * third.dot(&axes[supported[2].0]).signum();
    // Ends along each axis.
    let spans = [0, 1, 2].map(|side| {
        let (axis, middle) = (turned[side], centre.coords.dot(&turned[side]));
        [-1.0, 1.0].map(|sense| {
            let old = middle + sense * half_sides[side];
            let heights = near.iter().filter(|point| sense * point.normal.dot(&axis) >= ON_SIDE);
            let heights: Vec<f64> = heights.map(|point| point.position.coords.dot(&axis)).collect();
            let is_seen = heights.len() as f64 >= SIDE_SHARE * near.len() as f64 && !heights.is_empty();
            if is_seen { heights.iter().sum::<f64>() / heights.len() as f64 } else { old }
        })
    });
    spans.iter().all(|[low, high]| low <= high).then(|| cuboid_between(turned, spans))
}
