//! Sums over a moving window, and random fields that are correlated over one.

use super::sensor_kernels as kernels;
use crate::{geom::SimdLevel, seed::Stream};

/// Fewest uniform draws behind one value of a field: their sum is normal to within an excess kurtosis of -1.2/48 (Irwin and
/// Hall), and a window of 7 px has them already.
const MIN_DRAWS: usize = 48;

/// Values that one draw of 64 bits gives.
const VALUES: usize = 4;

/// Values that are drawn at a time.
const DRAWN: usize = 2048;

/// Sums of whole numbers over a square window that goes down an image; memory kept between images.
///
/// The numbers are on the padded grid: window - 1 rows and columns more than the image, so that the window around pixel
/// (x, y) starts at (x, y). Only the rows under the window are stored. Integers: exact in any order.
pub(super) struct WindowSums {
    level: SimdLevel,
    window: usize,
    stride: usize,
    /// Rows of the padded grid, each at its number modulo the window.
    rows: Vec<i32>,
    /// Numbers of the rows whose sum `columns` holds.
    held: std::ops::Range<usize>,
    /// Sums over those rows, one per column of the padded grid.
    columns: Vec<i32>,
    /// Sums over the window, one per pixel of a row.
    sums: Vec<i32>,
}

impl WindowSums {
    /// Memory for sums by these vector instructions.
    pub(super) fn new(level: SimdLevel) -> Self {
        let [rows, columns, sums] = std::array::from_fn(|_| Vec::new());
        Self { level, window: 1, stride: 0, rows, held: 0..0, columns, sums }
    }

    /// Starts on an image of this width; all rows are zero.
    pub(super) fn start(&mut self, width: usize, window: usize) {
        (self.window, self.stride) = (window, width + window - 1);
        for (values, count) in [(&mut self.rows, self.stride * window), (&mut self.columns, self.stride)] {
            values.clear();
            values.resize(count, 0);
        }
        self.sums.resize(width, 0);
        self.held = 0..0;
    }

    /// Sums over the window around each pixel of image row `y`, which must not be above the one before. `fill(row, values)` is
    /// called for each row of the padded grid that comes under the window; its values are those of the row one window above, or
    /// zero.
    pub(super) fn row(&mut self, y: usize, mut fill: impl FnMut(usize, &mut [i32])) -> &[i32] {
        let Self { level, window, stride, rows, held, columns, sums } = self;
        let place = |row: usize| (row % *window) * *stride..(row % *window + 1) * *stride;
        if y >= held.end {
            columns.fill(0);
            *held = y..y;
        }
        for row in held.start..y {
            kernels::subtract(*level, columns, &rows[place(row)]);
        }
        for row in held.end..y + *window {
            let values = &mut rows[place(row)];
            fill(row, values);
            kernels::add(*level, columns, values);
        }
        *held = y..y + *window;
        kernels::window_sums(*level, columns, *window, sums);
        sums
    }
}

/// Standard normal noise over an image, made row by row on demand: white noise averaged over a square window, so that
/// pixels (dx, dy) apart correlate by (1 - |dx|/window)(1 - |dy|/window).
pub(super) struct Noise {
    sums: WindowSums,
    /// A value of the white noise is the sum of theirs.
    rounds: Vec<White>,
    scale: f32,
    row: Vec<f32>,
}

impl Noise {
    /// Memory for noise by these vector instructions.
    pub(super) fn new(level: SimdLevel) -> Self {
        Self { sums: WindowSums::new(level), rounds: Vec::new(), scale: 0.0, row: Vec::new() }
    }

    /// Prepares for an image. The stream is left after all numbers that the noise of the whole image needs, used or not.
    pub(super) fn start(&mut self, width: usize, height: usize, window: usize, stream: &mut Stream) {
        self.sums.start(width, window);
        let rounds = MIN_DRAWS.div_ceil(window * window);
        let values = (width + window - 1) * (height + window - 1);
        self.rounds.clear();
        self.rounds.extend((0..rounds).map(|_| White::take(stream, values)));
        // A draw is uniform over the odd numbers from -65535 to 65535: mean 0, variance (2^32 - 1) / 3.
        let variance = (rounds * window * window) as f64 * (4_294_967_295.0 / 3.0);
        self.scale = (1.0 / variance.sqrt()) as f32;
        self.row.resize(width, 0.0);
    }

    /// The noise of image row `y`, which must not be above the one before.
    pub(super) fn row(&mut self, y: usize) -> &[f32] {
        let Self { sums, rounds, scale, row } = self;
        let level = sums.level;
        let sums = sums.row(y, |row, values| {
            let numbers = row * values.len()..(row + 1) * values.len();
            for (round, white) in rounds.iter_mut().enumerate() {
                let white = white.values(level, numbers.clone());
                if round == 0 { values.copy_from_slice(white) } else { kernels::add(level, values, white) }
            }
        });
        kernels::scale(level, sums, *scale, row);
        row
    }
}

