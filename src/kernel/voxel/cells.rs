//! Cells of one view's grid while a kernel fills it: a byte each, with a border.

use crate::geom::{Lanes, OccupancyGrid, SimdLevel, simd_kernel};

/// One byte per cell, 1 = occupied, in C order with a border of one cell all round whose bytes are 1: positions outside
/// the grid map to the border, so no kernel tests for them. Cell (x, y, z) of the grid is (x + 1, y + 1, z + 1) here.
#[derive(Default)]
pub(super) struct Cells {
    resolution: usize,
    empty: Vec<u8>,
    pub(super) bytes: Vec<u8>,
}

impl Cells {
    /// Bytes past the end that a kernel may read: a row of 64, or the cell two further along every axis.
    fn slack(&self) -> usize {
        64 + 2 * (self.side() * self.side() + self.side())
    }

    /// Makes every cell empty.
    pub(super) fn reset(&mut self, resolution: u32) {
        if self.resolution != resolution as usize {
            self.resolution = resolution as usize;
            let side = self.side();
            let border = |index: usize| index == 0 || index == side - 1;
            self.empty = (0..side.pow(3))
                .map(|index| {
                    let (x, y, z) = (index / side / side, index / side % side, index % side);
                    u8::from(border(x) || border(y) || border(z))
                })
                .collect();
            self.empty.resize(side.pow(3) + self.slack(), 1);
        }
        self.bytes.clear();
        self.bytes.extend_from_slice(&self.empty);
    }

    /// Cells along each axis with the border.
    pub(super) fn side(&self) -> usize {
        self.resolution + 2
    }

    /// Empties the cells with index 0 on any axis (a quirk of the `thesis` profile).
    pub(super) fn drop_index_zero(&mut self) {
        let side = self.side();
        for a in 1..side - 1 {
            for b in 1..side - 1 {
                for [x, y, z] in [[1, a, b], [a, 1, b], [a, b, 1]] {
                    self.bytes[(x * side + y) * side + z] = 0;
                }
            }
        }
    }

    /// The cells along z at (x, y) of the grid as bits.
    pub(super) fn rows(&self, level: SimdLevel, rows: &mut Vec<u128>) {
        rows.clear();
        rows.resize(self.resolution * self.resolution, 0);
        gather_rows(level, &self.bytes, self.resolution, rows);
    }
}

simd_kernel! {
    /// One number of `resolution` bits for each row along z, in C order.
    fn gather_rows(bytes: &[u8], resolution: usize, rows: &mut [u128]) = gather_rows_body;
}

#[inline(always)]
fn gather_rows_body<L: Lanes>(l: L, bytes: &[u8], resolution: usize, rows: &mut [u128]) {
    let side = resolution + 2;
    let (low, high) = (mask64(resolution.min(64)), mask64(resolution.saturating_sub(64)));
    for (x, line) in rows.chunks_exact_mut(resolution).enumerate() {
        for (y, row) in line.iter_mut().enumerate() {
            let start = ((x + 1) * side + y + 1) * side + 1;
            let part = |start: usize| l.low_bits((&bytes[start..start + 64]).try_into().expect("slack follows"));
            *row = u128::from(part(start) & low);
            if resolution > 64 {
                *row |= u128::from(part(start + 64) & high) << 64;
            }
        }
    }
}

fn mask64(bits: usize) -> u64 {
    if bits == 0 { 0 } else { u64::MAX >> (64 - bits) }
}

/// Packs rows of bits into a grid.
pub(super) fn pack_rows(rows: &[u128], resolution: u32, grid: &mut OccupancyGrid) {
    grid.reset(resolution);
    if resolution.is_multiple_of(8) && resolution < 64 {
        // Whole bytes: each row overwrites the zeros that the one before wrote past its end.
        let (step, bytes) = (resolution as usize / 8, grid.bytes_mut());
        for (row, start) in rows.iter().zip((0..).step_by(step)) {
            let row = (*row as u64).to_le_bytes();
            match bytes.get_mut(start..start + 8) {
                Some(eight) => eight.copy_from_slice(&row),
                None => bytes[start..start + step].copy_from_slice(&row[..step]),
            }
        }
        return;
    }
    // Rows of any length: bits gather in a 64-bit word that is written when full.
    let (mut words, mut pending, mut filled) = (0, 0_u64, 0_u32);
    let bytes = grid.bytes_mut();
    let mut push = |bits: u64, count: u32| {
        if count == 0 {
            return;
        }
        // Low part fills the word, the rest starts the next one.
        pending |= bits << filled;
        if filled + count < 64 {
            filled += count;
            return;
        }
        // The last word may be shorter; its bits past the end are 0.
        let end = bytes.len().min(8 * words + 8);
        bytes[8 * words..end].copy_from_slice(&pending.to_le_bytes()[..end - 8 * words]);
        words += 1;
        let used = 64 - filled;
        pending = if used < 64 { bits >> used } else { 0 };
        filled = count - used;
    };
    // Each row in two halves; the upper one may be empty.
    for row in rows {
        push(*row as u64, resolution.min(64));
        push((row >> 64) as u64, resolution.saturating_sub(64));
    }
    // Last, partly filled word.
    let rest = bytes.len() - 8 * words;
    if rest > 0 {
        bytes[8 * words..].copy_from_slice(&pending.to_le_bytes()[..rest]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_pack_as_the_grid_says_at_every_resolution_and_level() {
        for resolution in [1, 2, 7, 8, 33, 40, 63, 64, 65, 127, 128] {
            let mut cells = Cells::default();
            cells.reset(resolution);
            let mut expected = OccupancyGrid::new(resolution);
            let mut state = 1_u64;
            for _ in 0..resolution * resolution {
                let cell = std::array::from_fn(|_| {
                    state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                    (state >> 33) as u32 % resolution
                });
                expected.set(cell);
                let [x, y, z] = cell.map(|index| index as usize + 1);
                let side = cells.side();
                cells.bytes[(x * side + y) * side + z] = 1;
            }
            for level in SimdLevel::available() {
                let (mut rows, mut grid) = (Vec::new(), OccupancyGrid::default());
                cells.rows(level, &mut rows);
                pack_rows(&rows, resolution, &mut grid);
                assert_eq!(grid, expected, "resolution {resolution}, {level}");
            }
        }
    }
}
