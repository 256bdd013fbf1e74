//! Heatmaps of a network over an image, and their values between pixels.

/// Pixels between neighbouring values of a map, and from the image's border to its first value: a network that reads patches of 72
/// pixels halves its input three times.
const STRIDE: f64 = 8.0;
const FIRST: f64 = 36.0;

/// Points of a hand with maps: palm, F0, F1, F2.
pub(super) const POINTS: usize = 4;

/// Why values do not make heatmaps.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidHeatmaps {
    /// A count that differs from 4 * types * rows * columns.
    #[error(
        "{found} values of heatmaps, {expected} expected: 4 points * {types} types * {rows} rows * {columns} columns"
    )]
    Count {
        /// Values given.
        found: usize,
        /// Values required.
        expected: usize,
        /// Grasp types.
        types: usize,
        /// Rows of a map.
        rows: usize,
        /// Columns of a map.
        columns: usize,
    },
    /// Maps without a type, a row or a column.
    #[error("heatmaps of {types} types with {rows} rows and {columns} columns: each must be at least 1")]
    Empty {
        /// Grasp types.
        types: usize,
        /// Rows of a map.
        rows: usize,
        /// Columns of a map.
        columns: usize,
    },
    /// A value that is not finite.
    #[error("value {index} of the heatmaps is {value}: all must be finite")]
    NotFinite {
        /// Index in C order.
        index: usize,
        /// Value given.
        value: f32,
    },
}

/// Maps of a network, shape (4 * types, rows, columns) in C order: map 4 t + point of type t, points in the order palm, F0, F1, F2.
///
/// The value in (row, column) is that of the pixel (u, v) = (8 column + 36, 8 row + 36): 52 x 72 values for an image of 480 x 640.
/// Values between are bilinear. The border of 36 pixels has none.
#[derive(Clone, Debug, PartialEq)]
pub struct Heatmaps {
    types: usize,
    rows: usize,
    columns: usize,
    values: Vec<f32>,
}

impl Heatmaps {
    /// Heatmaps from values in C order.
    ///
    /// # Errors
    /// When their count does not fit, or one is not finite.
    pub fn new(types: usize, [rows, columns]: [usize; 2], values: Vec<f32>) -> Result<Self, InvalidHeatmaps> {
        if types == 0 || rows == 0 || columns == 0 {
            return Err(InvalidHeatmaps::Empty { types, rows, columns });
        }
        let (found, expected) = (values.len(), [types, rows, columns].iter().fold(POINTS, |a, b| a.saturating_mul(*b)));
        if found != expected {
            return Err(InvalidHeatmaps::Count { found, expected, types, rows, columns });
        }
        match values.iter().position(|value| !value.is_finite()) {
            Some(index) => Err(InvalidHeatmaps::NotFinite { index, value: values[index] }),
            None => Ok(Self { types, rows, columns, values }),
        }
    }

    /// Number of grasp types.
    pub fn types(&self) -> usize {
        self.types
    }

    /// Value of a map at pixel coordinates (u, v) [px], bilinear between the four values around; `None` in the border, beyond it, and
    /// at coordinates that are not finite. Columns follow u and rows v; algorithm 1 prints `[u][v]`.
    ///
    /// # Panics
    /// When there is no such map.
    pub fn value(&self, map: usize, [u, v]: [f64; 2]) -> Option<f64> {
        assert!(map < POINTS * self.types, "map {map} of {}", POINTS * self.types);
        let along = |at: f64, count: usize| {
            let at = (at - FIRST) / STRIDE;
            // The last value ends the last interval.
            let low = (at as usize).min(count.saturating_sub(2));
            (at >= 0.0 && at <= (count - 1) as f64).then_some((low, (low + 1).min(count - 1), at - low as f64))
        };
        let ((left, right, across), (top, bottom, down)) = (along(u, self.columns)?, along(v, self.rows)?);
        let value = |row: usize, column: usize| f64::from(self.values[(map * self.rows + row) * self.columns + column]);
        let mix = |one: f64, other: f64, share: f64| one * (1.0 - share) + other * share;
        let upper = mix(value(top, left), value(top, right), across);
        let lower = mix(value(bottom, left), value(bottom, right), across);
        Some(mix(upper, lower, down))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn values_between_lie_within_those_around(column in 0.0..3.0f64, row in 0.0..2.0f64, map in 0..8usize) {
            let maps = ramp();
            let value = maps.value(map, [36.0 + 8.0 * column, 36.0 + 8.0 * row]).expect("inside of the border");
            // The ramp is linear along rows and columns.
            prop_assert!((value - (100.0 * map as f64 + 10.0 * row + column)).abs() < 1e-9, "{value}");
        }
    }

    fn ramp() -> Heatmaps {
        let value = |index: usize| {
            let (map, row, column) = (index / 12, index / 4 % 3, index % 4);
            (100 * map + 10 * row + column) as f32
        };
        Heatmaps::new(2, [3, 4], (0..96).map(value).collect()).expect("8 * 3 * 4 values")
    }

    #[test]
    fn values_lie_at_their_pixels_and_rows_follow_v() {
        let maps = ramp();
        assert_eq!(maps.value(5, [36.0 + 8.0, 36.0 + 16.0]), Some(521.0));
        assert_eq!(maps.value(0, [36.0 + 4.0, 36.0 + 2.0]), Some(3.0));
        // The last value belongs to the map.
        assert_eq!(maps.value(7, [36.0 + 24.0, 36.0 + 16.0]), Some(723.0));
    }

    #[test]
    fn the_border_has_no_value() {
        let maps = ramp();
        for at in [[35.9, 40.0], [40.0, 35.9], [60.1, 40.0], [40.0, 52.1], [f64::NAN, 40.0], [40.0, f64::INFINITY]] {
            assert_eq!(maps.value(0, at), None, "{at:?}");
        }
    }

    #[test]
    fn one_row_or_column_is_a_line_of_values() {
        let maps = Heatmaps::new(1, [1, 2], (0..8).map(|value| value as f32).collect()).expect("4 * 2 values");
        assert_eq!(maps.value(1, [40.0, 36.0]), Some(2.5));
        assert_eq!(maps.value(1, [40.0, 36.1]), None);
    }

    #[test]
    fn values_that_do_not_fit_are_refused() {
        let refused = |types, size, values| Heatmaps::new(types, size, values).expect_err("no heatmaps");
        assert!(matches!(refused(0, [3, 4], Vec::new()), InvalidHeatmaps::Empty { .. }));
        assert!(matches!(refused(2, [3, 4], vec![0.0; 95]), InvalidHeatmaps::Count { expected: 96, .. }));
        assert!(matches!(refused(usize::MAX, [3, 4], Vec::new()), InvalidHeatmaps::Count { .. }));
        let mut values = vec![0.0; 96];
        values[7] = f32::NAN;
        assert!(matches!(refused(2, [3, 4], values), InvalidHeatmaps::NotFinite { index: 7, .. }));
    }
}
