//! Points of the objects on a padded grid of pixels, smoothed, with their normals.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

use crate::{frame::DepthFrame, plane::Plane};

/// Focal length at which steps and windows were chosen: that of a Kinect's 640 x 480 picture [px].
const FOCAL: f64 = 525.0;
/// Cells of a sensor's hole that neighbours are looked for across, at that focal length.
const HOLE: f64 = 6.0;
/// Half a window of the mean of inverse depths, at that focal length [px].
const SMOOTH: f64 = 2.0;
/// Half a window of the mean of gradients, at that focal length [px].
const GRADIENT: f64 = 3.0;
/// Half the distance of the pixels whose normals are compared, at that focal length [px].
const STEP: f64 = 5.0;
/// Neighbours whose depths differ by less than `NOISE z^2 + FLOOR` lie on one surface [1/m, m].
const NOISE: f32 = 0.0075;
/// See [`NOISE`].
const FLOOR: f32 = 0.004;
/// Gradients are averaged over points whose inverse depths differ by less than this share.
const WINDOW_JUMP: f32 = 0.04;
/// Neighbours two pixels apart whose inverse depths differ by more than this share have no gradient.
const JUMP: f32 = 0.015;

/// Kind of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cell {
    /// Without a return, or outside the picture.
    Empty,
    /// A return that is no point of an object.
    Other,
    /// A point of an object.
    Object,
}

/// A window of the picture around all points of objects, with a margin of empty cells.
pub(super) struct Grid {
    /// Cells per row.
    pub stride: usize,
    /// Pixel of each cell; meaningless in the margin.
    pub pixels: Vec<u32>,
    /// Kind of each cell.
    pub kinds: Vec<Cell>,
    /// Points of objects as measured, in `CameraCv` [m].
    pub points: [Vec<f32>; 3],
    /// Cells of objects, in order.
    pub objects: Vec<u32>,
    /// Half the distance of the cells whose normals are compared.
    pub step: usize,
    /// Cells of a hole that neighbours are looked for across.
    pub hole: usize,
    /// Cells of a picture with the focal length that the sizes were chosen at, per cell of this one.
    pub area: f64,
    /// Runs of cells in rows that contain all cells of objects.
    pub runs: Vec<Range<usize>>,
}

/// Smoothed points and normals; NaN where a cell has none.
pub(super) struct Surface {
    /// Points in `CameraCv` [m].
    pub points: [Vec<f32>; 3],
    /// Unit normals towards the camera.
    pub normals: [Vec<f32>; 3],
}

impl Surface {
    /// A smoothed point [m].
    pub fn point(&self, cell: usize) -> Vector3<f32> {
        Vector3::new(self.points[0][cell], self.points[1][cell], self.points[2][cell])
    }

    /// A unit normal towards the camera.
    pub fn normal(&self, cell: usize) -> Vector3<f32> {
        Vector3::new(self.normals[0][cell], self.normals[1][cell], self.normals[2][cell])
    }
}

