//! Random numbers of poses of a cup.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};

use kernel::{geom::rotation_towards, seed::Stream};

/// Share of the poses along the normal; the others are tilted.
const ALONG_NORMAL: f64 = 0.5;

/// Numbers from 0 to 1 that make one pose. A pose depends on nothing else of the stream.
pub(super) struct Draw {
    pub(super) point: [f64; 3],
    tilt: f64,
    side: f64,
}

impl Draw {
    /// The next pose: always the same count of numbers.
    pub(super) fn next(stream: &mut Stream) -> Self {
        let [scheme, group, place, tilt, side] = [(); 5].map(|()| stream.unit());
        Self { point: [scheme, group, place], tilt, side }
    }

    /// The approach about an inward normal, `None` along it: uniform over a cone of a half angle [rad].
    pub(super) fn tilted(&self, inward: &Vector3<f64>, half_angle: f64) -> Option<Vector3<f64>> {
        if self.tilt < ALONG_NORMAL || half_angle == 0.0 {
            return None;
        }
        let share = (self.tilt - ALONG_NORMAL) / (1.0 - ALONG_NORMAL);
        Some(in_cone(inward, half_angle, [share, self.side]))
    }
}

/// A direction by two numbers from 0 to 1: uniform over a cone of a half angle [rad] about an axis.
pub(super) fn in_cone(axis: &Vector3<f64>, half_angle: f64, [share, side]: [f64; 2]) -> Vector3<f64> {
    // Uniform in the cosine.
    let cos_tilt = 1.0 - share * (1.0 - libm::cos(half_angle));
    let sin_tilt = (1.0 - cos_tilt * cos_tilt).max(0.0).sqrt();
    let (sin, cos) = libm::sincos(TAU * side);
    let axes: Matrix3<f64> = rotation_towards(axis, 0.0);
    axes * Vector3::new(sin_tilt * cos, sin_tilt * sin, cos_tilt)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tilts_are_uniform_within_their_cone() {
        let mut stream = Stream::of_job(1, b"", "tilts");
        let (mut along, mut inner) = (0, 0);
        let inward = Vector3::new(0.6, 0.0, -0.8);
        for _ in 0..4000 {
            match Draw::next(&mut stream).tilted(&inward, 0.2) {
                None => along += 1,
                Some(approach) => {
                    let angle = libm::acos(approach.dot(&inward).min(1.0));
                    assert!(angle < 0.2 + 1e-9 && (approach.norm() - 1.0).abs() < 1e-12);
                    // Half of a small cone's solid angle is within its half angle over sqrt 2.
                    inner += u32::from(angle < 0.2 / 2f64.sqrt());
                }
            }
        }
        assert!((1850..2150).contains(&along) && (850..1150).contains(&inner), "{along} {inner}");
    }
}
