//! Cells that the camera sees to be free.
#![expect(unsafe_code, reason = "gathers without bounds checks: the hot path of every view")]

use crate::geom::{DepthCrop, GridPlacement, Intrinsics, Lanes, SimdLevel, simd_kernel};

/// Tables and a framed copy of the depth image; used again for every view.
#[derive(Default)]
pub(super) struct FreeTables {
    /// The crop with a frame of "no return" (+inf) one pixel wide: positions outside the crop map to the frame.
    framed: Vec<f32>,
    /// For each x and z: column in `framed`; z padded to a multiple of 16.
    columns: Vec<u32>,
    /// For each y and z: start of the row in `framed`.
    rows: Vec<u32>,
    /// For each z: depth of the cells' centres, rounded down to single precision.
    depths: Vec<f32>,
    /// For each z: one over that depth [1/m].
    inverse: Vec<f64>,
}

impl FreeTables {
    /// A cell's centre falls into column floor(fx x / z + cx), and x depends on the cell's x only: so columns are a
    /// table over (x, z), rows one over (y, z), in double precision; the kernel adds and looks up.
    pub(super) fn set(&mut self, level: SimdLevel, crop: &DepthCrop, camera: &Intrinsics, placement: &GridPlacement) {
        let (width, height) = (crop.width as usize, crop.height as usize);
        let n = placement.resolution as usize;
        let padded = n.next_multiple_of(16);
        self.framed.clear();
        self.framed.resize((width + 2) * (height + 2), f32::INFINITY);
        // Copy with NaN as infinitely far, inside the frame.
        for y in 0..height {
            let line = &mut self.framed[(y + 1) * (width + 2) + 1..][..width];
            for (to, depth) in line.iter_mut().zip(&crop.depth[y * width..]) {
                *to = if depth.is_nan() { f32::INFINITY } else { *depth };
            }
        }
        // Depth of each cell layer, and its inverse.
        let corner = placement.lower_corner();
        let centre = |axis: usize, index: usize| corner[axis] + (index as f64 + 0.5) * placement.cell_size;
        self.inverse.clear();
        self.inverse.extend((0..padded).map(|z| 1.0 / centre(2, z)));
        self.depths.clear();
        self.depths.extend((0..padded).map(|z| {
            let exact = centre(2, z);
            let rounded = exact as f32;
            // For a depth d in single precision, d > exact is then d > this.
            let down = if f64::from(rounded) > exact { rounded.next_down() } else { rounded };
            // A centre behind the camera is not seen: nothing is farther than infinity.
            if exact > 0.0 { down } else { f32::INFINITY }
        }));
        // Pinhole projection of the cells' centres: f x / z + c, relative to the crop and its frame.
        let mut table = |axis: usize, focal: f64, principal: f64, first: u32, count: u32, step: u32| {
            let table = if axis == 0 { &mut self.columns } else { &mut self.rows };
            table.resize(n * padded, 0);
            for (index, table) in table.chunks_exact_mut(padded).enumerate() {
                let line = Line {
                    scaled: focal * centre(axis, index),
                    shift: principal - f64::from(first) + 1.0,
                    last: count + 1,
                    step,
                };
                fill_line(level, &line, &self.inverse, table);
            }
        };
        table(0, camera.fx, camera.cx, crop.left, crop.width, 1);
        table(1, camera.fy, camera.cy, crop.top, crop.height, crop.width + 2);
    }
}

/// One row of a table: index of the pixel of `scaled / z`, clamped to 0..=last, times `step`.
struct Line {
    scaled: f64,
    shift: f64,
    last: u32,
    step: u32,
}

simd_kernel! {
    /// Pixels of one row of cells, from the inverse depths of their centres.
    fn fill_line(line: &Line, inverse: &[f64], table: &mut [u32]) = fill_line_body;
}

#[inline(always)]
fn fill_line_body<L: Lanes>(_: L, line: &Line, inverse: &[f64], table: &mut [u32]) {
    let last = f64::from(line.last);
    for (offset, inverse) in table.iter_mut().zip(inverse) {
        let pixel = line.scaled * inverse + line.shift;
        // Not negative once clamped, so truncation is floor; NaN becomes the frame.
        let pixel = if pixel > 0.0 { pixel } else { 0.0 };
        let pixel = if pixel < last { pixel } else { last };
        // SAFETY: 0 <= pixel <= 16385.
        *offset = unsafe { pixel.to_int_unchecked::<i32>() } as u32 * line.step;
    }
}

simd_kernel! {
    /// One number of bits for each row of cells along z, in C order: free where the depth behind the centre's pixel is
    /// larger than the centre's.
    pub(super) fn free_rows(tables: &FreeTables, resolution: usize, out: &mut [u128]) = free_rows_body;
}

#[inline(always)]
fn free_rows_body<L: Lanes>(l: L, tables: &FreeTables, resolution: usize, out: &mut [u128]) {
    let padded = resolution.next_multiple_of(16);
    let depths = tables.depths.as_chunks::<16>().0;
    let mask = u128::MAX >> (128 - resolution);
    for (x, line) in out.chunks_exact_mut(resolution).enumerate() {
        let columns = tables.columns[x * padded..(x + 1) * padded].as_chunks::<16>().0;
        for (y, row) in line.iter_mut().enumerate() {
            let rows = tables.rows[y * padded..(y + 1) * padded].as_chunks::<16>().0;
            let mut bits = 0;
            for (chunk, ((column, row), depth)) in columns.iter().zip(rows).zip(depths).enumerate() {
                let offset = l.add_i(l.load_i(column), l.load_i(row));
                // SAFETY: columns and rows were clamped to the framed image.
                let seen = unsafe { l.gather(&tables.framed, offset) };
                bits |= u128::from(l.bits(l.lt(l.load(depth), seen))) << (16 * chunk);
            }
            *row = bits & mask;
        }
    }
}
