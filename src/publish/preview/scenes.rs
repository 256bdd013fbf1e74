//! `preview.mcap` of a dataset of scenes.

use std::path::PathBuf;

use super::{
    Preview, arrow, calibration,
    foxglove::{Color, SceneEntity, SceneUpdate},
    google::protobuf::Timestamp,
    image, previewed, transform, write_file,
};
use format::{
    Scene, SceneOverview,
    dataset::{DatasetError, DatasetReader},
};

const FORCE: Color = Color { r: 0.9, g: 0.62, b: 0.0, a: 1.0 };

/// Length of the arrow of a newton [m].
const NEWTON: f64 = 0.01;

/// Length of an arrow, at most [m].
const MAX_ARROW: f64 = 0.1;

/// Writes `preview.mcap` into the folder of a dataset: scene k at k seconds, some of them spread over the dataset, on
/// `/preview/tf` (world -> camera), `/preview/camera`, `/preview/depth` (16 bit, millimetres, from above) and
/// `/preview/forces`: an arrow for each contact, the force on the body that is carried, in the world.
///
/// # Errors
/// When a shard is missing or damaged, or the file cannot be written.
pub fn write_scene_preview(reader: &DatasetReader) -> Result<PathBuf, DatasetError> {
    let mut scenes = Vec::new();
    for sample in previewed(reader)? {
        if let Some(overview) = sample.find::<SceneOverview>()? {
            scenes.push((sample.read::<Scene>()?, overview));
        }
    }
    write_file(reader.folder(), |file| write_messages(file, &scenes))
}

fn write_messages(
    file: impl std::io::Write + std::io::Seek,
    scenes: &[(Scene, SceneOverview)],
) -> mcap::McapResult<()> {
    let mut preview = Preview::create(file, include_bytes!("../generated/foxglove_scene.bin"))?;
    for (second, (scene, overview)) in (0..).zip(scenes) {
        let time = Some(Timestamp { seconds: second as i64, nanos: 0 });
        let camera = overview.camera();
        let pose = transform(time, &overview.camera_from_world().inverse(), "camera");
        preview.write(second, "/preview/tf", "foxglove.FrameTransform", &pose)?;
        preview.write(second, "/preview/camera", "foxglove.CameraCalibration", &calibration(time, &camera))?;
        let depth = image(time, overview.size, |column, row| overview.depth(column, row));
        preview.write(second, "/preview/depth", "foxglove.RawImage", &depth)?;
        preview.write(second, "/preview/forces", "foxglove.SceneUpdate", &forces(time, scene))?;
    }
    preview.finish()
}

fn forces(time: Option<Timestamp>, scene: &Scene) -> SceneUpdate {
    let arrows = scene.contacts.iter().filter_map(|contact| {
        let force = nalgebra::Vector3::from(contact.force);
        let size = force.norm();
        let at = nalgebra::Vector3::from(contact.point);
        (size > 0.0).then(|| arrow(&at, &(force / size), (size * NEWTON).min(MAX_ARROW), FORCE))
    });
    let entity = SceneEntity {
        timestamp: time,
        frame_id: "world".to_owned(),
        id: "forces".to_owned(),
        arrows: arrows.collect(),
        ..SceneEntity::default()
    };
    SceneUpdate { entities: vec![entity], ..SceneUpdate::default() }
}
