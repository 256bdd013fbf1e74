//! Depth pictures.

use kernel::{
    geom::{DepthCrop, Intrinsics},
    ids::Digest,
};
use nalgebra::Point3;

/// A depth picture with its camera.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthFrame {
    /// The camera; pixel centres lie at +0.5.
    pub camera: Intrinsics,
    /// Depth along the optical axis [m], NaN = no return. Shape (height, width), row-major.
    pub depth: Vec<f32>,
}

/// A depth picture, with an object's number per pixel where the file has one; 0 is no object.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelledFrame {
    /// The picture.
    pub frame: DepthFrame,
    /// Labels, shape (height, width), row-major.
    pub labels: Option<Vec<u32>>,
    /// BLAKE3 of the file.
    pub digest: Digest,
}

impl DepthFrame {
    /// Column and row of a pixel by its index.
    pub fn column_and_row(&self, pixel: u32) -> (u32, u32) {
        (pixel % self.camera.width, pixel / self.camera.width)
    }

    /// The point that a pixel sees, in `CameraCv` [m]; NaN where it has no return.
    pub fn point(&self, pixel: u32) -> Point3<f64> {
        let (column, row) = self.column_and_row(pixel);
        let depth = f64::from(self.depth[pixel as usize]);
        self.camera.unproject(f64::from(column) + 0.5, f64::from(row) + 0.5, depth)
    }

    /// Pixels with a return, in order.
    pub fn returns(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.depth.len() as u32).filter(|pixel| !self.depth[*pixel as usize].is_nan())
    }

    /// Pixels with a return, in order, with the points that they see, in `CameraCv` [m].
    pub(crate) fn points(&self) -> Vec<(u32, Point3<f64>)> {
        self.returns().map(|pixel| (pixel, self.point(pixel))).collect()
    }

    /// Side of the square that a pixel covers at its depth, facing the camera [m].
    pub fn footprint(&self, pixel: u32) -> f64 {
        f64::from(self.depth[pixel as usize]) / self.camera.fx.min(self.camera.fy)
    }

    /// The whole picture as a crop.
    pub fn whole(&self) -> DepthCrop {
        let (width, height) = (self.camera.width, self.camera.height);
        DepthCrop { left: 0, top: 0, width, height, depth: self.depth.clone() }
    }

    /// The smallest crop that holds these pixels; all others in it have no return.
    pub fn crop_of(&self, pixels: &[u32]) -> DepthCrop {
        let mut crop = DepthCrop { depth: vec![f32::NAN; self.depth.len()], ..self.whole() };
        pixels.iter().for_each(|pixel| crop.depth[*pixel as usize] = self.depth[*pixel as usize]);
        crop.trimmed()
    }
}
