//! `preview.mcap`: a few samples, or a map, in Foxglove's well-known schemas, which Foxglove and Rerun open without code.

mod cloud;
mod grasps;
mod heatmaps;
mod map;
mod pairs;
mod patches;
mod picks;
mod scenes;
mod suction;
mod views;
mod volumes;

pub use grasps::write_grasp_preview;
pub use heatmaps::write_heatmap_preview;
pub use map::write_map_preview;
pub use pairs::{PreviewSample, preview_samples, write_preview};
pub use patches::write_patch_preview;
pub use picks::write_pick_preview;
pub use scenes::write_scene_preview;
pub use suction::write_suction_preview;
pub use views::write_view_preview;
pub use volumes::write_volume_preview;

use std::{
    collections::BTreeMap,
    fs::File,
    io::{BufWriter, Seek},
    path::PathBuf,
};

use mcap::{Compression, WriteOptions, records::MessageHeader};
use nalgebra::UnitQuaternion;
use prost::Message;

use crate::inspection::evenly;
use format::dataset::{DatasetError, DatasetReader, Sample, Selection, TemporaryFile, layout::PREVIEW};
use foxglove::{ArrowPrimitive, CameraCalibration, Color, FrameTransform, Quaternion, RawImage, Vector3};
use google::protobuf::Timestamp;
use kernel::{
    files::Folder,
    geom::{Frame, Intrinsics, Pose},
    ids::SampleIndex,
    render::DepthError,
};

/// Samples or objects in a preview, at most.
pub const PREVIEWED: usize = 12;

/// Reason why a preview was not written.
#[derive(Debug, thiserror::Error)]
pub enum PreviewError {
    /// The dataset cannot be read, or the file cannot be written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A depth image could not be made again.
    #[error("{0}")]
    Depth(#[source] DepthError),
}

#[expect(clippy::enum_variant_names, reason = "Foxglove's names")]
pub(super) mod foxglove {
    include!("../generated/foxglove.rs");
}
pub(super) mod google {
    pub mod protobuf {
        include!("../generated/google.protobuf.rs");
    }
}

/// Writes `preview.mcap` into a folder, whole or not at all, out of what `write` writes.
fn write_file(
    folder: &Folder,
    write: impl FnOnce(&mut BufWriter<&File>) -> mcap::McapResult<()>,
) -> Result<PathBuf, DatasetError> {
    let (file, temporary) = TemporaryFile::create(folder, PREVIEW)?;
    let path = temporary.path();
    let mut buffer = BufWriter::new(&file);
    write(&mut buffer).map_err(DatasetError::mcap("writing", &path))?;
    buffer.into_inner().map_err(|error| DatasetError::io("writing", &path)(error.into_error()))?;
    temporary.publish(&file, PREVIEW)
}

/// Kept samples of a dataset, spread over it, that its preview shows.
fn previewed(reader: &DatasetReader) -> Result<Vec<Sample>, DatasetError> {
    let kept: Vec<SampleIndex> = reader.indices(Selection::default()).collect();
    evenly(&kept, PREVIEWED).into_iter().filter_map(|index| reader.sample(index).transpose()).collect()
}

/// Messages of well-known schemas on their way to a file.
pub(super) struct Preview<W: std::io::Write + Seek> {
    writer: mcap::Writer<W>,
    descriptors: &'static [u8],
    channels: BTreeMap<&'static str, u16>,
}

impl<W: std::io::Write + Seek> Preview<W> {
    /// Creates a file whose schemas are in this descriptor set.
    pub(super) fn create(file: W, descriptors: &'static [u8]) -> mcap::McapResult<Self> {
        let writer = WriteOptions::new()
            .compression(Some(Compression::Zstd))
            .compression_level(3)
            .compression_threads(0)
            .library("graspmill format 4")
            .create(file)?;
        Ok(Self { writer, descriptors, channels: BTreeMap::new() })
    }

    pub(super) fn finish(mut self) -> mcap::McapResult<()> {
        self.writer.finish().map(|_| ())
    }

