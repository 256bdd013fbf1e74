//! Boxes around objects, upright on their support plane.

use nalgebra::{Point3, Vector3};

/// A box in `CameraCv`, one of whose axes is the normal of the support plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// Middle [m].
    pub centre: Point3<f64>,
    /// Unit axes, right-handed: the longer and the shorter side of the footprint, and the normal.
    pub axes: [Vector3<f64>; 3],
    /// Full lengths along the axes [m].
    pub size: [f64; 3],
}

impl OrientedBox {
    /// The box with the smallest footprint around points in `CameraCv` [m]: its height is along `up`, a unit vector, and its
    /// footprint is the rectangle of smallest area around the points seen along it. One side of that rectangle lies on a side of
    /// their convex hull (Freeman and Shapira 1975, "Determining the minimum-area encasing rectangle for an arbitrary closed
    /// curve"). `None` without a point, or where the coordinates are not finite.
    pub fn around(points: &[Point3<f64>], up: &Vector3<f64>) -> Option<Self> {
        let helper = if up.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
        let across = (helper - up * up.dot(&helper)).try_normalize(1e-9)?;
        let along = up.cross(&across);
        let flat: Vec<[f64; 2]> =
            points.iter().map(|point| [across.dot(&point.coords), along.dot(&point.coords)]).collect();
        let heights = range(points.iter().map(|point| up.dot(&point.coords)));
        let (direction, [first, second]) = smallest_rectangle(&hull_of(flat))?;
        let height = heights[1] - heights[0];
        if !(height.is_finite() && first.iter().chain(&second).all(|value| value.is_finite())) {
            return None;
        }
        let one = across * direction[0] + along * direction[1];
        let other = up.cross(&one);
        let middle = |[low, high]: [f64; 2]| 0.5 * (low + high);
        let centre = one * middle(first) + other * middle(second) + up * middle(heights);
        let [length, width] = [first, second].map(|[low, high]| high - low);
        // The longer side first; both frames are right-handed.
        let (axes, size) = if length >= width {
            ([one, other, *up], [length, width, height])
        } else {
            ([other, -one, *up], [width, length, height])
        };
        Some(Self { centre: centre.into(), axes, size })
    }
}

/// Smallest and largest value.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
}

/// Corners of the convex hull of points in a plane, counterclockwise (Andrew 1979, "Another efficient algorithm for convex hulls
/// in two dimensions").
fn hull_of(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut hull: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while hull.len() > 1 && area(&hull[hull.len() - 2], &hull[hull.len() - 1], &point) <= 0.0 {
                hull.pop();
            }
            hull.push(point);
        }
        // The last point is the first one of the other chain.
        hull.pop();
        hull
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}

/// Twice the signed area of a triangle.
fn area(a: &[f64; 2], b: &[f64; 2], c: &[f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Direction of a side of the rectangle of smallest area around a convex hull, and the ranges of the corners along it and along the
/// direction a quarter turn from it; the first of equal ones.
fn smallest_rectangle(hull: &[[f64; 2]]) -> Option<([f64; 2], [[f64; 2]; 2])> {
    let mut best: Option<(f64, [f64; 2], [[f64; 2]; 2])> = None;
    for (index, from) in hull.iter().enumerate() {
        let to = hull[(index + 1) % hull.len()];
        let side = [to[0] - from[0], to[1] - from[1]];
        let length = (side[0] * side[0] + side[1] * side[1]).sqrt();
        // A single point has no side.
        let direction = if length > 0.0 { side.map(|value| value / length) } else { [1.0, 0.0] };
        let [x, y] = direction;
        let first = range(hull.iter().map(|point| x * point[0] + y * point[1]));
        let second = range(hull.iter().map(|point| x * point[1] - y * point[0]));
        let area = (first[1] - first[0]) * (second[1] - second[0]);
        if best.as_ref().is_none_or(|(smallest, ..)| area < *smallest) {
            best = Some((area, direction, [first, second]));
        }
    }
    best.map(|(_, direction, ranges)| (direction, ranges))
}

#[cfg(test)]
mod tests {
    use kernel::seed::Stream;
    use nalgebra::{Rotation3, UnitVector3};

    use super::*;

    #[test]
    fn a_box_that_is_rotated_about_the_vertical_is_found() {
        let mut draw = Stream::of_job(2, b"", "boxes");
        for _ in 0..40 {
            let up = UnitVector3::new_normalize(Vector3::new(draw.normal(), draw.normal(), draw.normal()));
            let tilt = Rotation3::rotation_between(&Vector3::z(), &up).unwrap_or_default();
            let turn = Rotation3::from_axis_angle(&up, draw.uniform(0.0, 6.0)) * tilt;
            let size = [0.30, 0.17, 0.08];
            let centre = Vector3::new(draw.normal(), draw.normal(), 2.0);
            let corner = |index: usize| {
                let sign = |axis: usize| if index >> axis & 1 == 1 { 0.5 } else { -0.5 };
                Point3::from(centre + turn * Vector3::new(sign(0) * size[0], sign(1) * size[1], sign(2) * size[2]))
            };
            let mut points: Vec<Point3<f64>> = (0..8).map(corner).collect();
            for _ in 0..50 {
                let inner = Vector3::from(size.map(|length| length * draw.uniform(-0.5, 0.5)));
                points.push(Point3::from(centre + turn * inner));
            }
            let found = OrientedBox::around(&points, &up).expect("a box");
            assert!((found.centre.coords - centre).norm() < 1e-9, "{found:?}");
            for (axis, length) in size.into_iter().enumerate() {
                assert!((found.size[axis] - length).abs() < 1e-9, "{found:?}");
                let truth = turn * Vector3::from_fn(|row, _| f64::from(u8::from(row == axis)));
                assert!((found.axes[axis].dot(&truth).abs() - 1.0).abs() < 1e-9, "{found:?}");
            }
            assert!((found.axes[0].cross(&found.axes[1]) - found.axes[2]).norm() < 1e-9, "right-handed");
        }
    }

    #[test]
    fn few_points_have_a_box_and_no_point_has_none() {
        let up = Vector3::new(0.0, -1.0, 0.0);
        assert_eq!(OrientedBox::around(&[], &up), None);
        let one = OrientedBox::around(&[Point3::new(0.1, 0.2, 0.9)], &up).expect("a box");
        assert_eq!(one.size, [0.0; 3]);
        let two = [Point3::new(0.0, 0.0, 1.0), Point3::new(0.3, 0.0, 1.4)];
        let size = OrientedBox::around(&two, &up).expect("a box").size;
        assert!((size[0] - 0.5).abs() < 1e-12 && size[1] < 1e-12 && size[2] == 0.0, "{size:?}");
        assert_eq!(OrientedBox::around(&[Point3::new(f64::NAN, 0.0, 1.0)], &up), None);
    }
}
