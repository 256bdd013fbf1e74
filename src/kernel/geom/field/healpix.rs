//! Directions spread evenly over the sphere.
//!
//! Górski et al., "HEALPix: a framework for high-resolution discretization and fast analysis of data distributed on the
//! sphere", Astrophysical Journal 622 (2005), section 4.1: pixel centres in the ring scheme.

use std::{
    collections::BTreeMap,
    f64::consts::{PI, TAU},
};

use nalgebra::{Matrix3, Vector3};

/// The 12 nside^2 pixel centres of HEALPix, in ring order: from the north pole (z up) southward, ring by ring, azimuth
/// growing from +x to +y.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct HealPix {
    nside: u32,
}

/// Directions of one height.
struct Ring {
    /// Height of the unit vectors.
    z: f64,
    /// Distance of the ring's directions from the z axis: sqrt(1 - z^2).
    out: f64,
    count: usize,
    /// Azimuth of the first one, in steps.
    shift: f64,
}

impl HealPix {
    /// The finest that there is here: 3,072 directions, 2.9 degrees.
    pub const MAX_NSIDE: u32 = 16;

    /// Directions at a resolution of 1 to [`Self::MAX_NSIDE`]; `None` for any other.
    pub fn new(nside: u32) -> Option<Self> {
        (1..=Self::MAX_NSIDE).contains(&nside).then_some(Self { nside })
    }

    /// The resolution: pixels along a side of each of the 12 base pixels.
    pub fn nside(self) -> u32 {
        self.nside
    }

    /// The resolution with this number of directions; `None` if there is none.
    pub fn of_count(count: usize) -> Option<Self> {
        (1..=Self::MAX_NSIDE).map(|nside| Self { nside }).find(|healpix| healpix.count() == count)
    }

    /// Number of directions.
    pub fn count(self) -> usize {
        12 * (self.nside as usize).pow(2)
    }

    /// The largest angle between any direction and the nearest of these [rad].
    ///
    /// No direction is farther from them than the poles are (checked against the Voronoi vertices of the directions), at
    /// whose nearest ring z = 1 - 1 / (3 nside^2) (equation 4 with i = 1): sin(angle / 2) = 1 / (sqrt(6) nside).
    pub fn covering_radius(self) -> f64 {
        2.0 * libm::asin(1.0 / (libm::sqrt(6.0) * f64::from(self.nside)))
    }

    /// Ring i of 1..4 nside, equations 4 to 9: caps of 4 i directions, a belt of 4 nside each, mirrored in the south.
    fn ring(self, i: u32) -> Ring {
        let (n, north) = (self.nside, i.min(4 * self.nside - i));
        let side = if i <= 2 * n { 1.0 } else { -1.0 };
        let wide = f64::from(n);
        if north < n {
            // 1 - |z|, which z itself would round away near a pole.
            let below = f64::from(north).powi(2) / (3.0 * wide * wide);
            let out = libm::sqrt(below * (2.0 - below));
            return Ring { z: side * (1.0 - below), out, count: 4 * north as usize, shift: 0.5 };
        }
        let z = side * (4.0 / 3.0 - 2.0 * f64::from(north) / (3.0 * wide));
        // s = (i - nside + 1) mod 2, of mirrored rings too: 4 nside - i is odd where i is.
        let shift = if (i - n + 1) % 2 == 1 { 0.5 } else { 1.0 };
        Ring { z, out: libm::sqrt((1.0 - z) * (1.0 + z)), count: 4 * n as usize, shift }
    }

    fn rings(self) -> impl Iterator<Item = Ring> {
        (1..4 * self.nside).map(move |i| self.ring(i))
    }

    /// Elevation above the level [rad, -pi/2..pi/2] and azimuth [rad, -pi..pi] of each direction.
    pub fn angles(self) -> Vec<[f64; 2]> {
        let of_ring = |ring: Ring| {
            let elevation = libm::atan2(ring.z, ring.out);
            (0..ring.count).map(move |j| {
                let azimuth = ring.azimuth(j);
                [elevation, if azimuth < PI { azimuth } else { azimuth - TAU }]
            })
        };
        self.rings().flat_map(of_ring).collect()
    }

    /// The directions as unit vectors.
    pub fn directions(self) -> Vec<Vector3<f64>> {
        let of_ring = |ring: Ring| {
            (0..ring.count).map(move |j| {
                let (sine, cosine) = libm::sincos(ring.azimuth(j));
                Vector3::new(ring.out * cosine, ring.out * sine, ring.z)
            })
        };
        self.rings().flat_map(of_ring).collect()
    }

