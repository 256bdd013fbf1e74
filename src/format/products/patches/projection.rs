//! Where points are in an image.

use nalgebra::Point3;

use kernel::geom::Intrinsics;

/// Projection of a point in camera axes [px], inside the image or not; `None` if nearer than the camera's near limit.
pub fn projection(camera: &Intrinsics, seen: &Point3<f64>) -> Option<[f64; 2]> {
    let (u, v) = camera.project(seen);
    (seen.z >= camera.near).then_some([u, v])
}

/// Column and row of the pixel that holds a projection [px]; `None` outside the image.
pub fn pixel_in_image(camera: &Intrinsics, projection: [f64; 2]) -> Option<[u32; 2]> {
    let within = |value: f64, side: u32| (0.0..f64::from(side)).contains(&value);
    let [u, v] = projection;
    (within(u, camera.width) && within(v, camera.height)).then(|| projection.map(|value| value as u32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_holds_its_left_and_top_border() {
        let camera = Intrinsics { width: 64, height: 48, fx: 50.0, fy: 50.0, cx: 32.0, cy: 24.0, near: 0.1 };
        for (pixel, expected) in [
            ([0.0, 0.0], Some([0, 0])),
            ([63.999, 47.999], Some([63, 47])),
            ([64.0, 3.0], None),
            ([-1e-9, 3.0], None),
            ([f64::NAN, 3.0], None),
        ] {
            assert_eq!(pixel_in_image(&camera, pixel), expected);
        }
        assert_eq!(projection(&camera, &Point3::new(0.0, 0.0, 0.099)), None);
        assert_eq!(projection(&camera, &Point3::new(0.1, -0.2, 0.1)), Some([82.0, -76.0]));
    }
}
