//! Lens distortion undone: the picture without it, and which pixel of the given picture each of its pixels shows.

use std::ops::Range;

use crate::camera::Distortion;

/// A pixel of the picture without distortion that shows nothing of the given one.
const NO_SOURCE: u32 = u32::MAX;
/// Most columns and rows of the given picture that one pixel of the other covers: no lens shrinks its picture more.
const MAX_SPAN: u32 = 16;

/// Relation of a picture without distortion to the picture that was given. Both have one size and one camera matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Rectification {
    /// Width and height [px].
    size: [u32; 2],
    /// fx, fy, cx, cy [px], pixel centres at +0.5.
    numbers: [f64; 4],
    distortion: Distortion,
    /// Square of the radius beyond which the model folds back.
    fold: f64,
    /// Pixel of the given picture by pixel, or [`NO_SOURCE`].
    sources: Vec<u32>,
    /// Depths or distances that the given picture measured [m], NaN = no return. Shape (height, width), row-major.
    measured: Vec<f32>,
}

impl Rectification {
    /// The relation for a picture [m] of this size and camera; what is not above 0 is no return.
    pub(crate) fn new(measured: &[f32], size: [u32; 2], numbers: [f64; 4], distortion: Distortion) -> Self {
        let measured = measured.iter().map(|depth| if *depth > 0.0 { *depth } else { f32::NAN }).collect();
        let [fx, fy, cx, cy] = numbers;
        let [width, height] = size;
        // The corner that is farthest from the principal point.
        let (x, y) = (largest_slope(cx, width, fx), largest_slope(cy, height, fy));
        let fold = distortion.square_of_fold(x * x + y * y);
        let mut found = Self { size, numbers, distortion, fold, sources: Vec::new(), measured };
        found.sources = (0..width * height).map(|pixel| found.look_up(pixel)).collect();
        found
    }

    /// The pixel of the given picture that holds the ray of a pixel's centre.
    fn look_up(&self, pixel: u32) -> u32 {
        let [width, height] = self.size;
        let Some([u, v]) = self.in_given([f64::from(pixel % width) + 0.5, f64::from(pixel / width) + 0.5]) else {
            return NO_SOURCE;
        };
        let is_inside = (0.0..f64::from(width)).contains(&u) && (0.0..f64::from(height)).contains(&v);
        if is_inside { v as u32 * width + u as u32 } else { NO_SOURCE }
    }

    /// Coordinates in the given picture of a point of the picture without distortion [px], pixel centres at +0.5; `None` if no
    /// ray of the lens leads.
    fn in_given(&self, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        let [fx, fy, cx, cy] = self.numbers;
        let (x, y) = ((u - cx) / fx, (v - cy) / fy);
        if x * x + y * y > self.fold {
            return None;
        }
        let [x, y] = self.distortion.distorted([x, y]);
        Some([fx * x + cx, fy * y + cy])
    }

    /// The picture without distortion: what was measured where each pixel's ray meets the sensor, NaN where that is outside. Depth
    /// along the axis does not depend on the pixel that holds it.
    pub(crate) fn rectified(&self) -> Vec<f32> {
        let value = |source: &u32| self.measured.get(*source as usize).copied().unwrap_or(f32::NAN);
        self.sources.iter().map(value).collect()
    }

    /// Distortion of the lens.
    pub fn distortion(&self) -> Distortion {
        self.distortion
    }

    /// Depths or distances that the given picture measured [m], NaN = no return. Shape (height, width), row-major.
    pub(crate) fn measured(&self) -> &[f32] {
        &self.measured
    }

    /// Pixel of the given picture that a pixel shows; `None` if it shows nothing of it.
    pub(crate) fn source(&self, pixel: u32) -> Option<u32> {
        Some(self.sources[pixel as usize]).filter(|source| *source != NO_SOURCE)
    }

