//! `preview.mcap`: a few samples in Foxglove's well-known schemas, which Foxglove and Rerun open without code.

use std::{io::Seek, path::PathBuf};

use nalgebra::Point3;

use super::{
    Preview, arrow, calibration,
    foxglove::{self, Color, PackedElementField, PointCloud, Quaternion, SceneEntity, SceneUpdate, Vector3},
    google::protobuf::Timestamp,
    image, transform, write_file,
};
use format::{
    Channel, Depth, TouchContact, VoxelPair,
    dataset::{DatasetError, DatasetReader, Selection},
};
use kernel::{
    files::Folder,
    geom::{DepthCrop, GridPlacement, OccupancyGrid},
    ids::SampleIndex,
};

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
    for index in 0..count {
        // The middle of each of `count` equal runs.
        if let Some(sample) = reader.sample(kept[(2 * index + 1) * kept.len() / (2 * count)])? {
            let touch = sample.touch()?.into_iter().map(|(channel, touch)| (channel, touch.contacts)).collect();
            samples.push(PreviewSample {
                pair: sample.read::<VoxelPair>()?,
                depth: sample.find::<Depth>()?.map(|depth| depth.crop),
                touch,
            });
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
pub fn write_preview(folder: &Folder, samples: &[PreviewSample]) -> Result<PathBuf, DatasetError> {
    write_file(folder, |file| write_messages(file, samples))
}

fn write_messages(file: impl std::io::Write + Seek, samples: &[PreviewSample]) -> mcap::McapResult<()> {
    // Previews without touch carry the schema, and keep the bytes, that they had before there was any.
    let touched = samples.iter().flat_map(|sample| &sample.touch).any(|(_, contacts)| !contacts.is_empty());
    let (plain, scene): (&[u8], &[u8]) =
        (include_bytes!("../generated/foxglove.bin"), include_bytes!("../generated/foxglove_scene.bin"));
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

/// An arrow at each contact, three cells long; each kind is an entity, which takes the place of the sample's before.
fn arrows(time: Option<Timestamp>, grid: &GridPlacement, touch: &[(Channel, Vec<TouchContact>)]) -> SceneUpdate {
    let entities = touch.iter().map(|(channel, contacts)| entity(time, grid, *channel, contacts)).collect();
    SceneUpdate { entities, ..SceneUpdate::default() }
}

fn entity(time: Option<Timestamp>, grid: &GridPlacement, channel: Channel, contacts: &[TouchContact]) -> SceneEntity {
    let arrows = contacts.iter().map(|contact| {
        let pale = if contact.visible { 0.4 } else { 1.0 };
        let color = match (channel, contact.visible) {
            (Channel::TOUCH_EXPLORATION | Channel::AMODAL_TOUCH_EXPLORATION, _) => {
                Color { r: 0.34, g: 0.71, b: 0.91, a: pale }
            }
            (Channel::TOUCH_GRASP, _) => Color { r: 0.8, g: 0.47, b: 0.65, a: pale },
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
        id: if channel.is_touch_by_hand() { channel.name() } else { "touch" }.to_owned(),
        arrows: arrows.collect(),
        ..SceneEntity::default()
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
