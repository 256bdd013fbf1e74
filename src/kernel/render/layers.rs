//! Images of several meshes: each mesh's own depth, combined by the nearest surface.
//!
//! Each mesh is rendered separately, so that its silhouette is that of the mesh without the others; its visible pixels
//! are those where no other mesh is nearer. At equal depths the mesh that was added first wins.

use nalgebra::{Point3, Vector3};

use super::Rasteriser;
use crate::geom::{CameraCv, DepthCrop, Intrinsics, Object, Pose, RenderMesh, SimdLevel};

/// Longest side of a canvas that the rasteriser fills [px].
const MAX_SIDE: u32 = 16_384;

/// Outline of a mesh alone, inside and outside the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Silhouette {
    /// Pixels, those outside the image included.
    pub pixels: u32,
    /// Pixels in the image.
    pub pixels_in_image: u32,
    /// First column and row, past-the-end column and row of all pixels; zeros without any. May reach outside the image [px].
    pub bounds: [i32; 4],
}

/// An image of several meshes; its memory is used again for every image.
pub struct LayeredImage {
    rasteriser: Rasteriser,
    /// Renders meshes that reach out of the image.
    wide: Rasteriser,
    camera: Intrinsics,
    /// Depth [m], infinite where nothing is. Shape (height, width), row-major.
    nearest: Vec<f32>,
    instances: Vec<u8>,
}

impl LayeredImage {
    /// Number of pixels that see nothing.
    pub const NOTHING: u8 = 0;

    /// An empty image of a camera.
    pub fn new(camera: Intrinsics, level: SimdLevel) -> Self {
        let (rasteriser, wide) = (Rasteriser::new(level), Rasteriser::new(level));
        let mut image = Self { rasteriser, wide, camera, nearest: Vec::new(), instances: Vec::new() };
        image.begin(camera);
        image
    }

    /// Begins another image.
    pub fn begin(&mut self, camera: Intrinsics) {
        let pixels = camera.width as usize * camera.height as usize;
        self.camera = camera;
        self.nearest.clear();
        self.nearest.resize(pixels, f32::INFINITY);
        self.instances.clear();
        self.instances.resize(pixels, Self::NOTHING);
    }

    /// Adds a mesh; the pixels that see it get the number `instance`. Returns the mesh's own depth.
    pub fn add(&mut self, mesh: &RenderMesh, camera_from_mesh: &Pose<CameraCv, Object>, instance: u8) -> &DepthCrop {
        self.rasteriser.render(mesh, &self.camera, camera_from_mesh);
        let (crop, stride) = (self.rasteriser.crop(), self.camera.width as usize);
        for (y, row) in crop.depth.chunks_exact((crop.width as usize).max(1)).enumerate() {
            let first = (crop.top as usize + y) * stride + crop.left as usize;
            let nearest = &mut self.nearest[first..][..row.len()];
            let instances = &mut self.instances[first..][..row.len()];
            for ((nearest, own), depth) in nearest.iter_mut().zip(instances).zip(row) {
                // NaN is not nearer.
                if *depth < *nearest {
                    (*nearest, *own) = (*depth, instance);
                }
            }
        }
        crop
    }

    /// Silhouette of the mesh that was added last, with the parts outside the image on a canvas that grows as far as they
    /// reach.
    pub fn silhouette(&mut self, mesh: &RenderMesh, camera_from_mesh: &Pose<CameraCv, Object>) -> Silhouette {
        let mut found = Silhouette::default();
        found.count(self.rasteriser.crop(), [0; 2], |_, _| true);
        found.pixels_in_image = found.pixels;
        let [left, top, right, bottom] = self.room_around(mesh, camera_from_mesh);
        if [left, top, right, bottom] == [0; 4] {
            return found;
        }
        let Intrinsics { width, height, cx, cy, .. } = self.camera;
        let canvas = Intrinsics {
            width: width + left + right,
            height: height + top + bottom,
            cx: cx + f64::from(left),
            cy: cy + f64::from(top),
            ..self.camera
        };
        // Pixels of the image were counted above: a canvas of another size may round them otherwise.
        let is_outside =
            |column: i32, row: i32| !((0..width as i32).contains(&column) && (0..height as i32).contains(&row));
        found.count(self.wide.render(mesh, &canvas, camera_from_mesh), [left as i32, top as i32], is_outside);
        found
    }

