//! `preview.mcap` of a dataset of patches: what the camera sees of a few grasps, and where their points are.

use std::{io::Seek, path::PathBuf};

use nalgebra::Vector3;

use super::{
    Preview, arrow, calibration,
    foxglove::{self, Color, Quaternion, RawImage, SceneEntity, SceneUpdate, SpherePrimitive},
    google::protobuf::Timestamp,
    image, transform, write_file,
};
use format::dataset::{DatasetError, DatasetReader, Selection};
use format::{Channel, Depth, HeatmapPatch, PATCH_POINTS, PatchColour};
use kernel::{geom::DepthCrop, ids::SampleIndex};

/// Topics of the patches around palm, F0, F1 and F2.
const DEPTH: [&str; PATCH_POINTS] = ["/preview/palm", "/preview/f0", "/preview/f1", "/preview/f2"];
const COLOUR: [&str; PATCH_POINTS] =
    ["/preview/palm_colour", "/preview/f0_colour", "/preview/f1_colour", "/preview/f2_colour"];
/// Colours of the points, in the same order.
const POINTS: [Color; PATCH_POINTS] = [
    Color { r: 0.84, g: 0.37, b: 0.0, a: 1.0 },
    Color { r: 0.34, g: 0.71, b: 0.91, a: 1.0 },
    Color { r: 0.0, g: 0.62, b: 0.45, a: 1.0 },
    Color { r: 0.8, g: 0.47, b: 0.65, a: 1.0 },
];
const APPROACH: Color = Color { r: 0.9, g: 0.62, b: 0.0, a: 1.0 };
/// Radius of a point, and length of the arrow along the approach [m].
const RADIUS: f64 = 0.004;
const ARROW: f64 = 0.08;

/// A grasp of a preview.
struct Seen {
    patch: HeatmapPatch,
    colour: Option<PatchColour>,
    image: Option<DepthCrop>,
}

/// Writes `preview.mcap` of a dataset of patches into its folder: grasp k at k seconds, `max` of them spread over the dataset,
/// on `/preview/tf` (object -> camera), `/preview/camera`, `/preview/depth` (16 bit, millimetres; the whole image where it is
/// stored, else the patches in their places), `/preview/palm` to `/preview/f2` (each patch alone), the same with `_colour`
/// where colours are stored, and `/preview/points`: the four points and an arrow along the approach, in the object's frame.
///
/// # Errors
/// When a shard is missing or damaged, or the file can't be written.
pub fn write_patch_preview(reader: &DatasetReader, max: usize) -> Result<PathBuf, DatasetError> {
    let folder = reader.folder();
    let kept: Vec<SampleIndex> = reader.indices(Selection::default()).collect();
    let count = max.min(kept.len());
    let mut grasps = Vec::with_capacity(count);
    for index in 0..count {
        // The middle of each of `count` equal runs.
        if let Some(sample) = reader.sample(kept[(2 * index + 1) * kept.len() / (2 * count)])? {
            let image = sample.find_at::<Depth>(Channel::PATCH_IMAGE)?.map(|image| image.crop);
            grasps.push(Seen { patch: sample.read::<HeatmapPatch>()?, colour: sample.find::<PatchColour>()?, image });
        }
    }
    write_file(folder, |file| write_messages(file, &grasps))
}

fn write_messages(file: impl std::io::Write + Seek, grasps: &[Seen]) -> mcap::McapResult<()> {
    let mut preview = Preview::create(file, include_bytes!("../generated/foxglove_scene.bin"))?;
    for (second, Seen { patch, colour, image: whole }) in (0..).zip(grasps) {
        let time = Some(Timestamp { seconds: second as i64, nanos: 0 });
        let (camera, side) = (&patch.camera, patch.side);
        let pose = transform(time, &patch.camera_from_object.inverse(), "camera");
        preview.write(second, "/preview/tf", "foxglove.FrameTransform", &pose)?;
        preview.write(second, "/preview/camera", "foxglove.CameraCalibration", &calibration(time, camera))?;
        let depth = image(time, [camera.width, camera.height], |column, row| match whole {
            Some(whole) => whole.at(column, row),
            None => in_patches(patch, column, row),
        });
        preview.write(second, "/preview/depth", "foxglove.RawImage", &depth)?;
        for (index, topic) in DEPTH.into_iter().enumerate() {
            let depth = patch.depth_of(index);
            let depth = image(time, [side; 2], |column, row| depth[(row * side + column) as usize]);
            preview.write(second, topic, "foxglove.RawImage", &depth)?;
        }
        if let Some(colour) = colour {
            for (index, topic) in COLOUR.into_iter().enumerate() {
                preview.write(second, topic, "foxglove.RawImage", &colours(time, colour, index))?;
            }
        }
        preview.write(second, "/preview/points", "foxglove.SceneUpdate", &points(time, patch))?;
    }
    preview.finish()
}

/// Depth in a pixel of the image, of the first patch that holds it [m]; NaN in none.
fn in_patches(patch: &HeatmapPatch, column: u32, row: u32) -> f32 {
    let side = patch.side;
    let mut depths = patch.points.iter().enumerate().filter_map(|(index, point)| {
        let (x, y) = (column.wrapping_sub(point.corner[0]), row.wrapping_sub(point.corner[1]));
        (x < side && y < side).then(|| patch.depth_of(index)[(y * side + x) as usize])
    });
    depths.next().unwrap_or(f32::NAN)
}

fn colours(time: Option<Timestamp>, colour: &PatchColour, index: usize) -> RawImage {
    RawImage {
        timestamp: time,
        width: colour.side,
        height: colour.side,
        encoding: "rgb8".to_owned(),
        step: 3 * colour.side,
        data: colour.rgb_of(index).as_flattened().to_vec(),
        frame_id: "camera".to_owned(),
    }
}

fn points(time: Option<Timestamp>, patch: &HeatmapPatch) -> SceneUpdate {
    let sphere = |(point, color): (&[f64; 3], Color)| SpherePrimitive {
        pose: Some(foxglove::Pose {
            position: Some(foxglove::Vector3 { x: point[0], y: point[1], z: point[2] }),
            orientation: Some(Quaternion { w: 1.0, ..Quaternion::default() }),
        }),
        size: Some(foxglove::Vector3 { x: 2.0 * RADIUS, y: 2.0 * RADIUS, z: 2.0 * RADIUS }),
        color: Some(color),
    };
    let approach = patch.object_from_approach.rotation().matrix().column(2).into_owned();
    let begin = Vector3::from(patch.points[0].point) - approach * ARROW;
    let entity = SceneEntity {
        timestamp: time,
        frame_id: "object".to_owned(),
        id: "points".to_owned(),
        spheres: patch.points.iter().map(|point| &point.point).zip(POINTS).map(sphere).collect(),
        arrows: vec![arrow(&begin, &approach, ARROW, APPROACH)],
        ..SceneEntity::default()
    };
    SceneUpdate { entities: vec![entity], ..SceneUpdate::default() }
}
