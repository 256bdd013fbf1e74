//! `preview.mcap`: a few samples in Foxglove's well-known schemas, which Foxglove and Rerun open without code.

use std::{
    collections::BTreeMap,
    io::{BufWriter, Seek},
    path::{Path, PathBuf},
};

use mcap::{Compression, WriteOptions, records::MessageHeader};
use nalgebra::{Point3, UnitQuaternion};
use prost::Message;

use super::{DatasetError, DatasetReader, Selection, durable::Temporary};
use crate::{
    geom::{DepthCrop, Frame, GridPlacement, Intrinsics, OccupancyGrid, Pose},
    ids::SampleIndex,
    record::{Channel, TouchContact, VoxelPair},
};

#[expect(clippy::enum_variant_names, reason = "Foxglove's names")]
pub(super) mod foxglove {
    include!(concat!(env!("OUT_DIR"), "/foxglove.rs"));
}
pub(super) mod google {
    pub mod protobuf {
        include!(concat!(env!("OUT_DIR"), "/google.protobuf.rs"));
    }
}
pub(super) use super::layout::PREVIEW;
use foxglove::{
    ArrowPrimitive, CameraCalibration, Color, FrameTransform, PackedElementField, PointCloud, Quaternion, RawImage,
    SceneEntity, SceneUpdate, Vector3,
};
use google::protobuf::Timestamp;

/// One sample of a preview.
#[derive(Clone, Debug, PartialEq)]
pub struct PreviewSample {
    /// Grids, camera and poses.
    pub pair: VoxelPair,
    /// The depth image that the pair came from, where it is stored or was made again.
    pub depth: Option<DepthCrop>,
    /// Where the object was touched, by kind, where that is stored.
    pub touch: Vec<(Channel, Vec<TouchContact>)>,
}

/// `count` kept samples spread over a dataset, with the stored depth where there is any.
///
/// # Errors
/// When a shard is missing or damaged.
pub fn preview_samples(reader: &DatasetReader, count: u32) -> Result<Vec<PreviewSample>, DatasetError> {
    let kept: Vec<SampleIndex> = reader.indices(Selection::default()).collect();
    let count = (count as usize).min(kept.len());
    let mut samples = Vec::with_capacity(count);
    for place in 0..count {
        // The middle of each of `count` equal runs.
        if let Some(sample) = reader.sample(kept[(2 * place + 1) * kept.len() / (2 * count)])? {
            let touch = sample.touch()?.into_iter().map(|(channel, touch)| (channel, touch.contacts)).collect();
            samples.push(PreviewSample { pair: sample.pair()?, depth: sample.depth()?.map(|depth| depth.crop), touch });
        }
    }
    Ok(samples)
}

/// Writes `preview.mcap` into a folder: sample k at k seconds, on the topics `/preview/partial`, `/preview/complete`
/// (cell centres, in the camera's frame), `/preview/touch` where touch is stored (an arrow along the normal at each contact,
/// one entity a kind: of rays green, or orange where the camera sees it; of a hand's exploration blue, of its grasp purple,
/// paler where the camera sees it), `/preview/depth` (16 bit, millimetres), `/preview/camera` and `/preview/tf`
/// (world -> camera, world -> object).
///
/// # Errors
/// When the file can't be written.
pub fn write_preview(folder: &Path, samples: &[PreviewSample]) -> Result<PathBuf, DatasetError> {
    let (file, temporary) = Temporary::create(folder, PREVIEW)?;
    let path = temporary.path().to_owned();
    let mut buffer = BufWriter::new(&file);
    write_messages(&mut buffer, samples).map_err(DatasetError::mcap("writing", &path))?;
    buffer.into_inner().map_err(|error| DatasetError::io("writing", &path)(error.into_error()))?;
    temporary.publish(&file, folder, PREVIEW)
}

/// Messages of well-known schemas on their way to a file.
pub(super) struct Preview<W: std::io::Write + Seek> {
    writer: mcap::Writer<W>,
    descriptors: &'static [u8],
    channels: BTreeMap<&'static str, u16>,
}

