//! A picture at a quarter of its resolution, with normals.

use nalgebra::{Point3, Vector3};

use crate::frame::DepthFrame;

/// Side of a cell at the focal length of a Kinect's picture [px].
const CELL: f64 = 4.0;
/// Focal length of that picture [px].
const FOCAL: f64 = 525.0;
/// Cells on each side of one whose points give its normal.
const APART: usize = 2;
/// Points of a cell differ from its first in inverse depth by less than this [1/m].
const JUMP: f64 = 0.02;
/// The middle of two points is as near to the point between them as this, and as this share of their distance [m].
const BEND: [f64; 2] = [0.006, 0.15];

/// A cell with a point and a normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// Mean of the points [m].
    pub point: Point3<f64>,
    /// Unit normal towards the camera.
    pub normal: Vector3<f64>,
    /// Whether the border of the picture is near.
    pub is_at_border: bool,
}

/// All cells that have a normal, row by row.
pub(super) fn facets_of(frame: &DepthFrame) -> Vec<Facet> {
    let scale = frame.camera.fx.min(frame.camera.fy) / FOCAL;
    let side = (CELL * scale).round().clamp(1.0, 64.0) as u32;
    let (columns, rows) = ((frame.camera.width / side) as usize, (frame.camera.height / side) as usize);
    let mut points = Vec::with_capacity(columns * rows);
    for row in 0..rows as u32 {
        points.extend((0..columns as u32).map(|column| mean_point(frame, [column * side, row * side], side)));
    }
    let mut facets = Vec::new();
    for row in APART..rows.saturating_sub(APART) {
        for column in APART..columns.saturating_sub(APART) {
            let at = row * columns + column;
            let tangent = |apart: usize| {
                let [before, here, after] = [points[at - apart], points[at], points[at + apart]];
                let along = after - before;
                let bend = (0.5 * (before + after) - here).norm();
                (bend < BEND[0] + BEND[1] * along.norm()).then_some(along)
            };
            let (Some(along), Some(down)) = (tangent(APART), tangent(APART * columns)) else { continue };
            let Some(normal) = along.cross(&down).try_normalize(1e-12) else { continue };
            let normal = if normal.dot(&points[at]) > 0.0 { -normal } else { normal };
            let edge = APART + 1;
            let is_at_border = column < edge || row < edge || column + edge >= columns || row + edge >= rows;
            facets.push(Facet { point: points[at].into(), normal, is_at_border });
        }
    }
    facets
}

/// Mean point of the square of pixels with this corner, by the mean of inverse depths near the first one; NaN if fewer than half
/// of the pixels have one.
fn mean_point(frame: &DepthFrame, [left, top]: [u32; 2], side: u32) -> Vector3<f64> {
    let (mut first, mut count, mut sum, mut middle) = (f64::NAN, 0_u32, 0.0, [0.0; 2]);
    for row in top..top + side {
        for column in left..left + side {
            let inverse = 1.0 / f64::from(frame.depth[(row * frame.camera.width + column) as usize]);
            if first.is_nan() {
                first = inverse;
            }
            if (inverse - first).abs() < JUMP {
                count += 1;
                sum += inverse;
                middle = [middle[0] + f64::from(column), middle[1] + f64::from(row)];
            }
        }
    }
    if 2 * count < side * side {
        return Vector3::repeat(f64::NAN);
    }
    let [column, row] = middle.map(|sum| sum / f64::from(count) + 0.5);
    frame.camera.unproject(column, row, f64::from(count) / sum).coords
}
