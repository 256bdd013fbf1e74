//! A small software drawing room: occupancy grids, slices, depth crops and solids as PNG, no display needed.
//!
//! Pictures use camera axes: x right, y down, +z away from the camera.

use std::collections::BTreeMap;

mod colour;
mod depth;
mod instances;
mod lettering;
mod png_file;
mod slices;
mod solids;
mod voxels;

pub use colour::{Colour, Oklab, depth_colours};
pub use depth::{DepthRange, colour_bar, depth_picture, grey_depth_picture, height_map};
pub use instances::{FLOOR, InstanceMap, WALLS, body_swatch};
pub use lettering::Panel;
pub(crate) use png_file::data_uri;
pub use slices::{SLICE_COLOURS, SliceColours, Slices, centre_of_mass};
pub use solids::{Solid, SolidView, seen_pixels, solid_picture};
pub use voxels::{Eye, VoxelPainter};

/// An image with straight (not premultiplied) alpha. Shape (height, width), row-major.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width [px].
    pub width: u32,
    /// Height [px].
    pub height: u32,
    /// `width * height` pixels: red, green, blue (sRGB), alpha.
    pub pixels: Vec<[u8; 4]>,
}

impl Picture {
    /// A picture of one colour.
    pub fn filled(width: u32, height: u32, pixel: [u8; 4]) -> Self {
        Self { width, height, pixels: vec![pixel; width as usize * height as usize] }
    }

    /// The pixel at (column, row).
    ///
    /// # Panics
    /// If it lies outside the picture.
    pub fn at(&self, column: u32, row: u32) -> [u8; 4] {
        assert!(column < self.width && row < self.height, "pixel outside the picture");
        self.pixels[(row * self.width + column) as usize]
    }

