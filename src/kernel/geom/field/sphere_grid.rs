//! A grid of end-effector poses over positions, directions and the roll about them.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::{
    AxisUnit, HealPix, InvalidPoseGrid,
    axis_grid::{Axis, AxisGrid},
    healpix::frame,
};

/// Positions, times HEALPix directions of the end effector's x axis (its approach), times even steps of roll about it.
///
/// Cells are in C order over (x, y, z, direction, roll): roll varies fastest. Directions are in ring order; a cell's
/// rotation is Rz(yaw) Ry(pitch) Rx(roll) with yaw the azimuth of its direction and pitch its elevation, negated.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereGrid {
    position_axes: [Axis; 3],
    directions: HealPix,
    roll: Axis,
    /// Pitch and yaw of each direction [rad].
    angles: Vec<[f64; 2]>,
    /// x axis, and y and z axis at roll 0, of each direction: columns.
    frames: Vec<Matrix3<f64>>,
}

impl SphereGrid {
    /// Largest number of orientations: pairs of them in a distance field then fit a few hundred megabytes.
    pub const MAX_ORIENTATIONS: usize = 1 << 14;

    /// A grid of positions [m], directions and `rolls` equal steps of a full revolution, the first at -pi.
    ///
    /// # Errors
    /// Axes of position as for [`AxisGrid::new`], no roll, more than [`Self::MAX_ORIENTATIONS`] or more than
    /// [`AxisGrid::MAX_CELLS`].
    pub fn new(position_axes: [Axis; 3], directions: HealPix, rolls: usize) -> Result<Self, InvalidPoseGrid> {
        let radian = |name, step, count, periodic| Axis {
            name,
            unit: AxisUnit::Radian,
            first: -TAU / 2.0,
            step,
            count,
            periodic,
        };
        let roll = radian("roll", TAU / rolls as f64, rolls, true);
        if rolls == 0 {
            return Err(InvalidPoseGrid::NoCells { name: "roll" });
        }
        let orientations = directions.count().checked_mul(rolls).filter(|count| *count <= Self::MAX_ORIENTATIONS);
        let orientations = orientations.ok_or(InvalidPoseGrid::TooManyOrientations { max: Self::MAX_ORIENTATIONS })?;
        // The same rules as of other grids: all orientations as cells of one axis.
        let [x, y, z] = position_axes;
        let one = |name| radian(name, TAU, 1, false);
        AxisGrid::new([x, y, z, one("roll"), one("pitch"), radian("yaw", 1.0, orientations, false)])?;
        let angles: Vec<[f64; 2]> = directions.angles();
        let frames = angles.iter().map(|angles| frame(*angles)).collect();
        let angles = angles.into_iter().map(|[elevation, azimuth]| [-elevation, azimuth]).collect();
        Ok(Self { position_axes, directions, roll, angles, frames })
    }

    /// The axes x, y, z [m].
    pub fn position_axes(&self) -> &[Axis; 3] {
        &self.position_axes
    }

    /// The directions.
    pub fn directions(&self) -> HealPix {
        self.directions
    }

    /// The roll about each direction [rad].
    pub fn roll(&self) -> &Axis {
        &self.roll
    }

    /// Cells of one position: directions times rolls.
    pub fn orientations(&self) -> usize {
        self.frames.len() * self.roll.count
    }

    /// Columns: a direction, and the y and z axis of its end effector at roll 0.
    pub(super) fn frames(&self) -> &[Matrix3<f64>] {
        &self.frames
    }

    /// Roll, pitch, yaw of an orientation [rad].
    pub fn rpy(&self, orientation: usize) -> [f64; 3] {
        let [pitch, yaw] = self.angles[orientation / self.roll.count];
        [self.roll.centre(orientation % self.roll.count), pitch, yaw]
    }

    /// The orientation nearest to a rotation, by the angle between the two.
    pub fn nearest_orientation(&self, rotation: &Rotation3<f64>) -> usize {
        let (direction, side) = (rotation.matrix().column(0).into_owned(), rotation.matrix().column(1).into_owned());
        // The squared cosine of half the angle between two rotations is that of the swing, times that of the roll: no roll
        // gives more than the first.
        let max = |frame: &Matrix3<f64>| 0.5 * (1.0 + frame.column(0).dot(&direction));
        let with_roll = |index: usize, max: f64| {
            let roll_angle = roll_about(&self.frames[index], &direction, &side);
            let roll = self.roll.nearest(roll_angle);
            let cosine = libm::cos(0.5 * (roll_angle - self.roll.centre(roll)));
            (index * self.roll.count + roll, max * cosine * cosine)
        };
        let ahead = |best: (usize, f64), next: (usize, f64)| if next.1 > best.1 { next } else { best };
        let bounds = || self.frames.iter().map(max).enumerate();
        let (nearest, bound) = bounds().fold((0, -1.0), ahead);
        let first = with_roll(nearest, bound);
        let best = bounds().fold(first, |best, (index, bound)| {
            if bound > best.1 && index != nearest { ahead(best, with_roll(index, bound)) } else { best }
        });
        best.0
    }

    /// Largest angle between any rotation and the nearest orientation [rad].
    ///
    /// A swing about an axis perpendicular to its x axis brings any rotation's x axis onto the nearest direction, by no
    /// more than the directions' covering radius rho; then a roll about that direction, by no more than half a step h,
    /// ends at an orientation. Two rotations about perpendicular axes compose to one by theta with cos(theta / 2) =
    /// cos(rho / 2) cos(h / 2). That is an upper bound, since an orientation with another direction may be nearer; with
    /// a multiple of four rolls it is exact, since the four directions around a pole then have the same rolls.
    pub fn covering_radius(&self) -> f64 {
        let half = |angle: f64| libm::cos(0.5 * angle);
        2.0 * libm::acos(half(self.directions.covering_radius()) * half(0.5 * self.roll.step))
    }
}

/// The roll about a direction of an end effector whose x axis was brought onto it by the smallest rotation [rad, -pi..pi].
///
/// `frame` holds the direction and the axes from which rolls count; `x` and `y` are the end effector's.
pub(super) fn roll_about(frame: &Matrix3<f64>, x: &Vector3<f64>, y: &Vector3<f64>) -> f64 {
    let direction = frame.column(0).into_owned();
    // Straight back there is no smallest rotation: any roll will do.
    let along = y.dot(&direction) / (1.0 + x.dot(&direction)).max(f64::MIN_POSITIVE);
    let swung = y - along * (x + direction);
    libm::atan2(swung.dot(&frame.column(2)), swung.dot(&frame.column(1)))
}