    /// Labels of the given picture out of those of the picture without distortion; 0 is none. A pixel that several pixels show has
    /// the smallest of their labels. One that none shows has that of the pixel whose square it lies in, where what both measured
    /// differs by less than `jump` of that pixel [m].
    pub(crate) fn labels_in_given(&self, labels: &[u16], jump: impl Fn(u32) -> f64) -> Vec<u16> {
        let [width, height] = self.size;
        let mut found = vec![0; labels.len()];
        let mut is_shown = vec![false; labels.len()];
        for (source, label) in self.sources.iter().zip(labels).filter(|(source, _)| **source != NO_SOURCE) {
            let at = &mut found[*source as usize];
            *at = if *at == 0 || *label == 0 { (*at).max(*label) } else { (*at).min(*label) };
            is_shown[*source as usize] = true;
        }
        for (pixel, label) in (0..).zip(labels).filter(|(_, label)| **label != 0) {
            let Some(source) = self.source(pixel) else { continue };
            let (column, row) = (f64::from(pixel % width), f64::from(pixel / width));
            let corners =
                [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[x, y]| self.in_given([column + x, row + y]));
            let Some(corners) = corners.into_iter().collect::<Option<Vec<_>>>() else { continue };
            // Pixels whose centres lie in the box of the square's image.
            let columns = span(corners.iter().map(|corner| corner[0]), width);
            let rows = span(corners.iter().map(|corner| corner[1]), height);
            let measured = self.measured[source as usize];
            for other in rows.flat_map(|row| columns.clone().map(move |column| row * width + column)) {
                let at = other as usize;
                let is_alike = f64::from((self.measured[at] - measured).abs()) < jump(pixel);
                if !is_shown[at] && is_alike && (found[at] == 0 || *label < found[at]) {
                    found[at] = *label;
                }
            }
        }
        found
    }
}

/// The largest slope of rays through an image along one axis: its pixels, its principal point and its focal length [px].
fn largest_slope(principal: f64, side: u32, focal: f64) -> f64 {
    principal.abs().max((f64::from(side) - principal).abs()) / focal
}

