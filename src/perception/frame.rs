//! Depth pictures.

use kernel::{
    geom::{DepthCrop, Intrinsics},
    ids::Digest,
};
use nalgebra::Point3;

use crate::rectification::Rectification;

/// A depth picture with its camera, without lens distortion.
///
/// Pixels of people (targets, masks) and pixels in results (labels, outlines, boxes) count in the picture that was given: columns
/// and rows from 0, whole numbers are centres. All other pixels of this crate count in this picture. Both are the same where the
/// given picture had no distortion.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthFrame {
    /// The camera; pixel centres lie at +0.5.
    pub camera: Intrinsics,
    /// Depth along the optical axis [m], NaN = no return. Shape (height, width), row-major.
    pub depth: Vec<f32>,
    /// Relation to the given picture, where its distortion was undone.
    pub rectification: Option<Rectification>,
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
    /// A picture without distortion. `depth` is along the optical axis [m], NaN = no return, shape (height, width), row-major.
    pub fn new(camera: Intrinsics, depth: Vec<f32>) -> Self {
        Self { camera, depth, rectification: None }
    }

    /// Depths that the given picture measured [m], NaN = no return. Shape (height, width), row-major.
    pub(crate) fn measured(&self) -> &[f32] {
        self.rectification.as_ref().map_or(&self.depth, Rectification::measured)
    }

    /// Pixel of the given picture that a pixel shows; `None` if it shows nothing of it.
    pub(crate) fn source(&self, pixel: u32) -> Option<u32> {
        self.rectification.as_ref().map_or(Some(pixel), |rectification| rectification.source(pixel))
    }

    /// Whether a pixel of the given picture has a return.
    ///
    /// # Panics
    /// When it lies outside of the picture.
    pub fn has_return_at(&self, column: u32, row: u32) -> bool {
        !self.measured()[row as usize * self.camera.width as usize + column as usize].is_nan()
    }

    /// Whether what is next to a pixel was not in the given picture.
    pub(crate) fn is_at_border(&self, pixel: u32) -> bool {
        let (column, row) = self.column_and_row(pixel);
        let (width, height) = (self.camera.width, self.camera.height);
        if column == 0 || row == 0 || column + 1 == width || row + 1 == height {
            return true;
        }
        [pixel - 1, pixel + 1, pixel - width, pixel + width].iter().any(|other| self.source(*other).is_none())
    }

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
