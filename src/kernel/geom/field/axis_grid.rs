//! A grid of end-effector poses over six axes.

use std::f64::consts::TAU;

/// Unit of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisUnit {
    /// Metre [m].
    Metre,
    /// Radian [rad].
    Radian,
    /// Index in the ring order of HEALPix pixels: no length, and neighbours in number need not be neighbours.
    HealPix,
}

impl AxisUnit {
    /// Name of the unit in files and for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Radian => "rad",
            Self::HealPix => "healpix",
        }
    }
}

/// One axis of a grid of poses: cell i has its centre at `first + i * step` and reaches half a step to both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Name of the axis, such as `"yaw"`.
    pub name: &'static str,
    /// Unit of `first` and `step`.
    pub unit: AxisUnit,
    /// Centre of cell 0.
    pub first: f64,
    /// Distance of neighbouring centres, above zero.
    pub step: f64,
    /// Number of cells, at least one.
    pub count: usize,
    /// Whether the cell after the last one is cell 0; then `count * step` is 2 pi, so that no pose is at both ends.
    pub periodic: bool,
}

impl Axis {
    /// Centre of cell `index`.
    pub fn centre(&self, index: usize) -> f64 {
        self.first + index as f64 * self.step
    }

    /// Steps between two cells, the shorter direction on a periodic axis.
    pub fn steps_between(&self, a: usize, b: usize) -> usize {
        let apart = a.abs_diff(b);
        if self.periodic { apart.min(self.count - apart) } else { apart }
    }

    /// A coordinate [steps from the centre of cell 0] brought into 0..=count on a periodic axis.
    ///
    /// Rounding may give the count itself, which is the centre of cell 0 again.
    #[inline]
    pub(super) fn wrap(&self, coordinate: f64) -> f64 {
        let count = self.count as f64;
        if !self.periodic || (0.0..count).contains(&coordinate) {
            return coordinate;
        }
        let periods = coordinate / count;
        if periods.abs() > 1e6 {
            return coordinate.rem_euclid(count);
        }
        // Far faster than `rem_euclid`, and as good while a revolution is much longer than its rounding.
        let whole = periods as i32;
        let whole = whole - i32::from(periods < f64::from(whole));
        (coordinate - f64::from(whole) * count).clamp(0.0, count)
    }

    /// The cell whose centre is nearest to a finite coordinate: wrapped on a periodic axis, clamped otherwise; the upper
    /// one of two at the same distance.
    pub fn nearest(&self, coordinate: f64) -> usize {
        let index = (self.wrap((coordinate - self.first) / self.step) + 0.5).floor().max(0.0) as usize;
        if self.periodic { index % self.count } else { index.min(self.count - 1) }
    }

    fn check(&self) -> Result<(), InvalidPoseGrid> {
        let &Self { name, unit, first, step, count, periodic } = self;
        if !first.is_finite() || !step.is_finite() {
            return Err(InvalidPoseGrid::NotFinite { name, first, step });
        }
        if step <= 0.0 {
            return Err(InvalidPoseGrid::StepNotPositive { name, step });
        }
        if count == 0 {
            return Err(InvalidPoseGrid::NoCells { name });
        }
        if !(first + count as f64 * step).is_finite() {
            return Err(InvalidPoseGrid::NotFinite { name, first, step });
        }
        let length = count as f64 * step;
        // Job files write pi to ten digits or more.
        if periodic && (unit != AxisUnit::Radian || (length - TAU).abs() > 1e-9 * TAU) {
            return Err(InvalidPoseGrid::NotOneTurn { name, length });
        }
        Ok(())
    }
}

