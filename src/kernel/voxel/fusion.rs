//! Truncated signed distances fused from depth images (Curless and Levoy 1996, "A volumetric method for building complex models from
//! range images"), by the rule of Open3D's `UniformTSDFVolume`.

use nalgebra::{Point3, Vector3};

use super::channels::TSDF_STEPS;
use crate::geom::{CameraCv, DepthCrop, Intrinsics, Pose, Volume};

/// A cube of voxels. Voxel (x, y, z) is value `(x * resolution + y) * resolution + z` of an array.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeGrid {
    /// Voxels along each edge, 1 to 128.
    pub resolution: u32,
    /// Length of an edge [m].
    pub size: f64,
}

impl VolumeGrid {
    /// Edge of a voxel [m].
    pub fn voxel(&self) -> f64 {
        self.size / f64::from(self.resolution)
    }

    /// Number of voxels.
    pub fn voxels(&self) -> usize {
        (self.resolution as usize).pow(3)
    }

    /// Centre of a voxel in `Volume` [m].
    pub fn centre(&self, voxel: [u32; 3]) -> Point3<f64> {
        Point3::from(voxel.map(|index| (f64::from(index) + 0.5) * self.voxel()))
    }
}

/// Fuses depth images into a volume; its memory is used again.
///
/// The centre of each voxel is projected into each image. If the pixel that contains it has a depth, the signed
/// distance is the pixel's depth less the centre's, both along the optical axis, times the length of the pixel's ray
/// per unit of depth. An image does not update voxels that are behind the visible surface by more than the truncation;
/// voxels in front of it by more are set to the truncation. A voxel's value is the mean over the images that update it,
/// each of weight 1.
///
/// Open3D counts pixel centres as whole numbers, adds a half and truncates: that is the pixel which holds the point. Sums are in
/// double precision and in the order of the images, so that equal images give equal bits on every machine.
#[derive(Debug)]
pub struct VolumeFusion {
    grid: VolumeGrid,
    truncation: f64,
    images: u32,
    sums: Vec<f64>,
    weights: Vec<u8>,
    row: RowScratch,
}

/// Memory for one row of voxels along z, projected into an image, and squares of slopes of the image's pixels.
#[derive(Debug, Default)]
struct RowScratch {
    columns: Vec<f64>,
    rows: Vec<f64>,
    depths: Vec<f64>,
    column_slopes: Vec<f64>,
    row_slopes: Vec<f64>,
}

impl VolumeFusion {
    /// Images that a volume takes, at most: a voxel's weight is a byte.
    pub const MAX_IMAGES: u32 = 255;

    /// A volume without an image.
    pub fn new(grid: VolumeGrid, truncation_voxels: f64) -> Self {
        let mut fusion = Self {
            grid,
            truncation: 0.0,
            images: 0,
            sums: Vec::new(),
            weights: Vec::new(),
            row: RowScratch::default(),
        };
        fusion.begin(grid, truncation_voxels);
        fusion
    }

    /// Begins another volume.
    pub fn begin(&mut self, grid: VolumeGrid, truncation_voxels: f64) {
        (self.grid, self.truncation, self.images) = (grid, truncation_voxels * grid.voxel(), 0);
        self.sums.clear();
        self.sums.resize(grid.voxels(), 0.0);
        self.weights.clear();
        self.weights.resize(grid.voxels(), 0);
    }

