//! Grids and label sets for the tests of this folder.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use super::{Axis, AxisGrid, AxisUnit};

const NAMES: [&str; 6] = ["x", "y", "z", "roll", "pitch", "yaw"];

pub(super) fn grid(first: [f64; 6], step: [f64; 6], count: [usize; 6], periodic: [bool; 6]) -> AxisGrid {
    AxisGrid::new(std::array::from_fn(|k| Axis {
        name: NAMES[k],
        unit: if k < 3 { AxisUnit::Metre } else { AxisUnit::Radian },
        first: first[k],
        step: step[k],
        count: count[k],
        periodic: periodic[k],
    }))
    .unwrap()
}

/// Axes of position a tenth of a metre apart.
pub(super) fn position_axes(counts: [usize; 3]) -> [Axis; 3] {
    std::array::from_fn(|k| Axis {
        name: NAMES[k],
        unit: AxisUnit::Metre,
        first: -0.2,
        step: 0.1,
        count: counts[k],
        periodic: false,
    })
}

/// The thesis's grid of 675,840 poses.
pub(super) fn fetch_grid() -> AxisGrid {
    grid(
        [0.0, -1.1, 0.0, -PI, -PI, -PI],
        [0.1, 0.1, 0.1, PI, FRAC_PI_4, FRAC_PI_4],
        [12, 22, 20, 2, 8, 8],
        [false, false, false, true, true, true],
    )
}

/// 7,500 cells with uneven steps, and a pitch that does not wrap.
pub(super) fn small_grid() -> AxisGrid {
    grid(
        [0.2, -0.3, 1.0, -PI, -1.0, 0.1],
        [0.1, 0.07, 0.13, TAU / 5.0, 0.4, TAU / 6.0],
        [5, 5, 5, 5, 2, 6],
        [false, false, false, true, false, true],
    )
}

/// Small grids of every kind of axis: periodic ones of even and odd count, and single cells.
pub(super) fn grids() -> Vec<AxisGrid> {
    let mixed = grid(
        [0.0; 6],
        [0.1, 0.2, 0.05, PI, TAU / 3.0, 0.3],
        [1, 7, 11, 2, 3, 9],
        [false, false, false, true, true, false],
    );
    let flat = grid(
        [0.0; 6],
        [0.1, 0.1, 0.1, TAU, TAU / 9.0, TAU / 12.0],
        [3, 1, 9, 1, 9, 12],
        [false, false, false, true, true, true],
    );
    vec![small_grid(), mixed, flat]
}

/// One number in 0..1 per call (SplitMix64): the room draws no random numbers but in its tests.
pub(super) struct Draws(pub(super) u64);

impl Draws {
    pub(super) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Labels drawn cell by cell.
pub(super) fn random_labels(grid: &AxisGrid, share: f64, seed: u64) -> Vec<bool> {
    let mut draws = Draws(seed);
    (0..grid.cells()).map(|_| draws.unit() < share).collect()
}

/// The union of a few balls in steps, about `radius` steps wide.
pub(super) fn blob_labels(grid: &AxisGrid, balls: usize, radius: f64, seed: u64) -> Vec<bool> {
    let mut draws = Draws(seed);
    let centres: Vec<[usize; 6]> =
        (0..balls).map(|_| grid.coordinates((draws.unit() * grid.cells() as f64) as usize)).collect();
    let near = |cell: [usize; 6], centre: &[usize; 6]| {
        let squares = (0..6).map(|k| (grid.axes()[k].steps_between(cell[k], centre[k]) as f64).powi(2));
        squares.sum::<f64>() <= radius * radius
    };
    (0..grid.cells()).map(|cell| centres.iter().any(|centre| near(grid.coordinates(cell), centre))).collect()
}
