//! Approach directions of end effectors, coarsely grouped for images and counts.

use nalgebra::Vector3;

use super::PoseGrid;

/// Directions 45 degrees apart in azimuth and in elevation, straight up and straight down once each: those that the grid
/// of the thesis has, in order of elevation, then of azimuth; unit vectors.
///
/// An end effector approaches along the x axis of its target site.
pub fn approach_directions() -> [Vector3<f64>; 26] {
    std::array::from_fn(|index| {
        let eighth = std::f64::consts::FRAC_PI_4;
        let (elevation, azimuth) = match index {
            0 => (-2.0, 0.0),
            25 => (2.0, 0.0),
            _ => (((index - 1) / 8) as f64 - 1.0, ((index - 1) % 8) as f64 - 4.0),
        };
        let (up, level) = libm::sincos(elevation * eighth);
        let (y, x) = libm::sincos(azimuth * eighth);
        Vector3::new(level * x, level * y, up)
    })
}

impl PoseGrid {
    /// The index in [`approach_directions`] that is nearest to each orientation's approach (x) axis, in the order of
    /// the orientations; the first of several at the same angle.
    pub fn approaches(&self) -> Vec<u8> {
        let directions = approach_directions();
        let nearest = |angle| {
            let approach = self.rotation(angle) * Vector3::x();
            let mut best = (0, f64::NEG_INFINITY);
            for (index, direction) in (0..).zip(&directions) {
                let cosine = direction.dot(&approach);
                // Rounding must not choose between equal ones.
                if cosine > best.1 + 1e-9 {
                    best = (index, cosine);
                }
            }
            best.0
        };
        (0..self.orientations()).map(nearest).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::field::fixtures::fetch_grid;

    /// The grid of 128 orientations has 16 that point straight up and 16 straight down (8 yaws about the approach axis,
    /// 2 rolls); of every other direction there are 4.
    #[test]
    fn the_thesis_grid_has_these_and_no_others() {
        let grid = PoseGrid::Axes(fetch_grid());
        let (directions, approaches) = (approach_directions(), grid.approaches());
        let mut counts = [0; 26];
        for (angle, approach) in approaches.iter().enumerate() {
            let axis = grid.rotation(angle) * Vector3::x();
            assert!((axis - directions[usize::from(*approach)]).norm() < 1e-9, "{:?}", grid.rpy(angle));
            counts[usize::from(*approach)] += 1;
        }
        assert_eq!((counts[0], counts[25]), (16, 16));
        assert!(counts[1..25].iter().all(|count| *count == 4), "{counts:?}");
    }
}