impl Grid {
    /// The grid of these pixels, with their points; `None` without pixels.
    pub fn new(frame: &DepthFrame, objects: &[(u32, Point3<f64>)]) -> Option<Self> {
        let width = frame.camera.width;
        let columns = || objects.iter().map(|(pixel, _)| (pixel % width) as usize);
        let rows = || objects.iter().map(|(pixel, _)| (pixel / width) as usize);
        let [left, right] = [columns().min()?, columns().max()?];
        let [top, bottom] = [rows().min()?, rows().max()?];
        let scale = frame.camera.fx.min(frame.camera.fy) / FOCAL;
        let sized = |size: f64, least: f64| (size * scale).round().clamp(least, 24.0) as usize;
        let (step, hole) = (sized(STEP, 2.0), sized(HOLE, 2.0));
        let margin = step.max(hole).max(sized(SMOOTH, 1.0) + 1).max(sized(GRADIENT, 1.0) + 1);
        let (stride, lines) = (right - left + 1 + 2 * margin, bottom - top + 1 + 2 * margin);
        let count = stride * lines;
        let mut pixels = vec![u32::MAX; count];
        let mut kinds = vec![Cell::Empty; count];
        let height = frame.camera.height as usize;
        for line in 0..lines {
            let Some(row) = (line + top).checked_sub(margin).filter(|row| *row < height) else { continue };
            for across in 0..stride {
                let Some(column) = (across + left).checked_sub(margin).filter(|column| *column < width as usize) else {
                    continue;
                };
                let pixel = row * width as usize + column;
                pixels[line * stride + across] = pixel as u32;
                if !frame.depth[pixel].is_nan() {
                    kinds[line * stride + across] = Cell::Other;
                }
            }
        }
        let mut points = [(); 3].map(|()| vec![f32::NAN; count]);
        let mut cells = Vec::with_capacity(objects.len());
        for (pixel, point) in objects {
            let (row, column) = ((pixel / width) as usize, (pixel % width) as usize);
            let cell = (row - top + margin) * stride + column - left + margin;
            kinds[cell] = Cell::Object;
            for (axis, values) in points.iter_mut().enumerate() {
                values[cell] = point[axis] as f32;
            }
            cells.push(cell as u32);
        }
        let runs = runs_of(&cells, margin);
        Some(Self { stride, pixels, kinds, points, objects: cells, step, hole, area: scale * scale, runs })
    }

    /// A point of an object [m].
    pub fn point(&self, cell: usize) -> Vector3<f32> {
        Vector3::new(self.points[0][cell], self.points[1][cell], self.points[2][cell])
    }

    /// Smoothed points and normals.
    pub fn surface(&self, frame: &DepthFrame) -> Surface {
        let scale = frame.camera.fx.min(frame.camera.fy) / FOCAL;
        let sized = |size: f64| (size * scale).round().clamp(1.0, 24.0) as usize;
        // On a plane the inverse depth is linear in the pixel, and so keeps its value in a mean over a window.
        let inverse: Vec<f32> = self.points[2].iter().map(|z| 1.0 / z).collect();
        let once = self.smoothed(&inverse, sized(SMOOTH));
        let twice = self.smoothed(&once, sized(SMOOTH));
        let gradients = self.gradients(&twice, sized(GRADIENT));
        self.surface_of(frame, &twice, &gradients)
    }

    /// Mean of the values in a window around each cell that lie on its surface. Shape of the grid.
    fn smoothed(&self, values: &[f32], half: usize) -> Vec<f32> {
        let mut smoothed = vec![f32::NAN; values.len()];
        for run in self.runs.iter().cloned() {
            let count = run.len();
            let middle = &values[run.clone()];
            let reach: Vec<f32> = middle.iter().map(|value| NOISE + FLOOR * value * value).collect();
            let (mut sums, mut weights) = (vec![0.0_f32; count], vec![0.0_f32; count]);
            for line in 0..=2 * half {
                for across in 0..=2 * half {
                    let start = run.start + line * self.stride + across - half * self.stride - half;
                    let others = &values[start..start + count];
                    for index in 0..count {
                        let is_near = (others[index] - middle[index]).abs() < reach[index];
                        sums[index] += if is_near { others[index] } else { 0.0 };
                        weights[index] += if is_near { 1.0 } else { 0.0 };
                    }
                }
            }
            for (index, value) in smoothed[run].iter_mut().enumerate() {
                *value = if weights[index] > 0.0 { sums[index] / weights[index] } else { f32::NAN };
            }
        }
        smoothed
    }

