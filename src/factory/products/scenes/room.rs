//! Room over the floor of a container: the widest upright box that meets no wall.

use kernel::geom::TriMesh;
use nalgebra::Point3;

/// Heights above the middle of a floor [m].
#[derive(Clone, Copy)]
pub(super) struct Slab {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Slab {
    /// The largest share of these half sides at which an upright box over a foot, from low to high, meets no triangle: exactly,
    /// however thin a post is.
    pub(super) fn share_beside(&self, mesh: &TriMesh, foot: &Point3<f64>, half: [f64; 2]) -> f64 {
        let share = |triangle: usize| {
            let corners = mesh.corners(triangle).map(|corner| {
                let [x, y, z] = (corner - foot).into();
                [x / half[0], y / half[1], z]
            });
            nearest(&self.clipped(&corners))
        };
        (0..mesh.triangles.len()).map(share).fold(f64::INFINITY, f64::min)
    }

    /// Part of a convex polygon between the two heights (Sutherland and Hodgman 1974).
    fn clipped(&self, corners: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut polygon = corners.to_vec();
        for (height, sign) in [(self.low, 1.0), (self.high, -1.0)] {
            let depth = |corner: &[f64; 3]| sign * (corner[2] - height);
            let mut kept = Vec::with_capacity(polygon.len() + 1);
            for (index, to) in polygon.iter().enumerate() {
                let from = &polygon[(index + polygon.len() - 1) % polygon.len()];
                let [start, end] = [depth(from), depth(to)];
                if (start < 0.0) != (end < 0.0) {
                    let t = start / (start - end);
                    kept.push([0, 1, 2].map(|axis| from[axis] + t * (to[axis] - from[axis])));
                }
                if end >= 0.0 {
                    kept.push(*to);
                }
            }
            polygon = kept;
        }
        polygon
    }
}

/// Smallest max(|x|, |y|) over a convex polygon: at a corner, where an edge crosses a diagonal or an axis, or 0 above
/// the foot.
fn nearest(polygon: &[[f64; 3]]) -> f64 {
    let edges =
        || polygon.iter().enumerate().map(|(index, to)| (polygon[(index + polygon.len() - 1) % polygon.len()], *to));
    let senses = || edges().map(|(from, to)| from[0] * to[1] - from[1] * to[0]);
    if polygon.len() > 2 && (senses().all(|sense| sense > 0.0) || senses().all(|sense| sense < 0.0)) {
        return 0.0;
    }
    let along = |(from, to): ([f64; 3], [f64; 3])| {
        let crossing = |[u, v]: [f64; 2]| {
            let [start, end] = [from, to].map(|corner| u * corner[0] + v * corner[1]);
            let t = start / (start - end);
            if (0.0..=1.0).contains(&t) { t } else { 1.0 }
        };
        let crossings = [[1.0, -1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]].map(crossing);
        let at = |t: f64| [0, 1].map(|axis| (from[axis] + t * (to[axis] - from[axis])).abs());
        crossings.into_iter().chain([1.0]).map(at).map(|[x, y]| x.max(y)).fold(f64::INFINITY, f64::min)
    };
    edges().map(along).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use kernel::seed::Stream;

    use super::*;

    #[test]
    fn polygons_are_as_near_as_their_nearest_point() {
        let (slab, mut draw) = (Slab { low: -0.3, high: 0.4 }, Stream::of_job(1, b"", "polygons"));
        let mut above = 0;
        for _ in 0..300 {
            let triangle = [0, 1, 2].map(|_| [0, 1, 2].map(|_| 2.0 * draw.unit() - 1.0));
            let found = nearest(&slab.clipped(&triangle));
            let mut sampled = f64::INFINITY;
            for (i, j) in (0..=120).flat_map(|i| (0..=120 - i).map(move |j| (i, j))) {
                let [a, b] = [f64::from(i) / 120.0, f64::from(j) / 120.0];
                let point = [0, 1, 2]
                    .map(|axis| a * triangle[0][axis] + b * triangle[1][axis] + (1.0 - a - b) * triangle[2][axis]);
                if (slab.low..=slab.high).contains(&point[2]) {
                    sampled = sampled.min(point[0].abs().max(point[1].abs()));
                }
            }
            assert!(found <= sampled + 1e-12, "{found} {sampled} {triangle:?}");
            assert!(sampled.is_infinite() || sampled - found < 0.04, "{found} {sampled} {triangle:?}");
            above += u32::from(found == 0.0);
        }
        assert!(above > 5, "{above} above the foot");
    }
}
