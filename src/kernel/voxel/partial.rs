//! From a depth image to the cells that it sees.
#![expect(unsafe_code, reason = "conversions and stores without checks: the hot path of every view")]

use super::{cells::Cells, placement::Slopes};
use crate::geom::{DepthCrop, GridPlacement, Lanes, simd_kernel};

simd_kernel! {
    /// Marks the cell of every pixel with a return: floor((p - centre) / cell_size + anchor) in double precision, p as
    /// [`crate::geom::Intrinsics::unproject`] has it. What lies outside falls on the border.
    pub(super) fn mark_points(crop: &DepthCrop, slopes: &Slopes, placement: &GridPlacement, cells: &mut Cells)
        = mark_points_body;
}

#[inline(always)]
fn mark_points_body<L: Lanes>(_: L, crop: &DepthCrop, slopes: &Slopes, placement: &GridPlacement, cells: &mut Cells) {
    const LANES: usize = 16;
    let side = cells.side() as i32;
    let scale = 1.0 / placement.cell_size;
    // The border shifts every index by one.
    let anchor = placement.anchor().map(|anchor| anchor + 1.0);
    let centre = placement.centre;
    let last = f64::from(side - 1);
    let index = |p: f64, axis: usize| {
        let g = (p - centre[axis]) * scale + anchor[axis];
        // NaN becomes 0, the border; what is clamped is not negative, so truncation is floor.
        let g = if g > 0.0 { g } else { 0.0 };
        let g = if g < last { g } else { last };
        // SAFETY: 0 <= g < 131.
        unsafe { g.to_int_unchecked::<i32>() }
    };
    for (line, slope_y) in crop.depth.chunks_exact(crop.width as usize).zip(&slopes.rows) {
        let mut mark = |depths: &[f32; LANES], slopes: &[f64; LANES]| {
            let mut indices = [0_i32; LANES];
            for lane in 0..LANES {
                // Unprojection: x and y are depth times the pixel's slopes, then the cell's index in C order.
                let z = f64::from(depths[lane]);
                let (x, y) = (index(slopes[lane] * z, 0), index(slope_y * z, 1));
                indices[lane] = (x * side + y) * side + index(z, 2);
            }
            for index in indices {
                // SAFETY: every index is at least 0 and below `side`.
                unsafe { *cells.bytes.get_unchecked_mut(index as usize) = 1 };
            }
        };
        let (chunks, rest) = line.as_chunks::<LANES>();
        let (slope_chunks, slope_rest) = slopes.columns.as_chunks::<LANES>();
        for (depths, slopes) in chunks.iter().zip(slope_chunks) {
            mark(depths, slopes);
        }
        if !rest.is_empty() {
            // Last pixels of a row: lanes without a pixel are NaN and fall on the border.
            let (mut depths, mut slopes) = ([f32::NAN; LANES], [0.0; LANES]);
            depths[..rest.len()].copy_from_slice(rest);
            slopes[..rest.len()].copy_from_slice(slope_rest);
            mark(&depths, &slopes);
        }
    }
}