    /// Pixels by which the box of a mesh extends beyond the image: to the left, above, to the right, below.
    fn room_around(&self, mesh: &RenderMesh, camera_from_mesh: &Pose<CameraCv, Object>) -> [u32; 4] {
        let Intrinsics { width, height, near, .. } = self.camera;
        let (mut low, mut high) = ([0.0f64; 2], [f64::from(width), f64::from(height)]);
        for corner in 0..8u32 {
            let signs = Vector3::from_fn(|axis, _| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 });
            let corner = Point3::from(mesh.centre().coords + mesh.half_extents().component_mul(&signs));
            let seen = camera_from_mesh.point(&corner);
            if seen.z <= near {
                // Not in front of the camera: three times the image, within the size limit.
                return [width, height, width, height].map(|side| side.min(MAX_SIDE / 3));
            }
            let (u, v) = self.camera.project(&seen);
            for (axis, value) in [u, v].into_iter().enumerate() {
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
        let spare = [MAX_SIDE - width, MAX_SIDE - height].map(|spare| f64::from(spare / 2));
        let beyond =
            |value: f64, axis: usize| if value > 0.0 { (value.ceil() + 1.0).min(spare[axis]) as u32 } else { 0 };
        [
            beyond(-low[0], 0),
            beyond(-low[1], 1),
            beyond(high[0] - f64::from(width), 0),
            beyond(high[1] - f64::from(height), 1),
        ]
    }

    /// The camera.
    pub fn camera(&self) -> &Intrinsics {
        &self.camera
    }

    /// The mesh's own depth, for the mesh that was added last.
    pub fn last(&self) -> &DepthCrop {
        self.rasteriser.crop()
    }

    /// Number of the mesh that each pixel sees. Shape (height, width), row-major.
    pub fn instances(&self) -> &[u8] {
        &self.instances
    }

    /// Writes the depth of the whole image [m], NaN where nothing is.
    pub fn depth(&self, crop: &mut DepthCrop) {
        (crop.left, crop.top, crop.width, crop.height) = (0, 0, self.camera.width, self.camera.height);
        crop.depth.clear();
        crop.depth.extend(self.nearest.iter().map(|depth| if depth.is_finite() { *depth } else { f32::NAN }));
    }
}

impl Silhouette {
    /// Adds the pixels of a crop whose canvas begins `shift` before the image, where `counts` returns true for column
    /// and row.
    fn count(&mut self, crop: &DepthCrop, shift: [i32; 2], counts: impl Fn(i32, i32) -> bool) {
        let [mut left, mut top, mut right, mut bottom] = match self.pixels {
            0 => [i32::MAX, i32::MAX, i32::MIN, i32::MIN],
            _ => self.bounds,
        };
        for (row, depths) in (0..).zip(crop.depth.chunks_exact((crop.width as usize).max(1))) {
            let row = crop.top as i32 + row - shift[1];
            for (column, depth) in (crop.left as i32 - shift[0]..).zip(depths) {
                if !depth.is_nan() && counts(column, row) {
                    self.pixels += 1;
                    (left, right) = (left.min(column), right.max(column + 1));
                    (top, bottom) = (top.min(row), bottom.max(row + 1));
                }
            }
        }
        self.bounds = if self.pixels == 0 { [0; 4] } else { [left, top, right, bottom] };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DepthCrop, TriMesh};

    const CAMERA: Intrinsics = Intrinsics { width: 64, height: 48, fx: 80.0, fy: 80.0, cx: 32.3, cy: 23.9, near: 0.01 };

    /// A square of this side [m] at a position, facing the camera.
    fn square(side: f32) -> RenderMesh {
        let half = side / 2.0;
        let vertices = vec![[-half, -half, 0.0], [half, -half, 0.0], [half, half, 0.0], [-half, half, 0.0]];
        RenderMesh::new(&TriMesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]] }, false)
    }

    fn at(x: f64, y: f64, z: f64) -> Pose<CameraCv, Object> {
        Pose::from_xyz_rpy([x, y, z, 0.0, 0.0, 0.0])
    }

    #[test]
    fn the_nearest_wins_whatever_the_order_and_the_first_of_two_at_one_depth() {
        let mut image = LayeredImage::new(CAMERA, SimdLevel::Scalar);
        let square = square(0.2);
        let (far, near) = (at(0.0, 0.0, 1.0), at(0.05, 0.0, 0.8));
        let alone = Rasteriser::new(SimdLevel::Scalar).render(&square, &CAMERA, &far).clone();
        assert_eq!(*image.add(&square, &far, 1), alone);
        image.add(&square, &near, 2);
        let (mut depth, first) = (DepthCrop::default(), image.instances().to_vec());
        image.depth(&mut depth);
        image.begin(CAMERA);
        image.add(&square, &near, 2);
        image.add(&square, &far, 1);
        assert_eq!(image.instances(), first);
        assert!(first.contains(&1) && first.contains(&2) && first.contains(&0));
        for (instance, depth) in first.iter().zip(&depth.depth) {
            let expected = [f32::NAN, 1.0, 0.8][usize::from(*instance)];
            assert!((depth - expected).abs() < 1e-6 || *instance == 0 && depth.is_nan(), "{depth} {expected}");
        }
        // Twice the same: the first stays.
        image.add(&square, &near, 7);
        assert_eq!(image.instances(), first);
    }

    #[test]
    fn a_silhouette_counts_what_the_image_cuts_off() {
        let mut image = LayeredImage::new(CAMERA, SimdLevel::Scalar);
        let square = square(0.3);
        let inside = at(0.0, 0.0, 1.0);
        image.add(&square, &inside, 1);
        let whole = image.silhouette(&square, &inside);
        assert_eq!((whole.pixels, whole.pixels_in_image), (24 * 24, 24 * 24));
        // 24 px wide: moved by whole pixels over the border on the left and above, it keeps its pixels.
        let moved = at(-35.0 / 80.0, -30.0 / 80.0, 1.0);
        image.begin(CAMERA);
        image.add(&square, &moved, 1);
        let cut = image.silhouette(&square, &moved);
        assert_eq!(cut.pixels, whole.pixels);
        assert_eq!(cut.bounds.map(|end| end), std::array::from_fn(|axis| whole.bounds[axis] - [35, 30][axis % 2]));
        assert!(cut.pixels_in_image > 0 && cut.pixels_in_image < cut.pixels);
        // Wholly outside.
        let outside = at(2.0, 0.0, 1.0);
        image.begin(CAMERA);
        image.add(&square, &outside, 1);
        let gone = image.silhouette(&square, &outside);
        assert_eq!((gone.pixels, gone.pixels_in_image), (whole.pixels, 0));
        // Next to the camera, partly behind it.
        let beside = Pose::from_xyz_rpy([0.0, 0.05, 0.1, 1.5, 0.0, 0.0]);
        image.begin(CAMERA);
        image.add(&square, &beside, 1);
        let beside = image.silhouette(&square, &beside);
        assert!(beside.pixels > beside.pixels_in_image && beside.pixels_in_image > 0, "{beside:?}");
    }
}