    /// Adds an image. Depths that are NaN or not positive are ignored.
    ///
    /// # Panics
    /// If the volume has [`Self::MAX_IMAGES`] already.
    pub fn add(&mut self, depth: &DepthCrop, camera: &Intrinsics, camera_from_volume: &Pose<CameraCv, Volume>) {
        assert!(self.images < Self::MAX_IMAGES, "a volume of {} images cannot take another", self.images);
        self.images += 1;
        let Self { grid, truncation, sums, weights, row: scratch, .. } = self;
        let (n, voxel, truncation) = (grid.resolution as usize, grid.voxel(), *truncation);
        scratch.set_slopes(depth, camera);
        let step: Vector3<f64> = camera_from_volume.rotation().matrix().column(2) * voxel;
        let [left, top] = [depth.left, depth.top].map(f64::from);
        let [right, bottom] = [depth.left + depth.width, depth.top + depth.height].map(f64::from);
        let per_truncation = 1.0 / truncation;
        // Centres of a row of voxels along z, projected at once.
        for x in 0..n {
            for y in 0..n {
                let first = camera_from_volume.point(&grid.centre([x as u32, y as u32, 0]));
                scratch.project_row(n, &first, &step, camera);
                let start = (x * n + y) * n;
                let voxels = sums[start..start + n].iter_mut().zip(&mut weights[start..start + n]);
                let projected = scratch.columns.iter().zip(&scratch.rows).zip(&scratch.depths);
                for ((sum, weight), ((&column, &row), &own)) in voxels.zip(projected) {
                    if !(own > 0.0 && column >= left && column < right && row >= top && row < bottom) {
                        continue;
                    }
                    // Depth of the pixel that contains the centre, less the centre's own depth.
                    let (column, row) = ((column as u32 - depth.left) as usize, (row as u32 - depth.top) as usize);
                    let seen = f64::from(depth.depth[row * depth.width as usize + column]);
                    let along = seen - own;
                    // A ray is one long per unit of depth at least: this far behind, the distance along it is beyond, too.
                    if !(seen > 0.0 && along > -truncation) {
                        continue;
                    }
                    // Distance along the ray in units of the truncation.
                    let value = if along >= truncation {
                        1.0
                    } else {
                        let ray = (scratch.column_slopes[column] + scratch.row_slopes[row] + 1.0).sqrt();
                        let distance = along * ray;
                        if distance <= -truncation {
                            continue;
                        }
                        (distance * per_truncation).min(1.0)
                    };
                    *sum += value;
                    *weight += 1;
                }
            }
        }
    }

    /// Number of images per voxel.
    pub fn weights(&self) -> &[u8] {
        &self.weights
    }

    /// Mean signed distances in steps of truncation / 32767, rounded to nearest, more than -32767 to 32767, negative
    /// behind the visible surface; 0 for a voxel without an image.
    pub fn steps(&self, out: &mut Vec<i16>) {
        out.clear();
        out.extend(self.sums.iter().zip(&self.weights).map(|(sum, weight)| {
            let mean = sum / f64::from((*weight).max(1));
            (mean * f64::from(TSDF_STEPS) + 0.5).floor() as i16
        }));
    }
}

impl RowScratch {
    /// Squares of the slopes of the rays through the centres of an image's columns and rows.
    fn set_slopes(&mut self, depth: &DepthCrop, camera: &Intrinsics) {
        let squares = |first: u32, count: u32, centre: f64, focal: f64| {
            (first..first + count).map(move |index| {
                let slope = (f64::from(index) + 0.5 - centre) / focal;
                slope * slope
            })
        };
        self.column_slopes.clear();
        self.column_slopes.extend(squares(depth.left, depth.width, camera.cx, camera.fx));
        self.row_slopes.clear();
        self.row_slopes.extend(squares(depth.top, depth.height, camera.cy, camera.fy));
    }

