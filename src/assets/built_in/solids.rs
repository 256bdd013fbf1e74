//! Boxes and superquadrics.

use std::f64::consts::{PI, TAU};

use super::surface::Surface;
use kernel::seed::Stream;

/// A box, its sides in even steps.
pub(super) fn cuboid(draw: &mut Stream, triangles: usize) -> Surface {
    let longest = draw.uniform(0.05, 0.24);
    let [x, y] = [longest * draw.uniform(0.2, 1.0), longest * draw.uniform(0.2, 1.0)];
    // Which side is the long one is drawn too.
    let mut sides = [x, y, longest];
    draw.shuffle(&mut sides);
    sized_cuboid(sides, triangles)
}

fn sized_cuboid(sides: [f64; 3], triangles: usize) -> Surface {
    let [x, y, z] = sides;
    // Side of a square cell from the surface area, at two triangles per cell.
    let step = libm::sqrt(4.0 * (x * y + y * z + z * x) / triangles as f64);
    let cells = sides.map(|side| libm::ceil(side / step).max(1.0) as usize);
    let mut surface = Surface::default();
    // Six grids; their common edges have equal positions and are merged when the mesh is prepared.
    for (axis, positive) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
        // Axes u, v and `axis` are right-handed: counter-clockwise in (u, v) faces along +`axis`.
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let corner = |i: usize, j: usize| {
            let mut corner = [0.0; 3];
            corner[axis] = if positive { sides[axis] } else { 0.0 };
            corner[u] = sides[u] * (i as f64 / cells[u] as f64);
            corner[v] = sides[v] * (j as f64 / cells[v] as f64);
            // Middle of the base at the origin.
            [corner[0] - x / 2.0, corner[1] - y / 2.0, corner[2]]
        };
        let start = surface.positions.len();
        surface
            .positions
            .extend((0..=cells[v]).flat_map(|j| (0..=cells[u]).map(move |i| (i, j))).map(|(i, j)| corner(i, j)));
        let index = |i: usize, j: usize| (start + j * (cells[u] + 1) + i) as u32;
        for (i, j) in (0..cells[v]).flat_map(|j| (0..cells[u]).map(move |i| (i, j))) {
            // Two triangles per cell, wound outward on both sides.
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            let faces = if positive { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
            surface.faces.extend(faces);
        }
    }
    surface
}

/// A superellipsoid (Barr 1981, "Superquadrics and angle-preserving transformations"), from boxy to pointed.
pub(super) fn superquadric(draw: &mut Stream, triangles: usize) -> Surface {
    let longest = draw.uniform(0.025, 0.08);
    let mut axes = [longest, longest * draw.uniform(0.35, 1.0), longest * draw.uniform(0.35, 1.0)];
    draw.shuffle(&mut axes);
    let exponents = [draw.uniform(0.35, 1.7), draw.uniform(0.35, 1.7)];
    sized_superquadric(axes, exponents, triangles)
}

/// Half axes [m] and the exponents along the meridian and around the axis; 1 is an ellipsoid.
fn sized_superquadric(axes: [f64; 3], [meridian, around]: [f64; 2], triangles: usize) -> Surface {
    // About sqrt(n) columns, a multiple of four, and an even count of rows: the axes' ends are sampled.
    let columns = libm::ceil(libm::sqrt(triangles as f64)) as usize / 4 * 4 + 4;
    let rows = triangles.div_ceil(2 * columns) / 2 * 2 + 2;
    // Distance from the centre to |x|^(2/e) + |y|^(2/e) = 1 in a direction.
    let reach = |(sin, cos): (f64, f64), exponent: f64| {
        let power = |x: f64| libm::pow(libm::fabs(x), 2.0 / exponent);
        libm::pow(power(sin) + power(cos), -exponent / 2.0)
    };
    let mut surface = Surface::default();
    // South pole, then row after row up to the north pole.
    let mut last: Vec<u32> = surface.row([[0.0, 0.0, 0.0]]).collect();
    for row in 1..=rows {
        // Even steps of latitude on the meridian's curve, in polar form.
        let (sin, cos) = libm::sincos(PI * row as f64 / rows as f64 - PI / 2.0);
        let far = reach((sin, cos), meridian);
        let height = axes[2] * (1.0 + far * sin);
        let next: Vec<u32> = if row == rows {
            surface.row([[0.0, 0.0, 2.0 * axes[2]]]).collect()
        } else {
            let ring = (0..columns).map(|column| {
                let (sin_c, cos_c) = libm::sincos(TAU * column as f64 / columns as f64);
                // Barr's spherical product: the meridian scales the curve around the axis.
                let radius = far * cos * reach((sin_c, cos_c), around);
                [axes[0] * radius * cos_c, axes[1] * radius * sin_c, height]
            });
            surface.row(ring.collect::<Vec<_>>()).collect()
        };
        surface.join(&last, &next);
        last = next;
    }
    surface
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_the_volume_of_its_sides() {
        assert!((sized_cuboid([0.03, 0.11, 0.2], 5000).volume() / (0.03 * 0.11 * 0.2) - 1.0).abs() < 1e-12);
    }

    /// 2 a b c e f B(e/2 + 1, e) B(f/2, f/2) (Jaklic, Leonardis, Solina 2000, "Segmentation and recovery of superquadrics",
    /// equation 2.60); an ellipsoid for e = f = 1.
    #[test]
    fn superquadrics_have_their_closed_form_volume() {
        let beta = |x: f64, y: f64| (libm::lgamma(x) + libm::lgamma(y) - libm::lgamma(x + y)).exp();
        for [e, f] in [[1.0, 1.0], [0.4, 1.0], [1.6, 0.5], [0.7, 1.3]] {
            let wanted = 2.0 * 0.03 * 0.05 * 0.02 * e * f * beta(e / 2.0 + 1.0, e) * beta(f / 2.0, f / 2.0);
            let error = |triangles| sized_superquadric([0.03, 0.05, 0.02], [e, f], triangles).volume() / wanted - 1.0;
            // An inscribed surface falls short, by less the finer it is.
            let (coarse, fine) = (error(4_000), error(64_000));
            assert!(coarse.abs() < 6e-3 && fine.abs() < 0.3 * coarse.abs(), "{e} {f}: {coarse} {fine}");
        }
    }
}