/// Why axes make no grid of poses.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidPoseGrid {
    /// A number is infinite or not a number.
    #[error("axis {name}: first = {first} and step = {step}, and all centres, must be finite")]
    NotFinite {
        /// The axis.
        name: &'static str,
        /// First value as given.
        first: f64,
        /// Step as given.
        step: f64,
    },
    /// The step is zero or negative.
    #[error("axis {name}: step = {step} must be above zero")]
    StepNotPositive {
        /// The axis.
        name: &'static str,
        /// Step as given.
        step: f64,
    },
    /// The axis is empty.
    #[error("axis {name}: count = 0; an axis needs at least one cell")]
    NoCells {
        /// The axis.
        name: &'static str,
    },
    /// A periodic axis does not close.
    #[error("axis {name} is periodic, but count * step = {length} is not 2 pi rad; leave out one of the two ends")]
    NotOneTurn {
        /// The axis.
        name: &'static str,
        /// Count times step.
        length: f64,
    },
    /// A position in radians or an angle in metres.
    #[error("axis {name}: unit {unit:?}; x, y, z are in metres and roll, pitch, yaw in radians")]
    WrongUnit {
        /// The axis.
        name: &'static str,
        /// Unit as given.
        unit: AxisUnit,
    },
    /// More orientations than a field over directions can compare.
    #[error("more than {max} orientations (directions times rolls); take fewer")]
    TooManyOrientations {
        /// Largest possible number.
        max: usize,
    },
    /// More cells than a cell index can count.
    #[error("more than {max} cells; take larger steps")]
    TooManyCells {
        /// Largest possible number.
        max: usize,
    },
}

/// Every combination of six axes x, y, z, roll, pitch, yaw, rotation = Rz(yaw) Ry(pitch) Rx(roll).
///
/// Cells are in C order: yaw varies fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisGrid {
    axes: [Axis; 6],
    strides: [usize; 6],
    inverse_steps: [f64; 6],
    cells: usize,
}

impl AxisGrid {
    /// The most cells of a grid: indices, and sums of three of them, fit 32 bits.
    pub const MAX_CELLS: usize = 1 << 30;

    /// A grid of these axes, in the order x, y, z [m], roll, pitch, yaw [rad].
    ///
    /// # Errors
    /// A number that is not finite, a step not above zero, an empty axis, a periodic axis that is not one revolution, a wrong
    /// unit, or more than [`Self::MAX_CELLS`] cells.
    pub fn new(axes: [Axis; 6]) -> Result<Self, InvalidPoseGrid> {
        let mut strides = [1; 6];
        let mut cells = 1_usize;
        for k in (0..6).rev() {
            axes[k].check()?;
            let unit = if k < 3 { AxisUnit::Metre } else { AxisUnit::Radian };
            if axes[k].unit != unit {
                return Err(InvalidPoseGrid::WrongUnit { name: axes[k].name, unit: axes[k].unit });
            }
            strides[k] = cells;
            cells = cells
                .checked_mul(axes[k].count)
                .filter(|cells| *cells <= Self::MAX_CELLS)
                .ok_or(InvalidPoseGrid::TooManyCells { max: Self::MAX_CELLS })?;
        }
        Ok(Self { axes, strides, inverse_steps: axes.map(|axis| 1.0 / axis.step), cells })
    }

    /// The axes x, y, z, roll, pitch, yaw.
    pub fn axes(&self) -> &[Axis; 6] {
        &self.axes
    }

    /// Cells along each axis.
    pub fn shape(&self) -> [usize; 6] {
        self.axes.map(|axis| axis.count)
    }

    /// Difference of a cell's index per step along each axis.
    pub fn strides(&self) -> [usize; 6] {
        self.strides
    }

    /// One over each step: lookups multiply.
    pub(super) fn inverse_steps(&self) -> [f64; 6] {
        self.inverse_steps
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// Index of the cell with these coordinates, each below its axis's count.
    pub fn index(&self, coordinates: [usize; 6]) -> usize {
        debug_assert!((0..6).all(|k| coordinates[k] < self.axes[k].count));
        (0..6).map(|k| coordinates[k] * self.strides[k]).sum()
    }

    /// Coordinates of the cell with this index.
    pub fn coordinates(&self, index: usize) -> [usize; 6] {
        debug_assert!(index < self.cells);
        std::array::from_fn(|k| index / self.strides[k] % self.axes[k].count)
    }

    /// Pose at the centre of a cell: x, y, z [m], roll, pitch, yaw [rad].
    pub fn pose(&self, index: usize) -> [f64; 6] {
        let coordinates = self.coordinates(index);
        std::array::from_fn(|k| self.axes[k].centre(coordinates[k]))
    }

    /// Index of the cell nearest to a finite pose, axis by axis: wrapped on periodic axes, clamped on the others.
    ///
    /// Several numbers may mean one rotation: only those given are looked up.
    pub fn nearest(&self, pose: [f64; 6]) -> usize {
        self.index(std::array::from_fn(|k| self.axes[k].nearest(pose[k])))
    }
}

#[cfg(test)]
mod tests {
    use super::{super::fixtures::*, *};
    use std::f64::consts::PI;

