//! The partial point cloud.

use crate::geom::{DepthCrop, Intrinsics};

/// Writes the points seen by a depth crop to `out`, in `CameraCv` [m]: shape (returns, 3), pixels row by row, those
/// without a return left out.
pub fn point_cloud(camera: &Intrinsics, crop: &DepthCrop, out: &mut Vec<[f32; 3]>) {
    out.clear();
    let rows = crop.depth.chunks_exact(crop.width.max(1) as usize);
    for (row, depths) in rows.enumerate() {
        let v = f64::from(crop.top) + row as f64 + 0.5;
        for (column, depth) in depths.iter().enumerate().filter(|(_, depth)| !depth.is_nan()) {
            let u = f64::from(crop.left) + column as f64 + 0.5;
            let point = camera.unproject(u, v, f64::from(*depth));
            out.push([point.x as f32, point.y as f32, *depth]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_on_the_ray_of_their_pixel_in_row_order() {
        let camera = Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.1).expect("a camera");
        let crop =
            DepthCrop { left: 100, top: 50, width: 3, height: 2, depth: vec![1.0, f32::NAN, 1.25, 0.5, 2.0, f32::NAN] };
        let mut cloud = vec![[9.0; 3]];
        point_cloud(&camera, &crop, &mut cloud);
        let expected = [(100.5, 50.5, 1.0), (102.5, 50.5, 1.25), (100.5, 51.5, 0.5), (101.5, 51.5, 2.0)];
        assert_eq!(cloud.len(), expected.len());
        for (point, (u, v, z)) in cloud.iter().zip(expected) {
            let (seen_u, seen_v) = camera.project(&nalgebra::Point3::from(point.map(f64::from)));
            assert!((seen_u - u).abs() < 1e-4 && (seen_v - v).abs() < 1e-4, "{point:?}");
            assert_eq!(f64::from(point[2]), z);
        }
        point_cloud(&camera, &DepthCrop::default(), &mut cloud);
        assert!(cloud.is_empty());
    }
}
