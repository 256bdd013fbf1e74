//! A picture of what was found.

use crate::{clusters::Cluster, frame::DepthFrame, labels::LabelImage};

/// Colours of clusters, told apart by most eyes (Okabe and Ito 2008); repeated after the eighth.
const COLOURS: [[u8; 3]; 7] =
    [[230, 159, 0], [86, 180, 233], [0, 158, 115], [240, 228, 66], [0, 114, 178], [213, 94, 0], [204, 121, 167]];

/// The colour of a cluster by its index.
pub fn cluster_colour(index: usize) -> [u8; 3] {
    COLOURS[index % COLOURS.len()]
}

/// The picture of [`outline_pixels`] as a PNG file.
pub fn draw_outlines(frame: &DepthFrame, clusters: &[Cluster]) -> Vec<u8> {
    let (width, height) = (frame.camera.width, frame.camera.height);
    let pixels = outline_pixels(frame, clusters);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder
        .write_header()
        .and_then(|mut writer| {
            writer.write_image_data(pixels.as_flattened())?;
            writer.finish()
        })
        .expect("memory takes every byte, and the image is complete");
    bytes
}

/// The given picture's depth as grey, near is bright, with each cluster tinted and outlined. Shape (height, width), row-major.
pub fn outline_pixels(frame: &DepthFrame, clusters: &[Cluster]) -> Vec<[u8; 3]> {
    let (width, height) = (frame.camera.width, frame.camera.height);
    let measured = frame.measured();
    let mut depths: Vec<f32> = measured.iter().copied().filter(|depth| !depth.is_nan()).collect();
    depths.sort_by(f32::total_cmp);
    // From the nearest to what all but a twentieth are nearer than.
    let near = depths.first().copied().unwrap_or(0.0);
    let far = depths.get(depths.len() * 19 / 20).copied().unwrap_or(1.0).max(near + 1e-3);
    let LabelImage { labels, .. } = LabelImage::of_clusters(frame, clusters);
    let is_rim = |pixel: usize| {
        let (column, row) = (pixel as u32 % width, pixel as u32 / width);
        let beside = [(column > 0, pixel.wrapping_sub(1)), (column + 1 < width, pixel + 1)];
        let above = [(row > 0, pixel.wrapping_sub(width as usize)), (row + 1 < height, pixel + width as usize)];
        beside.into_iter().chain(above).any(|(exists, other)| !exists || labels[other] != labels[pixel])
    };
    let tint = |(pixel, depth): (usize, &f32)| {
        let share = 1.0 - ((depth - near) / (far - near)).clamp(0.0, 1.0);
        let grey = if depth.is_nan() { 0.0 } else { 40.0 + 180.0 * share };
        let colour = labels[pixel].checked_sub(1).map(|index| cluster_colour(usize::from(index)));
        match colour {
            Some(colour) if is_rim(pixel) => colour,
            Some(colour) => colour.map(|value| (0.6 * grey + 0.4 * f32::from(value)) as u8),
            None => [grey as u8; 3],
        }
    };
    measured.iter().enumerate().map(tint).collect()
}
