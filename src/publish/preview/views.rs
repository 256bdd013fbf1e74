//! `preview.mcap` of a dataset of views.

use std::path::PathBuf;

use super::{Preview, calibration, google::protobuf::Timestamp, image, previewed, transform, write_file};
use format::{
    Depth, SceneImage,
    dataset::{DatasetError, DatasetReader},
};

/// Writes `preview.mcap` into the folder of a dataset: view k at k seconds, some of them spread over the dataset, on
/// `/preview/tf` (world -> camera), `/preview/camera`, `/preview/depth` (16 bit, millimetres) and `/preview/bodies` (16 bit, the
/// number of what is in front).
///
/// # Errors
/// When a shard is missing or damaged, or the file cannot be written.
pub fn write_view_preview(reader: &DatasetReader) -> Result<PathBuf, DatasetError> {
    let mut views = Vec::new();
    for sample in previewed(reader)? {
        if let Some(depth) = sample.find::<Depth>()? {
            views.push((sample.read::<SceneImage>()?, depth));
        }
    }
    write_file(reader.folder(), |file| write_messages(file, &views))
}

fn write_messages(file: impl std::io::Write + std::io::Seek, views: &[(SceneImage, Depth)]) -> mcap::McapResult<()> {
    let mut preview = Preview::create(file, include_bytes!("../generated/foxglove.bin"))?;
    for (second, (view, depth)) in (0..).zip(views) {
        let time = Some(Timestamp { seconds: second as i64, nanos: 0 });
        let size = [view.camera.width, view.camera.height];
        let pose = transform(time, &view.world_from_camera, "camera");
        preview.write(second, "/preview/tf", "foxglove.FrameTransform", &pose)?;
        preview.write(second, "/preview/camera", "foxglove.CameraCalibration", &calibration(time, &view.camera))?;
        let measured = image(time, size, |column, row| depth.crop.at(column, row));
        preview.write(second, "/preview/depth", "foxglove.RawImage", &measured)?;
        // Numbers as if they were millimetres.
        let number = |column: u32, row: u32| f32::from(view.instances[(row * size[0] + column) as usize]) / 1000.0;
        preview.write(second, "/preview/bodies", "foxglove.RawImage", &image(time, size, number))?;
    }
    preview.finish()
}
