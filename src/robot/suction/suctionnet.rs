//! Scores of SuctionNet-1Billion (Cao et al. 2021, "SuctionNet-1Billion: A Large-Scale Benchmark for Suction Grasping").

use nalgebra::{Matrix3, Vector3};

use super::cup::elastic_moment;

/// Constant of the elastic moment pi r k in SuctionNet's wrench score [N].
pub const SUCTIONNET_STIFFNESS: f64 = 15.6;

/// Acceleration of gravity in SuctionNet's wrench score [m/s^2].
pub const SUCTIONNET_GRAVITY: f64 = 9.8;

/// Weight of the mean squared residual in the seal score [1/m^2].
const RESIDUAL_WEIGHT: f64 = 1e5;

/// SuctionNet's seal score, 0 to 1: exp(-1e5 s) times the smallest share of a piece of the ideal lip in that of the real one, where
/// s is the mean squared distance of the lip's points from the plane fitted to them [m^2].
///
/// `residuals` are those distances along the axis [m], and `gaps` the points' distances along the axis [m], both for evenly spaced
/// points in the order of the lip; `radius` is that of the lip [m].
///
/// ```
/// let flat = [0.0; 72];
/// assert_eq!(graspmill_robot::suction::suctionnet_seal(&flat, &flat, 0.01), 1.0);
/// ```
pub fn suctionnet_seal(residuals: &[f64], gaps: &[f64], radius: f64) -> f64 {
    let count = gaps.len();
    let mean_square = residuals.iter().map(|residual| residual * residual).sum::<f64>() / count as f64;
    // The ideal piece is a chord of the circle.
    let ideal = 2.0 * radius * libm::sin(std::f64::consts::PI / count as f64);
    let share = |index: usize| {
        let rise = gaps[(index + 1) % count] - gaps[index];
        ideal / (ideal * ideal + rise * rise).sqrt()
    };
    libm::exp(-RESIDUAL_WEIGHT * mean_square) * (0..count).map(share).fold(1.0, f64::min)
}

/// SuctionNet's wrench score, 0 to 1: 1 - min(1, tau / (pi r k)), where tau is the larger of the two components, across the cup's
/// axis, of the moment of a kilogram about the middle of the lip.
///
/// `outward` is the unit vector out of the surface along the cup's axis, `lever` leads from the middle of the lip to the centre of
/// mass [m], and `down` is the unit vector of gravity, all in one frame; SuctionNet takes the components along a direction at right
/// angles to that frame's z axis and along a third one. `radius` is that of the lip [m].
///
/// ```
/// use nalgebra::Vector3;
/// use graspmill_robot::suction::suctionnet_wrench;
///
/// // 25 mm aside of a cup that holds from above: half of the moment of 0.49 N m that SuctionNet accepts.
/// let score = suctionnet_wrench(&Vector3::z(), &Vector3::new(0.025, 0.0, 0.0), &-Vector3::z(), 0.01);
/// assert!((score - 0.5).abs() < 1e-3);
/// ```
pub fn suctionnet_wrench(outward: &Vector3<f64>, lever: &Vector3<f64>, down: &Vector3<f64>, radius: f64) -> f64 {
    let axes = suction_axes(outward);
    let (lever, weight) = (axes.tr_mul(lever), axes.tr_mul(down) * SUCTIONNET_GRAVITY);
    // Moment about y and z; the moment about the axis does not count.
    let about_y = weight.x * lever.z - weight.z * lever.x;
    let about_z = weight.y * lever.x - weight.x * lever.y;
    let moment = about_y.abs().max(about_z.abs());
    1.0 - (moment / elastic_moment(radius, SUCTIONNET_STIFFNESS)).min(1.0)
}

/// SuctionNet's axes of a suction direction: x along it, y level.
fn suction_axes(outward: &Vector3<f64>) -> Matrix3<f64> {
    let level = Vector3::new(-outward.y, outward.x, 0.0);
    let y = level.try_normalize(0.0).unwrap_or_else(Vector3::y);
    Matrix3::from_columns(&[*outward, y, outward.cross(&y)])
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// Points along a lip of 10 mm on a cylinder.
    fn lip_on_cylinder(radius: f64) -> Vec<f64> {
        let gap = |index: usize| {
            let aside = 0.01 * libm::sin(TAU * (index as f64 + 0.5) / 72.0);
            radius - (radius * radius - aside * aside).sqrt()
        };
        (0..72).map(gap).collect()
    }

    #[test]
    fn seals_on_cylinders_are_those_of_suctionnet() {
        for (radius, score) in [(0.02, 0.883), (0.03, 0.950), (0.05, 0.982)] {
            let gaps = lip_on_cylinder(radius);
            let mean = gaps.iter().sum::<f64>() / 72.0;
            let residuals: Vec<f64> = gaps.iter().map(|gap| gap - mean).collect();
            let found = suctionnet_seal(&residuals, &gaps, 0.01);
            assert!((found - score).abs() < 2e-3, "{radius}: {found}");
            // The closed form of small gaps.
            let ratio = 0.01 / radius;
            let near = libm::exp(-1e5 * 1e-4 * ratio * ratio / 32.0) / (1.0 + ratio * ratio / 4.0).sqrt();
            assert!((found - near).abs() < 0.02, "{radius}: {found} {near}");
        }
    }

    #[test]
    fn moments_about_the_axis_do_not_count() {
        let score = |lever: [f64; 3]| suctionnet_wrench(&Vector3::x(), &lever.into(), &-Vector3::z(), 0.01);
        assert_eq!(score([0.0, 0.025, 0.0]), 1.0);
        assert!((score([-0.025, 0.0, 0.0]) - 0.5).abs() < 1e-3);
        assert!((score([-0.025, 0.025, 0.025]) - 0.5).abs() < 1e-3);
        assert_eq!(score([-0.2, 0.0, 0.0]), 0.0);
    }
}
