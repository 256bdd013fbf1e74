//! `preview.mcap` of a dataset of picks.

use std::{collections::BTreeMap, path::PathBuf};

use nalgebra::UnitQuaternion;

use super::{
    Preview,
    foxglove::{self, Color, Quaternion, SceneEntity, SceneUpdate, SpherePrimitive, TriangleListPrimitive},
    google::protobuf::Timestamp,
    previewed, write_file,
};
use format::{
    PickCandidates,
    dataset::{DatasetError, DatasetReader},
    extras::Shapes,
};
use kernel::{
    geom::{Object, Pose, TriMesh, World},
    ids::ObjectId,
};

pub(super) const BODY: Color = Color { r: 0.9, g: 0.62, b: 0.0, a: 1.0 };
pub(super) const NEIGHBOUR: Color = Color { r: 0.55, g: 0.55, b: 0.56, a: 1.0 };
pub(super) const FREE: Color = Color { r: 0.0, g: 0.62, b: 0.45, a: 1.0 };
pub(super) const BLOCKED: Color = Color { r: 0.84, g: 0.37, b: 0.0, a: 0.6 };

/// Diameter of the ball at a hand's base [m].
const BALL: f64 = 0.006;

/// Writes `preview.mcap` into the folder of a dataset: body k at k seconds, some of them spread over the dataset, on
/// `/preview/bodies` (the meshes of its scene, the body orange) and `/preview/hands`: a ball at the base of each hand that was
/// evaluated, green where it is free, red where something is in its way; all in the world.
///
/// # Errors
/// When a shard or the shapes are missing or damaged, or the file cannot be written.
pub fn write_pick_preview(reader: &DatasetReader) -> Result<PathBuf, DatasetError> {
    let shapes = Shapes::open(reader.folder())?;
    let places = reader.assets()?.objects.into_iter().map(|row| row.object);
    let places: BTreeMap<ObjectId, usize> = places.zip(0..).collect();
    let mut scenes = Vec::new();
    for (second, sample) in (0..).zip(previewed(reader)?) {
        let candidates = sample.read::<PickCandidates>()?;
        let mut meshes = Vec::new();
        for (number, (object, pose)) in (1..).zip(&candidates.bodies) {
            if let Some(place) = places.get(object) {
                let colour = if number == candidates.body() { BODY } else { NEIGHBOUR };
                meshes.push(triangles(&shapes.object(*place)?.mesh, pose, colour));
            }
        }
        let bodies = SceneEntity { triangles: meshes, ..entity(second, "bodies") };
        let hands = SceneEntity { spheres: balls(&candidates), ..entity(second, "hands") };
        scenes.push([bodies, hands].map(|entity| SceneUpdate { entities: vec![entity], ..SceneUpdate::default() }));
    }
    write_file(reader.folder(), |file| write_messages(file, &scenes))
}

fn write_messages(file: impl std::io::Write + std::io::Seek, scenes: &[[SceneUpdate; 2]]) -> mcap::McapResult<()> {
    let mut preview = Preview::create(file, include_bytes!("../generated/foxglove_scene.bin"))?;
    for (second, updates) in (0..).zip(scenes) {
        for (topic, update) in ["/preview/bodies", "/preview/hands"].into_iter().zip(updates) {
            preview.write(second, topic, "foxglove.SceneUpdate", update)?;
        }
    }
    preview.finish()
}

/// Each entity takes the place of the one before with its name.
pub(super) fn entity(second: i64, id: &str) -> SceneEntity {
    SceneEntity {
        timestamp: Some(Timestamp { seconds: second, nanos: 0 }),
        frame_id: "world".to_owned(),
        id: id.to_owned(),
        ..SceneEntity::default()
    }
}

pub(super) fn triangles(mesh: &TriMesh, pose: &Pose<World, Object>, colour: Color) -> TriangleListPrimitive {
    let rotation = UnitQuaternion::from_rotation_matrix(pose.rotation()).coords;
    let orientation = Quaternion { x: rotation.x, y: rotation.y, z: rotation.z, w: rotation.w };
    let at = pose.translation();
    let position = foxglove::Vector3 { x: at.x, y: at.y, z: at.z };
    let corner = |corner: &[f32; 3]| {
        let [x, y, z] = corner.map(f64::from);
        foxglove::Point3 { x, y, z }
    };
    TriangleListPrimitive {
        pose: Some(foxglove::Pose { position: Some(position), orientation: Some(orientation) }),
        points: mesh.vertices.iter().map(corner).collect(),
        color: Some(colour),
        indices: mesh.triangles.as_flattened().to_vec(),
        ..TriangleListPrimitive::default()
    }
}

fn balls(candidates: &PickCandidates) -> Vec<SpherePrimitive> {
    let upright = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };
    let ball = |candidate: &format::PickCandidate| {
        let at = candidate.world_from_base.translation();
        let position = foxglove::Vector3 { x: at.x, y: at.y, z: at.z };
        SpherePrimitive {
            pose: Some(foxglove::Pose { position: Some(position), orientation: Some(upright) }),
            size: Some(foxglove::Vector3 { x: BALL, y: BALL, z: BALL }),
            color: Some(if candidate.is_free() { FREE } else { BLOCKED }),
        }
    };
    candidates.candidates.iter().map(ball).collect()
}
