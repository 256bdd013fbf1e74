//! How much of the solid lies inside a view's grid.

use nalgebra::Point3;

use super::view_grids::grid_coordinates;
use crate::geom::{CameraCv, GridPlacement, Object, Pose, SolidGrid};

/// Counts of solid cells in blocks of 8 x 8 x 8.
pub(super) struct Blocks {
    /// First cell (x, y, z) and count of each block that is not empty.
    blocks: Vec<([u8; 3], u16)>,
    total: u64,
}

const BLOCK: usize = 8;

impl Blocks {
    pub(super) fn new(solid: &SolidGrid) -> Self {
        const BLOCKS: usize = SolidGrid::SIDE / BLOCK;
        let mut counts = vec![0_u16; BLOCKS.pow(3)];
        for (place, word) in solid.words.iter().enumerate() {
            if *word != 0 {
                let (x, y, part) = (place / 1024, place / 4 % 256, place % 4);
                let line = &mut counts[((x / BLOCK) * BLOCKS + y / BLOCK) * BLOCKS + part * 8..][..8];
                for (count, byte) in line.iter_mut().zip(word.to_le_bytes()) {
                    *count += byte.count_ones() as u16;
                }
            }
        }
        let blocks: Vec<_> = (0..counts.len())
            .filter(|place| counts[*place] > 0)
            .map(|place| {
                let first = [place / BLOCKS / BLOCKS, place / BLOCKS % BLOCKS, place % BLOCKS];
                (first.map(|index| (index * BLOCK) as u8), counts[place])
            })
            .collect();
        let total = blocks.iter().map(|(_, count)| u64::from(*count)).sum();
        Self { blocks, total }
    }

    /// Share of the solid cells whose centre lies in the grid; 1 for an object without solid cells.
    pub(super) fn share(
        &self,
        solid: &SolidGrid,
        camera_from_object: &Pose<CameraCv, Object>,
        placement: &GridPlacement,
    ) -> f64 {
        if self.total == 0 {
            return 1.0;
        }
        let n = f64::from(placement.resolution);
        let to_grid = |point: Point3<f64>| grid_coordinates(placement, &camera_from_object.point(&point));
        let base = to_grid(solid.origin);
        let steps: [[f64; 3]; 3] = std::array::from_fn(|axis| {
            let rotation = camera_from_object.rotation().matrix();
            std::array::from_fn(|row| rotation[(row, axis)] * solid.pitch / placement.cell_size)
        });
        let at = |cell: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|row| {
                base[row] + steps[0][row] * cell[0] + steps[1][row] * cell[1] + steps[2][row] * cell[2]
            })
        };
        // How far a block reaches along each axis of the grid.
        let reach: [f64; 3] =
            std::array::from_fn(|row| steps.iter().map(|step| step[row].abs()).sum::<f64>() * BLOCK as f64 / 2.0);
        let mut inside = 0_u64;
        for (first, count) in &self.blocks {
            let middle = at(first.map(|first| f64::from(first) + BLOCK as f64 / 2.0));
            let outside = (0..3).any(|row| middle[row] + reach[row] < 0.0 || middle[row] - reach[row] >= n);
            let within = (0..3).all(|row| middle[row] - reach[row] >= 0.0 && middle[row] + reach[row] < n);
            if within {
                inside += u64::from(*count);
            } else if !outside {
                let first = first.map(usize::from);
                for x in first[0]..first[0] + BLOCK {
                    for y in first[1]..first[1] + BLOCK {
                        let byte = solid.words[(x * 256 + y) * 4 + first[2] / 64] >> (first[2] % 64) & 0xff;
                        if byte == 0 {
                            continue;
                        }
                        for z in 0..BLOCK {
                            let centre = [x, y, first[2] + z].map(|index| index as f64 + 0.5);
                            let held = byte >> z & 1 != 0 && at(centre).iter().all(|value| (0.0..n).contains(value));
                            inside += u64::from(held);
                        }
                    }
                }
            }
        }
        inside as f64 / self.total as f64
    }
}
