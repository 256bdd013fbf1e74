//! Masks: which pixels of a picture belong to an object.

use std::{io::Cursor, path::Path};

use kernel::files::Bound;

use super::{
    FrameError, judged_bytes,
    raw::{FrameProblem, pixel_count},
};
use crate::frame::DepthFrame;

/// Pixels of a picture that a mask marks and that have a return, in order. A mask is a grey PNG of 8 or 16 bits, of the size of
/// the picture that was given, and marks that picture's pixels; what is not 0 belongs to the object.
///
/// # Errors
/// With the file, what is wrong in it and the remedy.
pub fn read_mask(path: &Path, frame: &DepthFrame) -> Result<Vec<u32>, FrameError> {
    let failed = |problem| FrameError { file: path.to_owned(), problem };
    let bytes = judged_bytes(path, "png", Bound::MASK, |head| parse(head, frame).map(drop)).map_err(failed)?;
    parse(&bytes, frame).map_err(failed)
}

fn parse(bytes: &[u8], frame: &DepthFrame) -> Result<Vec<u32>, FrameProblem> {
    let damaged = |error: png::DecodingError| FrameProblem::content("the PNG", error, "save the mask again");
    let head = |found: String, remedy| FrameProblem::content("the PNG's head", found, remedy);
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().map_err(damaged)?;
    let info = reader.info();
    let (width, height) = (info.width, info.height);
    let pixel_bytes = match (info.color_type, info.bit_depth) {
        (png::ColorType::Grayscale, png::BitDepth::Eight) => 1,
        (png::ColorType::Grayscale, png::BitDepth::Sixteen) => 2,
        (colour, depth) => {
            let found = format!("{colour:?} of {depth:?} bits per channel");
            return Err(head(found, "a mask is a grey PNG of 8 or 16 bits: save it as such"));
        }
    };
    if (width, height) != (frame.camera.width, frame.camera.height) {
        let wanted = (frame.camera.width, frame.camera.height);
        let found = format!("{width} x {height} px, the picture has {} x {}", wanted.0, wanted.1);
        return Err(head(found, "give a mask of the picture's size"));
    }
    let mut data = vec![0; pixel_bytes * pixel_count(width as usize, height as usize, "the PNG's head")?];
    reader.next_frame(&mut data).map_err(damaged)?;
    let marked: Vec<bool> = data.chunks_exact(pixel_bytes).map(|value| value.iter().any(|byte| *byte != 0)).collect();
    // A pixel belongs to the object where the one that it shows is marked: the way of its depth.
    let is_marked = |pixel: &u32| frame.source(*pixel).is_some_and(|source| marked[source as usize]);
    let pixels: Vec<u32> = frame.returns().filter(is_marked).collect();
    if pixels.is_empty() {
        let found = "no marked pixel with a return";
        return Err(FrameProblem::content("the mask", found, "mark the object's pixels with a value above 0"));
    }
    Ok(pixels)
}

#[cfg(test)]
mod tests {
    use kernel::geom::Intrinsics;

    use super::*;

    fn png_of(width: u32, height: u32, colour: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().expect("a head");
        writer.write_image_data(data).expect("pixels");
        writer.finish().expect("an end");
        bytes
    }

    #[test]
    fn marked_pixels_with_a_return_are_read_and_other_files_refused() {
        let camera = Intrinsics { width: 3, height: 2, fx: 3.0, fy: 3.0, cx: 1.5, cy: 1.0, near: 0.01 };
        let frame = DepthFrame::new(camera, vec![1.0, f32::NAN, 1.0, 1.0, 1.0, 1.0]);
        let (grey, eight, sixteen) = (png::ColorType::Grayscale, png::BitDepth::Eight, png::BitDepth::Sixteen);
        let found = parse(&png_of(3, 2, grey, eight, &[255, 255, 0, 0, 1, 0]), &frame).expect("a mask");
        assert_eq!(found, [0, 4]);
        let found = parse(&png_of(3, 2, grey, sixteen, &[0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0]), &frame);
        assert_eq!(found.expect("a mask"), [2, 3]);
        for (bytes, says) in [
            (png_of(2, 2, grey, eight, &[1; 4]), "2 x 2 px, the picture has 3 x 2"),
            (png_of(3, 2, png::ColorType::Rgb, eight, &[1; 18]), "a mask is a grey PNG"),
            (png_of(3, 2, grey, eight, &[0, 9, 0, 0, 0, 0]), "no marked pixel with a return"),
            (b"mask".to_vec(), "save the mask again"),
        ] {
            let said = parse(&bytes, &frame).expect_err("refused").to_string();
            assert!(said.contains(says), "{says}: {said}");
        }
    }
}
