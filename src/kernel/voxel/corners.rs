//! The thesis's truth: lower corners of solid fine cells, mapped forward into the grid.
#![expect(unsafe_code, reason = "stores without checks: the hot path of every view")]

use super::{cells::Cells, interior::FineFromGrid, lookup::add_solid, placement::grid_coordinates};
use crate::geom::{Affine, CameraCv, GridPlacement, Lanes, Object, Pose, SimdLevel, SolidGrid, each_of, simd_kernel};

/// The solid cells near an empty one.
///
/// Why these are enough: let the grid's cells be at least sqrt(3) fine cells wide. The lattice points in a cell can be
/// walked in steps of at most 2.37: with c the cell's middle, from a point p farther than 1.5 from c there is one within
/// 0.87 of the point 1.5 nearer to c, whose ball of that radius lies in the cell; otherwise the point nearest c is near
/// enough. So when a cell holds a solid lattice point but none with an empty one within 2.37, all of its points are
/// solid, and the point nearest its middle shows it. Squared distances are whole, so 2.37 means at most 5.
pub(super) struct CornerShell {
    /// x, y, z a byte each; filled up to a multiple of 16 with copies of the last.
    points: Vec<u32>,
}

impl CornerShell {
    const SQUARED_REACH: i32 = 5;

    pub(super) fn new(solid: &SolidGrid) -> Self {
        const SIDE: i32 = SolidGrid::SIDE as i32;
        // Offsets within the reach: a discrete ball.
        let offsets: Vec<[i32; 3]> = (-2..=2)
            .flat_map(|x| (-2..=2).flat_map(move |y| (-2..=2).map(move |z| [x, y, z])))
            .filter(|[x, y, z]| x * x + y * y + z * z <= Self::SQUARED_REACH)
            .collect();
        // Bit z of the word `part` of row (x, y), shifted by dz; outside is empty.
        let word = |x: i32, y: i32, part: i32, dz: i32| -> u64 {
            if !(0..SIDE).contains(&x) || !(0..SIDE).contains(&y) {
                return 0;
            }
            let get = |part: i32| {
                if (0..4).contains(&part) { solid.words[((x * SIDE + y) * 4 + part) as usize] } else { 0 }
            };
            // Shifts across the word's end bring in bits of the neighbour.
            match dz {
                0 => get(part),
                1.. => get(part) >> dz | get(part + 1) << (64 - dz),
                _ => get(part) << -dz | get(part - 1) >> (64 + dz),
            }
        };
        let mut points = Vec::new();
        for x in 0..SIDE {
            for y in 0..SIDE {
                for part in 0..4 {
                    let own = word(x, y, part, 0);
                    if own == 0 {
                        continue;
                    }
                    // Erosion by the ball, 64 cells at a time: a deep cell has all offsets solid.
                    let deep =
                        offsets.iter().fold(
                            own,
                            |deep, [dx, dy, dz]| {
                                if deep == 0 { 0 } else { deep & word(x + dx, y + dy, part, *dz) }
                            },
                        );
                    // Shell: solid cells that the erosion removes, bit by bit.
                    let mut shell = own & !deep;
                    while shell != 0 {
                        let z = part as u32 * 64 + shell.trailing_zeros();
                        points.push(x as u32 | (y as u32) << 8 | z << 16);
                        shell &= shell - 1;
                    }
                }
            }
        }
        // Fill up to whole vectors with the last point.
        if let Some(last) = points.last().copied() {
            points.resize(points.len().next_multiple_of(16), last);
        }
        Self { points }
    }

    /// Marks the cells that hold a corner of the shell, or, where cells are too small for the shell to be enough, of any
    /// solid cell.
    pub(super) fn mark(
        &self,
        level: SimdLevel,
        solid: &SolidGrid,
        camera_from_object: &Pose<CameraCv, Object>,
        placement: &GridPlacement,
        cells: &mut Cells,
    ) {
        let origin = grid_coordinates(placement, &camera_from_object.point(&solid.origin));
        let rotation = camera_from_object.rotation().matrix();
        let scale = solid.pitch / placement.cell_size;
        // The border shifts every index by one.
        let rows = std::array::from_fn(|row| {
            let [a, b, c] = [0, 1, 2].map(|axis| (rotation[(row, axis)] * scale) as f32);
            [a, b, c, (origin[row] + 1.0) as f32]
        });
        if shell_is_enough(solid, placement) {
            mark_corners(level, &self.points, &rows, cells);
            return;
        }
        let mut points = Vec::new();
        for (index, word) in solid.words.iter().enumerate() {
            let mut word = *word;
            while word != 0 {
                let z = (index % 4 * 64) as u32 + word.trailing_zeros();
                points.push((index / 1024) as u32 | ((index / 4 % 256) << 8) as u32 | z << 16);
                word &= word - 1;
            }
        }
        if let Some(last) = points.last().copied() {
            points.resize(points.len().next_multiple_of(16), last);
        }
        mark_corners(level, &points, &rows, cells);
    }

    /// Adds the cells that hold solid corners only: those whose middle's nearest corner is a solid cell's.
    pub(super) fn fill(
        &self,
        level: SimdLevel,
        solid: &SolidGrid,
        camera_from_object: &Pose<CameraCv, Object>,
        placement: &GridPlacement,
        rows: &mut [u128],
    ) {
        if shell_is_enough(solid, placement) {
            let fine = FineFromGrid::new(solid, camera_from_object, placement);
            add_solid(level, solid, &fine, 0.5, placement.resolution as usize, rows);
        }
    }
}

fn shell_is_enough(solid: &SolidGrid, placement: &GridPlacement) -> bool {
    placement.cell_size >= 1.74 * solid.pitch
}

simd_kernel! {
    /// Marks the cell of each lattice point.
    fn mark_corners(points: &[u32], rows: &[[f32; 4]; 3], cells: &mut Cells) = mark_corners_body;
}

#[inline(always)]
fn mark_corners_body<L: Lanes>(l: L, points: &[u32], rows: &[[f32; 4]; 3], cells: &mut Cells) {
    let [to_x, to_y, to_z] = each_of!([0, 1, 2], row => Affine::new(l, rows[row]));
    let (zero, last) = (l.splat(0.0), l.splat((cells.side() - 1) as f32));
    let side = l.splat_i(cells.side() as i32);
    let byte = l.splat_i(0xff);
    for points in points.as_chunks::<16>().0 {
        let points = l.load_i(points);
        let x = l.to_float(l.and_i(points, byte));
        let y = l.to_float(l.and_i(l.shr_i::<8>(points), byte));
        let z = l.to_float(l.shr_i::<16>(points));
        let [x, y, z] = each_of!([&to_x, &to_y, &to_z], row => {
            l.truncate(l.max(l.min(row.at(l, x, y, z), last), zero))
        });
        let mut indices = [0; 16];
        l.store_i(l.add_i(l.mul_i(l.add_i(l.mul_i(x, side), y), side), z), &mut indices);
        for index in indices {
            // SAFETY: every index was clamped to the cells and their border.
            unsafe { *cells.bytes.get_unchecked_mut(index as usize) = 1 };
        }
    }
}
