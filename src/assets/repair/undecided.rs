//! Share of a surface without a clear inside.
//!
//! The generalised winding number (Jacobson, Kavan and Sorkine-Hornung 2013) is a whole number everywhere around a
//! closed surface, and nearly one near a surface with small holes. Where it is farther than 1/4 from a whole number, no
//! side of the surface is clearly inside. It differs from a whole number only by the winding number of any surface that
//! closes the mesh, so the rim alone determines how far.

use std::f64::consts::TAU;

use nalgebra::{Complex, Vector3};

use super::edges::{BOUNDARY, CROWDED, Edges, from, to};
use kernel::geom::TriMesh;

type V3 = Vector3<f64>;

/// The rim of a surface: each edge as often as the faces that run along it in one direction outnumber the others.
pub(crate) struct Rim {
    /// Start and end of each edge [m].
    edges: Vec<[V3; 2]>,
    /// Length of all edges [m].
    pub(crate) length: f64,
}

impl Rim {
    /// The rim of `mesh`, whose `edges` were found after its faces were oriented.
    pub(crate) fn of(mesh: &TriMesh, edges: &Edges) -> Self {
        let faces = &mesh.triangles;
        let mut rim = Self { edges: Vec::new(), length: 0.0 };
        let mut add = |half: u32, times: i32| {
            let [a, b] = [from(faces, half), to(faces, half)]
                .map(|vertex| V3::from(mesh.vertices[vertex as usize].map(f64::from)));
            let edge = if times < 0 { [b, a] } else { [a, b] };
            rim.length += f64::from(times.abs()) * (b - a).norm();
            rim.edges.extend((0..times.abs()).map(|_| edge));
        };
        if edges.boundary + edges.same_direction > 0 {
            for (half, &partner) in (0..).zip(&edges.partner) {
                if partner == BOUNDARY {
                    add(half, 1);
                } else if partner != CROWDED && half < partner && from(faces, half) == from(faces, partner) {
                    add(half, 2);
                }
            }
        }
        for crowd in &edges.crowded {
            let start = from(faces, crowd[0]);
            add(crowd[0], crowd.iter().map(|&half| if from(faces, half) == start { 1 } else { -1 }).sum());
        }
        rim
    }

    /// Distance of the winding number at `point` from the nearest whole number. Lengths are divided by `size` first.
    ///
    /// Closes the surface by a band from the rim to a point at infinity. Solid angles of its triangles: Van Oosterom and
    /// Strackee 1983, with the first corner at infinity. Their sum modulo 4 pi is the argument of a product, so that one arc
    /// tangent is enough.
    fn distance_from_whole(&self, point: &V3, size: f64) -> f64 {
        /// Direction of the point at infinity: of unit length, along no axis.
        const AWAY: V3 = V3::new(0.48, 0.6, 0.64);
        /// Factors between two rescalings: their product stays far from the ends of the numbers' range.
        const FACTORS: usize = 8;
        let mut product = Complex::new(1.0, 0.0);
        for edges in self.edges.chunks(FACTORS) {
            for edge in edges {
                let [a, b] = edge.map(|end| (end - point) / size);
                let (length_a, length_b) = (a.norm(), b.norm());
                product *= Complex::new(
                    length_a * length_b + a.dot(&b) + AWAY.dot(&a) * length_b + AWAY.dot(&b) * length_a,
                    AWAY.dot(&a.cross(&b)),
                );
            }
            let scale = libm::fabs(product.re).max(libm::fabs(product.im));
            if scale > 0.0 {
                product /= scale;
            }
        }
        libm::fabs(libm::atan2(product.im, product.re)) / TAU
    }

    /// Share of the area of `mesh` at which the winding number is farther than 1/4 from a whole number, by samples.
    pub(crate) fn undecided_share(&self, mesh: &TriMesh) -> f64 {
        /// Fewest and most samples.
        const SAMPLES: [usize; 2] = [128, 512];
        /// Edges that may be looked at, as long as the fewest samples are taken.
        const BUDGET: usize = 1 << 22;
        if self.edges.is_empty() {
            return 0.0;
        }
        let samples = (BUDGET / self.edges.len()).clamp(SAMPLES[0], SAMPLES[1]);
        let size = mesh.aabb().map_or(1.0, |aabb| aabb.longest_side());
        let points = surface_points(mesh, samples);
        let undecided = points.iter().filter(|point| self.distance_from_whole(point, size) > 0.25).count();
        undecided as f64 / points.len().max(1) as f64
    }
}

