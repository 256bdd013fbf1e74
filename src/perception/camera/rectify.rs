//! Lens distortion undone: Brown's model with three radial and two tangential terms, as OpenCV has it (plumb bob).

/// The picture that the same camera would take without distortion, each pixel by its ray: what was measured where the distorted
/// ray meets the sensor, NaN where that is outside.
///
/// The measured number stays: depth along the axis does not depend on the pixel that holds it.
pub(crate) fn rectified(
    values: &[f32],
    [width, height]: [u32; 2],
    [fx, fy, cx, cy]: [f64; 4],
    distortion: [f64; 5],
) -> Vec<f32> {
    let [k1, k2, p1, p2, k3] = distortion;
    let value = |pixel: u32| {
        let (u, v) = (f64::from(pixel % width) + 0.5, f64::from(pixel / width) + 0.5);
        let (x, y) = ((u - cx) / fx, (v - cy) / fy);
        let square = x * x + y * y;
        // Past the radius where the model folds back, no ray reaches the sensor.
        let slope = 1.0 + square * (3.0 * k1 + square * (5.0 * k2 + square * 7.0 * k3));
        let radial = 1.0 + square * (k1 + square * (k2 + square * k3));
        let distorted_x = x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x);
        let distorted_y = y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y;
        let (u, v) = (fx * distorted_x + cx, fy * distorted_y + cy);
        let is_inside = (0.0..f64::from(width)).contains(&u) && (0.0..f64::from(height)).contains(&v);
        if slope > 0.0 && is_inside { values[v as usize * width as usize + u as usize] } else { f32::NAN }
    };
    (0..width * height).map(value).collect()
}
