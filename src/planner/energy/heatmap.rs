//! The heatmap energy of the thesis, section 4.4.2, and its mixture with the contact energy, equation 4.2.

use nalgebra::Point3;

use super::{
    MAX_ENERGY,
    maps::{Heatmaps, POINTS},
    shape::HandShape,
};
use kernel::geom::Intrinsics;

/// Weights of the heatmap energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeatmapSettings {
    /// Energy per bin of distance from the nearest canonical type.
    pub mu: f64,
    /// Largest distance from it in bins at which heatmaps count.
    pub alpha: f64,
    /// Factor of the values of heatmaps.
    pub scale: f64,
}

impl HeatmapSettings {
    /// Values times 100, as the potential: labels of -epsilon are hundredths, a contact energy tens.
    pub const STANDARD: Self = Self { mu: 10.0, alpha: 2.5, scale: 100.0 };

    /// Values as they are, for maps of energies (table 4.2); alpha is not in the thesis.
    pub const THESIS: Self = Self { scale: 1.0, ..Self::STANDARD };
}

/// The heatmap energy: the sum of the values of four heatmaps at the pixels of palm and fingertips, in the maps of the canonical type
/// nearest to the hand's shape, and mu times the distance from that type (thesis, 4.4.2 and algorithm 1).
///
/// ```
/// use graspmill_planner::energy::{HandShape, HeatmapEnergy, HeatmapSettings, Heatmaps};
/// use kernel::geom::Intrinsics;
/// use nalgebra::Point3;
///
/// let shape = HandShape { spread: 0.5, flexions: [0.9; 3], roll: 0.0 };
/// let energy = HeatmapEnergy {
///     types: vec![shape],
///     maps: Heatmaps::new(1, [52, 72], vec![-0.1; 4 * 52 * 72])?,
///     camera: Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.05)?,
///     settings: HeatmapSettings::STANDARD,
/// };
/// // Palm and fingertips at the middle of the image, except for one tip that is out of it.
/// let [middle, aside] = [Point3::new(0.0, 0.0, 0.8), Point3::new(0.8, 0.0, 0.8)];
/// let value = energy.of(&shape, &[middle, middle, middle, aside]);
/// assert_eq!((value.nearest, value.distance, value.without_value), (Some(0), 0.0, 1));
/// assert!((value.energy + 30.0).abs() < 1e-5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct HeatmapEnergy {
    /// Median shape of each canonical type, in the order of the maps.
    pub types: Vec<HandShape>,
    /// Heatmaps of the types.
    pub maps: Heatmaps,
    /// Camera of the image that the maps were made from.
    pub camera: Intrinsics,
    /// Weights.
    pub settings: HeatmapSettings,
}

/// Heatmap energy of a state, with what it is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeatmapValue {
    /// Energy; [`MAX_ENERGY`] where no type is within alpha.
    pub energy: f64,
    /// The nearest canonical type, the first of equals; `None` of a shape that is not finite.
    pub nearest: Option<usize>,
    /// Distance from it in bins.
    pub distance: f64,
    /// Points whose pixel has no value, in the border, out of the image or behind the camera: each counts 0.
    pub without_value: u32,
}

impl HeatmapEnergy {
    /// Energy of a hand's shape and of its palm and fingertips F0, F1, F2, expressed in `CameraCv` [m].
    ///
    /// # Panics
    /// When there are fewer maps than types.
    pub fn of(&self, shape: &HandShape, points: &[Point3<f64>; POINTS]) -> HeatmapValue {
        assert!(self.types.len() <= self.maps.types(), "{} types of {} maps", self.types.len(), self.maps.types());
        let HeatmapSettings { mu, alpha, scale } = self.settings;
        let distances = self.types.iter().map(|known| shape.distance(known)).enumerate();
        let finite = distances.filter(|(_, distance)| distance.is_finite());
        let nearest = finite.min_by(|(_, one), (_, other)| one.total_cmp(other));
        let Some((kind, distance)) = nearest else {
            return HeatmapValue { energy: MAX_ENERGY, nearest: None, distance: f64::INFINITY, without_value: 0 };
        };
        let (mut sum, mut without_value) = (0.0, 0);
        for (index, point) in points.iter().enumerate() {
            match self.value(POINTS * kind + index, point) {
                Some(value) => sum += value,
                None => without_value += 1,
            }
        }
        let energy = if distance > alpha { MAX_ENERGY } else { scale * sum + mu * distance };
        HeatmapValue { energy, nearest: Some(kind), distance, without_value }
    }

    /// Value of a map at the pixel of a point in front of the camera.
    fn value(&self, map: usize, point: &Point3<f64>) -> Option<f64> {
        let (u, v) = (point.z >= self.camera.near).then(|| self.camera.project(point))?;
        self.maps.value(map, [u, v])
    }
}

/// The combined energy rho E_h + (1 - rho) E_c (thesis, equation 4.2; rho = 0.1 in table 4.2).
pub fn combined_energy(rho: f64, heatmap: f64, contact: f64) -> f64 {
    rho * heatmap + (1.0 - rho) * contact
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: HandShape = HandShape { spread: 0.5, flexions: [0.9; 3], roll: 0.3 };

    fn energy() -> HeatmapEnergy {
        let map = |value: f32| std::iter::repeat_n(value, 52 * 72);
        HeatmapEnergy {
            types: vec![HandShape { spread: 2.5, ..SHAPE }, SHAPE],
            maps: Heatmaps::new(2, [52, 72], (0..8).flat_map(|index| map(index as f32 / 100.0)).collect())
                .expect("values"),
            camera: Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.05).expect("a camera"),
            settings: HeatmapSettings::STANDARD,
        }
    }

    #[test]
    fn the_maps_are_those_of_the_nearest_type() {
        let points = [Point3::new(0.01, 0.02, 0.7); 4];
        let value = energy().of(&HandShape { spread: 0.6, ..SHAPE }, &points);
        assert_eq!((value.nearest, value.without_value), (Some(1), 0));
        let expected = 100.0 * (0.04 + 0.05 + 0.06 + 0.07) + 10.0 * value.distance;
        assert!((value.energy - expected).abs() < 1e-5, "{value:?}");
    }

    #[test]
    fn a_shape_beyond_alpha_or_without_numbers_has_the_largest_energy() {
        let points = [Point3::new(0.01, 0.02, 0.7); 4];
        let far = energy().of(&HandShape { flexions: [0.9, 0.9, 2.4], ..SHAPE }, &points);
        assert!(far.distance > 2.5 && far.energy == MAX_ENERGY && far.nearest == Some(1), "{far:?}");
        let lost = energy().of(&HandShape { roll: f64::NAN, ..SHAPE }, &points);
        assert_eq!((lost.energy, lost.nearest), (MAX_ENERGY, None));
    }

    #[test]
    fn points_behind_the_camera_have_no_value() {
        let front = Point3::new(0.0, 0.0, 0.7);
        let behind = [Point3::new(0.0, 0.0, -0.7), Point3::new(0.0, 0.0, 0.01), Point3::origin()];
        let value = energy().of(&SHAPE, &[front, behind[0], behind[1], behind[2]]);
        assert_eq!(value.without_value, 3);
        assert!((value.energy - 4.0).abs() < 1e-5, "{value:?}");
    }

    #[test]
    fn a_mixture_of_the_thesis_is_nearly_the_contact_energy() {
        assert_eq!(combined_energy(0.1, -20.0, 30.0), 25.0);
        assert_eq!(combined_energy(0.0, MAX_ENERGY, 30.0), 30.0);
    }
}