/// Points on the surface, one per equal share of its area.
fn surface_points(mesh: &TriMesh, count: usize) -> Vec<V3> {
    /// Steps of the sequence R2 (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences").
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    let corners = |face: usize| mesh.corners(face).map(|corner| corner.coords);
    let area = |[a, b, c]: [V3; 3]| (b - a).cross(&(c - a)).norm();
    let total: f64 = (0..mesh.triangles.len()).map(|face| area(corners(face))).sum();
    let (mut points, mut below) = (Vec::with_capacity(count), 0.0);
    for face in 0..mesh.triangles.len() {
        let [a, b, c] = corners(face);
        below += area([a, b, c]);
        while points.len() < count && (points.len() as f64 + 0.5) * total < below * count as f64 {
            let [u, v] = STEPS.map(|step| (0.5 + step * points.len() as f64) % 1.0);
            let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
            points.push(a + (b - a) * u + (c - a) * v);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square tube of side 1 and this length along z, open at both ends.
    fn tube(length: f32) -> TriMesh {
        let corner = |corner: u32| [(corner & 1) as f32, (corner >> 1 & 1) as f32, length * (corner >> 2) as f32];
        let quads = [[0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        TriMesh {
            vertices: (0..8).map(corner).collect(),
            triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        }
    }

    fn rim(mesh: &TriMesh) -> Rim {
        Rim::of(mesh, &Edges::of(&mesh.triangles, mesh.vertices.len()))
    }

    /// A square of side 1 covers 4 atan(1 / (2 d sqrt(4 d^2 + 2))) on its axis at distance d; both ends of the tube are open.
    #[test]
    fn on_the_axis_of_an_open_tube_the_distance_is_that_of_the_closed_form() {
        let cover = |d: f64| 4.0 * libm::atan(1.0 / (2.0 * d * libm::sqrt(4.0 * d * d + 2.0))) / (2.0 * TAU);
        let rim = rim(&tube(3.0));
        assert_eq!((rim.edges.len(), rim.length), (8, 8.0));
        for z in [0.1, 0.7, 1.5, 2.2] {
            let wanted = cover(z) + cover(3.0 - z);
            let found = rim.distance_from_whole(&V3::new(0.5, 0.5, z), 3.0);
            assert!((found - wanted.min(1.0 - wanted)).abs() < 1e-12, "{z}: {found}, not {wanted}");
        }
    }

    #[test]
    fn a_long_tube_has_an_inside_and_a_ring_has_none() {
        let [long, ring] = [8.0, 0.1].map(|length| {
            let mesh = tube(length);
            rim(&mesh).undecided_share(&mesh)
        });
        assert!(long < 0.02 && ring > 0.98, "{long} {ring}");
    }

    #[test]
    fn a_closed_surface_has_no_rim_and_three_faces_at_an_edge_have_one() {
        let mut mesh = tube(1.0);
        mesh.triangles.extend([[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6]]);
        assert_eq!((rim(&mesh).length, rim(&mesh).undecided_share(&mesh)), (0.0, 0.0));
        // A wall across, in both its edges along z the third face.
        mesh.triangles.extend([[0, 3, 7], [0, 7, 4]]);
        let length = 2.0 * (1.0 + libm::sqrt(2.0));
        assert!((rim(&mesh).length - length).abs() < 1e-12, "{}", rim(&mesh).length);
    }

    #[test]
    fn samples_spread_over_the_area() {
        let mesh = tube(1.0);
        let points = surface_points(&mesh, 400);
        assert_eq!(points.len(), 400);
        let low = points.iter().filter(|point| point.z < 0.5).count();
        let front = points.iter().filter(|point| point.y == 0.0).count();
        assert!((190..=210).contains(&low) && front == 100, "{low} {front}");
    }
}
