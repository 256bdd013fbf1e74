//! The triangle next to a point.
//!
//! Distances are taken in f32: the triangle is the nearest one but for rounding.

use super::{LEAF, Leaf, NONE, Node, TriangleTree, WIDTH};

impl TriangleTree {
    /// Index of the triangle nearest to `point` among those with a squared distance below `bound` [m^2], if any.
    pub fn nearest(&self, point: [f32; 3], bound: f32) -> Option<u32> {
        self.nearest_with_distance(point, bound).map(|(triangle, _)| triangle)
    }

    /// [`TriangleTree::nearest`], with its squared distance [m^2].
    pub fn nearest_with_distance(&self, point: [f32; 3], mut bound: f32) -> Option<(u32, f32)> {
        let mut best = None;
        self.visit(point, &mut bound, |leaf, distances, bound| {
            for (index, distance) in distances.iter().enumerate().take(leaf.count as usize) {
                if *distance < *bound {
                    *bound = *distance;
                    best = Some((leaf.first + index as u32, *distance));
                }
            }
            false
        });
        best
    }

    /// Whether a triangle has a squared distance from `point` below `bound` [m^2]: whether there is a
    /// [nearest](TriangleTree::nearest) one, without looking for it.
    pub fn is_near(&self, point: [f32; 3], mut bound: f32) -> bool {
        let mut found = false;
        self.visit(point, &mut bound, |leaf, distances, bound| {
            found = distances.iter().take(leaf.count as usize).any(|distance| *distance < *bound);
            found
        });
        found
    }

    /// Calls `at_leaf` with the leaves that may hold triangles nearer than `bound`, about the nearest first, and their squared
    /// distances, until it returns true. It may lower the bound.
    #[inline(always)]
    fn visit(&self, point: [f32; 3], bound: &mut f32, mut at_leaf: impl FnMut(&Leaf, &Lanes, &mut f32) -> bool) {
        // Three waiting children a level; medians of 2^31 triangles make at most 16 levels.
        let mut waiting = [(0f32, NONE); 64];
        let mut depth = 0;
        let mut next = self.root;
        while next != NONE {
            let mut nearest = (f32::INFINITY, NONE);
            if next & LEAF != 0 {
                let leaf = &self.leaves[(next & !LEAF) as usize];
                if at_leaf(leaf, &leaf.distances(point), bound) {
                    return;
                }
            } else {
                let node = &self.nodes[next as usize];
                let distances = node.distances(point);
                for (distance, child) in distances.into_iter().zip(node.children) {
                    if distance < nearest.0 {
                        if nearest.0 < *bound {
                            waiting[depth] = nearest;
                            depth += 1;
                        }
                        nearest = (distance, child);
                    } else if distance < *bound {
                        waiting[depth] = (distance, child);
                        depth += 1;
                    }
                }
            }
            while nearest.0 >= *bound && depth > 0 {
                depth -= 1;
                nearest = waiting[depth];
            }
            next = if nearest.0 < *bound { nearest.1 } else { NONE };
        }
    }

    /// Reports to `found` the index and the squared distance [m^2] of every triangle that is nearer to `point` than `bound`
    /// [m^2]; in no order that matters.
    pub fn within(&self, point: [f32; 3], bound: f32, mut found: impl FnMut(u32, f32)) {
        let mut waiting = [NONE; 64];
        let mut depth = 0;
        let mut next = self.root;
        while next != NONE {
            if next & LEAF != 0 {
                let leaf = &self.leaves[(next & !LEAF) as usize];
                let distances = leaf.distances(point);
                for (index, distance) in (0..leaf.count).zip(distances) {
                    if distance < bound {
                        found(leaf.first + index, distance);
                    }
                }
            } else {
                let node = &self.nodes[next as usize];
                for (distance, child) in node.distances(point).into_iter().zip(node.children) {
                    if distance < bound && child != NONE {
                        waiting[depth] = child;
                        depth += 1;
                    }
                }
            }
            depth = depth.wrapping_sub(1);
            next = waiting.get(depth).copied().unwrap_or(NONE);
        }
    }
}

impl Node {
    /// Squared distance of a point to each child's box.
    fn distances(&self, point: [f32; 3]) -> [f32; WIDTH] {
        let mut sums = [0.0; WIDTH];
        for (axis, p) in point.into_iter().enumerate() {
            for (lane, sum) in sums.iter_mut().enumerate() {
                let outside = above(above(self.min[axis][lane] - p, p - self.max[axis][lane]), 0.0);
                *sum += outside * outside;
            }
        }
        sums
    }
}

