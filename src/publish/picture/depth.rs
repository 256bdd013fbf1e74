//! Depth crops in colour.

use nalgebra::Point3;

use super::{Colour, Picture, depth_colours};
use kernel::geom::{DepthCrop, GridPlacement, OccupancyGrid};

/// Nearest and farthest depth of a picture [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthRange {
    /// Nearest [m]: drawn lightest.
    pub near: f64,
    /// Farthest [m]: drawn darkest.
    pub far: f64,
}

impl DepthRange {
    /// The range of the returns; `None` without any.
    pub fn from_crop(crop: &DepthCrop) -> Option<Self> {
        let returns = || crop.depth.iter().copied().filter(|depth| depth.is_finite());
        let (near, far) = (returns().reduce(f32::min)?, returns().reduce(f32::max)?);
        Some(Self { near: f64::from(near), far: f64::from(far) })
    }

    /// Position of a depth between near (0) and far (1).
    fn share(self, depth: f64) -> f64 {
        if self.far > self.near { ((depth - self.near) / (self.far - self.near)).clamp(0.0, 1.0) } else { 0.5 }
    }
}

/// A depth crop as a picture: near is light, far is dark, no return is clear. Each pixel of the crop becomes
/// `zoom` x `zoom` pixels.
pub fn depth_picture(crop: &DepthCrop, range: DepthRange, zoom: u32) -> Picture {
    painted(crop, range, zoom, &depth_colours())
}

/// A depth crop in shades of grey, as a ground for marks in colour: near is light, far is darker, no return is clear.
pub fn grey_depth_picture(crop: &DepthCrop, range: DepthRange) -> Picture {
    let (darkest, lightest) = (70, 240);
    let shade = |level: usize| (darkest + level * (lightest - darkest) / 255) as u8;
    painted(crop, range, 1, &std::array::from_fn(|level| Colour([shade(level); 3])))
}

fn painted(crop: &DepthCrop, range: DepthRange, zoom: u32, colours: &[Colour; 256]) -> Picture {
    let mut picture = Picture::filled(crop.width * zoom, crop.height * zoom, [0; 4]);
    for (index, depth) in (0u32..).zip(&crop.depth) {
        if depth.is_finite() {
            let (column, row) = (index % crop.width * zoom, index / crop.width * zoom);
            let level = (1.0 - range.share(f64::from(*depth))) * 255.0 + 0.5;
            picture.fill(column..column + zoom, row..row + zoom, colours[level as usize].opaque());
        }
    }
    picture
}

/// The colours of a depth picture as a narrow column, near at the top.
pub fn colour_bar(width: u32, height: u32) -> Picture {
    let colours = depth_colours();
    let mut bar = Picture::filled(width, height, [0; 4]);
    for row in 0..height {
        let level = 255 - row * 255 / (height - 1).max(1);
        bar.fill(0..width, row..row + 1, colours[level as usize].opaque());
    }
    bar
}

/// Depth as the partial grid knows it: along each column of cells, the depth of the nearest occupied cell's
/// middle [m]; one pixel per cell, x to the right and y down. Orthographic; used if no depth crop was stored.
pub fn height_map(partial: &OccupancyGrid, placement: &GridPlacement) -> DepthCrop {
    let n = partial.resolution();
    let lower: Point3<f64> = placement.lower_corner();
    let mut depth = vec![f32::NAN; (n * n) as usize];
    for [x, y, z] in partial.cells() {
        let pixel = &mut depth[(y * n + x) as usize];
        let metres = (lower.z + (f64::from(z) + 0.5) * placement.cell_size) as f32;
        *pixel = pixel.min(metres); // f32::min passes over NaN
    }
    DepthCrop { left: 0, top: 0, width: n, height: n, depth }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_is_light_and_nothing_is_clear() {
        let crop = DepthCrop { left: 3, top: 4, width: 3, height: 1, depth: vec![0.9, f32::NAN, 1.1] };
        let range = DepthRange::from_crop(&crop).unwrap();
        assert_eq!((range.near, range.far), (f64::from(0.9f32), f64::from(1.1f32)));
        let picture = depth_picture(&crop, range, 2);
        assert_eq!((picture.width, picture.height), (6, 2));
        let colours = depth_colours();
        assert_eq!(picture.at(1, 1), colours[255].opaque());
        assert_eq!(picture.at(2, 0), [0; 4]);
        assert_eq!(picture.at(5, 1), colours[0].opaque());
    }

    #[test]
    fn nothing_seen_has_no_range() {
        let crop = DepthCrop { width: 1, height: 1, depth: vec![f32::NAN], ..DepthCrop::default() };
        assert_eq!(DepthRange::from_crop(&crop), None);
    }

    #[test]
    fn height_map_takes_the_nearest_cell() {
        let placement = GridPlacement { resolution: 40, centre: Point3::new(0.0, 0.0, 1.0), cell_size: 0.01 };
        let mut partial = OccupancyGrid::new(40);
        partial.set([3, 5, 20]);
        partial.set([3, 5, 10]);
        let map = height_map(&partial, &placement);
        // Cell 18 starts at the centre's z: cell 10's middle lies 7.5 cells before it.
        assert!((map.at(3, 5) - 0.925).abs() < 1e-6);
        assert_eq!(map.returns(), 1);
    }
}
