//! Images as PNG files: colours, levels of grey, masks, and depth in 16 bits.

use super::error::ExportError;
use kernel::ids::SampleIndex;

/// Millimetres per metre.
const MM: f64 = 1e3;

/// An image in colour, row-major.
pub(super) fn colour_png(size: [u32; 2], rgb: &[[u8; 3]]) -> Vec<u8> {
    png_file(size, (png::ColorType::Rgb, png::BitDepth::Eight), rgb.as_flattened())
}

/// A mask, 255 if set and 0 otherwise, row-major.
pub(super) fn mask_png(size: [u32; 2], mask: &[bool]) -> Vec<u8> {
    let bytes: Vec<u8> = mask.iter().map(|own| if *own { 255 } else { 0 }).collect();
    png_file(size, (png::ColorType::Grayscale, png::BitDepth::Eight), &bytes)
}

/// A depth image [m], NaN = no return, row-major, in 16 bits: 0 is no return, and a step is `scale` millimetres.
///
/// # Errors
/// When a depth of view `view` does not fit into 65,535 steps.
pub(super) fn depth_png(
    [width, height]: [u32; 2],
    depth: &[f32],
    scale: f64,
    view: SampleIndex,
) -> Result<Vec<u8>, ExportError> {
    let mut bytes = Vec::with_capacity(2 * depth.len());
    for metres in depth {
        // Depths below half a step would be read as no return.
        let steps = (MM / scale * f64::from(*metres) + 0.5).floor().max(1.0);
        if steps > f64::from(u16::MAX) {
            return Err(ExportError::TooFar { view, depth: f64::from(*metres), farthest: scale * 65.535 });
        }
        let steps = if metres.is_nan() { 0 } else { steps as u16 };
        bytes.extend(steps.to_be_bytes());
    }
    Ok(png_file([width, height], (png::ColorType::Grayscale, png::BitDepth::Sixteen), &bytes))
}

/// The smallest of some scales [mm] with which every depth [m] fits into 16 bits; the largest scale if none does.
pub(super) fn depth_scale(depth: &[f32], scales: &[f64]) -> f64 {
    let farthest = depth.iter().copied().filter(|metres| !metres.is_nan()).fold(0.0, f32::max);
    let fits = |scale: &&f64| MM / **scale * f64::from(farthest) < f64::from(u16::MAX);
    scales.iter().find(fits).or(scales.last()).copied().unwrap_or(1.0)
}

/// An image of this kind as PNG; numbers of 16 bits are big-endian.
fn png_file([width, height]: [u32; 2], (colour, depth): (png::ColorType, png::BitDepth), bytes: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.set_filter(if depth == png::BitDepth::Sixteen { png::Filter::Sub } else { png::Filter::NoFilter });
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(bytes)?;
        writer.finish()
    });
    written.expect("memory takes every byte, and the image is complete");
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_finest_scale_that_holds_all_depths_is_chosen() {
        let scales = [0.1, 1.0];
        assert_eq!(depth_scale(&[0.5, f32::NAN, 6.553], &scales), 0.1);
        assert_eq!(depth_scale(&[0.5, 6.6], &scales), 1.0);
        assert_eq!(depth_scale(&[70.0], &scales), 1.0);
        assert!(depth_png([1, 1], &[70.0], 1.0, SampleIndex(3)).is_err());
        assert!(depth_png([2, 1], &[1.0, f32::NAN], 1.0, SampleIndex(3)).is_ok());
    }
}