    /// Triangles over the sphere whose corners are the directions: counter-clockwise from outside, without gap or overlap.
    ///
    /// Strips between neighbouring rings, each cut along the shorter diagonals; two triangles at each pole.
    fn triangles(self) -> Vec<[usize; 3]> {
        let mut triangles = Vec::with_capacity(2 * self.count() - 4);
        // North polar cap: the first ring has four directions.
        let (mut above, mut first) = (self.ring(1), 0);
        triangles.extend([[0, 1, 2], [0, 2, 3]]);
        for i in 2..4 * self.nside {
            let (below, second) = (self.ring(i), first + above.count);
            // Steps taken along both rings, from where they begin: within one step of each other.
            let (mut a, mut b) = (0, 0);
            let azimuth =
                |ring: &Ring, steps: usize| ring.azimuth(steps % ring.count) + TAU * (steps / ring.count) as f64;
            while a < above.count || b < below.count {
                let [high, low] = [first + a % above.count, second + b % below.count];
                let [next_high, next_low] = [first + (a + 1) % above.count, second + (b + 1) % below.count];
                // Greedy strip: the next triangle takes the shorter of the two diagonals, in azimuth.
                let along = (azimuth(&above, a + 1) - azimuth(&below, b)).abs();
                let across = (azimuth(&below, b + 1) - azimuth(&above, a)).abs();
                if b == below.count || (a < above.count && along <= across) {
                    triangles.push([high, low, next_high]);
                    a += 1;
                } else {
                    triangles.push([high, low, next_low]);
                    b += 1;
                }
            }
            (above, first) = (below, second);
        }
        // South polar cap, its corners in reversed order: counter-clockwise from outside as well.
        triangles.extend([[first, first + 2, first + 1], [first, first + 3, first + 2]]);
        triangles
    }
}

impl Ring {
    /// Azimuth of a direction [rad], 0..=2 pi.
    fn azimuth(&self, j: usize) -> f64 {
        TAU / self.count as f64 * (j as f64 + self.shift)
    }
}

/// Between which three directions another one lies.
#[derive(Clone, Debug)]
pub(super) struct Mesh {
    triangles: Vec<Triangle>,
    /// For each cell of the six faces of a cube, a triangle nearby: where a walk begins.
    hints: Vec<u32>,
    /// Cells along the side of a face.
    side: usize,
}

#[derive(Clone, Debug)]
struct Triangle {
    corners: [u32; 3],
    /// A direction's weights are its products with these, over their sum.
    duals: [Vector3<f64>; 3],
    /// The triangle beyond the side opposite each corner.
    beyond: [u32; 3],
}

impl Mesh {
    pub(super) fn new(healpix: HealPix) -> Self {
        let (directions, corners) = (healpix.directions(), healpix.triangles());
        // Triangle on the left of each directed side: its neighbour has the side reversed.
        let mut sides = BTreeMap::new();
        for (index, corners) in (0_u32..).zip(&corners) {
            for k in 0..3 {
                sides.insert([corners[(k + 1) % 3], corners[(k + 2) % 3]], index);
            }
        }
        let triangle = |corners: &[usize; 3]| {
            let [a, b, c] = corners.map(|corner| directions[corner]);
            // Dual basis of the corners (Cramer's rule): the dual of a has product 1 with a and 0 with b and c.
            let volume = a.dot(&b.cross(&c));
            let beyond = |k: usize| sides[&[corners[(k + 2) % 3], corners[(k + 1) % 3]]];
            Triangle {
                corners: corners.map(|corner| corner as u32),
                duals: [b.cross(&c) / volume, c.cross(&a) / volume, a.cross(&b) / volume],
                beyond: [beyond(0), beyond(1), beyond(2)],
            }
        };
        // Cells of a cube around the sphere, 2 nside along each side of a face.
        let side = 2 * healpix.nside as usize;
        let mut mesh = Self { triangles: corners.iter().map(triangle).collect(), hints: Vec::new(), side };
        let mut near = 0;
        for cell in 0..6 * side * side {
            let [face, row, column] = [cell / side / side, cell / side % side, cell % side];
            // Middle of the cell on its face of the cube [-1, 1]^3.
            let coordinate = |index: usize| (index as f64 + 0.5) / side as f64 * 2.0 - 1.0;
            let (axis, mut middle) = (face / 2, Vector3::zeros());
            middle[axis] = if face % 2 == 0 { 1.0 } else { -1.0 };
            (middle[(axis + 1) % 3], middle[(axis + 2) % 3]) = (coordinate(row), coordinate(column));
            // Walk from the last cell's triangle: cells in order are mostly neighbours.
            near = mesh.walk(&middle, near);
            mesh.hints.push(near);
        }
        mesh
    }

