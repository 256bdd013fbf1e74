//! Random fields that are correlated over a matching window, and box sums.

use super::sensor_kernels as kernels;
use crate::{geom::SimdLevel, seed::Stream};

/// Least count of uniform draws behind one value of a field: their sum is normal to within an excess kurtosis of
/// -1.2/48 (Irwin and Hall), and a window of 7 px has them already.
const MIN_DRAWS: usize = 48;

/// Values that are drawn at a time; a multiple of four, since one draw of 64 bits gives four.
const DRAWN: usize = 2048;

/// Memory for [`BoxSum`]; kept between calls.
pub(super) struct BoxSum {
    level: SimdLevel,
    /// Values on the padded grid, shape (height + window - 1, width + window - 1), row-major.
    padded: Vec<i32>,
    /// Sums over the rows of the window, one per column of the padded grid.
    columns: Vec<i32>,
    /// Sums over 1, 2, 4, ... columns, and the next of them.
    powers: [Vec<i32>; 2],
    /// Sums over the window, one per pixel of a row.
    sums: Vec<i32>,
    bytes: Vec<u8>,
}

impl BoxSum {
    /// Memory for sums by these vector instructions.
    pub(super) fn new(level: SimdLevel) -> Self {
        let [padded, columns, sums, first, second] = std::array::from_fn(|_| Vec::new());
        Self { level, padded, columns, powers: [first, second], sums, bytes: vec![0; 2 * DRAWN] }
    }

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
        let Self { level, padded, columns, powers, sums, .. } = self;
        columns.clear();
        columns.resize(stride, 0);
        for line in padded.chunks_exact(stride).take(window - 1) {
            kernels::add(*level, columns, line);
        }
        for y in 0..height {
            let [top, bottom] = [y, y + window - 1].map(|y| &padded[y * stride..][..stride]);
            kernels::add(*level, columns, bottom);
            kernels::window_sums(*level, columns, window, powers, sums);
            row(y, sums);
            kernels::subtract(*level, columns, top);
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
        self.padded.resize((width + window - 1) * (height + window - 1), 0);
        for round in 0..rounds {
            // What the memory held before does not count.
            let keep = i32::from(round > 0);
            for values in self.padded.chunks_mut(DRAWN) {
                let bytes = &mut self.bytes[..values.len().div_ceil(4) * 8];
                stream.fill(bytes);
                kernels::draws(self.level, values, keep, bytes);
            }
        }
        // A draw is uniform over the odd numbers from -65535 to 65535: mean 0, variance (2^32 - 1) / 3.
        let variance = (rounds * window * window) as f64 * (4_294_967_295.0 / 3.0);
        let scale = (1.0 / variance.sqrt()) as f32;
        field.resize(width * height, 0.0);
        let level = self.level;
        self.sums(width, height, window, |y, sums| {
            kernels::scale(level, sums, scale, &mut field[y * width..][..width]);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(window: usize) -> Vec<f32> {
        let (mut field, mut stream) = (Vec::new(), Stream::of_job(3, b"", "field"));
        BoxSum::new(SimdLevel::detect()).noise(&mut field, 400, 400, window, &mut stream);
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

    #[test]
    fn sums_are_those_of_the_window_at_every_level() {
        let (width, height) = (37, 21);
        for window in [1, 3, 5, 9, 31] {
            for level in SimdLevel::available() {
                let mut boxes = BoxSum::new(level);
                let (padded, stride) = boxes.padded(width, height, window);
                (0..).zip(padded.iter_mut()).for_each(|(i, value)| *value = (i * 7919) % 257 - 128);
                let input = padded.to_vec();
                let mut rows = 0;
                boxes.sums(width, height, window, |y, sums| {
                    let expected = (0..width).map(|x| {
                        (0..window).map(|dy| input[(y + dy) * stride + x..][..window].iter().sum::<i32>()).sum::<i32>()
                    });
                    assert_eq!(sums, expected.collect::<Vec<_>>(), "window {window}, row {y}, {level}");
                    rows += 1;
                });
                assert_eq!(rows, height);
            }
        }
    }
}
