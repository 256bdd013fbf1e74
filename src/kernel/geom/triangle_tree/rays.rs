//! Rays against the triangles of a tree, in double precision.
//!
//! A ray and a triangle meet by Woop, Benthin and Wald 2013, "Watertight ray/triangle intersection": seen along the ray,
//! the three edges are tested with the same products from either side, so that no ray slips through between two triangles
//! that share an edge. Either side of a triangle is met.

use nalgebra::{Point3, Unit, Vector3};

use super::{LEAF, Leaf, NONE, Node, TriangleTree, WIDTH};
use crate::geom::{SimdLevel, doubles::Doubles, each_of, simd_kernel};

/// Waiting children: three per level; medians of 2^31 triangles make at most 16 levels.
const WAITING: usize = 64;

/// A ray with the numbers for tests against boxes and triangles.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts, in `Object` [m].
    origin: [f64; 3],
    /// One over each part of the direction; a huge number for 0, so that 0 times it is 0.
    inverse: [f64; 3],
    /// Axis along which the direction is largest, then the two after it.
    axes: [usize; 3],
    /// Shift of a point along the other two axes onto the ray's own axis, per metre along the first; and
    /// metres along the ray per metre along the first.
    shear: [f64; 3],
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// From the ray's origin [m].
    pub distance: f64,
    /// Leaf and index in it.
    leaf: u32,
    lane: u32,
}

impl Ray {
    /// A ray from a point in `Object` [m].
    pub fn new(origin: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> Self {
        let direction: [f64; 3] = direction.into_inner().into();
        let size = direction.map(f64::abs);
        let first = (1..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best });
        let axes = [first, (first + 1) % 3, (first + 2) % 3];
        let [along, b, c] = axes.map(|axis| direction[axis]);
        Self {
            origin: origin.coords.into(),
            inverse: direction.map(|part| if part == 0.0 { 1e300 } else { 1.0 / part }),
            axes,
            shear: [1.0 / along, b / along, c / along],
        }
    }
}

impl TriangleTree {
    /// Where a ray meets the surface first, at most `reach` [m] away. Of several triangles at the same distance the one
    /// that comes first in the order of the leaves.
    pub fn first_hit(&self, level: SimdLevel, ray: &Ray, reach: f64) -> Option<TriangleHit> {
        first_hit(level, self, ray, reach)
    }

    /// Whether a ray meets the surface at most `reach` [m] away.
    pub fn blocks(&self, level: SimdLevel, ray: &Ray, reach: f64) -> bool {
        blocks(level, self, ray, reach)
    }

    /// Unit normal of the triangle that was hit, by the order of its corners; `None` for a triangle without area.
    pub fn normal(&self, hit: &TriangleHit) -> Option<Unit<Vector3<f64>>> {
        let corners = &self.leaves[hit.leaf as usize].corners;
        let corner = |corner: usize| Vector3::from_fn(|axis, _| f64::from(corners[corner][axis][hit.lane as usize]));
        let [a, b, c] = [0, 1, 2].map(corner);
        Unit::try_new((b - a).cross(&(c - a)), 0.0)
    }
}

simd_kernel! {
    fn first_hit(tree: &TriangleTree, ray: &Ray, reach: f64) -> Option<TriangleHit> = first_hit_body;
}

simd_kernel! {
    fn blocks(tree: &TriangleTree, ray: &Ray, reach: f64) -> bool = blocks_body;
}

#[inline(always)]
fn first_hit_body<L: Doubles>(l: L, tree: &TriangleTree, ray: &Ray, reach: f64) -> Option<TriangleHit> {
    let (mut bound, mut best) = (reach, None::<TriangleHit>);
    let (mut waiting, mut depth) = ([(0.0, NONE); WAITING], 0);
    let mut next = tree.root;
    while next != NONE {
        let mut nearest = (f64::INFINITY, NONE);
        if next & LEAF != 0 {
            // Leaf: keep the nearest hit; at equal distances the first in the order of the leaves.
            let index = next & !LEAF;
            let leaf = &tree.leaves[index as usize];
            let distances = leaf.met(l, ray);
            for (lane, distance) in (0..leaf.count).zip(distances) {
                let first = |hit: TriangleHit| (index, lane) < (hit.leaf, hit.lane);
                if distance < bound || distance == bound && distance.is_finite() && best.is_none_or(first) {
                    bound = distance;
                    best = Some(TriangleHit { distance, leaf: index, lane });
                }
            }
        } else {
            // Node: visit the nearest child next and stack the others.
            let node = &tree.nodes[next as usize];
            let entries = node.entries(l, ray, bound);
            for (distance, child) in entries.into_iter().zip(node.children) {
                if distance < nearest.0 {
                    if nearest.1 != NONE {
                        waiting[depth] = nearest;
                        depth += 1;
                    }
                    nearest = (distance, child);
                } else if distance < f64::INFINITY {
                    waiting[depth] = (distance, child);
                    depth += 1;
                }
            }
        }
        // Unstack a child that may still contain a nearer hit.
        while (nearest.1 == NONE || nearest.0 > bound) && depth > 0 {
            depth -= 1;
            nearest = waiting[depth];
        }
        next = if nearest.0 > bound { NONE } else { nearest.1 };
    }
    best
}