impl<W: std::io::Write + Seek> Preview<W> {
    /// Begins a file whose schemas stand in this descriptor set.
    pub(super) fn create(file: W, descriptors: &'static [u8]) -> mcap::McapResult<Self> {
        let writer = WriteOptions::new()
            .compression(Some(Compression::Zstd))
            .compression_level(3)
            .compression_threads(0)
            .library("graspmill format 1")
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

fn write_messages(file: impl std::io::Write + Seek, samples: &[PreviewSample]) -> mcap::McapResult<()> {
    // Previews without touch carry the schema, and keep the bytes, that they had before there was any.
    let touched = samples.iter().flat_map(|sample| &sample.touch).any(|(_, contacts)| !contacts.is_empty());
    let (plain, scene): (&[u8], &[u8]) = (
        include_bytes!(concat!(env!("OUT_DIR"), "/foxglove.bin")),
        include_bytes!(concat!(env!("OUT_DIR"), "/foxglove_scene.bin")),
    );
    let mut preview = Preview::create(file, if touched { scene } else { plain })?;
    for (second, PreviewSample { pair, depth, touch }) in (0..).zip(samples) {
        let time = Some(Timestamp { seconds: second as i64, nanos: 0 });
        preview.write(
            second,
            "/preview/tf",
            "foxglove.FrameTransform",
            &transform(time, &pair.world_from_camera, "camera"),
        )?;
        preview.write(
            second,
            "/preview/tf",
            "foxglove.FrameTransform",
            &transform(time, &pair.world_from_object, "object"),
        )?;
        preview.write(second, "/preview/camera", "foxglove.CameraCalibration", &calibration(time, &pair.camera))?;
        if let Some(depth) = depth {
            preview.write(
                second,
                "/preview/depth",
                "foxglove.RawImage",
                &image(time, [pair.camera.width, pair.camera.height], |column, row| depth.at(column, row)),
            )?;
        }
        preview.write(second, "/preview/partial", "foxglove.PointCloud", &cloud(time, &pair.grid, &pair.partial))?;
        preview.write(second, "/preview/complete", "foxglove.PointCloud", &cloud(time, &pair.grid, &pair.complete))?;
        if touched {
            preview.write(second, "/preview/touch", "foxglove.SceneUpdate", &arrows(time, &pair.grid, touch))?;
        }
    }
    preview.finish()
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

pub(super) fn calibration(time: Option<Timestamp>, camera: &Intrinsics) -> CameraCalibration {
    let (fx, fy, cx, cy) = (camera.fx, camera.fy, camera.cx, camera.cy);
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

/// An arrow at each contact, three cells long; each kind is an entity, which takes the place of the sample's before.
fn arrows(time: Option<Timestamp>, grid: &GridPlacement, touch: &[(Channel, Vec<TouchContact>)]) -> SceneUpdate {
    let entities = touch.iter().map(|(channel, contacts)| entity(time, grid, *channel, contacts)).collect();
    SceneUpdate { entities, ..SceneUpdate::default() }
}

fn entity(time: Option<Timestamp>, grid: &GridPlacement, channel: Channel, contacts: &[TouchContact]) -> SceneEntity {
    let arrows = contacts.iter().map(|contact| {
        let pale = if contact.visible { 0.4 } else { 1.0 };
        let color = match (channel, contact.visible) {
            (Channel::TouchExploration, _) => Color { r: 0.34, g: 0.71, b: 0.91, a: pale },
            (Channel::TouchGrasp, _) => Color { r: 0.8, g: 0.47, b: 0.65, a: pale },
            (_, false) => Color { r: 0.0, g: 0.62, b: 0.45, a: 1.0 },
            (_, true) => Color { r: 0.84, g: 0.37, b: 0.0, a: 1.0 },
        };
        let [position, normal] = [contact.position, contact.normal].map(|v| nalgebra::Vector3::from(v.map(f64::from)));
        arrow(&position, &normal, 3.0 * grid.cell_size, color)
    });
    SceneEntity {
        timestamp: time,
        frame_id: "camera".to_owned(),
        // Rays keep the name that they had alone.
        id: if channel == Channel::TouchRays { "touch" } else { channel.name() }.to_owned(),
        arrows: arrows.collect(),
        ..SceneEntity::default()
    }
}

/// It begins at a place and points along x of its pose.
pub(super) fn arrow(
    at: &nalgebra::Vector3<f64>,
    direction: &nalgebra::Vector3<f64>,
    length: f64,
    color: Color,
) -> ArrowPrimitive {
    // Straight back: any half turn will do.
    let turn = UnitQuaternion::rotation_between(&nalgebra::Vector3::x(), direction)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&nalgebra::Vector3::z_axis(), std::f64::consts::PI));
    let (turn, place) = (turn.coords, Vector3 { x: at.x, y: at.y, z: at.z });
    let orientation = Quaternion { x: turn.x, y: turn.y, z: turn.z, w: turn.w };
    ArrowPrimitive {
        pose: Some(foxglove::Pose { position: Some(place), orientation: Some(orientation) }),
        shaft_length: 0.65 * length,
        shaft_diameter: 0.08 * length,
        head_length: 0.35 * length,
        head_diameter: 0.22 * length,
        color: Some(color),
    }
}

/// Centres of the occupied cells, in the camera's frame.
fn cloud(time: Option<Timestamp>, grid: &GridPlacement, cells: &OccupancyGrid) -> PointCloud {
    let lower = grid.lower_corner();
    let centre = |cell: [u32; 3]| -> Point3<f64> {
        lower + nalgebra::Vector3::from(cell.map(|c| (f64::from(c) + 0.5) * grid.cell_size))
    };
    let float = foxglove::packed_element_field::NumericType::Float32 as i32;
    let fields = (["x", "y", "z"].into_iter().zip([0, 4, 8]))
        .map(|(name, offset)| PackedElementField { name: name.to_owned(), offset, r#type: float })
        .collect();
    PointCloud {
        timestamp: time,
        frame_id: "camera".to_owned(),
        pose: Some(foxglove::Pose {
            position: Some(Vector3::default()),
            orientation: Some(Quaternion { w: 1.0, ..Quaternion::default() }),
        }),
        point_stride: 12,
        fields,
        data: cells
            .cells()
            .flat_map(|cell| centre(cell).coords.map(|c| c as f32).data.0[0])
            .flat_map(f32::to_le_bytes)
            .collect(),
    }
}
