//! Random fields that are correlated over a matching window, and box sums.

use crate::seed::Stream;

/// Least count of uniform draws behind one value of a field: their sum is normal to within an excess kurtosis of
/// -1.2/48 (Irwin and Hall), and a window of 7 px has them already.
const MIN_DRAWS: usize = 48;

/// Memory for [`BoxSum`]; kept between calls.
#[derive(Default)]
pub(super) struct BoxSum {
    /// Values on the padded grid, shape (height + window - 1, width + window - 1), row-major.
    padded: Vec<i32>,
    columns: Vec<i32>,
}

impl BoxSum {
    /// Zeroed input on the padded grid and its row length.
    pub(super) fn padded(&mut self, width: usize, height: usize, window: usize) -> (&mut [i32], usize) {
        let stride = width + window - 1;
        self.padded.clear();
        self.padded.resize(stride * (height + window - 1), 0);
        (&mut self.padded, stride)
    }

    /// Calls `row(y, sums)` with the sums of the padded input over the window around each pixel, row by row.
    /// Integers: no rounding, whatever the order.
    pub(super) fn sums(&mut self, width: usize, height: usize, window: usize, mut row: impl FnMut(usize, &[i32])) {
        let stride = width + window - 1;
        for line in self.padded.chunks_exact_mut(stride) {
            let mut sum: i32 = line[..window - 1].iter().sum();
            for x in 0..width {
                sum += line[x + window - 1];
                let first = line[x];
                line[x] = sum;
                sum -= first;
            }
        }
        self.columns.clear();
        self.columns.resize(width, 0);
        for y in 0..height + window - 1 {
            let line = &self.padded[y * stride..][..width];
            for (sum, value) in self.columns.iter_mut().zip(line) {
                *sum += value;
            }
            if let Some(top) = (y + 1).checked_sub(window) {
                row(top, &self.columns);
                let line = &self.padded[top * stride..][..width];
                for (sum, value) in self.columns.iter_mut().zip(line) {
                    *sum -= value;
                }
            }
        }
    }

    /// Fills `field` (height, width) with standard normal noise: white noise averaged over a square of side `window`,
    /// so that pixels (dx, dy) apart correlate by (1 - |dx|/window)(1 - |dy|/window).
    pub(super) fn noise(
        &mut self,
        field: &mut Vec<f32>,
        width: usize,
        height: usize,
        window: usize,
        stream: &mut Stream,
    ) {
        let rounds = MIN_DRAWS.div_ceil(window * window);
        let (padded, _) = self.padded(width, height, window);
        for _ in 0..rounds {
            for four in padded.chunks_mut(4) {
                let mut bits = stream.bits();
                for value in four {
                    // Uniform over the odd numbers from -65535 to 65535: mean 0, variance (2^32 - 1) / 3.
                    *value += 2 * (bits & 0xffff) as i32 - 0xffff;
                    bits >>= 16;
                }
            }
        }
        let variance = (rounds * window * window) as f64 * (4_294_967_295.0 / 3.0);
        let scale = (1.0 / variance.sqrt()) as f32;
        field.clear();
        field.resize(width * height, 0.0);
        self.sums(width, height, window, |y, sums| {
            for (value, sum) in field[y * width..][..width].iter_mut().zip(sums) {
                *value = *sum as f32 * scale;
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(window: usize) -> Vec<f32> {
        let (mut field, mut stream) = (Vec::new(), Stream::of_job(3, b"", "field"));
        BoxSum::default().noise(&mut field, 400, 400, window, &mut stream);
        field
    }

    #[test]
    fn noise_is_standard_normal_for_every_window() {
        for (window, tolerance) in [(1, 0.01), (3, 0.02), (9, 0.06)] {
            let field = field(window);
            let n = field.len() as f64;
            let moment = |k: i32| field.iter().map(|v| f64::from(*v).powi(k)).sum::<f64>() / n;
            assert!(moment(1).abs() < tolerance, "mean {} for window {window}", moment(1));
            assert!((moment(2) - 1.0).abs() < 2.0 * tolerance, "variance {} for window {window}", moment(2));
            let kurtosis = moment(4) / moment(2).powi(2);
            assert!((kurtosis - 3.0).abs() < 0.1 + 3.0 * tolerance, "kurtosis {kurtosis} for window {window}");
        }
    }

    #[test]
    fn noise_correlates_as_a_triangle_over_the_window() {
        let field = field(9);
        for lag in [0usize, 3, 6, 9, 12] {
            let pairs = (0..400).flat_map(|y| (0..400 - lag).map(move |x| y * 400 + x));
            let (sum, n) = pairs.fold((0.0, 0.0), |(sum, n), i| (sum + f64::from(field[i] * field[i + lag]), n + 1.0));
            let expected = (1.0 - lag as f64 / 9.0).max(0.0);
            assert!((sum / n - expected).abs() < 0.06, "lag {lag}: {} for {expected}", sum / n);
        }
    }
}
