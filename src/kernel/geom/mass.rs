//! Mass properties of a solid, from its cells.

use nalgebra::{Matrix3, Point3, Vector3};

use super::SolidGrid;

/// Volume, centre of mass and inertia of a solid of even density, in `Object`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// [m^3].
    pub volume: f64,
    /// Centre of mass [m].
    pub centre: Point3<f64>,
    /// Inertia about the centre of mass of a kilogram of it [m^2]: times the mass it is the inertia tensor.
    pub inertia: Matrix3<f64>,
}

/// Sums over cells: of 1, of x, y, z, and of xx, yy, zz, xy, xz, yz of their numbers.
#[derive(Default)]
struct Sums {
    count: u64,
    first: [u64; 3],
    squares: [u64; 3],
    products: [u64; 3],
}

impl MassProperties {
    /// Mass properties of the solid cells, each a cube of even density; robust where a surface has holes. `None` where
    /// no cell is solid.
    ///
    /// Sums are of integers, so that no order of them changes a bit.
    pub fn of_solid(solid: &SolidGrid) -> Option<Self> {
        let mut sums = Sums::default();
        for (row, words) in solid.words.chunks_exact(4).enumerate() {
            let [x, y] = [row / SolidGrid::SIDE, row % SolidGrid::SIDE].map(|number| number as u64);
            sums.add_row(x, y, words);
        }
        let count = sums.count as f64;
        if sums.count == 0 {
            return None;
        }
        // In cells, about the centre of cell (0, 0, 0).
        let mean = sums.first.map(|sum| sum as f64 / count);
        // A cube's own 1/12 in addition to the part from its centre.
        let variance: [f64; 3] =
            std::array::from_fn(|axis| sums.squares[axis] as f64 / count - mean[axis] * mean[axis] + 1.0 / 12.0);
        let mixed = |product: usize, one: usize, other: usize| {
            -(sums.products[product] as f64 / count - mean[one] * mean[other])
        };
        let [xy, xz, yz] = [mixed(0, 0, 1), mixed(1, 0, 2), mixed(2, 1, 2)];
        let [xx, yy, zz] = variance;
        let inertia = Matrix3::new(yy + zz, xy, xz, xy, xx + zz, yz, xz, yz, xx + yy) * (solid.pitch * solid.pitch);
        let centre = solid.origin + Vector3::from(mean).add_scalar(0.5) * solid.pitch;
        Some(Self { volume: solid.volume(), centre, inertia })
    }
}

impl Sums {
    /// A row of cells along z, bit by bit.
    fn add_row(&mut self, x: u64, y: u64, words: &[u64]) {
        let (mut count, mut sum, mut squares) = (0_u64, 0_u64, 0_u64);
        for (part, word) in (0_u64..).zip(words) {
            let (mut rest, first) = (*word, 64 * part);
            while rest != 0 {
                // Runs of solid cells: their sums are polynomials of where they end.
                let low = u64::from(rest.trailing_zeros());
                let run = u64::from((rest >> low).trailing_ones());
                let (from, to) = (first + low, first + low + run);
                count += run;
                sum += below(to) - below(from);
                squares += squares_below(to) - squares_below(from);
                rest = if low + run == 64 { 0 } else { rest >> (low + run) << (low + run) };
            }
        }
        self.count += count;
        for (first, add) in self.first.iter_mut().zip([x * count, y * count, sum]) {
            *first += add;
        }
        for (square, add) in self.squares.iter_mut().zip([x * x * count, y * y * count, squares]) {
            *square += add;
        }
        for (product, add) in self.products.iter_mut().zip([x * y * count, x * sum, y * sum]) {
            *product += add;
        }
    }
}

/// Sum of the numbers below `end`.
fn below(end: u64) -> u64 {
    end * end.saturating_sub(1) / 2
}

/// Sum of the squares of the numbers below `end`.
fn squares_below(end: u64) -> u64 {
    end * end.saturating_sub(1) * (2 * end).saturating_sub(1) / 6
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells within a box of cells.
    fn grid(inside: impl Fn([f64; 3]) -> bool) -> SolidGrid {
        let mut grid = SolidGrid::new(Point3::new(-0.1, 0.2, 0.3), 0.256);
        for x in 0..SolidGrid::SIDE {
            for y in 0..SolidGrid::SIDE {
                for z in 0..SolidGrid::SIDE {
                    if inside([x, y, z].map(|number| number as f64 + 0.5)) {
                        grid.words[(x * SolidGrid::SIDE + y) * 4 + z / 64] |= 1 << (z % 64);
                    }
                }
            }
        }
        grid
    }

    #[test]
    fn a_brick_weighs_what_the_formula_says() {
        let grid = grid(|[x, y, z]| x < 100.0 && y > 56.0 && (30.0..170.0).contains(&z));
        let found = MassProperties::of_solid(&grid).expect("solid cells");
        let [a, b, c] = [0.1, 0.2, 0.14];
        assert!((found.volume / (a * b * c) - 1.0).abs() < 1e-12);
        assert!((found.centre - Point3::new(-0.05, 0.356, 0.4)).norm() < 1e-12, "{}", found.centre);
        let wanted = Matrix3::from_diagonal(&(Vector3::new(b * b + c * c, a * a + c * c, a * a + b * b) / 12.0));
        assert!((found.inertia - wanted).norm() < 1e-12, "{}", found.inertia);
    }

    #[test]
    fn a_ball_and_an_oblique_solid() {
        let ball = grid(|at| at.iter().map(|part| (part - 128.0).powi(2)).sum::<f64>() < 100.0_f64.powi(2));
        let found = MassProperties::of_solid(&ball).expect("solid cells");
        let wanted = 0.4 * 0.1_f64.powi(2);
        assert!((found.inertia - Matrix3::from_diagonal_element(wanted)).norm() < 1e-3 * wanted);
        assert!((found.volume / (4.0 / 3.0 * std::f64::consts::PI * 1e-3) - 1.0).abs() < 1e-3);
        // Two cubes across a diagonal: by Steiner.
        let two = grid(|[x, y, z]| {
            let low = x < 20.0 && y < 20.0 && z < 20.0;
            low || ((100.0..120.0).contains(&x) && (50.0..70.0).contains(&y) && (30.0..50.0).contains(&z))
        });
        let found = MassProperties::of_solid(&two).expect("solid cells");
        let arm = Vector3::new(0.05, 0.025, 0.015);
        let steiner: Matrix3<f64> = Matrix3::identity() * arm.norm_squared() - arm * arm.transpose();
        let wanted = steiner + Matrix3::identity() * (0.02_f64.powi(2) / 6.0);
        assert!((found.inertia - wanted).norm() < 1e-12, "{} {wanted}", found.inertia);
        assert_eq!(MassProperties::of_solid(&grid(|_| false)), None);
    }
}