    /// Gradients of the inverse depth along a row and a column [1/m per px], averaged over a window.
    fn gradients(&self, inverse: &[f32], half: usize) -> [Vec<f32>; 2] {
        let slopes = [1, self.stride].map(|beside| {
            let mut central = vec![f32::NAN; inverse.len()];
            for run in self.runs.iter().cloned() {
                for cell in run {
                    let (before, after) = (inverse[cell - beside], inverse[cell + beside]);
                    if (after - before).abs() < JUMP * inverse[cell] {
                        central[cell] = 0.5 * (after - before);
                    }
                }
            }
            central
        });
        let mut means = [(); 2].map(|()| vec![f32::NAN; inverse.len()]);
        for run in self.runs.iter().cloned() {
            let count = run.len();
            let middle = &inverse[run.clone()];
            let reach: Vec<f32> = middle.iter().map(|value| WINDOW_JUMP * value).collect();
            // Sums and weights along a row and along a column.
            let [mut sums, mut weights] = [(); 2].map(|()| [(); 2].map(|()| vec![0.0_f32; count]));
            let ([along_sums, down_sums], [along_weights, down_weights]) = (&mut sums, &mut weights);
            for line in 0..=2 * half {
                for across in 0..=2 * half {
                    let start = run.start + line * self.stride + across - half * self.stride - half;
                    let others = &inverse[start..start + count];
                    let [along, down] = slopes.each_ref().map(|values| &values[start..start + count]);
                    for index in 0..count {
                        let is_near = (others[index] - middle[index]).abs() < reach[index];
                        let [is_along, is_down] = [is_near & !along[index].is_nan(), is_near & !down[index].is_nan()];
                        along_sums[index] += if is_along { along[index] } else { 0.0 };
                        along_weights[index] += if is_along { 1.0 } else { 0.0 };
                        down_sums[index] += if is_down { down[index] } else { 0.0 };
                        down_weights[index] += if is_down { 1.0 } else { 0.0 };
                    }
                }
            }
            for (means, (sums, weights)) in means.iter_mut().zip(sums.iter().zip(&weights)) {
                for (index, mean) in means[run.clone()].iter_mut().enumerate() {
                    *mean = if weights[index] > 0.0 { sums[index] / weights[index] } else { f32::NAN };
                }
            }
        }
        means
    }

    /// Points and normals by inverse depths and their gradients.
    fn surface_of(&self, frame: &DepthFrame, inverse: &[f32], [along, down]: &[Vec<f32>; 2]) -> Surface {
        let camera = &frame.camera;
        let [fx, fy, cx, cy] = [camera.fx, camera.fy, camera.cx, camera.cy].map(|value| value as f32);
        let width = camera.width;
        let mut surface = Surface {
            points: [(); 3].map(|()| vec![f32::NAN; inverse.len()]),
            normals: [(); 3].map(|()| vec![f32::NAN; inverse.len()]),
        };
        for cell in self.objects.iter().map(|cell| *cell as usize) {
            let pixel = self.pixels[cell];
            let (u, v) = ((pixel % width) as f32 + 0.5 - cx, (pixel / width) as f32 + 0.5 - cy);
            let z = 1.0 / inverse[cell];
            // The plane a x + b y + c z = 1 has the inverse depth a u / fx + b v / fy + c.
            let (a, b) = (fx * along[cell], fy * down[cell]);
            let c = inverse[cell] - along[cell] * u - down[cell] * v;
            let length = (a * a + b * b + c * c).sqrt();
            let (point, normal) = ([u / fx * z, v / fy * z, z], [-a / length, -b / length, -c / length]);
            for axis in 0..3 {
                surface.points[axis][cell] = point[axis];
                surface.normals[axis][cell] = normal[axis];
            }
        }
        surface
    }
}

/// Runs of cells that contain all of these, in order, and no gap of `gap` cells.
fn runs_of(cells: &[u32], gap: usize) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for cell in cells.iter().map(|cell| *cell as usize) {
        match runs.last_mut().filter(|run| cell < run.end + gap) {
            Some(run) => run.end = cell + 1,
            None => runs.push(cell..cell + 1),
        }
    }
    runs
}

/// Height of a point above a plane, in single precision [m].
pub(super) fn height(plane: &Plane, point: &Vector3<f32>) -> f32 {
    (plane.normal.dot(&point.map(f64::from)) + plane.offset) as f32
}