    /// The three directions around another one, their weights, which sum to 1, and how each weight grows as the direction
    /// moves.
    ///
    /// The weights are those of the point where the direction meets the plane of the three. At one of them its weight is 1;
    /// on the side between two, the third's is 0: from triangle to triangle weights do not jump.
    pub(super) fn around(&self, direction: &Vector3<f64>) -> ([usize; 3], [f64; 3], [Vector3<f64>; 3]) {
        let face = direction.iamax();
        let [first, second] = [(face + 1) % 3, (face + 2) % 3];
        let cell = |k: usize| {
            let coordinate = (direction[k] / direction[face].abs() + 1.0) * 0.5 * self.side as f64;
            (coordinate.max(0.0) as usize).min(self.side - 1)
        };
        let face = 2 * face + usize::from(direction[face] < 0.0);
        let hint = self.hints[(face * self.side + cell(first)) * self.side + cell(second)];
        let Triangle { corners, duals, .. } = &self.triangles[self.walk(direction, hint) as usize];
        let parts = duals.map(|dual| dual.dot(direction));
        let sum = parts[0] + parts[1] + parts[2];
        let weights = parts.map(|part| part / sum);
        let all = duals[0] + duals[1] + duals[2];
        let slopes = std::array::from_fn(|k| (duals[k] - weights[k] * all) / sum);
        (corners.map(|corner| corner as usize), weights, slopes)
    }

    /// The triangle around a direction, from a triangle nearby: across the side that the direction lies farthest beyond.
    fn walk(&self, direction: &Vector3<f64>, from: u32) -> u32 {
        let min = |triangle: &Triangle| {
            let parts = triangle.duals.map(|dual| dual.dot(direction));
            let k = if parts[0] <= parts[1] { 0 } else { 1 };
            let k = if parts[k] <= parts[2] { k } else { 2 };
            (k, parts[k])
        };
        let mut at = from;
        // Far more than there are triangles between neighbouring hints; a circle of rounding ends here, too.
        for _ in 0..4 * self.side {
            let triangle = &self.triangles[at as usize];
            let (k, part) = min(triangle);
            if part >= 0.0 {
                return at;
            }
            at = triangle.beyond[k];
        }
        let parts = (0..).zip(&self.triangles).map(|(index, triangle)| (index, min(triangle).1));
        parts.fold((at, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best }).0
    }
}

/// Rotation from x ahead, z up to the direction of the given angles: the columns of Rz(azimuth) Ry(-elevation).
pub(super) fn frame([elevation, azimuth]: [f64; 2]) -> Matrix3<f64> {
    crate::geom::rotation_from_rpy(0.0, -elevation, azimuth).into_inner()
}

#[cfg(test)]
mod tests {
    use super::{super::fixtures::Draws, *};
    use std::f64::consts::FRAC_PI_2;

    fn all() -> impl Iterator<Item = HealPix> {
        (1..=16).filter_map(HealPix::new)
    }

    /// The twelve base pixels, and the rows of table 1 of Calabretta and Roukema (2007) at nside = 2.
    #[test]
    fn centres_are_those_of_the_paper() {
        let base = HealPix::new(1).unwrap().angles();
        let elevations = [libm::asin(2.0 / 3.0), 0.0, -libm::asin(2.0 / 3.0)];
        for (index, [elevation, azimuth]) in base.into_iter().enumerate() {
            assert!((elevation - elevations[index / 4]).abs() < 1e-15);
            let shift = if index / 4 == 1 { 1.0 } else { 0.5 };
            let expected = FRAC_PI_2 * ((index % 4) as f64 + shift);
            assert!((libm::sin(azimuth - expected)).abs() < 1e-15 && libm::cos(azimuth - expected) > 0.0);
        }
        let heights: Vec<f64> = HealPix::new(2).unwrap().rings().map(|ring| ring.z).collect();
        let expected = [11.0, 8.0, 4.0, 0.0, -4.0, -8.0, -11.0].map(|z| z / 12.0);
        assert!(heights.iter().zip(expected).all(|(found, z)| (found - z).abs() < 1e-15), "{heights:?}");
    }

