//! `preview.mcap` of a dataset of heatmaps.

use std::path::PathBuf;

use super::{
    Preview, calibration, cloud::coloured_cloud, google::protobuf::Timestamp, image, previewed, transform, write_file,
};
use crate::{pick_colours::state_colour, picture::Colour};
use format::{
    Depth, SceneHeatmap,
    dataset::{DatasetError, DatasetReader},
};

/// Writes `preview.mcap` into the folder of a dataset: image k at k seconds, some of them spread over the dataset, on
/// `/preview/tf` (world -> camera), `/preview/camera`, `/preview/depth` (16 bit, millimetres) and `/preview/points`: palms and
/// fingertips of the free grasps in the world, green where a grasp held, red where it failed, else blue, with the label and the
/// number of the point in the hand.
///
/// # Errors
/// When a shard is missing or damaged, or the file cannot be written.
pub fn write_heatmap_preview(reader: &DatasetReader) -> Result<PathBuf, DatasetError> {
    let mut images = Vec::new();
    for sample in previewed(reader)? {
        if let Some(depth) = sample.find::<Depth>()? {
            images.push((sample.read::<SceneHeatmap>()?, depth));
        }
    }
    write_file(reader.folder(), |file| write_messages(file, &images))
}

fn write_messages(file: impl std::io::Write + std::io::Seek, images: &[(SceneHeatmap, Depth)]) -> mcap::McapResult<()> {
    let mut preview = Preview::create(file, include_bytes!("../generated/foxglove.bin"))?;
    for (second, (heatmap, depth)) in (0..).zip(images) {
        let time = Some(Timestamp { seconds: second as i64, nanos: 0 });
        let pose = transform(time, &heatmap.world_from_camera, "camera");
        preview.write(second, "/preview/tf", "foxglove.FrameTransform", &pose)?;
        preview.write(second, "/preview/camera", "foxglove.CameraCalibration", &calibration(time, &heatmap.camera))?;
        let size = [heatmap.camera.width, heatmap.camera.height];
        let metres = image(time, size, |column, row| depth.crop.at(column, row));
        preview.write(second, "/preview/depth", "foxglove.RawImage", &metres)?;
        let names = ["x", "y", "z", "label", "point"];
        let cloud = coloured_cloud(time, "world", &names, points(heatmap));
        preview.write(second, "/preview/points", "foxglove.PointCloud", &cloud)?;
    }
    preview.finish()
}

/// Positions, labels and numbers of the points of all free grasps, with their colours.
fn points(heatmap: &SceneHeatmap) -> Vec<u8> {
    let mut data = Vec::new();
    for grasp in &heatmap.grasps {
        let Colour([red, green, blue]) = state_colour(grasp.state);
        for (index, point) in grasp.points.iter().enumerate() {
            let [x, y, z] = point.point.map(|value| value as f32);
            data.extend(
                [x, y, z, grasp.value, index as f32]
                    .into_iter()
                    .flat_map(f32::to_le_bytes)
                    .chain([red, green, blue, 255]),
            );
        }
    }
    data
}