/// Columns or rows whose centres lie between the smallest and the largest of these coordinates [px]; none where they are too many.
fn span(coordinates: impl Iterator<Item = f64> + Clone, side: u32) -> Range<u32> {
    let low = (coordinates.clone().fold(f64::INFINITY, f64::min) - 0.5).ceil().max(0.0);
    let high = (coordinates.fold(f64::NEG_INFINITY, f64::max) - 0.5).floor().min(f64::from(side) - 1.0);
    if low <= high && high - low < f64::from(MAX_SPAN) { low as u32..high as u32 + 1 } else { 0..0 }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SIZE: [u32; 2] = [160, 120];
    const NUMBERS: [f64; 4] = [150.0, 152.0, 81.0, 58.5];

    fn lens(coefficients: [f64; 8]) -> Distortion {
        Distortion::from_opencv(coefficients)
    }

    /// Column and row [px], pixel centres at +0.5, in the picture without distortion of the ray that a point of the given picture
    /// sees; found by iteration: the inverse of what the product computes in closed form.
    fn undistorted([u, v]: [f64; 2], [k1, k2, p1, p2, k3, k4, k5, k6]: [f64; 8]) -> [f64; 2] {
        let [fx, fy, cx, cy] = NUMBERS;
        let (xd, yd) = ((u - cx) / fx, (v - cy) / fy);
        let (mut x, mut y) = (xd, yd);
        for _ in 0..80 {
            let square = x * x + y * y;
            let radial = (1.0 + square * (k1 + square * (k2 + square * k3)))
                / (1.0 + square * (k4 + square * (k5 + square * k6)));
            (x, y) = (
                (xd - 2.0 * p1 * x * y - p2 * (square + 2.0 * x * x)) / radial,
                (yd - p1 * (square + 2.0 * y * y) - 2.0 * p2 * x * y) / radial,
            );
        }
        [fx * x + cx, fy * y + cy]
    }

    const LENSES: [[f64; 8]; 3] = [
        [-0.25, 0.08, 0.002, -0.001, 0.01, 0.0, 0.0, 0.0],
        [0.2, 0.1, -0.001, 0.002, 0.0, 0.0, 0.0, 0.0],
        [0.4, -0.2, 0.001, 0.0005, 0.02, 0.7, -0.3, 0.1],
    ];

    #[test]
    fn distortion_is_undone_ray_by_ray() {
        let [width, height] = SIZE;
        let centre = |pixel: u32| [f64::from(pixel % width) + 0.5, f64::from(pixel / width) + 0.5];
        for coefficients in LENSES {
            // Each pixel of the given picture holds the column, or the row, that its ray has without distortion.
            let rays: Vec<[f64; 2]> =
                (0..width * height).map(|pixel| undistorted(centre(pixel), coefficients)).collect();
            let moved = (0..).zip(&rays).map(|(pixel, ray)| (ray[0] - centre(pixel)[0]).abs()).fold(0.0, f64::max);
            let mut checked = 0;
            for axis in 0..2 {
                let given: Vec<f32> = rays.iter().map(|ray| ray[axis] as f32).collect();
                let found = Rectification::new(&given, SIZE, NUMBERS, lens(coefficients));
                for (pixel, value) in (0..).zip(found.rectified()).filter(|(_, value)| !value.is_nan()) {
                    // The nearest pixel is up to half a pixel away, a little more where the lens shrinks the image.
                    let wanted = centre(pixel)[axis];
                    assert!((f64::from(value) - wanted).abs() < 0.8, "pixel {pixel}: {value}, not {wanted}");
                    checked += 1;
                }
            }
            assert!(checked > 25_000 && moved > 1.5, "{checked} values, the lens moves rays by {moved} px");
        }
        let plain: Vec<f32> = (1..=width * height).map(|pixel| pixel as f32).collect();
        assert_eq!(Rectification::new(&plain, SIZE, NUMBERS, Distortion::default()).rectified(), plain);
    }

    #[test]
    fn behind_the_fold_of_a_model_nothing_is_seen() {
        // r (1 - 2 r^2 + r^4) grows up to r = 0.447, falls, and grows again from r = 1: there the same pixels would be seen twice.
        let fold = lens([-2.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).square_of_fold(4.0);
        assert!((fold.sqrt() - 0.447).abs() < 0.001, "{fold}");
        // A divisor that passes 0.
        let fold = lens([0.0, 0.0, 0.0, 0.0, 0.0, -4.0, 0.0, 0.0]).square_of_fold(4.0);
        assert!((0.24..0.25).contains(&fold), "{fold}");
        assert_eq!(Distortion::default().square_of_fold(4.0), 4.0);
        let measured = vec![1.0; 160 * 120];
        let wide = [60.0, 60.0, 80.0, 60.0];
        let found = Rectification::new(&measured, SIZE, wide, lens([-2.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
        for (pixel, depth) in (0..).zip(found.rectified()) {
            let (x, y) = ((f64::from(pixel % 160) + 0.5 - 80.0) / 60.0, (f64::from(pixel / 160) + 0.5 - 60.0) / 60.0);
            assert_eq!(depth.is_nan(), x * x + y * y > found.fold, "pixel {pixel}");
        }
    }

    #[test]
    fn labels_go_back_to_the_pixels_that_they_came_from() {
        let [width, height] = SIZE;
        // A disc of the picture without distortion, nearer than the rest.
        let in_disc = |[u, v]: [f64; 2]| (u - 90.0).powi(2) + (v - 70.0).powi(2) < 625.0;
        let centre = |pixel: u32| [f64::from(pixel % width) + 0.5, f64::from(pixel / width) + 0.5];
        for coefficients in LENSES {
            let truth: Vec<bool> =
                (0..width * height).map(|pixel| in_disc(undistorted(centre(pixel), coefficients))).collect();
            let measured: Vec<f32> = truth.iter().map(|is_near| if *is_near { 0.6 } else { 0.9 }).collect();
            let found = Rectification::new(&measured, SIZE, NUMBERS, lens(coefficients));
            let labels: Vec<u16> = found.rectified().iter().map(|depth| u16::from(*depth == 0.6)).collect();
            let given = found.labels_in_given(&labels, |_| 0.01);
            // All of the disc, and nothing else: also those pixels that no pixel of the other picture shows.
            let wrong = given.iter().zip(&truth).filter(|(label, is_near)| (**label == 1) != **is_near).count();
            assert_eq!(wrong, 0, "{coefficients:?}: {wrong} of {} px", truth.iter().filter(|near| **near).count());
        }
    }

    proptest! {
        #[test]
        fn no_coefficients_make_it_panic(
            coefficients in prop::array::uniform8(-1e4_f64..1e4),
            numbers in (6.4_f64..1000.0, 6.4_f64..1000.0, 0.0_f64..16.0, 0.0_f64..12.0),
        ) {
            let measured: Vec<f32> = (0..16 * 12).map(|pixel| if pixel % 5 == 0 { f32::NAN } else { 1.0 }).collect();
            let (fx, fy, cx, cy) = numbers;
            let found = Rectification::new(&measured, [16, 12], [fx, fy, cx, cy], lens(coefficients));
            let labels: Vec<u16> = found.rectified().iter().map(|depth| u16::from(!depth.is_nan())).collect();
            let given = found.labels_in_given(&labels, |_| 0.01);
            // Only what was measured has a label.
            prop_assert!(given.iter().zip(&measured).all(|(label, depth)| *label == 0 || !depth.is_nan()));
        }
    }
}
