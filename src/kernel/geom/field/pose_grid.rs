//! A grid of end-effector poses, of either kind.

use std::borrow::Cow;

use nalgebra::{Rotation3, Vector3};

use super::{Axis, AxisGrid, AxisUnit, Covering, HealPix, InvalidPoseGrid, SphereGrid, covering};
use crate::geom::rotation_from_rpy;

/// A grid of end-effector poses: cells of position, each with the same orientations.
///
/// Cells are in C order over x, y, z and orientation: a position's orientations lie side by side.
#[derive(Clone, Debug, PartialEq)]
pub enum PoseGrid {
    /// Every combination of six axes, as the thesis has it.
    Axes(AxisGrid),
    /// Positions, directions and roll: orientations spread evenly.
    Sphere(SphereGrid),
}

impl From<AxisGrid> for PoseGrid {
    fn from(grid: AxisGrid) -> Self {
        Self::Axes(grid)
    }
}

impl From<SphereGrid> for PoseGrid {
    fn from(grid: SphereGrid) -> Self {
        Self::Sphere(grid)
    }
}

impl PoseGrid {
    /// A grid of six axes, as by [`AxisGrid::new`].
    ///
    /// # Errors
    /// Errors of [`AxisGrid::new`].
    pub fn new(axes: [Axis; 6]) -> Result<Self, InvalidPoseGrid> {
        AxisGrid::new(axes).map(Self::Axes)
    }

    /// A grid of positions, directions and roll, as by [`SphereGrid::new`].
    ///
    /// # Errors
    /// Errors of [`SphereGrid::new`].
    pub fn on_sphere(position_axes: [Axis; 3], directions: HealPix, rolls: usize) -> Result<Self, InvalidPoseGrid> {
        SphereGrid::new(position_axes, directions, rolls).map(Self::Sphere)
    }

    /// The axes x, y, z [m].
    pub fn position_axes(&self) -> &[Axis; 3] {
        match self {
            Self::Axes(grid) => grid.axes().first_chunk().expect("six axes begin with three"),
            Self::Sphere(grid) => grid.position_axes(),
        }
    }

    /// Cells along x, y and z.
    pub fn position_counts(&self) -> [usize; 3] {
        self.position_axes().map(|axis| axis.count)
    }

    /// Number of positions.
    pub fn positions(&self) -> usize {
        self.position_counts().iter().product()
    }

    /// Cells of one position.
    pub fn orientations(&self) -> usize {
        match self {
            Self::Axes(grid) => grid.strides()[2],
            Self::Sphere(grid) => grid.orientations(),
        }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.positions() * self.orientations()
    }

    /// All axes as files and people name them: x, y, z, then roll, pitch, yaw or direction (which counts directions), roll.
    pub fn axes(&self) -> Cow<'_, [Axis]> {
        match self {
            Self::Axes(grid) => Cow::Borrowed(grid.axes()),
            Self::Sphere(grid) => {
                let [x, y, z] = *grid.position_axes();
                let count = grid.directions().count();
                let direction =
                    Axis { name: "direction", unit: AxisUnit::HealPix, first: 0.0, step: 1.0, count, periodic: false };
                Cow::Owned(vec![x, y, z, direction, *grid.roll()])
            }
        }
    }

    /// Cells along each of [`Self::axes`].
    pub fn shape(&self) -> Vec<usize> {
        self.axes().iter().map(|axis| axis.count).collect()
    }

    /// Index of a position in C order over x, y, z.
    pub fn position([_, ny, nz]: [usize; 3], [x, y, z]: [usize; 3]) -> usize {
        (x * ny + y) * nz + z
    }

    /// The cells of a position, by its indices along x, y and z.
    pub fn cells_at(&self, indices: [usize; 3]) -> std::ops::Range<usize> {
        let first = Self::position(self.position_counts(), indices) * self.orientations();
        first..first + self.orientations()
    }

    /// Roll, pitch, yaw of an orientation [rad].
    pub fn rpy(&self, orientation: usize) -> [f64; 3] {
        match self {
            Self::Axes(grid) => {
                let [.., roll, pitch, yaw] = grid.pose(orientation);
                [roll, pitch, yaw]
            }
            Self::Sphere(grid) => grid.rpy(orientation),
        }
    }

    /// Rotation of an orientation.
    pub fn rotation(&self, orientation: usize) -> Rotation3<f64> {
        let [roll, pitch, yaw] = self.rpy(orientation);
        rotation_from_rpy(roll, pitch, yaw)
    }

    /// Where a position is [m].
    pub fn centre(&self, position: usize) -> Vector3<f64> {
        let [_, ny, nz] = self.position_counts();
        let indices = [position / (ny * nz), position / nz % ny, position % nz];
        Vector3::from(std::array::from_fn::<f64, 3, _>(|k| self.position_axes()[k].centre(indices[k])))
    }

    /// Pose at the centre of a cell: x, y, z [m], roll, pitch, yaw [rad].
    pub fn pose(&self, cell: usize) -> [f64; 6] {
        let ([x, y, z], [roll, pitch, yaw]) =
            (self.centre(cell / self.orientations()).into(), self.rpy(cell % self.orientations()));
        [x, y, z, roll, pitch, yaw]
    }

    /// Index of the cell nearest to a finite pose; positions are clamped.
    ///
    /// On six axes: axis by axis, wrapped on periodic ones; of the numbers that mean one rotation only those given are
    /// looked up. On directions: by the angle between the rotations.
    pub fn nearest(&self, pose: [f64; 6]) -> usize {
        match self {
            Self::Axes(grid) => grid.nearest(pose),
            Self::Sphere(grid) => {
                let [x, y, z, roll, pitch, yaw] = pose;
                let indices = [0, 1, 2].map(|k| grid.position_axes()[k].nearest([x, y, z][k]));
                let orientation = grid.nearest_orientation(&rotation_from_rpy(roll, pitch, yaw));
                Self::position(self.position_counts(), indices) * grid.orientations() + orientation
            }
        }
    }

    /// Covering radii of the orientations: for six axes by branch and bound over all rotations, which takes a
    /// moment; of directions a bound in closed form ([`SphereGrid::covering_radius`]).
    pub fn covering(&self) -> Covering {
        match self {
            Self::Axes(grid) => {
                let (radius, method) = (covering::of_axes(grid), "by branch and bound, to 0.01 deg");
                Covering { radius, directions: None, method }
            }
            Self::Sphere(grid) => {
                let (radius, method) = (grid.covering_radius(), "a bound in closed form");
                Covering { radius, directions: Some(grid.directions().covering_radius()), method }
            }
        }
    }
}
