//! Depth as a NumPy file: `float32` or `float64` in metres, `uint16` in units.

use kernel::npy::NpyArray;

use super::raw::{FrameProblem, Image, Values, pixel_count};

const REMEDY: &str = "save it by numpy.save as float32 in metres or as uint16, with shape (height, width)";

/// Numbers of a two-dimensional array in C order.
pub(super) fn parse(bytes: &[u8]) -> Result<Image, FrameProblem> {
    let wrong = |found: &str| FrameProblem::content("the NPY's head", found, REMEDY);
    let NpyArray { kind, shape, data } = NpyArray::parse(bytes).map_err(|error| wrong(error.found()))?;
    let [height, width] = shape[..] else { return Err(wrong("a shape that is not (height, width)")) };
    let count = pixel_count(width, height, "the NPY's head")?;
    let values = match kind.as_str() {
        "<f4" => Values::Real(data.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()),
        "<f8" => Values::Real(data.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes) as f32).collect()),
        "<u2" => Values::Whole(data.as_chunks::<2>().0.iter().map(|bytes| u16::from_le_bytes(*bytes)).collect()),
        other => return Err(wrong(&format!("numbers of the type '{other}'"))),
    };
    if values.len() != count {
        let found = format!("{} numbers for {height} x {width} pixels", values.len());
        return Err(FrameProblem::content("the NPY's data", found, REMEDY));
    }
    Ok(Image { width: width as u32, height: height as u32, values })
}