/// White noise from a stream, by the number of the value.
struct White {
    stream: Stream,
    /// Values that the stream holds for it.
    count: usize,
    /// Numbers of `values`; the first is the first of its draw, and the stream is positioned after the last.
    held: std::ops::Range<usize>,
    values: Vec<i32>,
    bytes: Vec<u8>,
}

impl White {
    /// Takes `count` values from the stream's position on; advances the stream past them.
    fn take(stream: &mut Stream, count: usize) -> Self {
        let (values, bytes) = (Vec::new(), Vec::new());
        let own = Self { stream: stream.clone(), count, held: 0..0, values, bytes };
        stream.skip(count.div_ceil(VALUES) as u64);
        own
    }

    /// The values with these numbers; later calls must request later ones.
    fn values(&mut self, level: SimdLevel, numbers: std::ops::Range<usize>) -> &[i32] {
        if numbers.end > self.held.end {
            self.draw(level, numbers.clone());
        }
        &self.values[numbers.start - self.held.start..][..numbers.len()]
    }

    /// Draws these values and some that come after them.
    fn draw(&mut self, level: SimdLevel, numbers: std::ops::Range<usize>) {
        // The last values may be requested again.
        let kept = numbers.start.min(self.held.end)..self.held.end;
        self.values.copy_within(kept.start - self.held.start.., 0);
        let start = if kept.is_empty() { numbers.start / VALUES * VALUES } else { kept.start };
        self.stream.skip(((start + kept.len() - self.held.end) / VALUES) as u64);
        let end = numbers.end.max(start + DRAWN).min(self.count).next_multiple_of(VALUES);
        self.values.resize(end - start, 0);
        let drawn = &mut self.values[kept.len()..];
        self.bytes.resize(2 * drawn.len(), 0);
        self.stream.fill(&mut self.bytes);
        kernels::draws(level, drawn, &self.bytes);
        self.held = start..end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream() -> Stream {
        Stream::of_job(3, b"", "field")
    }

    fn field(window: usize) -> Vec<f32> {
        let mut noise = Noise::new(SimdLevel::detect());
        noise.start(400, 400, window, &mut stream());
        (0..400).flat_map(|y| noise.row(y).to_vec()).collect()
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
    fn noise_is_the_sum_of_draws_in_the_order_of_the_padded_grid() {
        // Odd lengths of rows: draws that hold values of two of them.
        for (width, height, window) in [(37, 21, 9), (40, 9, 3), (5, 30, 1)] {
            let rounds = MIN_DRAWS.div_ceil(window * window);
            let (stride, mut draws) = (width + window - 1, stream());
            let mut padded = vec![0i32; stride * (height + window - 1)];
            for _ in 0..rounds {
                let mut bytes = vec![0; padded.len().div_ceil(VALUES) * 8];
                draws.fill(&mut bytes);
                for (value, pair) in padded.iter_mut().zip(bytes.as_chunks::<2>().0) {
                    *value += 2 * i32::from(u16::from_le_bytes(*pair)) - 65_535;
                }
            }
            let expected = |x: usize, y: usize| {
                let rows = (0..window).flat_map(|dy| &padded[(y + dy) * stride + x..][..window]);
                rows.sum::<i32>() as f32
            };
            // All rows; every third; two far apart.
            for asked in [(0..height).collect(), (0..height).step_by(3).collect(), vec![0, height - 1]] {
                let (mut noise, mut after) = (Noise::new(SimdLevel::detect()), stream());
                noise.start(width, height, window, &mut after);
                assert_eq!(after.bits(), draws.clone().bits(), "the stream is positioned after the noise");
                for y in asked {
                    let row = noise.row(y).to_vec();
                    let scale = noise.scale;
                    let wanted: Vec<f32> = (0..width).map(|x| expected(x, y) * scale).collect();
                    assert_eq!(row, wanted, "row {y}, window {window}");
                }
            }
        }
    }

    #[test]
    fn sums_are_those_of_the_window_at_every_level() {
        let (width, height) = (37usize, 21usize);
        for window in [1, 3, 5, 9, 31] {
            let stride = width + window - 1;
            let input: Vec<i32> =
                (0..(stride * (height + window - 1)) as i32).map(|i| (i * 7919) % 257 - 128).collect();
            for level in SimdLevel::available() {
                // All rows; some with gaps between them.
                for asked in [(0..height).collect(), vec![0, 1, 2, 5, 8, 9, height - 1]] {
                    let mut sums = WindowSums::new(level);
                    sums.start(width, window);
                    for y in asked {
                        let expected = (0..width).map(|x| {
                            (0..window)
                                .map(|dy| input[(y + dy) * stride + x..][..window].iter().sum::<i32>())
                                .sum::<i32>()
                        });
                        let got = sums.row(y, |row, values| values.copy_from_slice(&input[row * stride..][..stride]));
                        assert_eq!(got, expected.collect::<Vec<_>>(), "window {window}, row {y}, {level}");
                    }
                }
            }
        }
    }
}