#[inline(always)]
fn blocks_body<L: Doubles>(l: L, tree: &TriangleTree, ray: &Ray, reach: f64) -> bool {
    let (mut waiting, mut depth) = ([NONE; WAITING], 0);
    let mut next = tree.root;
    while next != NONE {
        if next & LEAF != 0 {
            let leaf = &tree.leaves[(next & !LEAF) as usize];
            if leaf.met(l, ray).iter().any(|distance| *distance <= reach) {
                return true;
            }
        } else {
            let node = &tree.nodes[next as usize];
            for (distance, child) in node.entries(l, ray, reach).into_iter().zip(node.children) {
                if distance < f64::INFINITY {
                    waiting[depth] = child;
                    depth += 1;
                }
            }
        }
        next = if depth > 0 { waiting[depth - 1] } else { NONE };
        depth = depth.saturating_sub(1);
    }
    false
}

impl Node {
    /// Where a ray enters each child's box [m], at least 0; infinite where it passes by or enters beyond `reach`.
    #[inline(always)]
    fn entries<L: Doubles>(&self, l: L, ray: &Ray, reach: f64) -> [f64; WIDTH] {
        // A little farther, so that rounding loses no touch of a side.
        let farther = l.splat(1.0 + 4.0 * f64::EPSILON);
        let (mut enter, mut leave) = (l.splat(0.0), l.splat(reach));
        for axis in 0..3 {
            let (origin, inverse) = (l.splat(ray.origin[axis]), l.splat(ray.inverse[axis]));
            let sides = [&self.min[axis], &self.max[axis]];
            let [near, far] = if ray.inverse[axis] > 0.0 { sides } else { [sides[1], sides[0]] };
            let [from, to] = [l.load(near), l.load(far)];
            enter = l.max(l.mul(l.sub(from, origin), inverse), enter);
            leave = l.min(l.mul(l.mul(l.sub(to, origin), inverse), farther), leave);
        }
        let (enter, leave) = (l.array(enter), l.array(leave));
        let entry = |lane: usize| if enter[lane] <= leave[lane] { enter[lane] } else { f64::INFINITY };
        [entry(0), entry(1), entry(2), entry(3)]
    }
}

