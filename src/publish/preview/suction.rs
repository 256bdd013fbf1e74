//! `preview.mcap` of a dataset of suction.

use std::{collections::BTreeMap, path::PathBuf};

use nalgebra::Vector3;

use super::{
    Preview, arrow,
    foxglove::{Color, SceneEntity, SceneUpdate},
    picks::{BLOCKED, BODY, FREE, NEIGHBOUR, entity, triangles},
    previewed, write_file,
};
use format::{
    SuctionPoses, SuctionResult,
    dataset::{DatasetError, DatasetReader},
    extras::Shapes,
};
use kernel::ids::ObjectId;

const OTHERS: Color = Color { r: 0.34, g: 0.71, b: 0.91, a: 0.6 };

/// Length of an arrow [m].
const ARROW: f64 = 0.03;

/// Writes `preview.mcap` into the folder of a dataset: body k at k seconds, some of them spread over the dataset, on
/// `/preview/bodies` (the meshes of its scene, the body orange) and `/preview/cups`: an arrow from each stored pose out of the surface,
/// green if it is free, red if the cup leaks, else blue; all in the world.
///
/// # Errors
/// When a shard or the meshes are missing or damaged, or the file cannot be written.
pub fn write_suction_preview(reader: &DatasetReader) -> Result<PathBuf, DatasetError> {
    let shapes = Shapes::open(reader.folder())?;
    let places = reader.assets()?.objects.into_iter().map(|row| row.object);
    let places: BTreeMap<ObjectId, usize> = places.zip(0..).collect();
    let mut scenes = Vec::new();
    for (second, sample) in (0..).zip(previewed(reader)?) {
        let poses = sample.read::<SuctionPoses>()?;
        let mut meshes = Vec::new();
        for (number, (object, pose)) in (1..).zip(&poses.bodies) {
            if let Some(place) = places.get(object) {
                let colour = if number == poses.body() { BODY } else { NEIGHBOUR };
                meshes.push(triangles(&shapes.object(*place)?.mesh, pose, colour));
            }
        }
        let bodies = SceneEntity { triangles: meshes, ..entity(second, "bodies") };
        let cups = SceneEntity { arrows: arrows(&poses), ..entity(second, "cups") };
        scenes.push([bodies, cups].map(|entity| SceneUpdate { entities: vec![entity], ..SceneUpdate::default() }));
    }
    write_file(reader.folder(), |file| write_messages(file, &scenes))
}

fn write_messages(file: impl std::io::Write + std::io::Seek, scenes: &[[SceneUpdate; 2]]) -> mcap::McapResult<()> {
    let mut preview = Preview::create(file, include_bytes!("../generated/foxglove_scene.bin"))?;
    for (second, updates) in (0..).zip(scenes) {
        for (topic, update) in ["/preview/bodies", "/preview/cups"].into_iter().zip(updates) {
            preview.write(second, topic, "foxglove.SceneUpdate", update)?;
        }
    }
    preview.finish()
}

fn arrows(poses: &SuctionPoses) -> Vec<super::foxglove::ArrowPrimitive> {
    let world_from_object = poses.world_from_object().isometry();
    let one = |pose: &format::SuctionPose| {
        let world_from_cup = world_from_object * pose.object_from_cup.isometry();
        let outward = world_from_cup.rotation * -Vector3::z();
        let colour = match pose.result() {
            SuctionResult::Free => FREE,
            SuctionResult::Leaking => BLOCKED,
            SuctionResult::Weak | SuctionResult::Blocked => OTHERS,
        };
        arrow(&world_from_cup.translation.vector, &outward, ARROW, colour)
    };
    poses.poses.iter().map(one).collect()
}
