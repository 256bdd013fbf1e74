//! A scalar over a plane of positions: filled bands as a picture, their borders as lines.

use std::fmt::Write as _;

use crate::picture::{Colour, Oklab, Picture};

/// Pixels of a band picture along a cell.
const ZOOM: usize = 12;

/// Values at the centres of a plane's cells, interpolated bilinearly between them, constant beyond the outermost.
pub struct Plane {
    /// Cells to the right and up.
    pub shape: [usize; 2],
    /// Column by column from the left, each from below.
    pub values: Vec<f64>,
}

impl Plane {
    /// Value at a position in cells from the plane's lower left corner.
    fn at(&self, right: f64, up: f64) -> f64 {
        let [columns, rows] = self.shape;
        let split = |coordinate: f64, count: usize| {
            let coordinate = (coordinate - 0.5).clamp(0.0, count as f64 - 1.0);
            let low = (coordinate as usize).min(count.saturating_sub(2));
            (low, (low + 1).min(count - 1), coordinate - low as f64)
        };
        let ((a, b, s), (c, d, t)) = (split(right, columns), split(up, rows));
        let value = |column: usize, row: usize| self.values[column * rows + row];
        let mix = |from: f64, to: f64, share: f64| if share == 0.0 { from } else { from + (to - from) * share };
        mix(mix(value(a, c), value(b, c), s), mix(value(a, d), value(b, d), s), t)
    }

    /// Bands of this width: blue below zero, stronger with depth; grey above, darker with distance.
    pub fn bands(&self, width: f64) -> Picture {
        let [columns, rows] = self.shape.map(|count| count * ZOOM);
        let mut picture = Picture::filled(columns as u32, rows as u32, [0; 4]);
        let middle = |pixel: usize| (pixel as f64 + 0.5) / ZOOM as f64;
        for row in 0..rows {
            for column in 0..columns {
                let value = self.at(middle(column), middle(rows - 1 - row));
                picture.pixels[row * columns + column] = band_colour((value / width).floor()).opaque();
            }
        }
        picture
    }

    /// The line where the value is `level`, as path data, `scale` a cell, y down from the plane's top: marching squares
    /// over quarters of cells.
    pub fn line(&self, level: f64, scale: f64) -> String {
        const PARTS: usize = 4;
        let [columns, rows] = self.shape.map(|count| count * PARTS);
        let part = |index: usize| index as f64 / PARTS as f64;
        let mut path = String::new();
        for column in 0..columns {
            for row in 0..rows {
                // Corners round the square, and the points at which its sides meet the level.
                let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(a, b)| {
                    let (right, up) = (part(column + a), part(row + b));
                    (right, up, self.at(right, up) - level)
                });
                let mut crossings = Vec::with_capacity(4);
                for k in 0..4 {
                    let ((x0, y0, a), (x1, y1, b)) = (corners[k], corners[(k + 1) % 4]);
                    if (a < 0.0) != (b < 0.0) && (a - b).is_finite() {
                        let share = a / (a - b);
                        crossings.push((x0 + (x1 - x0) * share, y0 + (y1 - y0) * share));
                    }
                }
                for pair in crossings.chunks_exact(2) {
                    let down = |up: f64| (self.shape[1] as f64 - up) * scale;
                    let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
                    let _ = write!(path, "M{:.1} {:.1}", x0 * scale, down(y0));
                    let _ = write!(path, "L{:.1} {:.1}", x1 * scale, down(y1));
                }
            }
        }
        path
    }

    /// Smallest and largest finite value.
    pub fn range(&self) -> Option<(f64, f64)> {
        let finite = || self.values.iter().copied().filter(|value| value.is_finite());
        let (min, max) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
        (min <= max).then_some((min, max))
    }
}

/// Band -1 reaches from minus one width to zero.
pub fn band_colour(band: f64) -> Colour {
    let (lightness, chroma, hue) = if band < 0.0 {
        let depth = (-band).min(8.0);
        (0.955 - 0.025 * depth, 0.01 + 0.01 * depth, 245.0_f64)
    } else {
        (0.985 - 0.008 * band.min(24.0), 0.004, 85.0)
    };
    Oklab::from_hue(lightness, chroma, hue.to_radians()).srgb()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A value that grows by one per cell to the right: bands are columns, lines are vertical.
    #[test]
    fn bands_and_lines_of_a_slope() {
        let plane = Plane { shape: [4, 3], values: (0..12).map(|coordinate| (coordinate / 3) as f64 - 1.5).collect() };
        assert_eq!(plane.range(), Some((-1.5, 1.5)));
        let picture = plane.bands(1.0);
        assert_eq!((picture.width, picture.height), (4 * ZOOM as u32, 3 * ZOOM as u32));
        for (column, band) in [(0, -2.0), (ZOOM + 7, -1.0), (2 * ZOOM + 1, 0.0), (4 * ZOOM - 1, 1.0)] {
            assert_eq!(picture.at(column as u32, 5), band_colour(band).opaque(), "{column}");
        }
        let path = plane.line(0.0, 10.0);
        let points: Vec<&str> = path.split(['M', 'L']).filter(|point| !point.is_empty()).collect();
        assert!(points.len() == 2 * 12 && points.iter().all(|point| point.starts_with("20.0 ")), "{path}");
        assert_eq!(plane.line(7.0, 10.0), "");
    }

    #[test]
    fn nothing_reachable_has_bands_and_no_lines() {
        let plane = Plane { shape: [1, 2], values: vec![f64::INFINITY; 2] };
        assert_eq!((plane.bands(0.1).height, plane.line(0.0, 1.0).as_str(), plane.range()), (24, "", None));
    }
}
