//! Is the origin inside the hull? A linear programme, and a simplex of wrenches around the origin as its witness.

use super::set::WrenchSet;
use kernel::geom::SimdLevel;

/// Corners of the largest simplex.
pub(super) const CORNERS: usize = 7;
/// Steps of the simplex method before it gives up. It takes about ten; cycles need ties, which moved wrenches do not have.
const STEPS: usize = 200;
/// Reduced costs and pivots below this are rounding.
const ROUNDING: f64 = 1e-12;
/// A column that is not of the set.
const ARTIFICIAL: u16 = u16::MAX;

/// A simplex of `D + 1` wrenches and the inverse of their matrix, a column (wrench, 1) each. Row `i` of the inverse gives the
/// barycentric coordinate of corner `i`: (gradient, value at the origin).
#[derive(Clone, Copy, Debug)]
pub(super) struct Simplex<const D: usize> {
    pub corners: [u16; CORNERS],
    pub inverse: [[f64; CORNERS]; CORNERS],
}

impl<const D: usize> Simplex<D> {
    /// With these wrenches as corners; `None` when they are flat.
    pub fn new(set: &WrenchSet, corners: &[u16; CORNERS]) -> Option<Self> {
        let mut simplex = Self { corners: *corners, inverse: [[0.0; CORNERS]; CORNERS] };
        simplex.invert(set)?;
        Some(simplex)
    }

    /// Whether the origin is inside, its border included.
    fn holds_origin(&self) -> bool {
        self.inverse[..=D].iter().all(|row| row[D] >= 0.0)
    }

    /// Gauss and Jordan with partial pivoting, from the corners.
    fn invert(&mut self, set: &WrenchSet) -> Option<()> {
        // Columns are the corners with a last row of ones, so that the inverse gives barycentric coordinates.
        let mut matrix = [[0.0; CORNERS]; CORNERS];
        for (column, corner) in self.corners[..=D].iter().enumerate() {
            let corner: [f64; D] = set.point(*corner);
            (0..D).for_each(|row| matrix[row][column] = corner[row]);
            matrix[D][column] = 1.0;
        }
        let mut inverse = [[0.0; CORNERS]; CORNERS];
        (0..=D).for_each(|row| inverse[row][row] = 1.0);
        // Eliminate one column per step, with the largest remaining pivot.
        for step in 0..=D {
            let size = |row: &usize| matrix[*row][step].abs();
            let pivot = (step..=D).fold(step, |best, row| if size(&row) > size(&best) { row } else { best });
            if matrix[pivot][step].abs() <= ROUNDING {
                return None;
            }
            matrix.swap(step, pivot);
            inverse.swap(step, pivot);
            let scale = 1.0 / matrix[step][step];
            for column in 0..=D {
                matrix[step][column] *= scale;
                inverse[step][column] *= scale;
            }
            let (own, own_inverse) = (matrix[step], inverse[step]);
            for row in (0..=D).filter(|row| *row != step) {
                let share = matrix[row][step];
                for column in 0..=D {
                    matrix[row][column] -= share * own[column];
                    inverse[row][column] -= share * own_inverse[column];
                }
            }
        }
        self.inverse = inverse;
        Some(())
    }
}

/// A simplex of the set's wrenches that contains the origin, possibly on its border; if there is none, a direction
/// along which no wrench reaches the origin, if one was found. `before` is tried first.
pub(super) fn enclose<const D: usize>(
    set: &WrenchSet,
    level: SimdLevel,
    before: Option<&[u16; CORNERS]>,
) -> Result<Simplex<D>, Option<[f64; D]>> {
    if set.len() <= D {
        return Err(None);
    }
    let fits = |corners: &&[u16; CORNERS]| corners[..=D].iter().all(|corner| usize::from(*corner) < set.len());
    let known = before.filter(fits).and_then(|corners| Simplex::new(set, corners)).filter(Simplex::holds_origin);
    known.map_or_else(|| search(set, level), Ok)
}

/// Phase 1 of the simplex method: least weight of artificial corners. These are the unit vectors and minus their sum, which
/// hold the origin in their middle, so that no step has length 0 as it would with slacks.
fn search<const D: usize>(set: &WrenchSet, level: SimdLevel) -> Result<Simplex<D>, Option<[f64; D]>> {
    let share = 1.0 / (D as f64 + 1.0);
    let mut simplex = Simplex { corners: [ARTIFICIAL; CORNERS], inverse: [[0.0; CORNERS]; CORNERS] };
    for row in 0..=D {
        for column in 0..D {
            simplex.inverse[row][column] = if row == column { 1.0 - share } else { -share };
        }
        simplex.inverse[row][D] = share;
    }
    for _ in 0..STEPS {
        if !simplex.corners[..=D].contains(&ARTIFICIAL) {
            return simplex.invert(set).map(|()| simplex).ok_or(None);
        }
        let (mut price, mut constant) = ([0.0; D], 0.0);
        for (row, _) in simplex.inverse.iter().zip(&simplex.corners[..=D]).filter(|(_, corner)| **corner == ARTIFICIAL)
        {
            (0..D).for_each(|axis| price[axis] += row[axis]);
            constant += row[D];
        }
        let (entering, value) = set.support(level, &price);
        if value + constant <= ROUNDING {
            return Err(Some(price));
        }
        enter(&mut simplex, set, entering).ok_or(None)?;
    }
    Err(None)
}

/// Swaps a corner for a wrench so that the origin stays inside: an artificial one where there is a choice.
fn enter<const D: usize>(simplex: &mut Simplex<D>, set: &WrenchSet, entering: u16) -> Option<()> {
    let corner: [f64; D] = set.point(entering);
    let shares: [f64; CORNERS] = std::array::from_fn(|row| {
        let row = &simplex.inverse[row];
        (0..D).fold(row[D], |sum, axis| sum + row[axis] * corner[axis])
    });
    let mut leaving = None;
    for row in (0..=D).filter(|row| shares[*row] > ROUNDING) {
        let (ratio, real) = (simplex.inverse[row][D] / shares[row], simplex.corners[row] != ARTIFICIAL);
        if leaving.is_none_or(|(min, was_real, _)| (ratio, real) < (min, was_real)) {
            leaving = Some((ratio, real, row));
        }
    }
    let (_, _, row) = leaving?;
    let scale = 1.0 / shares[row];
    simplex.inverse[row].iter_mut().for_each(|value| *value *= scale);
    let own = simplex.inverse[row];
    for other in (0..=D).filter(|other| *other != row) {
        for (value, part) in simplex.inverse[other].iter_mut().zip(own) {
            *value -= shares[other] * part;
        }
    }
    simplex.corners[row] = entering;
    Some(())
}
