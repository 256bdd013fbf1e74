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

    /// The whole image of this size [m]; NaN = no return. Shape (height, width), row-major.
    pub fn whole(&self, width: u32, height: u32) -> Vec<f32> {
        (0..height).flat_map(|row| (0..width).map(move |column| self.at(column, row))).collect()
    }

    /// The smallest crop with the same returns; empty when there are none.
    pub fn trimmed(&self) -> Self {
        let mut bounds: Option<[u32; 4]> = None;
        for (index, _) in self.depth.iter().enumerate().filter(|(_, depth)| !depth.is_nan()) {
            let (x, y) = (index as u32 % self.width, index as u32 / self.width);
            let [x0, y0, x1, y1] = bounds.unwrap_or([x, y, x, y]);
            bounds = Some([x0.min(x), y0.min(y), x1.max(x), y1.max(y)]);
        }
        let Some([x0, y0, x1, y1]) = bounds else { return Self { left: self.left, top: self.top, ..Self::default() } };
        let row = |y: u32| (y * self.width + x0) as usize..=(y * self.width + x1) as usize;
        let depth = (y0..=y1).flat_map(|y| self.depth[row(y)].iter().copied()).collect();
        Self { left: self.left + x0, top: self.top + y0, width: x1 - x0 + 1, height: y1 - y0 + 1, depth }
    }

    /// Number of pixels with a return.
    pub fn returns(&self) -> usize {
        self.depth.iter().filter(|depth| !depth.is_nan()).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trimming_loses_no_return() {
        let mut crop = DepthCrop { left: 10, top: 20, width: 5, height: 4, depth: vec![f32::NAN; 20] };
        assert_eq!((crop.trimmed().width, crop.trimmed().returns()), (0, 0));
        crop.depth[5 + 2] = 1.0;
        crop.depth[10 + 4] = 2.0;
        let small = crop.trimmed();
        assert_eq!((small.left, small.top, small.width, small.height), (12, 21, 3, 2));
        for (column, row) in (10..15).flat_map(|column| (20..24).map(move |row| (column, row))) {
            assert_eq!(small.at(column, row).to_bits(), crop.at(column, row).to_bits());
        }
    }
}
