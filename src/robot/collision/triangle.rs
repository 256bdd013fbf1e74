//! Triangles: how far a point is from one, and whether two touch.

use nalgebra::{Point3, Vector3};

use super::{parts::Bounds, segment::nearest_points};

/// Three corners [m].
pub(super) type Triangle = [Point3<f64>; 3];

/// Squared distance from a point to a triangle [m^2] (Ericson, Real-Time Collision Detection, 5.1.5).
pub(super) fn squared_distance(point: &Point3<f64>, [a, b, c]: &Triangle) -> f64 {
    // Vertex region of a.
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ap.norm_squared();
    }
    // Vertex region of b.
    let bp = point - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return bp.norm_squared();
    }
    // Edge region of ab: vc is the barycentric coordinate of c, not normalised.
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (ap - ab * (d1 / (d1 - d3))).norm_squared();
    }
    // Vertex region of c.
    let cp = point - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return cp.norm_squared();
    }
    // Edge region of ac.
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (ap - ac * (d2 / (d2 - d6))).norm_squared();
    }
    // Edge region of bc.
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return (bp - (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))).norm_squared();
    }
    // Face region: projection onto the plane by barycentric coordinates.
    let scale = 1.0 / (va + vb + vc);
    (ap - ab * (vb * scale) - ac * (vc * scale)).norm_squared()
}

/// The box of a triangle.
pub(super) fn bounds([a, b, c]: &Triangle) -> Bounds {
    Bounds { low: a.inf(b).inf(c), high: a.sup(b).sup(c) }
}

/// The box of many.
pub(super) fn bounds_of<'a>(triangles: impl IntoIterator<Item = &'a Triangle>) -> Bounds {
    let nothing = Bounds { low: Point3::from([f64::INFINITY; 3]), high: Point3::from([f64::NEG_INFINITY; 3]) };
    triangles.into_iter().map(bounds).fold(nothing, Bounds::with)
}

/// Whether a triangle has an area that rounding does not drown.
pub(super) fn has_area([a, b, c]: &Triangle) -> bool {
    let (ab, ac) = (b - a, c - a);
    ab.cross(&ac).norm_squared() > 1e-24 * ab.norm_squared() * ac.norm_squared()
}

/// Whether two triangles touch: no plane lies between them (separating axes; Gottschalk 1996). Both have an area.
pub(super) fn touch(first: &Triangle, second: &Triangle) -> bool {
    let edges = |[a, b, c]: &Triangle| [b - a, c - b, a - c];
    let (e1, e2) = (edges(first), edges(second));
    let (n1, n2) = (e1[0].cross(&e1[1]), e2[0].cross(&e2[1]));
    // Relative to one corner: the numbers stay small where the triangles are near each other.
    let origin = first[0];
    let (first, second) = (first.map(|corner| corner - origin), second.map(|corner| corner - origin));
    let apart = |axis: &Vector3<f64>| {
        let (low1, high1) = span(axis, &first);
        let (low2, high2) = span(axis, &second);
        high1 < low2 || high2 < low1
    };
    if apart(&n1) || apart(&n2) {
        return false;
    }
    for a in &e1 {
        for b in &e2 {
            let axis = a.cross(b);
            if axis.norm_squared() > 1e-20 * a.norm_squared() * b.norm_squared() && apart(&axis) {
                return false;
            }
        }
    }
    let coplanar = n1.cross(&n2).norm_squared() <= 1e-20 * n1.norm_squared() * n2.norm_squared();
    !(coplanar && (e1.iter().any(|edge| apart(&n1.cross(edge))) || e2.iter().any(|edge| apart(&n2.cross(edge)))))
}

/// Squared distance between two triangles [m^2]; 0 where they touch. Both have an area.
///
/// Triangles that are apart are nearest at two edges, or at a corner of one (E. Larsen, S. Gottschalk, M. Lin,
/// D. Manocha, "Fast proximity queries with swept sphere volumes", 1999).
pub(super) fn squared_gap(first: &Triangle, second: &Triangle) -> f64 {
    if bounds(first).meets(&bounds(second)) && touch(first, second) {
        return 0.0;
    }
    let edges = |[a, b, c]: &Triangle| [[*a, *b], [*b, *c], [*c, *a]];
    let others = edges(second);
    let mut best = f64::INFINITY;
    for one in edges(first) {
        for two in others {
            let [on_one, on_two] = nearest_points(one, two);
            best = best.min((on_two - on_one).norm_squared());
        }
    }
    let corners = first.iter().map(|corner| squared_distance(corner, second));
    corners.chain(second.iter().map(|corner| squared_distance(corner, first))).fold(best, f64::min)
}