    /// Writes a message at a second of the preview's clock.
    pub(super) fn write(
        &mut self,
        second: u64,
        topic: &'static str,
        schema: &str,
        message: &impl Message,
    ) -> mcap::McapResult<()> {
        let channel_id = match self.channels.get(topic) {
            Some(id) => *id,
            None => {
                let schema = self.writer.add_schema(schema, "protobuf", self.descriptors)?;
                let id = self.writer.add_channel(schema, topic, "protobuf", &BTreeMap::new())?;
                self.channels.insert(topic, id);
                id
            }
        };
        let log_time = second * 1_000_000_000;
        let header = MessageHeader { channel_id, sequence: second as u32, log_time, publish_time: log_time };
        self.writer.write_to_known_channel(&header, &message.encode_to_vec())
    }
}

pub(super) fn transform<To: Frame, From: Frame>(
    time: Option<Timestamp>,
    pose: &Pose<To, From>,
    child: &str,
) -> FrameTransform {
    let rotation = UnitQuaternion::from_rotation_matrix(pose.rotation());
    let (at, q) = (pose.translation(), rotation.coords);
    FrameTransform {
        timestamp: time,
        parent_frame_id: To::NAME.to_owned(),
        child_frame_id: child.to_owned(),
        translation: Some(Vector3 { x: at.x, y: at.y, z: at.z }),
        rotation: Some(Quaternion { x: q.x, y: q.y, z: q.z, w: q.w }),
    }
}

/// A camera as Foxglove has it: as in ROS, whole columns and rows are pixel centres.
pub(super) fn calibration(time: Option<Timestamp>, camera: &Intrinsics) -> CameraCalibration {
    let (fx, fy, cx, cy) = (camera.fx, camera.fy, camera.cx - 0.5, camera.cy - 0.5);
    CameraCalibration {
        timestamp: time,
        width: camera.width,
        height: camera.height,
        distortion_model: "plumb_bob".to_owned(),
        d: vec![0.0; 5],
        k: vec![fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: vec![fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        frame_id: "camera".to_owned(),
    }
}

/// An image of this width and height in millimetres, 0 = no return, of depths at its columns and rows [m].
pub(super) fn image(time: Option<Timestamp>, [width, height]: [u32; 2], depth: impl Fn(u32, u32) -> f32) -> RawImage {
    let pixels = (0..height).flat_map(|row| (0..width).map(move |column| [column, row]));
    let pixels = pixels.map(|[column, row]| depth(column, row));
    // A saturating cast: NaN becomes 0.
    let data = pixels.flat_map(|depth| ((depth * 1000.0 + 0.5) as u16).to_le_bytes()).collect();
    RawImage {
        timestamp: time,
        width,
        height,
        encoding: "16UC1".to_owned(),
        step: 2 * width,
        data,
        frame_id: "camera".to_owned(),
    }
}

/// Arrow that begins at a position and points along x of its pose.
pub(super) fn arrow(
    at: &nalgebra::Vector3<f64>,
    direction: &nalgebra::Vector3<f64>,
    length: f64,
    color: Color,
) -> ArrowPrimitive {
    // Straight back: any half revolution will do.
    let rotation = UnitQuaternion::rotation_between(&nalgebra::Vector3::x(), direction)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&nalgebra::Vector3::z_axis(), std::f64::consts::PI));
    let (rotation, position) = (rotation.coords, Vector3 { x: at.x, y: at.y, z: at.z });
    let orientation = Quaternion { x: rotation.x, y: rotation.y, z: rotation.z, w: rotation.w };
    ArrowPrimitive {
        pose: Some(foxglove::Pose { position: Some(position), orientation: Some(orientation) }),
        shaft_length: 0.65 * length,
        shaft_diameter: 0.08 * length,
        head_length: 0.35 * length,
        head_diameter: 0.22 * length,
        color: Some(color),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_viewer_s_ray_through_a_whole_pixel_is_that_of_its_centre() {
        let camera = Intrinsics { width: 64, height: 48, fx: 60.0, fy: 61.0, cx: 31.5, cy: 24.25, near: 0.1 };
        let CameraCalibration { k, p, .. } = calibration(None, &camera);
        for [column, row] in [[0.0, 0.0], [63.0, 0.0], [17.0, 40.0]] {
            // As image_geometry of ROS makes rays of pixels.
            let ray = [(column - k[2]) / k[0], (row - k[5]) / k[4]];
            let point = camera.unproject(column + 0.5, row + 0.5, 1.0);
            assert!((ray[0] - point.x).abs() < 1e-12 && (ray[1] - point.y).abs() < 1e-12, "{ray:?} {point}");
        }
        assert_eq!([p[0], p[2], p[5], p[6]], [k[0], k[2], k[4], k[5]]);
    }
}
