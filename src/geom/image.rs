//! Depth images.

/// The part of a depth image that holds the object; everything outside is "no return".
///
/// Depth is measured along the optical axis [m] (not range along the ray), NaN = no return. Shape
/// (height, width), row-major; pixel (column, row) of the crop is pixel (left + column, top + row) of the image,
/// whose centre lies at +0.5.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DepthCrop {
    /// First column of the image inside the crop [px].
    pub left: u32,
    /// First row of the image inside the crop [px].
    pub top: u32,
    /// Width of the crop [px].
    pub width: u32,
    /// Height of the crop [px].
    pub height: u32,
    /// Depth [m], NaN = no return; `width * height` values, row-major.
    pub depth: Vec<f32>,
}

impl DepthCrop {
    /// Depth at a pixel of the whole image [m]; NaN outside the crop.
    pub fn at(&self, column: u32, row: u32) -> f32 {
        let (x, y) = (column.wrapping_sub(self.left), row.wrapping_sub(self.top));
        if x < self.width && y < self.height { self.depth[(y * self.width + x) as usize] } else { f32::NAN }
    }

    /// Count of pixels with a return.
    pub fn returns(&self) -> usize {
        self.depth.iter().filter(|depth| !depth.is_nan()).count()
    }
}