/// Whether a segment passes through a triangle, or nearly: what passes an edge within rounding counts.
pub(super) fn may_cross(from: &Point3<f64>, to: &Point3<f64>, [a, b, c]: &Triangle) -> bool {
    // Relative to one end: the numbers stay small where the triangle is near.
    let (edge, corners) = (to - from, [a, b, c].map(|corner| corner - from));
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let (here, there) = (-normal.dot(&a), normal.dot(&(edge - a)));
    let slack = 1e-12 * normal.norm() * (edge.norm() + a.norm());
    if here.min(there) > slack || here.max(there) < -slack {
        return false;
    }
    let sides = [(a, b), (b, c), (c, a)].map(|(one, two)| edge.dot(&one.cross(&two)));
    let slack = 1e-12 * edge.norm() * (a.norm_squared() + b.norm_squared() + c.norm_squared());
    sides.iter().all(|side| *side >= -slack) || sides.iter().all(|side| *side <= slack)
}

fn span(axis: &Vector3<f64>, corners: &[Vector3<f64>; 3]) -> (f64, f64) {
    let [a, b, c] = corners.map(|corner| axis.dot(&corner));
    (a.min(b).min(c), a.max(b).max(c))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Point3<f64>> {
        [-1.0..1.0, -1.0..1.0, -1.0..1.0f64].prop_map(|[x, y, z]| Point3::new(x, y, z))
    }

    fn triangle() -> impl Strategy<Value = Triangle> {
        [point(), point(), point()]
    }

    /// Whether a segment passes through a triangle, by signed volumes.
    fn pierces(from: &Point3<f64>, to: &Point3<f64>, [a, b, c]: &Triangle) -> bool {
        let volume =
            |p: &Point3<f64>, q: &Point3<f64>, r: &Point3<f64>, s: &Point3<f64>| (q - p).cross(&(r - p)).dot(&(s - p));
        let sides = [volume(from, to, a, b), volume(from, to, b, c), volume(from, to, c, a)];
        let ends = volume(a, b, c, from) * volume(a, b, c, to) < 0.0;
        ends && (sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0))
    }

    proptest! {
        #[test]
        fn touching_is_an_edge_of_one_through_the_other(first in triangle(), second in triangle()) {
            let edges = |[a, b, c]: Triangle| [(a, b), (b, c), (c, a)];
            let through = edges(first).iter().any(|(from, to)| pierces(from, to, &second))
                || edges(second).iter().any(|(from, to)| pierces(from, to, &first));
            prop_assert_eq!(touch(&first, &second), through);
            prop_assert_eq!(touch(&second, &first), through);
        }

        #[test]
        fn the_gap_of_two_triangles_is_the_closest_of_many_points(first in triangle(), second in triangle()) {
            let mut best = f64::INFINITY;
            for i in 0..=40 {
                for j in 0..=40 - i {
                    let (u, v) = (f64::from(i) / 40.0, f64::from(j) / 40.0);
                    let on = first[0] + (first[1] - first[0]) * u + (first[2] - first[0]) * v;
                    best = best.min(squared_distance(&on, &second).sqrt());
                }
            }
            let found = squared_gap(&first, &second).sqrt();
            prop_assert!(found <= best + 1e-12 && found >= best - 0.09, "{found} {best}");
            prop_assert!((found - squared_gap(&second, &first).sqrt()).abs() < 1e-12);
        }

        #[test]
        fn a_segment_crosses_where_its_volumes_say(from in point(), to in point(), triangle in triangle()) {
            prop_assert_eq!(may_cross(&from, &to, &triangle), pierces(&from, &to, &triangle));
        }

        #[test]
        fn the_closest_point_is_the_closest_of_many(point in point(), triangle in triangle()) {
            let mut best = f64::INFINITY;
            for i in 0..=60 {
                for j in 0..=60 - i {
                    let (u, v) = (f64::from(i) / 60.0, f64::from(j) / 60.0);
                    let on = triangle[0] + (triangle[1] - triangle[0]) * u + (triangle[2] - triangle[0]) * v;
                    best = best.min((on - point).norm());
                }
            }
            let found = squared_distance(&point, &triangle).sqrt();
            prop_assert!(found <= best + 1e-12 && found >= best - 0.06, "{found} {best}");
        }
    }

    #[test]
    fn flat_neighbours() {
        let base = [Point3::new(0.0, 0.0, 0.0), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
        let moved = |by: [f64; 3]| base.map(|corner| corner + Vector3::from(by));
        assert!(touch(&base, &moved([0.2, 0.2, 0.0])));
        assert!(!touch(&base, &moved([0.8, 0.8, 0.0])), "coplanar, next to each other");
        assert!(!touch(&base, &moved([0.2, 0.2, 1e-9])), "parallel");
        assert!(touch(&base, &base));
    }
}
