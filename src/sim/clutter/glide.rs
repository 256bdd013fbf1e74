//! Straight motions by minimum jerk.

use nalgebra::Vector3;

/// A straight motion by minimum jerk (Flash and Hogan 1985): it begins and ends at rest and without acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Glide {
    /// Where it begins [m].
    pub(super) from: Vector3<f64>,
    /// Where it ends [m].
    pub(super) to: Vector3<f64>,
    /// Duration [s].
    pub(super) time: f64,
}

impl Glide {
    /// No motion for a time.
    pub(super) fn still(at: Vector3<f64>, time: f64) -> Self {
        Self { from: at, to: at, time }
    }

    /// Position [m] and velocity [m/s], `time` after the beginning [s].
    pub(super) fn at(&self, time: f64) -> [Vector3<f64>; 2] {
        let s = time / self.time;
        let way = self.to - self.from;
        let share = s * s * s * (10.0 + s * (-15.0 + s * 6.0));
        let rate = s * s * (30.0 + s * (-60.0 + s * 30.0)) / self.time;
        [self.from + way * share, way * rate]
    }

    /// Acceleration, `time` after the beginning [m/s^2].
    pub(super) fn acceleration(&self, time: f64) -> Vector3<f64> {
        let s = time / self.time;
        (self.to - self.from) * (s * (60.0 + s * (-180.0 + s * 120.0)) / (self.time * self.time))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_sums_of_velocities_and_these_of_accelerations() {
        let glide = Glide { from: Vector3::new(0.1, 0.0, -0.2), to: Vector3::new(0.0, 0.3, -0.1), time: 0.8 };
        let step = 1e-4;
        for index in 0..8000 {
            let time = f64::from(index) * step;
            let ([from, before], [to, after]) = (glide.at(time), glide.at(time + step));
            let half = time + step / 2.0;
            assert!(((to - from) / step - glide.at(half)[1]).norm() < 1e-6, "{time}");
            assert!(((after - before) / step - glide.acceleration(half)).norm() < 1e-5, "{time}");
        }
        for (time, at) in [(0.0, glide.from), (0.8, glide.to)] {
            let [position, velocity] = glide.at(time);
            assert!((position - at).norm() < 1e-12 && velocity.norm() < 1e-12, "{time}");
            assert!(glide.acceleration(time).norm() < 1e-9, "{time}");
        }
    }
}