impl Leaf {
    /// Distance along a ray to each triangle [m]; infinite where the ray misses it, or it lies behind.
    #[inline(always)]
    fn met<L: Doubles>(&self, l: L, ray: &Ray) -> [f64; WIDTH] {
        let origin = each_of!([0, 1, 2], k => l.splat(ray.origin[ray.axes[k]]));
        let shear = each_of!([0, 1, 2], k => l.splat(ray.shear[k]));
        // Corners with the ray's origin as theirs, sheared so that the ray is the first axis.
        let corners = each_of!([&self.corners[0], &self.corners[1], &self.corners[2]], corner => {
            let [a, b, c] = each_of!([0, 1, 2], k => l.sub(l.load(&corner[ray.axes[k]]), origin[k]));
            [l.mul(a, shear[0]), l.sub(b, l.mul(a, shear[1])), l.sub(c, l.mul(a, shear[2]))]
        });
        let [[along_p, right_p, up_p], [along_q, right_q, up_q], [along_r, right_r, up_r]] = corners;
        // Twice the area of the triangle over the ray and each edge.
        let u = l.sub(l.mul(right_q, up_r), l.mul(up_q, right_r));
        let v = l.sub(l.mul(right_r, up_p), l.mul(up_r, right_p));
        let w = l.sub(l.mul(right_p, up_q), l.mul(up_p, right_q));
        let (min, max) = (l.array(l.min(l.min(u, v), w)), l.array(l.max(l.max(u, v), w)));
        let area = l.add(l.add(u, v), w);
        let moment = l.add(l.add(l.mul(u, along_p), l.mul(v, along_q)), l.mul(w, along_r));
        let distance = l.array(l.div(moment, area));
        // Without area the distance is no number, or infinite.
        let met = |lane: usize| {
            let inside = (min[lane] >= 0.0) | (max[lane] <= 0.0);
            if inside & (distance[lane] >= 0.0) { distance[lane] } else { f64::INFINITY }
        };
        [met(0), met(1), met(2), met(3)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{TriMesh, rotation_from_rpy};

    /// A bumpy ball of 2 rings^2 quadrangles.
    fn ball(rings: usize) -> TriMesh {
        let around = 2 * rings;
        let point = |ring: usize, step: usize| {
            let (polar, azimuth) =
                (ring as f64 / rings as f64 * std::f64::consts::PI, step as f64 / rings as f64 * std::f64::consts::PI);
            let radius = 0.1 + 0.02 * libm::sin(5.0 * polar) * libm::cos(3.0 * azimuth);
            if ring.is_multiple_of(rings) {
                // The poles are one point each, for every azimuth.
                return [0.0, 0.0, if ring == 0 { 0.1 } else { -0.1 }];
            }
            let (sine, cosine) = libm::sincos(polar);
            [radius * sine * libm::cos(azimuth), radius * sine * libm::sin(azimuth), radius * cosine].map(|x| x as f32)
        };
        let vertices = (0..=rings).flat_map(|ring| (0..around).map(move |step| point(ring, step))).collect();
        let name = |ring: usize, step: usize| (ring * around + step % around) as u32;
        let quads = (0..rings).flat_map(|ring| (0..around).map(move |step| (ring, step)));
        let triangles = quads.flat_map(|(ring, step)| {
            let [a, b] = [name(ring, step), name(ring, step + 1)];
            let [c, d] = [name(ring + 1, step), name(ring + 1, step + 1)];
            [[a, c, d], [a, d, b]]
        });
        TriMesh { vertices, triangles: triangles.collect() }
    }

    /// Where a ray meets a triangle, by Cramer's rule.
    fn by_determinants(corners: [Point3<f64>; 3], origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let [a, b, c] = corners;
        let matrix = nalgebra::Matrix3::from_columns(&[-direction, b - a, c - a]);
        let solved = matrix.try_inverse()? * (origin - a);
        (solved.y >= 0.0 && solved.z >= 0.0 && solved.y + solved.z <= 1.0 && solved.x >= 0.0).then_some(solved.x)
    }

    fn rays(count: usize) -> impl Iterator<Item = (Point3<f64>, Unit<Vector3<f64>>)> {
        (0..count).map(|number| {
            let k = number as f64;
            let rotation = rotation_from_rpy(1.7 * k, 0.9 * k + 0.4, 2.3 * k + 0.1);
            let aside = [0.12 * libm::sin(3.1 * k), 0.12 * libm::cos(5.3 * k)];
            // Every fourth ray points along an axis.
            let rotation = if number % 4 == 0 { rotation_from_rpy(0.0, 0.0, 0.0) } else { rotation };
            (rotation * Point3::new(aside[0], aside[1], -0.4), Unit::new_normalize(rotation * Vector3::z()))
        })
    }

    #[test]
    fn rays_meet_what_trying_every_triangle_meets_at_every_level() {
        let mesh = ball(24);
        let tree = TriangleTree::new(&mesh);
        let mut hits = 0;
        for (origin, direction) in rays(1000) {
            let all = (0..mesh.triangles.len()).filter_map(|t| by_determinants(mesh.corners(t), &origin, &direction));
            let expected = all.fold(f64::INFINITY, f64::min);
            let ray = Ray::new(&origin, &direction);
            let found = tree.first_hit(SimdLevel::Scalar, &ray, 2.0);
            assert_eq!(tree.first_hit(SimdLevel::Scalar, &ray, f64::INFINITY), found);
            for level in SimdLevel::available() {
                assert_eq!(tree.first_hit(level, &ray, 2.0), found);
                assert_eq!(tree.blocks(level, &ray, 2.0), found.is_some());
            }
            let Some(found) = found else {
                assert_eq!(expected, f64::INFINITY);
                continue;
            };
            hits += 1;
            assert!((found.distance - expected).abs() < 1e-12, "{} {expected}", found.distance);
            assert!(tree.normal(&found).expect("an area").dot(&direction) < 0.0, "wound outward");
            assert!(!tree.blocks(SimdLevel::Scalar, &ray, found.distance * 0.999));
            assert!(tree.blocks(SimdLevel::Scalar, &ray, found.distance * 1.001));
            assert_eq!(tree.first_hit(SimdLevel::Scalar, &ray, found.distance * 0.999), None);
        }
        assert!((300..1000).contains(&hits), "{hits}");
    }

    /// Rays through corners and the middles of edges, where one rounding too many opens a gap.
    #[test]
    fn no_ray_slips_through_an_edge() {
        let mesh = ball(16);
        let tree = TriangleTree::new(&mesh);
        for (number, (_, direction)) in rays(mesh.triangles.len()).enumerate() {
            let [a, b, c] = mesh.corners(number);
            for target in [a, b, c, nalgebra::center(&a, &b), nalgebra::center(&b, &c)] {
                // Towards the middle of the ball, so that the surface is crossed and not grazed.
                let inward = Unit::new_normalize(-target.coords);
                let origin = target - inward.into_inner() * 0.3;
                assert!(tree.first_hit(SimdLevel::Scalar, &Ray::new(&origin, &inward), 0.5).is_some());
            }
            // From the middle outward, along any direction.
            let ray = Ray::new(&Point3::origin(), &direction);
            assert!(tree.first_hit(SimdLevel::Scalar, &ray, 0.5).is_some());
        }
    }

    #[test]
    fn a_tree_of_nothing_meets_no_ray() {
        let empty = TriangleTree::new(&TriMesh::default());
        let ray = Ray::new(&Point3::origin(), &Vector3::z_axis());
        assert_eq!(empty.first_hit(SimdLevel::Scalar, &ray, 1.0), None);
        assert!(!empty.blocks(SimdLevel::Scalar, &ray, 1.0));
    }
}
