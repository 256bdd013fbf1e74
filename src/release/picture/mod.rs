//! A small software drawing room: occupancy grids, slices, depth crops and solids as PNG, no display needed.
//!
//! Pictures stand in camera axes as everywhere: x right, y down, +z away from the camera.

use std::collections::BTreeMap;

mod colour;
mod depth;
mod png_file;
mod slices;
mod solids;
mod voxels;

pub use colour::{Colour, Oklab, depth_colours};
pub use depth::{DepthRange, colour_bar, depth_picture, height_map};
pub use slices::{SLICE_COLOURS, SliceColours, Slices, centre_of_mass};
pub use solids::{Solid, SolidView, solid_picture};
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

    /// The same picture in at most 256 different pixels, for a small PNG: channels in steps of 8, and where that is not
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

    /// Paints a rectangle; what lies outside the picture is left out.
    pub fn fill(&mut self, columns: std::ops::Range<u32>, rows: std::ops::Range<u32>, pixel: [u8; 4]) {
        for row in rows.start..rows.end.min(self.height) {
            let start = (row * self.width) as usize;
            let (from, to) = (columns.start.min(self.width) as usize, columns.end.min(self.width) as usize);
            self.pixels[start + from..start + to].fill(pixel);
        }
    }
}
