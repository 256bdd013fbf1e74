//! Share of completions that reaches into space that the camera saw to be empty.

use kernel::geom::Intrinsics;
use nalgebra::Point3;

/// Share of points that lie more than `margin` [m] in front of all depths that were seen that near to them: of a completion
/// whose points are on its surface, what contradicts the picture.
///
/// Points are in `CameraCv` [m]. `depth` is the whole picture [m], NaN = no return, shape (height, width), row-major; a pixel
/// without a return says nothing against a point. 0 without points.
///
/// # Panics
/// If the picture's size is not the camera's.
pub fn free_space_violation<'a>(
    points: impl IntoIterator<Item = &'a Point3<f64>>,
    camera: &Intrinsics,
    depth: &[f32],
    margin: f64,
) -> f64 {
    assert_eq!(depth.len(), camera.width as usize * camera.height as usize, "a depth per pixel");
    let (mut count, mut in_front) = (0_u32, 0_u32);
    for point in points {
        count += 1;
        in_front += u32::from(is_in_front(point, camera, depth, margin));
    }
    if count == 0 { 0.0 } else { f64::from(in_front) / f64::from(count) }
}

fn is_in_front(point: &Point3<f64>, camera: &Intrinsics, depth: &[f32], margin: f64) -> bool {
    let (u, v) = camera.project(point);
    let is_inside = (0.0..f64::from(camera.width)).contains(&u) && (0.0..f64::from(camera.height)).contains(&v);
    if !is_inside {
        return false;
    }
    let reach = |focal: f64| margin * focal / point.z;
    let span =
        |middle: f64, reach: f64, end: u32| (middle - reach).max(0.0) as u32..=((middle + reach) as u32).min(end - 1);
    let columns = span(u, reach(camera.fx), camera.width);
    let mut around =
        span(v, reach(camera.fy), camera.height).flat_map(|row| columns.clone().map(move |column| (row, column)));
    let is_behind = |(row, column): (u32, u32)| {
        let depth = f64::from(depth[(row * camera.width + column) as usize]);
        depth.is_nan() || point.z >= depth - margin
    };
    !around.any(is_behind)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_lies_well_before_everything_seen_around_it_counts() {
        let camera = Intrinsics { width: 40, height: 30, fx: 40.0, fy: 40.0, cx: 20.0, cy: 15.0, near: 0.1 };
        // A wall at 1 m; the right half of the picture has no return.
        let depth: Vec<f32> = (0..1200).map(|pixel| if pixel % 40 < 20 { 1.0 } else { f32::NAN }).collect();
        let share = |points: &[[f64; 3]]| {
            let points: Vec<Point3<f64>> = points.iter().map(|point| Point3::from(*point)).collect();
            free_space_violation(&points, &camera, &depth, 0.05)
        };
        assert_eq!(share(&[]), 0.0);
        assert_eq!(share(&[[-0.2, 0.0, 0.94]]), 1.0);
        assert_eq!(share(&[[-0.2, 0.0, 0.96], [-0.2, 0.0, 1.5], [0.2, 0.0, 0.5], [-9.0, 0.0, 0.9]]), 0.0);
        assert_eq!(share(&[[-0.2, 0.0, 0.5], [0.2, 0.0, 0.5]]), 0.5);
        // Within the margin of pixels without a return nothing is claimed.
        assert_eq!(share(&[[-0.02, 0.0, 0.9]]), 0.0);
    }
}
