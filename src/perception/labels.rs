//! Which object each pixel of the given picture shows.

use std::collections::BTreeMap;

use crate::{clusters::Cluster, frame::DepthFrame, plane::Plane, sheet::JUMP};

/// Label of the objects' support plane.
pub const PLANE_LABEL: u16 = u16::MAX;
/// Label of a container's walls and rim.
pub const CONTAINER_LABEL: u16 = PLANE_LABEL - 1;
/// Most objects that labels can count.
pub const MAX_OBJECTS: usize = CONTAINER_LABEL as usize - 1;

/// A label for each pixel of the picture that was given, whatever its lens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelImage {
    /// Width [px].
    pub width: u32,
    /// Height [px].
    pub height: u32,
    /// 0 for no object, n for the n-th, [`PLANE_LABEL`] for the plane, [`CONTAINER_LABEL`] for a container. Shape (height, width), row-major.
    pub labels: Vec<u16>,
}

/// Pixels of one label in the given picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelExtent {
    /// Count of the pixels.
    pub pixels: usize,
    /// Left column, top row, right column and bottom row, the last included.
    pub bounds: [u32; 4],
    /// Mean column and row; whole numbers are pixel centres.
    pub mean: [f64; 2],
}

impl LabelImage {
    /// Labels of clusters alone; those after [`MAX_OBJECTS`] have none.
    pub fn of_clusters(frame: &DepthFrame, clusters: &[Cluster]) -> Self {
        Self::in_given(frame, &owners(frame, clusters))
    }

    /// Labels of clusters; where no cluster is, those of the container's pixels, and of the plane: pixels whose points lie within
    /// `reach` of it [m].
    pub(crate) fn of_scene(
        frame: &DepthFrame,
        clusters: &[Cluster],
        container: &[u32],
        plane: Option<&Plane>,
        reach: f64,
    ) -> Self {
        let mut labels = owners(frame, clusters);
        for pixel in container {
            let label = &mut labels[*pixel as usize];
            *label = if *label == 0 { CONTAINER_LABEL } else { *label };
        }
        if let Some(plane) = plane {
            for pixel in frame.returns().filter(|pixel| plane.height(&frame.point(*pixel)).abs() <= reach) {
                let label = &mut labels[pixel as usize];
                *label = if *label == 0 { PLANE_LABEL } else { *label };
            }
        }
        Self::in_given(frame, &labels)
    }

    fn in_given(frame: &DepthFrame, labels: &[u16]) -> Self {
        let labels = match &frame.rectification {
            Some(rectification) => rectification.labels_in_given(labels, |pixel| JUMP * frame.footprint(pixel)),
            None => labels.to_vec(),
        };
        Self { width: frame.camera.width, height: frame.camera.height, labels }
    }

    /// The label at a column and a row; `None` outside of the picture.
    pub fn at(&self, column: u32, row: u32) -> Option<u16> {
        let is_inside = column < self.width && row < self.height;
        is_inside.then(|| self.labels[row as usize * self.width as usize + column as usize])
    }

    /// The pixels of each label but 0.
    pub fn extents(&self) -> BTreeMap<u16, LabelExtent> {
        let mut found: BTreeMap<u16, LabelExtent> = BTreeMap::new();
        for (pixel, label) in (0..).zip(&self.labels).filter(|(_, label)| **label != 0) {
            let (column, row) = (pixel % self.width, pixel / self.width);
            let first = LabelExtent { pixels: 0, bounds: [column, row, column, row], mean: [0.0; 2] };
            let extent = found.entry(*label).or_insert(first);
            let [left, top, right, bottom] = extent.bounds;
            extent.pixels += 1;
            extent.bounds = [column.min(left), row.min(top), column.max(right), row.max(bottom)];
            // Sums, until all pixels are counted.
            extent.mean = [extent.mean[0] + f64::from(column), extent.mean[1] + f64::from(row)];
        }
        for LabelExtent { pixels, mean, .. } in found.values_mut() {
            *mean = mean.map(|sum| sum / *pixels as f64);
        }
        found
    }

    /// The labels as a grey PNG of 16 bits.
    pub fn to_png(&self) -> Vec<u8> {
        let data: Vec<u8> = self.labels.iter().flat_map(|label| label.to_be_bytes()).collect();
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        encoder
            .write_header()
            .and_then(|mut writer| {
                writer.write_image_data(&data)?;
                writer.finish()
            })
            .expect("memory takes every byte, and the image is complete");
        bytes
    }
}

/// The number of the cluster that each pixel of the picture without distortion belongs to, from 1.
fn owners(frame: &DepthFrame, clusters: &[Cluster]) -> Vec<u16> {
    let mut labels = vec![0; frame.depth.len()];
    for (label, cluster) in (1..CONTAINER_LABEL).zip(clusters) {
        cluster.pixels.iter().for_each(|pixel| labels[*pixel as usize] = label);
    }
    labels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_label_has_its_count_bounds_and_mean() {
        let labels = LabelImage { width: 4, height: 3, labels: vec![0, 2, 2, 0, 0, 2, 0, 0, PLANE_LABEL, 0, 0, 0] };
        let wanted = [
            (2, LabelExtent { pixels: 3, bounds: [1, 0, 2, 1], mean: [4.0 / 3.0, 1.0 / 3.0] }),
            (PLANE_LABEL, LabelExtent { pixels: 1, bounds: [0, 2, 0, 2], mean: [0.0, 2.0] }),
        ];
        assert_eq!(labels.extents(), wanted.into());
        assert_eq!([labels.at(2, 0), labels.at(4, 0), labels.at(0, 3)], [Some(2), None, None]);
    }
}
