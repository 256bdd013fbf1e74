//! Nearest points of two segments.

use nalgebra::Point3;

/// Nearest points of two segments, one on each, or one such pair (C. Ericson, Real-Time Collision Detection,
/// 2005, section 5.1.9).
pub(super) fn nearest_points(one: [Point3<f64>; 2], two: [Point3<f64>; 2]) -> [Point3<f64>; 2] {
    let (a, b, between) = (one[1] - one[0], two[1] - two[0], one[0] - two[0]);
    let (aa, bb, ab) = (a.norm_squared(), b.norm_squared(), a.dot(&b));
    let (ac, bc) = (a.dot(&between), b.dot(&between));
    // A segment without a length has its only point at 0.
    let ratio = |value: f64, of: f64| if of > 0.0 { (value / of).clamp(0.0, 1.0) } else { 0.0 };
    let s = ratio(ab * bc - ac * bb, aa * bb - ab * ab);
    let t = ratio(ab * s + bc, bb);
    // Where `t` was cut off, or `b` has no length, the point on the first follows from it.
    let s = ratio(ab * t - ac, aa);
    [one[0] + a * s, two[0] + b * t]
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::seed::Stream;

    #[test]
    fn no_points_of_two_segments_are_nearer_than_the_nearest() {
        let mut draw = Stream::of_job(1, b"", "segments");
        for round in 0..2000 {
            let mut point = || Point3::from([0; 3].map(|_: i32| draw.uniform(-1.0, 1.0)));
            let (mut one, mut two) = ([point(), point()], [point(), point()]);
            match round % 5 {
                // A point, two points, parallel segments.
                1 => one[1] = one[0],
                2 => (one[1], two[1]) = (one[0], two[0]),
                3 => two[1] = two[0] + (one[1] - one[0]) * 0.7,
                _ => {}
            }
            let found = nearest_points(one, two);
            let on = |[from, to]: [Point3<f64>; 2], point: Point3<f64>| {
                (to - from).cross(&(point - from)).norm() < 1e-12
                    && (-1e-12..=(to - from).norm_squared() + 1e-12).contains(&(to - from).dot(&(point - from)))
            };
            assert!(on(one, found[0]) && on(two, found[1]));
            let nearest = (found[0] - found[1]).norm();
            let share = |step: i32| f64::from(step) / 20.0;
            for (i, j) in (0..=20).flat_map(|i| (0..=20).map(move |j| (i, j))) {
                let apart = one[0] + (one[1] - one[0]) * share(i) - (two[0] + (two[1] - two[0]) * share(j));
                assert!(nearest <= apart.norm() + 1e-12, "{one:?} {two:?}");
            }
        }
    }
}