/// The greater one; the second where the first is no number. One vector instruction, unlike `f32::max`.
fn above(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller one; the second if the first is NaN.
fn below(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

type Lanes = [f32; WIDTH];

fn lanes(f: impl Fn(usize) -> f32) -> Lanes {
    std::array::from_fn(f)
}

fn minus(a: &[Lanes; 3], b: &[Lanes; 3]) -> [Lanes; 3] {
    std::array::from_fn(|axis| lanes(|lane| a[axis][lane] - b[axis][lane]))
}

fn dot(a: &[Lanes; 3], b: &[Lanes; 3]) -> Lanes {
    lanes(|lane| a[0][lane] * b[0][lane] + a[1][lane] * b[1][lane] + a[2][lane] * b[2][lane])
}

fn cross(a: &[Lanes; 3], b: &[Lanes; 3]) -> [Lanes; 3] {
    std::array::from_fn(|axis| {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        lanes(|lane| a[i][lane] * b[j][lane] - a[j][lane] * b[i][lane])
    })
}

impl Leaf {
    /// Squared distance of a point to each triangle: to its plane inside the prism over it, else to the nearest edge.
    fn distances(&self, point: [f32; 3]) -> Lanes {
        let point = point.map(|v| [v; WIDTH]);
        let edges: [[Lanes; 3]; 3] = std::array::from_fn(|i| minus(&self.corners[(i + 1) % 3], &self.corners[i]));
        let normal = cross(&edges[0], &edges[1]);
        let mut min = [f32::INFINITY; WIDTH];
        let mut inside = [true; WIDTH];
        let mut from_first = [[0.0; WIDTH]; 3];
        for (edge, corner) in edges.iter().zip(&self.corners) {
            let from = minus(&point, corner);
            let (along, length) = (dot(edge, &from), dot(edge, edge));
            let side = dot(&cross(&normal, edge), &from);
            // An edge without length gives no number, which `above` replaces by 0: its first corner.
            let share = lanes(|lane| below(above(along[lane] / length[lane], 0.0), 1.0));
            let apart: [Lanes; 3] =
                std::array::from_fn(|axis| lanes(|lane| from[axis][lane] - edge[axis][lane] * share[lane]));
            let distance = dot(&apart, &apart);
            for lane in 0..WIDTH {
                min[lane] = below(distance[lane], min[lane]);
                inside[lane] &= side[lane] > 0.0;
            }
            from_first = from;
        }
        let (height, length) = (dot(&normal, &from_first), dot(&normal, &normal));
        lanes(|lane| if inside[lane] { height[lane] * height[lane] / length[lane] } else { min[lane] })
    }
}

#[cfg(test)]
mod tests {
    use crate::{geom::TriangleTree, seed::Stream, test_shapes::built_in};

    #[test]
    fn something_is_near_where_there_is_a_nearest_triangle() {
        let mut stream = Stream::of_job(3, b"", "near");
        let (mut near, mut far) = (0, 0);
        for name in ["mug-01", "goblet-01", "box-01"] {
            let mesh = built_in(name);
            let (tree, bounds) = (TriangleTree::new(&mesh), mesh.aabb().expect("vertices"));
            for _ in 0..2000 {
                let point =
                    [0, 1, 2].map(|axis| stream.uniform(bounds.min[axis] - 0.02, bounds.max[axis] + 0.02) as f32);
                let bound = stream.uniform(0.0, 0.03).powi(2) as f32;
                let is_near = tree.is_near(point, bound);
                assert_eq!(is_near, tree.nearest(point, bound).is_some(), "{name}, {point:?}, {bound}");
                // At exactly the distance of the nearest triangle nothing is nearer.
                let (_, distance) = tree.nearest_with_distance(point, f32::INFINITY).expect("a triangle");
                assert!(
                    !tree.is_near(point, distance) && tree.is_near(point, distance * 1.001 + 1e-12),
                    "{name}, {point:?}"
                );
                *(if is_near { &mut near } else { &mut far }) += 1;
            }
        }
        assert!(near > 1000 && far > 1000, "{near} {far}");
    }
}
