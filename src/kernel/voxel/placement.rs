//! From a depth image to the position of the sample's grid.

use nalgebra::Point3;

use crate::geom::{Aabb, DepthCrop, GridPlacement, Intrinsics, Lanes, SimdLevel, simd_kernel};

/// Why a view has no grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoGrid {
    /// No pixel has a return.
    #[error("no pixel sees the object")]
    NothingSeen,
    /// The cloud's box has no side (one pixel), or is not finite.
    #[error("all pixels see one point: the grid has no size")]
    NoExtent,
}

/// Grid coordinates of a point in `CameraCv`.
pub(super) fn grid_coordinates(placement: &GridPlacement, point: &Point3<f64>) -> [f64; 3] {
    let anchor = placement.anchor();
    std::array::from_fn(|axis| (point[axis] - placement.centre[axis]) / placement.cell_size + anchor[axis])
}

/// The grid of a depth image: see [`GridPlacement`].
pub(super) fn place_grid(
    level: SimdLevel,
    crop: &DepthCrop,
    camera: &Intrinsics,
    slopes: &mut Slopes,
    resolution: u32,
) -> Result<GridPlacement, NoGrid> {
    slopes.set(crop, camera);
    let mut bounds = [f64::INFINITY, f64::INFINITY, f64::INFINITY, -f64::INFINITY, -f64::INFINITY, -f64::INFINITY];
    if crop.width > 0 {
        cloud_bounds(level, crop, slopes, &mut bounds);
    }
    let [x0, y0, z0, x1, y1, z1] = bounds;
    if x0 > x1 {
        return Err(NoGrid::NothingSeen);
    }
    let aabb = Aabb { min: Point3::new(x0, y0, z0), max: Point3::new(x1, y1, z1) };
    let cell_size = aabb.longest_side() / (GridPlacement::FILL * f64::from(resolution));
    if !(cell_size > 0.0 && cell_size.is_finite()) {
        return Err(NoGrid::NoExtent);
    }
    Ok(GridPlacement { resolution, centre: aabb.centre(), cell_size })
}

/// x/z of each column and y/z of each row of a crop, as [`Intrinsics::unproject`] has them.
#[derive(Default)]
pub(super) struct Slopes {
    pub(super) columns: Vec<f64>,
    pub(super) rows: Vec<f64>,
}

impl Slopes {
    pub(super) fn set(&mut self, crop: &DepthCrop, camera: &Intrinsics) {
        let centre = |first: u32, index: u32| f64::from(first + index) + 0.5;
        self.columns.clear();
        self.columns.extend((0..crop.width).map(|x| (centre(crop.left, x) - camera.cx) / camera.fx));
        self.rows.clear();
        self.rows.extend((0..crop.height).map(|y| (centre(crop.top, y) - camera.cy) / camera.fy));
    }
}

simd_kernel! {
    /// Widens the bounds to the lower and upper corner of the unprojected pixels.
    fn cloud_bounds(crop: &DepthCrop, slopes: &Slopes, bounds: &mut [f64; 6]) = cloud_bounds_body;
}

#[inline(always)]
fn cloud_bounds_body<L: Lanes>(_: L, crop: &DepthCrop, slopes: &Slopes, bounds: &mut [f64; 6]) {
    // Comparisons are false for NaN, so pixels without return change nothing.
    let smaller = |a: f64, b: f64| if a < b { a } else { b };
    let larger = |a: f64, b: f64| if a > b { a } else { b };
    const LANES: usize = 8;
    let (mut x0, mut x1) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
    let [mut y0, mut z0, mut y1, mut z1] = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for (line, slope_y) in crop.depth.chunks_exact(crop.width as usize).zip(&slopes.rows) {
        let (mut near, mut far) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
        let (eights, rest) = line.as_chunks::<LANES>();
        let (slope_eights, slope_rest) = slopes.columns.as_chunks::<LANES>();
        // Extremes per lane: x of each pixel, depth for the row's y and z.
        for (depths, slopes) in eights.iter().zip(slope_eights) {
            for lane in 0..LANES {
                let x = slopes[lane] * f64::from(depths[lane]);
                x0[lane] = smaller(x, x0[lane]);
                x1[lane] = larger(x, x1[lane]);
                near[lane] = if depths[lane] < near[lane] { depths[lane] } else { near[lane] };
                far[lane] = if depths[lane] > far[lane] { depths[lane] } else { far[lane] };
            }
        }
        // Pixels after the last whole eight.
        for (lane, (depth, slope)) in rest.iter().zip(slope_rest).enumerate() {
            let x = slope * f64::from(*depth);
            x0[lane] = smaller(x, x0[lane]);
            x1[lane] = larger(x, x1[lane]);
            near[lane] = if *depth < near[lane] { *depth } else { near[lane] };
            far[lane] = if *depth > far[lane] { *depth } else { far[lane] };
        }
        let (near, far) = (near.into_iter().fold(f32::INFINITY, f32::min), far.into_iter().fold(0.0, f32::max));
        if near <= far {
            // Rounding keeps order, so y's extremes are at the row's nearest and farthest pixel.
            let (near, far) = (f64::from(near), f64::from(far));
            (z0, z1) = (smaller(near, z0), larger(far, z1));
            for y in [slope_y * near, slope_y * far] {
                (y0, y1) = (smaller(y, y0), larger(y, y1));
            }
        }
    }
    // Reduce the lanes, then widen the bounds given.
    let x0 = x0.into_iter().fold(f64::INFINITY, smaller);
    let x1 = x1.into_iter().fold(f64::NEG_INFINITY, larger);
    let found = [x0, y0, z0, x1, y1, z1];
    for (axis, bound) in bounds.iter_mut().enumerate() {
        *bound = if axis < 3 { smaller(found[axis], *bound) } else { larger(found[axis], *bound) };
    }
}
