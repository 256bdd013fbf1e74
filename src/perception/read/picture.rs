//! Depth as PNG of 16 bits.

use std::io::Cursor;

use super::raw::{FrameProblem, Image, Values, pixel_count};

/// Numbers of a grey PNG of 16 bits.
pub(super) fn parse(bytes: &[u8]) -> Result<Image, FrameProblem> {
    let damaged = |error: png::DecodingError| FrameProblem::content("the PNG", error, "save the picture again");
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().map_err(damaged)?;
    let info = reader.info();
    if (info.color_type, info.bit_depth) != (png::ColorType::Grayscale, png::BitDepth::Sixteen) {
        let found = format!("{:?} of {:?} bits per channel", info.color_type, info.bit_depth);
        return Err(FrameProblem::content("the PNG's head", found, "depth is a grey PNG of 16 bits: save it as such"));
    }
    let (width, height) = (info.width, info.height);
    let count = pixel_count(width as usize, height as usize, "the PNG's head")?;
    let mut data = vec![0; 2 * count];
    reader.next_frame(&mut data).map_err(damaged)?;
    let values = data.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect();
    Ok(Image { width, height, values: Values::Whole(values) })
}
