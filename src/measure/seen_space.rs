//! Share of a completed surface in observed free space.

use std::ops::RangeInclusive;

use kernel::geom::{Intrinsics, TriMesh};
use nalgebra::Point3;

/// Distance in front of the observed surface above which a surface contradicts a picture [m]: noise of depth cameras at arm's
/// length is a few millimetres.
pub const FREE_SPACE_MARGIN: f64 = 0.008;
/// Depths of pixels up to this many columns and rows away count as seen there: edges in depth pictures are that uncertain [px].
pub const FREE_SPACE_PIXELS: u32 = 3;

/// Share of a mesh's area that lies in seen space. Each triangle is judged at its centroid and weighs by its area. A centroid is in
/// seen space where it lies more than [`FREE_SPACE_MARGIN`] in front of every depth within [`FREE_SPACE_PIXELS`] columns and rows of
/// the pixel that it projects to. If none of these pixels has a value, or the pixel is outside the picture, the space is
/// unobserved.
///
/// The mesh is in `CameraCv` [m]. `depth` is the whole picture [m], shape (height, width), row-major; NaN is unknown, such as a
/// lost return, and infinity is empty space. 0 for a mesh without area.
///
/// # Panics
/// If the picture's size is not the camera's.
pub fn free_space_violation(mesh: &TriMesh, camera: &Intrinsics, depth: &[f32]) -> f64 {
    assert_eq!(depth.len(), camera.width as usize * camera.height as usize, "a depth per pixel");
    let (mut whole, mut in_front) = (0.0, 0.0);
    for index in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(index);
        let area = 0.5 * (b - a).cross(&(c - a)).norm();
        let centroid = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        whole += area;
        if is_in_seen_space(&centroid, camera, depth) {
            in_front += area;
        }
    }
    if whole > 0.0 { in_front / whole } else { 0.0 }
}

fn is_in_seen_space(point: &Point3<f64>, camera: &Intrinsics, depth: &[f32]) -> bool {
    let (u, v) = camera.project(point);
    let is_inside = (0.0..f64::from(camera.width)).contains(&u) && (0.0..f64::from(camera.height)).contains(&v);
    if point.z <= 0.0 || !is_inside {
        return false;
    }
    let columns = pixels_around(u, camera.width);
    let around = pixels_around(v, camera.height).flat_map(|row| columns.clone().map(move |column| (row, column)));
    let depths = around.map(|(row, column)| f64::from(depth[(row * camera.width + column) as usize]));
    let nearest = depths.filter(|depth| !depth.is_nan()).reduce(f64::min);
    nearest.is_some_and(|nearest| point.z + FREE_SPACE_MARGIN < nearest)
}

/// Columns or rows around that of a coordinate inside of the picture.
fn pixels_around(coordinate: f64, side: u32) -> RangeInclusive<u32> {
    let middle = coordinate as u32;
    middle.saturating_sub(FREE_SPACE_PIXELS)..=(middle + FREE_SPACE_PIXELS).min(side - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle of 0.03 mm2 around each point.
    fn specks(points: &[[f64; 3]]) -> TriMesh {
        let mut mesh = TriMesh::default();
        for [x, y, z] in points {
            let first = mesh.vertices.len() as u32;
            for [dx, dy] in [[-1e-4, -1e-4], [1e-4, -1e-4], [0.0, 2e-4]] {
                mesh.vertices.push([(x + dx) as f32, (y + dy) as f32, *z as f32]);
            }
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        mesh
    }

    #[test]
    fn only_what_lies_well_before_everything_seen_around_it_counts() {
        let camera = Intrinsics { width: 40, height: 30, fx: 40.0, fy: 40.0, cx: 20.0, cy: 15.0, near: 0.1 };
        // A wall at 1 m; the right half of the picture has no return.
        let depth: Vec<f32> = (0..1200).map(|pixel| if pixel % 40 < 20 { 1.0 } else { f32::NAN }).collect();
        let of_camera = |points: &[[f64; 3]]| free_space_violation(&specks(points), &camera, &depth);
        assert_eq!(of_camera(&[]), 0.0);
        assert_eq!(of_camera(&[[-0.2, 0.0, 0.991]]), 1.0);
        assert_eq!(of_camera(&[[-0.2, 0.0, 0.993]]), 0.0, "within the margin");
        // Behind the wall, where nothing was measured, beside the picture, behind the camera.
        for point in [[-0.2, 0.0, 1.5], [0.2, 0.0, 0.5], [-9.0, 0.0, 0.9], [0.2, 0.0, -1.0]] {
            assert_eq!(of_camera(&[point]), 0.0, "{point:?}");
        }
        assert!((of_camera(&[[-0.2, 0.0, 0.5], [0.2, 0.0, 0.5]]) - 0.5).abs() < 1e-6, "shares are those of areas");
        // Three columns beside the wall its depth counts, four columns beside it does not.
        let beside = |columns: f64| [(columns - 0.5) / 40.0 * 0.9, 0.0, 0.9];
        assert_eq!([of_camera(&[beside(3.0)]), of_camera(&[beside(4.0)])], [1.0, 0.0]);
        // Where nothing is there, all is seen space but what is near the wall and behind it.
        let seen_through: Vec<f32> =
            depth.iter().map(|depth| if depth.is_nan() { f32::INFINITY } else { *depth }).collect();
        let of_perfect = |points: &[[f64; 3]]| free_space_violation(&specks(points), &camera, &seen_through);
        assert_eq!([of_perfect(&[[0.2, 0.0, 0.5]]), of_perfect(&[[2.0, 0.0, 5.0]])], [1.0, 1.0]);
        assert_eq!(of_perfect(&[[0.03, 0.0, 1.2]]), 0.0, "one column beside the wall, behind it");
    }
}
