//! Whole images in colour.

use prost::Message;

use crate::codec::{
    RecordError,
    fields::{broken, lengthy, ranged},
    proto, sample_from_proto, wire,
};
use kernel::ids::SampleId;

const MESSAGE: &str = "PatchImageColour";

/// The image from which patches are cut, in colour: the smallest box outside which all is background.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PatchImageColour {
    /// Which sample.
    pub sample: SampleId,
    /// First column of the image inside the box [px].
    pub left: u32,
    /// First row of the image inside the box [px].
    pub top: u32,
    /// Width of the box [px].
    pub width: u32,
    /// Height of the box [px].
    pub height: u32,
    /// The colour outside: red, green, blue.
    pub background: [u8; 3],
    /// Red, green, blue. Shape (height, width), row-major.
    pub rgb: Vec<[u8; 3]>,
}

impl PatchImageColour {
    /// The colour of a pixel of the whole image.
    pub fn at(&self, column: u32, row: u32) -> [u8; 3] {
        let (x, y) = (column.wrapping_sub(self.left), row.wrapping_sub(self.top));
        if x < self.width && y < self.height { self.rgb[(y * self.width + x) as usize] } else { self.background }
    }

    /// The whole image of this size. Shape (height, width), row-major.
    pub fn whole(&self, width: u32, height: u32) -> Vec<[u8; 3]> {
        (0..height).flat_map(|row| (0..width).map(move |column| self.at(column, row))).collect()
    }

    /// Cuts the box from a whole image that is `columns` wide; an image of background only has the size 0 x 0.
    pub fn take(&mut self, image: &[[u8; 3]], columns: u32) {
        let columns = columns.max(1) as usize;
        let seen = |rgb: &[u8; 3]| *rgb != self.background;
        let rows = || image.chunks_exact(columns).enumerate().filter(|(_, row)| row.iter().any(seen)).map(|(y, _)| y);
        let (top, bottom) = (rows().next().unwrap_or(0), rows().next_back().map_or(0, |last| last + 1));
        let inside = || image[top * columns..bottom * columns].chunks_exact(columns);
        let left = inside().filter_map(|row| row.iter().position(seen)).min().unwrap_or(0);
        let right = inside().filter_map(|row| row.iter().rposition(seen)).max().map_or(0, |last| last + 1);
        self.rgb.clear();
        self.rgb.extend(inside().flat_map(|row| &row[left..right]));
        [self.left, self.top] = [left as u32, top as u32];
        [self.width, self.height] = [(right - left) as u32, (bottom - top) as u32];
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        wire::sample(out, 1, &self.sample);
        wire::uint32(out, 2, self.left);
        wire::uint32(out, 3, self.top);
        wire::uint32(out, 4, self.width);
        wire::uint32(out, 5, self.height);
        wire::bytes(out, 6, &self.background);
        wire::bytes(out, 7, self.rgb.as_flattened());
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length or range does not hold.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::PatchImageColour::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample)?;
        let proto::PatchImageColour { left, top, width, height, background, rgb, .. } = raw;
        for (field, side) in [("left", left), ("top", top), ("width", width), ("height", height)] {
            ranged(MESSAGE, field, f64::from(side), side <= 16384, "at most 16384")?;
        }
        lengthy(MESSAGE, "background", 3, background.len())?;
        lengthy(MESSAGE, "rgb", 3 * width as usize * height as usize, rgb.len())?;
        let background = background.try_into().unwrap_or_default();
        Ok(Self { sample, left, top, width, height, background, rgb: rgb.as_chunks::<3>().0.to_vec() })
    }
}
