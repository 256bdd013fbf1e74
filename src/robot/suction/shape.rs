//! Measures of the surface under a cup, from its distances along the axis.

use std::f64::consts::PI;

use nalgebra::Vector2;

use super::suctionnet::suctionnet_seal;

/// Points along the lip, and along each other circle.
pub(super) const LIP: usize = 72;
pub(super) const RING: usize = 24;

/// Measures of the surface under a cup.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SealShape {
    /// Distance along the axis, from the cup's frame to the farthest point of the lip [m]: the relaxed lip is there when all of it
    /// lies on the surface.
    pub seat: f64,
    /// Mean compression of the bellows then [m].
    pub compression: f64,
    /// Range of the lip's distances along the axis [m].
    pub spread: f64,
    /// Slope of the plane of the lip along x and y of the cup's frame.
    pub slope: [f64; 2],
    /// Range of the lip's distances from its plane, along the axis [m].
    pub flex: f64,
    /// Largest stretch of a piece of the lip between two points, out of its plane, as a share of its length.
    pub stretch: f64,
    /// Largest height of the surface inside of the lip over the plane, towards the cup [m]; below 0 where all of it is lower.
    pub bulge: f64,
    /// Largest depth of the surface inside of the lip or along its outer edge below the plane [m]; below 0 where all of it is higher.
    pub hole: f64,
    /// Principal curvatures of the quadric on the axis, ascending, positive where the object is convex [1/m].
    pub curvatures: [f64; 2],
    /// Seal score of SuctionNet-1Billion, 0 to 1.
    pub suctionnet: f64,
}

impl SealShape {
    /// Angle between the axis and the normal of the lip's plane [rad].
    pub fn tilt(&self) -> f64 {
        libm::atan(libm::hypot(self.slope[0], self.slope[1]))
    }

    /// Measures of points across the axis [m] and their distances along it [m]: [`LIP`] along the lip, those inside of it, [`RING`]
    /// along its outer edge. `residuals` receives the distances of the lip's points from its plane [m].
    pub(super) fn of(points: &[Vector2<f64>], gaps: &[f64], radius: f64, residuals: &mut Vec<f64>) -> Self {
        let (lip, others) = gaps.split_at(LIP);
        let (around, other_points) = points.split_at(LIP);
        // Plane of the lip: on evenly spaced points of a circle, the sums of the normal equations are orthogonal.
        let mean = lip.iter().sum::<f64>() / LIP as f64;
        let moment = |axis: usize| around.iter().zip(lip).map(|(point, gap)| point[axis] * gap).sum::<f64>();
        let slope = [0, 1].map(|axis| moment(axis) / (LIP as f64 * radius * radius / 2.0));
        let depth = |(point, gap): (&Vector2<f64>, &f64)| gap - (mean + slope[0] * point.x + slope[1] * point.y);
        residuals.clear();
        residuals.extend(around.iter().zip(lip).map(depth));
        // Stretch of the pieces of the lip out of its plane.
        let chord = 2.0 * radius * libm::sin(PI / LIP as f64);
        let stretch = |index: usize| {
            let rise = residuals[(index + 1) % LIP] - residuals[index];
            (chord * chord + rise * rise).sqrt() / chord - 1.0
        };
        let stretch = (0..LIP).map(stretch).fold(0.0, f64::max);
        // The surface over the plane inside of the lip, and below it up to its outer edge.
        let inside = others.len() - RING;
        let heights = other_points.iter().zip(others).take(inside).map(|at| -depth(at));
        let bulge = heights.fold(f64::NEG_INFINITY, f64::max);
        let hole = other_points.iter().zip(others).map(depth).fold(f64::NEG_INFINITY, f64::max);
        let [low, high] = range(lip);
        let [lowest, highest] = range(residuals);
        Self {
            seat: high,
            compression: high - mean,
            spread: high - low,
            slope,
            flex: highest - lowest,
            stretch,
            bulge,
            hole,
            curvatures: curvatures(points.iter().zip(gaps).take(LIP + inside), radius),
            suctionnet: suctionnet_seal(residuals, lip, radius),
        }
    }
}

/// Smallest and largest number.
fn range(numbers: &[f64]) -> [f64; 2] {
    numbers.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], number| [low.min(*number), high.max(*number)])
}

/// Principal curvatures on the axis, ascending [1/m], of the quadric a + b x + c y + m (x^2 + y^2) + d (x^2 - y^2) + 2 e x y that is
/// nearest to points on circles about the axis, evenly spaced on each: by least squares along the axis.
fn curvatures<'a>(points: impl Iterator<Item = (&'a Vector2<f64>, &'a f64)>, radius: f64) -> [f64; 2] {
    // In units of the radius. On such circles, all functions but 1 and x^2 + y^2 are orthogonal.
    let (mut count, mut squares, mut fourths) = (0.0, 0.0, 0.0);
    let (mut sum, mut along, mut x_sum, mut y_sum, mut d_sum, mut e_sum) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (point, gap) in points {
        let (x, y, z) = (point.x / radius, point.y / radius, gap / radius);
        let square = x * x + y * y;
        count += 1.0;
        squares += square;
        fourths += square * square;
        sum += z;
        along += z * square;
        x_sum += z * x;
        y_sum += z * y;
        d_sum += z * (x * x - y * y);
        e_sum += z * (2.0 * x * y);
    }
    let m = (count * along - squares * sum) / (count * fourths - squares * squares);
    let (b, c) = (2.0 * x_sum / squares, 2.0 * y_sum / squares);
    let (d, e) = (2.0 * d_sum / fourths, 2.0 * e_sum / fourths);
    // Curvatures of a graph: mean H and Gaussian K by its first and second derivatives (do Carmo 1976, section 3-3).
    let (xx, yy, xy) = (2.0 * (m + d), 2.0 * (m - d), 2.0 * e);
    let w = 1.0 + b * b + c * c;
    let mean = ((1.0 + c * c) * xx - 2.0 * b * c * xy + (1.0 + b * b) * yy) / (2.0 * w * w.sqrt());
    let gaussian = (xx * yy - xy * xy) / (w * w);
    let half = (mean * mean - gaussian).max(0.0).sqrt();
    [(mean - half) / radius, (mean + half) / radius]
}