    /// Pixel coordinates and depths of a row of voxels from its first centre on. Depth, and pixel coordinates times depth, change by
    /// the same step from centre to centre.
    fn project_row(&mut self, n: usize, first: &Point3<f64>, step: &Vector3<f64>, camera: &Intrinsics) {
        for values in [&mut self.columns, &mut self.rows, &mut self.depths] {
            values.resize(n, 0.0);
        }
        let Intrinsics { fx, fy, cx, cy, .. } = *camera;
        let (first_column, first_row) = (fx * first.x + cx * first.z, fy * first.y + cy * first.z);
        let (column_step, row_step) = (fx * step.x + cx * step.z, fy * step.y + cy * step.z);
        let values = self.columns[..n].iter_mut().zip(&mut self.rows[..n]).zip(&mut self.depths[..n]);
        for (index, ((column, row), depth)) in values.enumerate() {
            let along = f64::from(index as i32);
            let own = first.z + along * step.z;
            let per_depth = 1.0 / own;
            *column = (first_column + along * column_step) * per_depth;
            *row = (first_row + along * row_step) * per_depth;
            *depth = own;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    const CAMERA: Intrinsics =
        Intrinsics { width: 320, height: 240, fx: 300.0, fy: 290.0, cx: 163.5, cy: 118.0, near: 0.01 };

    const GRID: VolumeGrid = VolumeGrid { resolution: 40, size: 0.3 };

    /// Depth of an image whose ray through a pixel's centre, of slopes `x` and `y`, ends at a depth.
    fn image(depth_of: impl Fn(f64, f64) -> f64) -> DepthCrop {
        let pixels = (0..CAMERA.height).flat_map(|row| (0..CAMERA.width).map(move |column| (column, row)));
        let depth = pixels.map(|(column, row)| {
            let slope = |index: u32, centre: f64, focal: f64| (f64::from(index) + 0.5 - centre) / focal;
            depth_of(slope(column, CAMERA.cx, CAMERA.fx), slope(row, CAMERA.cy, CAMERA.fy)) as f32
        });
        DepthCrop { left: 0, top: 0, width: CAMERA.width, height: CAMERA.height, depth: depth.collect() }
    }

    /// A camera that sees the cube's centre from this far, from a side.
    fn pose(distance: f64, roll: f64, pitch: f64) -> Pose<CameraCv, Volume> {
        let rotation = Rotation3::from_euler_angles(roll, pitch, 0.3);
        let centre = Vector3::repeat(GRID.size / 2.0);
        Pose::new(rotation, Vector3::new(0.0, 0.0, distance) - rotation * centre)
    }

    fn fused(images: &[(DepthCrop, Pose<CameraCv, Volume>)]) -> (Vec<i16>, Vec<u8>) {
        let mut fusion = VolumeFusion::new(GRID, 4.0);
        images.iter().for_each(|(depth, pose)| fusion.add(depth, &CAMERA, pose));
        let mut steps = Vec::new();
        fusion.steps(&mut steps);
        (steps, fusion.weights().to_vec())
    }

    fn voxels() -> impl Iterator<Item = (usize, Point3<f64>)> {
        let n = GRID.resolution;
        let indices = (0..n).flat_map(move |x| (0..n).flat_map(move |y| (0..n).map(move |z| [x, y, z])));
        indices.map(|voxel| GRID.centre(voxel)).enumerate()
    }

    #[test]
    fn a_plane_across_the_view_has_its_closed_form() {
        let (wall, pose) = (0.7, pose(0.7, 0.0, 0.0));
        let (steps, weights) = fused(&[(image(|_, _| wall), pose)]);
        let truncation = 4.0 * GRID.voxel();
        let (mut near, mut behind) = (0, 0);
        for (index, centre) in voxels() {
            let point = pose.point(&centre);
            let (u, v) = CAMERA.project(&point);
            assert!((0.0..320.0).contains(&u) && (0.0..240.0).contains(&v), "the whole cube is in sight");
            // The distance along the ray through the pixel that holds the centre.
            let slope = [(u.floor() + 0.5 - CAMERA.cx) / CAMERA.fx, (v.floor() + 0.5 - CAMERA.cy) / CAMERA.fy];
            let distance = (wall - point.z) * (slope[0] * slope[0] + slope[1] * slope[1] + 1.0).sqrt();
            if distance <= -truncation {
                assert_eq!((weights[index], steps[index]), (0, 0));
                behind += 1;
            } else {
                assert_eq!(weights[index], 1);
                let expected = (distance / truncation).min(1.0);
                assert!((f64::from(steps[index]) / 32767.0 - expected).abs() < 2e-5, "{index} {expected}");
                near += usize::from(expected < 1.0);
            }
        }
        assert!(near > 10_000 && behind > 10_000, "{near} {behind}");
    }

    /// Along the ray of its pixel the true distance from a voxel to a ball; the voxel's centre is off that ray by less
    /// than a pixel, so that the value may be off by the change of the surface within a pixel.
    #[test]
    fn a_ball_seen_by_one_camera_is_as_far_as_its_rays_say() {
        let (distance, radius) = (0.5, 0.06);
        let hit = |x: f64, y: f64| {
            // Nearer root of |t (x, y, 1) - (0, 0, distance)| = radius.
            let (a, b, c) = (x * x + y * y + 1.0, distance, distance * distance - radius * radius);
            let root = b * b - a * c;
            if root < 0.0 { f64::NAN } else { (b - root.sqrt()) / a }
        };
        let pose = pose(distance, 0.4, -0.7);
        let (steps, weights) = fused(&[(image(hit), pose)]);
        let truncation = 4.0 * GRID.voxel();
        let (mut seen, mut worst, mut beyond) = (0, 0.0f64, 0);
        for (index, centre) in voxels() {
            let point = pose.point(&centre);
            let (x, y) = (point.x / point.z, point.y / point.z);
            let depth = hit(x, y);
            // Two pixels from the outline the surface is not steep.
            if (x * x + y * y).sqrt() > 0.8 * radius / distance {
                beyond += usize::from(weights[index] == 0 && depth.is_nan());
                continue;
            }
            let along = (depth - point.z) * (x * x + y * y + 1.0).sqrt();
            if (along + truncation).abs() < 0.0012 {
                continue;
            }
            assert_eq!(weights[index] == 1, along > -truncation, "{index}: {along}");
            if weights[index] == 1 {
                let expected = (along / truncation).min(1.0);
                worst = worst.max((f64::from(steps[index]) / 32767.0 - expected).abs());
                seen += 1;
            }
        }
        // Half a pixel is 0.8 mm at this distance, and the surface rises by 4 / 3 of that at most: 1.1 of 30 mm.
        assert!(seen > 1_000 && beyond > 10_000 && worst < 0.05, "{seen} {beyond} {worst}");
        assert!(worst > 1e-3, "pixels have a size");
    }

    #[test]
    fn values_are_means_whatever_the_order_and_a_crop_is_its_image() {
        let images: Vec<_> = [(0.42, 0.0), (0.5, 0.9), (0.46, -1.2)]
            .map(|(wall, turn)| (image(|x, y| wall + 0.1 * x - 0.05 * y), pose(0.5, turn, 0.2)))
            .into();
        let (steps, weights) = fused(&images);
        let alone: Vec<_> = images.iter().map(|image| fused(std::slice::from_ref(image))).collect();
        for index in 0..GRID.voxels() {
            let weight: u32 = alone.iter().map(|(_, weights)| u32::from(weights[index])).sum();
            assert_eq!(u32::from(weights[index]), weight);
            let sum: f64 = alone.iter().map(|(steps, _)| f64::from(steps[index])).sum();
            assert!((f64::from(steps[index]) - sum / f64::from(weight.max(1))).abs() <= 1.01);
        }
        assert_eq!(weights.iter().max(), Some(&3));
        // Columns and rows that see nothing change nothing when they are cut off.
        let mut holes = images[0].clone();
        for (index, depth) in (0..).zip(&mut holes.0.depth) {
            let (column, row): (u32, u32) = (index % CAMERA.width, index / CAMERA.width);
            if !(100..200).contains(&column) || !(90..180).contains(&row) {
                *depth = if index % 2 == 0 { 0.0 } else { f32::NAN };
            }
        }
        let mut cut = holes.clone();
        cut.0.depth.iter_mut().filter(|depth| **depth == 0.0).for_each(|depth| *depth = f32::NAN);
        cut.0 = cut.0.trimmed();
        assert_eq!((cut.0.width, cut.0.height), (100, 90));
        assert_eq!(fused(&[holes]), fused(&[cut]));
    }

    #[test]
    fn nothing_behind_a_camera_or_outside_its_image_is_seen() {
        let behind: Pose<CameraCv, Volume> = Pose::new(Rotation3::identity(), Vector3::new(-0.15, -0.15, -0.4));
        let beside: Pose<CameraCv, Volume> = Pose::new(Rotation3::identity(), Vector3::new(2.0, -0.15, 0.4));
        for pose in [behind, beside] {
            let (steps, weights) = fused(&[(image(|_, _| 5.0), pose)]);
            assert!(steps.iter().all(|steps| *steps == 0) && weights.iter().all(|weight| *weight == 0));
        }
    }
}
