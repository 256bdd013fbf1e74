//! Lens distortion: Brown's radial and tangential terms with OpenCV's rational extension (`plumb_bob` and `rational_polynomial` of
//! ROS; OpenCV's documentation of `calib3d`, "Detailed Description").

/// Steps in which the radius is searched where a model folds back.
const FOLD_STEPS: u32 = 4096;

/// Distortion of a lens, by the coefficients of OpenCV; all are 0 for none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion {
    /// k1, k2, k3: the radial polynomial.
    pub radial: [f64; 3],
    /// p1, p2: the tangential terms.
    pub tangential: [f64; 2],
    /// k4, k5, k6: the polynomial by which the radial one is divided.
    pub divisor: [f64; 3],
}

impl Distortion {
    /// The coefficients in OpenCV's order: k1, k2, p1, p2, k3, k4, k5, k6.
    pub const fn from_opencv([k1, k2, p1, p2, k3, k4, k5, k6]: [f64; 8]) -> Self {
        Self { radial: [k1, k2, k3], tangential: [p1, p2], divisor: [k4, k5, k6] }
    }

    /// The coefficients with their names, in OpenCV's order.
    pub fn coefficients(&self) -> [(&'static str, f64); 8] {
        let ([k1, k2, k3], [p1, p2], [k4, k5, k6]) = (self.radial, self.tangential, self.divisor);
        [("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2), ("k3", k3), ("k4", k4), ("k5", k5), ("k6", k6)]
    }

    /// Whether rays meet the sensor where those of a pinhole would.
    pub fn is_none(&self) -> bool {
        self.coefficients().iter().all(|(_, value)| *value == 0.0)
    }

    /// Where the ray through (x, y, 1) meets the sensor, as the ray through (x', y', 1) of a pinhole would.
    pub(crate) fn distorted(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([k1, k2, k3], [p1, p2], [k4, k5, k6]) = (self.radial, self.tangential, self.divisor);
        let square = x * x + y * y;
        let divisor = 1.0 + square * (k4 + square * (k5 + square * k6));
        let radial = (1.0 + square * (k1 + square * (k2 + square * k3))) / divisor;
        [
            x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    }

    /// The square of the radius up to which radii grow with those of the rays, at most `largest`: beyond it the model folds back,
    /// and no ray of the lens exists there, regardless of the polynomials.
    pub(crate) fn square_of_fold(&self, largest: f64) -> f64 {
        let squares = (1..=FOLD_STEPS).map(|step| largest * f64::from(step) / f64::from(FOLD_STEPS));
        squares.take_while(|square| self.grows_at(*square)).last().unwrap_or(0.0)
    }

    /// Whether radii grow with those of the rays where these have this square.
    fn grows_at(&self, s: f64) -> bool {
        let ([k1, k2, k3], [k4, k5, k6]) = (self.radial, self.divisor);
        // With s = r^2, N and D the polynomials: d(r N / D) / dr > 0 where D > 0 and N D + 2 s (N' D - N D') > 0.
        let (n, d) = (1.0 + s * (k1 + s * (k2 + s * k3)), 1.0 + s * (k4 + s * (k5 + s * k6)));
        let (slope_n, slope_d) = (k1 + s * (2.0 * k2 + s * 3.0 * k3), k4 + s * (2.0 * k5 + s * 3.0 * k6));
        d > 0.0 && n * d + 2.0 * s * (slope_n * d - n * slope_d) > 0.0
    }
}