    #[test]
    fn the_fetch_grid_has_its_count_and_order() {
        let grid = fetch_grid();
        assert_eq!(grid.cells(), 675_840);
        assert_eq!(grid.strides(), [56_320, 2_560, 128, 64, 8, 1]);
        assert_eq!(grid.index([1, 2, 3, 1, 4, 5]), 56_320 + 2 * 2_560 + 3 * 128 + 64 + 4 * 8 + 5);
    }

    #[test]
    fn index_coordinates_and_pose_agree() {
        let grid = small_grid();
        for index in 0..grid.cells() {
            let coordinates = grid.coordinates(index);
            assert_eq!(grid.index(coordinates), index);
            assert_eq!(grid.nearest(grid.pose(index)), index);
            let pose = grid.pose(index);
            let shifted = std::array::from_fn(|k| if grid.axes()[k].periodic { pose[k] - 3.0 * TAU } else { pose[k] });
            assert_eq!(grid.nearest(shifted), index);
        }
    }

    #[test]
    fn nearest_wraps_angles_and_clamps_positions() {
        let grid = fetch_grid();
        let cell = |pose| grid.coordinates(grid.nearest(pose));
        assert_eq!(cell([-5.0, 9.0, 0.26, 0.0, PI - 0.1, PI + 0.1]), [0, 21, 3, 1, 0, 0]);
        assert_eq!(cell([0.54, -1.1, 7.0, 1.5 * PI, -PI - 0.5, 1e9 * TAU]), [5, 0, 19, 1, 7, 4]);
    }

    #[test]
    fn every_defect_has_its_error() {
        let with = |k: usize, change: &dyn Fn(&mut Axis)| {
            let mut axes = *fetch_grid().axes();
            change(&mut axes[k]);
            AxisGrid::new(axes)
        };
        for step in [0.0, -0.0, -0.1] {
            assert_eq!(with(1, &|axis| axis.step = step), Err(InvalidPoseGrid::StepNotPositive { name: "y", step }));
        }
        assert_eq!(with(4, &|axis| axis.count = 0), Err(InvalidPoseGrid::NoCells { name: "pitch" }));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(matches!(with(0, &|axis| axis.first = bad), Err(InvalidPoseGrid::NotFinite { name: "x", .. })));
            assert!(matches!(with(5, &|axis| axis.step = bad), Err(InvalidPoseGrid::NotFinite { name: "yaw", .. })));
        }
        assert!(matches!(with(2, &|axis| axis.step = 1e308), Err(InvalidPoseGrid::NotFinite { name: "z", .. })));
        for count in [1, 7, 9] {
            let length = count as f64 * PI / 4.0;
            assert_eq!(with(5, &|axis| axis.count = count), Err(InvalidPoseGrid::NotOneTurn { name: "yaw", length }));
        }
        assert!(with(5, &|axis| axis.step = (1e10 * axis.step).round() / 1e10).is_ok(), "pi / 4 to ten digits");
        assert!(matches!(with(0, &|axis| axis.periodic = true), Err(InvalidPoseGrid::NotOneTurn { name: "x", .. })));
        assert_eq!(
            with(2, &|axis| axis.unit = AxisUnit::Radian),
            Err(InvalidPoseGrid::WrongUnit { name: "z", unit: AxisUnit::Radian })
        );
        assert!(matches!(with(0, &|axis| axis.count = 1 << 40), Err(InvalidPoseGrid::TooManyCells { .. })));
        assert!(matches!(with(0, &|axis| axis.count = usize::MAX), Err(InvalidPoseGrid::TooManyCells { .. })));
        let text = with(1, &|axis| axis.step = -0.1).unwrap_err().to_string();
        assert_eq!(text, "axis y: step = -0.1 must be above zero");
    }
}