    /// This picture in at most 256 different pixels, for a small PNG: channels in steps of 8, and where that is not
    /// enough, rare pixels take the place of the nearest frequent one.
    pub fn with_few_colours(mut self) -> Self {
        for pixel in &mut self.pixels {
            // A pixel that cannot be seen has no colour; the top step stays 255.
            *pixel = if pixel[3] < 4 { [0; 4] } else { pixel.map(|channel| channel & 0xf8 | channel >> 5) };
        }
        let mut counts: BTreeMap<[u8; 4], usize> = BTreeMap::new();
        for run in self.pixels.chunk_by(|a, b| a == b) {
            *counts.entry(run[0]).or_default() += run.len();
        }
        if counts.len() <= 256 {
            return self;
        }
        let mut ranked: Vec<[u8; 4]> = counts.keys().copied().collect();
        ranked.sort_by_key(|pixel| std::cmp::Reverse(counts[pixel]));
        let (frequent, rare) = ranked.split_at(256);
        let distance = |a: &[u8; 4], b: &[u8; 4]| a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b)).pow(2)).sum();
        let stand_ins: BTreeMap<&[u8; 4], &[u8; 4]> = rare
            .iter()
            .filter_map(|pixel| Some((pixel, frequent.iter().min_by_key(|other| -> u32 { distance(pixel, other) })?)))
            .collect();
        for run in self.pixels.chunk_by_mut(|a, b| a == b) {
            if let Some(other) = stand_ins.get(&run[0]) {
                run.fill(**other);
            }
        }
        self
    }

    /// Pictures from left to right on white, `gap` pixels apart, each in the middle of the row's height.
    pub fn row(pictures: &[Self], gap: u32) -> Self {
        let width =
            pictures.iter().map(|picture| picture.width).sum::<u32>() + gap * pictures.len().max(1) as u32 - gap;
        let height = pictures.iter().map(|picture| picture.height).max().unwrap_or(0);
        let mut row = Self::filled(width.max(1), height.max(1), [255; 4]);
        let mut left = 0;
        for picture in pictures {
            row.lay(picture, left, (height - picture.height) / 2);
            left += picture.width + gap;
        }
        row
    }

    /// Pictures from top to bottom on white, `gap` pixels apart, each in the middle of the column's width.
    pub fn column(pictures: &[Self], gap: u32) -> Self {
        let height =
            pictures.iter().map(|picture| picture.height).sum::<u32>() + gap * pictures.len().max(1) as u32 - gap;
        let width = pictures.iter().map(|picture| picture.width).max().unwrap_or(0);
        let mut column = Self::filled(width.max(1), height.max(1), [255; 4]);
        let mut top = 0;
        for picture in pictures {
            column.lay(picture, (width - picture.width) / 2, top);
            top += picture.height + gap;
        }
        column
    }

    /// Lays a picture over this opaque one, its upper left corner at (`left`, `top`).
    fn lay(&mut self, picture: &Self, left: u32, top: u32) {
        for row in 0..picture.height {
            for column in 0..picture.width {
                let [red, green, blue, alpha] = picture.at(column, row);
                let index = ((top + row) * self.width + left + column) as usize;
                let under = self.pixels[index];
                let over = |above: u8, below: u8| {
                    let alpha = u32::from(alpha);
                    ((u32::from(above) * alpha + u32::from(below) * (255 - alpha) + 127) / 255) as u8
                };
                self.pixels[index] = [over(red, under[0]), over(green, under[1]), over(blue, under[2]), 255];
            }
        }
    }

    /// This picture with a grey line around it, one pixel wide.
    pub fn framed(self) -> Self {
        let (width, height) = (self.width + 2, self.height + 2);
        let mut framed = Self::filled(width, height, [0xb4, 0xb4, 0xb4, 255]);
        framed.fill(1..width - 1, 1..height - 1, [255; 4]);
        framed.lay(&self, 1, 1);
        framed
    }

    /// The picture in the middle of a clear square of `side` pixels, or itself where it is larger.
    pub fn in_square(self, side: u32) -> Self {
        if self.width > side || self.height > side {
            return self;
        }
        let mut square = Self::filled(side, side, [0; 4]);
        let (left, top) = ((side - self.width) / 2, (side - self.height) / 2);
        for row in 0..self.height {
            let (from, to) = ((row * self.width) as usize, ((top + row) * side + left) as usize);
            square.pixels[to..to + self.width as usize].copy_from_slice(&self.pixels[from..from + self.width as usize]);
        }
        square
    }

    /// Paints a round dot about a point (column, row) [px]. Its rim, dark about a light dot and pale about a dark one, sets it
    /// off from other dots and from its ground.
    pub fn dot(&mut self, [x, y]: [f64; 2], radius: f64, colour: Colour) {
        let rim = Colour(if colour.oklab().lightness < 0.4 { [250; 3] } else { [20; 3] });
        let inner = radius - (0.3 * radius).max(1.0);
        let span = |middle: f64, end: u32| {
            let [from, to] = [middle - radius - 1.0, middle + radius + 2.0].map(|pixel| pixel.max(0.0) as u32);
            from..to.min(end)
        };
        let (columns, rows) = (span(x, self.width), span(y, self.height));
        for (row, column) in rows.flat_map(|row| columns.clone().map(move |column| (row, column))) {
            let away = libm::hypot(f64::from(column) + 0.5 - x, f64::from(row) + 0.5 - y);
            if away <= radius {
                let ink = if away > inner { rim } else { colour };
                self.pixels[(row * self.width + column) as usize] = ink.opaque();
            }
        }
    }

    /// Paints a rectangle; what lies outside the picture is left out.
    pub fn fill(&mut self, columns: std::ops::Range<u32>, rows: std::ops::Range<u32>, pixel: [u8; 4]) {
        for row in rows.start..rows.end.min(self.height) {
            let start = (row * self.width) as usize;
            let (from, to) = (columns.start.min(self.width) as usize, columns.end.min(self.width) as usize);
            self.pixels[start + from..start + to].fill(pixel);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_opaque_and_keeps_its_pictures() {
        let red = Picture::filled(2, 2, [255, 0, 0, 255]);
        let clear = Picture::filled(1, 4, [0; 4]);
        let row = Picture::row(&[red.clone(), clear, red.in_square(3)], 1);
        assert_eq!((row.width, row.height), (2 + 1 + 1 + 1 + 3, 4));
        assert_eq!(
            [row.at(0, 0), row.at(0, 1), row.at(1, 2), row.at(3, 3)],
            [[255; 4], [255, 0, 0, 255], [255, 0, 0, 255], [255; 4]]
        );
        // A square of three holds the red one at its upper left.
        assert_eq!([row.at(5, 0), row.at(6, 1), row.at(7, 2)], [[255, 0, 0, 255], [255, 0, 0, 255], [255; 4]]);
        let framed = Picture::filled(1, 1, [0, 0, 0, 255]).framed();
        assert_eq!((framed.width, framed.at(1, 1), framed.at(2, 1)), (3, [0, 0, 0, 255], [0xb4, 0xb4, 0xb4, 255]));
        let half = Picture::row(&[Picture::filled(1, 1, [0, 0, 0, 128])], 9);
        assert_eq!((half.width, half.at(0, 0)), (1, [127, 127, 127, 255]));
    }
}
