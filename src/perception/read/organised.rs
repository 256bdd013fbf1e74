//! Organised clouds: a point per pixel, row by row.

use super::raw::{Cloud, FrameProblem};

/// Pixels whose points lie further than this from the camera's rays [px] do not belong to a pinhole camera.
const MAX_RESIDUAL: f64 = 1.0;

/// Depths of an organised cloud [m], NaN = no return, and fx, fy, cx, cy [px] of the camera that its points obey.
///
/// # Errors
/// Where the points lie on no pinhole camera's rays.
pub(super) fn depths_and_camera(cloud: &Cloud) -> Result<(Vec<f32>, [f64; 4]), FrameProblem> {
    let depth = cloud.points.iter().map(|point| if is_seen(point) { point[2] as f32 } else { f32::NAN }).collect();
    let seen = || cloud.points.iter().enumerate().filter(|(_, point)| is_seen(point));
    let width = cloud.width as usize;
    let centre = |index: usize, axis: usize| (if axis == 0 { index % width } else { index / width }) as f64 + 0.5;
    // Pixel = focal * slope + principal point, along each axis, by least squares.
    let mut fits = [[0.0; 2]; 2];
    for (axis, fit) in fits.iter_mut().enumerate() {
        let pairs = || seen().map(|(index, point)| (point[axis] / point[2], centre(index, axis)));
        let count = seen().count().max(1) as f64;
        let mean_slope = pairs().map(|(slope, _)| slope).sum::<f64>() / count;
        let mean_pixel = pairs().map(|(_, pixel)| pixel).sum::<f64>() / count;
        let both = pairs().map(|(slope, pixel)| (slope - mean_slope) * (pixel - mean_pixel)).sum::<f64>();
        let square = pairs().map(|(slope, _)| (slope - mean_slope).powi(2)).sum::<f64>();
        let focal = both / square;
        let principal = mean_pixel - focal * mean_slope;
        let residual = pairs().map(|(slope, pixel)| (focal * slope + principal - pixel).powi(2)).sum::<f64>() / count;
        // A comparison that is false for NaN.
        if !(residual.sqrt() <= MAX_RESIDUAL && focal > 0.0) && seen().count() > 0 {
            let found = format!("points up to {:.1} px off a pinhole camera's rays", residual.sqrt());
            return Err(FrameProblem::content(
                "the points",
                found,
                "give the cloud in the camera's own frame (x right, y down, z forward), each point at its pixel",
            ));
        }
        *fit = [focal, principal];
    }
    let [[fx, cx], [fy, cy]] = fits;
    Ok((depth, [fx, fy, cx, cy]))
}

fn is_seen(point: &[f64; 3]) -> bool {
    point.iter().all(|value| value.is_finite()) && point[2] > 0.0
}