    #[test]
    fn every_ring_has_its_count_and_the_sphere_its_symmetries() {
        for healpix in all() {
            let (directions, angles) = (healpix.directions(), healpix.angles());
            assert_eq!((directions.len(), angles.len()), (healpix.count(), healpix.count()));
            assert_eq!(HealPix::of_count(healpix.count()), Some(healpix));
            assert!(directions.iter().sum::<Vector3<f64>>().norm() < 1e-11, "{healpix:?}");
            for (direction, angles) in directions.iter().zip(angles) {
                assert!((direction.norm() - 1.0).abs() < 1e-15);
                assert!((frame(angles).column(0) - direction).norm() < 2e-15, "{direction} {angles:?}");
                let rotated = Vector3::new(-direction.y, direction.x, -direction.z);
                assert!(directions.iter().any(|other| (other - rotated).norm() < 1e-14), "{direction}");
            }
        }
        assert_eq!((HealPix::new(0), HealPix::new(17), HealPix::of_count(13)), (None, None, None));
    }

    /// Each point on the sphere lies within the stated angle, and the poles lie at it.
    #[test]
    fn the_covering_radius_covers() {
        let mut draws = Draws(5);
        for healpix in all() {
            let (directions, radius) = (healpix.directions(), healpix.covering_radius());
            let nearest = |point: Vector3<f64>| {
                let cosine = directions.iter().map(|direction| direction.dot(&point)).fold(-1.0, f64::max);
                libm::acos(cosine.min(1.0))
            };
            assert!((nearest(Vector3::z()) - radius).abs() < 1e-12 && (nearest(-Vector3::z()) - radius).abs() < 1e-12);
            for _ in 0..4_000 {
                let (z, (sine, cosine)) = (2.0 * draws.unit() - 1.0, libm::sincos(TAU * draws.unit()));
                let out = libm::sqrt(1.0 - z * z);
                assert!(nearest(Vector3::new(out * cosine, out * sine, z)) <= radius, "{healpix:?}");
            }
        }
    }

    #[test]
    fn triangles_tile_the_sphere() {
        for healpix in all() {
            let (directions, triangles) = (healpix.directions(), healpix.triangles());
            assert_eq!(triangles.len(), 2 * directions.len() - 4);
            let mut whole = 0.0;
            for corners in &triangles {
                let [a, b, c] = corners.map(|corner| directions[corner]);
                let volume = a.dot(&b.cross(&c));
                assert!(volume > 1e-6, "{healpix:?} {corners:?}: {volume}");
                whole += 2.0 * libm::atan2(volume, 1.0 + a.dot(&b) + b.dot(&c) + c.dot(&a));
            }
            assert!((whole - 4.0 * PI).abs() < 1e-9, "{healpix:?}: {whole}");
        }
    }

    #[test]
    fn directions_are_sums_of_those_around_them() {
        let mut draws = Draws(6);
        for nside in [1, 2, 3, 7] {
            let healpix = HealPix::new(nside).unwrap();
            let (mesh, directions) = (Mesh::new(healpix), healpix.directions());
            let mut points: Vec<Vector3<f64>> = directions.clone();
            points.extend([Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y(), Vector3::z(), -Vector3::z()]);
            points.extend((0..2_000).map(|_| {
                let (z, (sine, cosine)) = (2.0 * draws.unit() - 1.0, libm::sincos(TAU * draws.unit()));
                let out = libm::sqrt(1.0 - z * z);
                Vector3::new(out * cosine, out * sine, z)
            }));
            for (index, point) in points.iter().enumerate() {
                let (corners, weights, slopes) = mesh.around(point);
                assert!(weights.iter().all(|weight| *weight > -1e-12), "{weights:?}");
                assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                let sum: Vector3<f64> = corners.iter().zip(weights).map(|(corner, w)| w * directions[*corner]).sum();
                assert!((sum.normalize() - point).norm() < 1e-12);
                assert!(slopes.iter().sum::<Vector3<f64>>().norm() < 1e-9);
                if index < directions.len() {
                    let own = corners.iter().zip(weights).find(|(corner, _)| **corner == index).expect("a corner");
                    assert!((own.1 - 1.0).abs() < 1e-12);
                }
            }
        }
    }
}
