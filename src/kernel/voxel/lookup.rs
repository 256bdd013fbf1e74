//! The fine cell that belongs to each cell of a grid.
#![expect(unsafe_code, reason = "gathers without bounds checks: the hot path of every view")]

use super::interior::FineFromGrid;
use crate::geom::{Lanes, SimdLevel, SolidGrid, each_of, simd_kernel};

/// Sets the bit of every cell whose centre, moved by `shift` fine cells along every axis, lies in a solid fine cell: with
/// 0 the cell that holds the centre, with 0.5 the one whose lower corner is nearest. In single precision.
pub(super) fn add_solid(
    level: SimdLevel,
    solid: &SolidGrid,
    fine: &FineFromGrid,
    shift: f64,
    n: usize,
    rows: &mut [u128],
) {
    add_solid_rows(level, &solid.words, fine, shift, n, rows);
}

simd_kernel! {
    fn add_solid_rows(words: &[u64], fine: &FineFromGrid, shift: f64, n: usize, rows: &mut [u128]) = add_solid_body;
}

#[inline(always)]
fn add_solid_body<L: Lanes>(l: L, words: &[u64], fine: &FineFromGrid, shift: f64, n: usize, rows: &mut [u128]) {
    const SIDE: f32 = SolidGrid::SIDE as f32;
    const { assert!(cfg!(target_endian = "little"), "halves of words are counted from the lowest") };
    // SAFETY: any bits make a u32.
    let (_, halves, _) = unsafe { words.align_to::<u32>() };
    let lane = l.to_float(l.load_i(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]));
    let step = fine.step_along_z().map(|step| step as f32);
    let (zero, side) = (l.splat(0.0), l.splat(SIDE));
    let last = l.splat(SIDE - 1.0);
    let all = u128::MAX >> (128 - n);
    for (index, row) in rows.iter_mut().enumerate() {
        // Affine along the row: the first cell's centre, plus z steps.
        let start = fine.at([(index / n) as f64 + 0.5, (index % n) as f64 + 0.5, 0.5]);
        let mut bits = 0;
        for first in (0..n).step_by(16) {
            let z = l.add(lane, l.splat(first as f32));
            let [x, y, z] = each_of!([0, 1, 2], axis => {
                l.add(l.splat((start[axis] + shift) as f32), l.mul(z, l.splat(step[axis])))
            });
            // Cells outside the fine grid stay empty.
            let [in_x, in_y, in_z] = each_of!([x, y, z], value => l.both(l.ge(value, zero), l.lt(value, side)));
            let inside = l.both(l.both(in_x, in_y), in_z);
            if l.bits(inside) == 0 {
                continue;
            }
            // Not negative once clamped, so truncation is floor.
            let [x, y, z] = each_of!([x, y, z], value => l.truncate(l.max(l.min(value, last), zero)));
            // Index of the 32-bit word: (256 x + y) 8 + z / 32.
            let word = l.add_i(l.shl_i::<3>(l.add_i(l.shl_i::<8>(x), y)), l.shr_i::<5>(z));
            // SAFETY: x, y and z are at most 255, so the index is below 256 * 256 * 8.
            let word = unsafe { l.gather_i(halves, word) };
            // Bit z mod 32 of the word.
            let solid = l.and_i(l.shr_each(word, l.and_i(z, l.splat_i(31))), l.splat_i(1));
            let found = l.both(inside, l.gt_i(solid, l.splat_i(0)));
            bits |= u128::from(l.bits(found)) << first;
        }
        *row |= bits & all;
    }
}
