//! `preview.mcap` of a dataset of grasps: the best grasp of a few objects, with hand and contacts.

use std::{collections::BTreeMap, io::Seek, path::PathBuf};

use nalgebra::{IsometryMatrix3, UnitQuaternion, Vector3};

use super::{
    Preview, arrow,
    cloud::{plain_cloud, solid_points, surface_points},
    foxglove::{
        self, Color, CubePrimitive, CylinderPrimitive, PointCloud, Quaternion, SceneEntity, SceneUpdate,
        SpherePrimitive, TriangleListPrimitive,
    },
    google::protobuf::Timestamp,
    write_file,
};
use format::{Grasp, GraspRun, HandShape, ObjectShape};
use format::{
    dataset::{DatasetError, DatasetReader, Selection},
    extras::Shapes,
};
use kernel::{
    geom::{Shape, TouchShape},
    ids::ObjectId,
};

const HAND: Color = Color { r: 0.34, g: 0.71, b: 0.91, a: 1.0 };
const OBJECT: Color = Color { r: 0.9, g: 0.62, b: 0.0, a: 1.0 };
const CONTACT: Color = Color { r: 0.84, g: 0.37, b: 0.0, a: 1.0 };
/// Length of the arrow of a contact [m].
const ARROW: f64 = 0.04;

/// Writes `preview.mcap` of a dataset of grasps into its folder: object k at k seconds, for `max` objects spread over the
/// asset table, on `/preview/grasp` its mesh, the closed hand of its best kept grasp, and an arrow out of the object at each
/// contact; of an object without a kept grasp the state of lowest energy. On `/preview/object_points`, `/preview/hand_points` and
/// `/preview/contact_points` the same as clouds, for viewers that draw no scenes. In the object's frame.
///
/// # Errors
/// When a shard or the shapes are missing or damaged, or the file can't be written.
pub fn write_grasp_preview(reader: &DatasetReader, max: usize) -> Result<PathBuf, DatasetError> {
    let folder = reader.folder();
    let shapes = Shapes::open(folder)?;
    let hand = shapes.hand()?;
    let best = best_grasps(reader)?;
    let mut scenes = Vec::new();
    let count = shapes.objects().min(max);
    for index in 0..count {
        let object = shapes.object(index * shapes.objects() / count)?;
        if let Some((_, grasp)) = best.get(&object.object) {
            let second = scenes.len() as i64;
            scenes.push((scene(second, &object, &hand, grasp), clouds(second, &object, &hand, grasp)));
        }
    }
    write_file(folder, |file| write_messages(file, &scenes))
}

/// A scene, and the same as clouds of points.
type Drawn = (SceneUpdate, [PointCloud; 3]);

/// Topics of the clouds: object, hand, contacts.
const CLOUDS: [&str; 3] = ["/preview/object_points", "/preview/hand_points", "/preview/contact_points"];

fn write_messages(file: impl std::io::Write + Seek, scenes: &[Drawn]) -> mcap::McapResult<()> {
    let mut preview = Preview::create(file, include_bytes!("../generated/foxglove_scene.bin"))?;
    for (second, (scene, clouds)) in (0..).zip(scenes) {
        preview.write(second, "/preview/grasp", "foxglove.SceneUpdate", scene)?;
        for (topic, cloud) in CLOUDS.into_iter().zip(clouds) {
            preview.write(second, topic, "foxglove.PointCloud", cloud)?;
        }
    }
    preview.finish()
}

/// A grasp with its epsilon (-1 where it is not kept) and its energy, negated so that more is better.
type Ranked = ((f64, f64), Grasp);

/// The best grasp of each object: kept before others, then by epsilon, then by energy; the first of equals.
fn best_grasps(reader: &DatasetReader) -> Result<BTreeMap<ObjectId, Ranked>, DatasetError> {
    let mut best: BTreeMap<ObjectId, Ranked> = BTreeMap::new();
    for sample in reader.iter(Selection::default()) {
        let run = sample?.read::<GraspRun>()?;
        let kept = run.kept().map(|grasp| ((grasp.epsilon(&run.method), -grasp.energy), grasp));
        let first = run.grasps.first().map(|grasp| ((-1.0, -grasp.energy), grasp));
        for (rank, grasp) in kept.chain(first) {
            if best.get(&run.sample.subject).is_none_or(|(known, _)| rank > *known) {
                best.insert(run.sample.subject, (rank, grasp.clone()));
            }
        }
    }
    Ok(best)
}

/// Each entity takes the place of the one before with its name.
fn scene(second: i64, object: &ObjectShape, hand: &HandShape, grasp: &Grasp) -> SceneUpdate {
    let entity = |id: &str| SceneEntity {
        timestamp: Some(Timestamp { seconds: second, nanos: 0 }),
        frame_id: "object".to_owned(),
        id: id.to_owned(),
        ..SceneEntity::default()
    };
    let corner = |corner: [f32; 3]| {
        let [x, y, z] = corner.map(f64::from);
        foxglove::Point3 { x, y, z }
    };
    let mesh = TriangleListPrimitive {
        pose: Some(pose(&IsometryMatrix3::identity())),
        points: object.mesh.vertices.iter().copied().map(corner).collect(),
        color: Some(OBJECT),
        indices: object.mesh.triangles.as_flattened().to_vec(),
        ..TriangleListPrimitive::default()
    };
    let arrows = grasp
        .contacts
        .iter()
        .map(|contact| arrow(&Vector3::from(contact.point), &Vector3::from(contact.normal), ARROW, CONTACT));
    let entities = vec![
        SceneEntity { triangles: vec![mesh], ..entity("object") },
        with_hand(entity("hand"), hand, grasp),
        SceneEntity { arrows: arrows.collect(), ..entity("contacts") },
    ];
    SceneUpdate { entities, ..SceneUpdate::default() }
}

/// Points on the object and on the closed hand, and its contacts.
fn clouds(second: i64, object: &ObjectShape, hand: &HandShape, grasp: &Grasp) -> [PointCloud; 3] {
    let time = Some(Timestamp { seconds: second, nanos: 0 });
    let frames = hand.link_frames(&grasp.joints);
    let solids = hand.solids.iter().filter_map(|solid| {
        let object_from_solid = grasp.object_from_base.isometry() * frames[solid.link] * solid.link_from_solid;
        // A mesh without triangles has nothing to be drawn.
        Some(solid_points(&TouchShape::new(&solid.shape).ok()?, &object_from_solid))
    });
    let contacts = grasp.contacts.iter().map(|contact| contact.point.into());
    [
        plain_cloud(time, "object", surface_points(&object.mesh), OBJECT),
        plain_cloud(time, "object", solids.flatten(), HAND),
        plain_cloud(time, "object", contacts, CONTACT),
    ]
}

/// The closed hand.
fn with_hand(mut entity: SceneEntity, hand: &HandShape, grasp: &Grasp) -> SceneEntity {
    let frames = hand.link_frames(&grasp.joints);
    for solid in &hand.solids {
        let object_from_solid = grasp.object_from_base.isometry() * frames[solid.link] * solid.link_from_solid;
        let ball = |entity: &mut SceneEntity, object_from_solid: &IsometryMatrix3<f64>, radius: f64| {
            entity.spheres.push(SpherePrimitive {
                pose: Some(pose(object_from_solid)),
                size: Some(size([2.0 * radius; 3])),
                color: Some(HAND),
            });
        };
        let cylinder = |entity: &mut SceneEntity, radius: f64, half: f64| {
            entity.cylinders.push(CylinderPrimitive {
                pose: Some(pose(&object_from_solid)),
                size: Some(size([2.0 * radius, 2.0 * radius, 2.0 * half])),
                bottom_scale: 1.0,
                top_scale: 1.0,
                color: Some(HAND),
            });
        };
        match &solid.shape {
            Shape::Box { half } => entity.cubes.push(CubePrimitive {
                pose: Some(pose(&object_from_solid)),
                size: Some(size(half.map(|side| 2.0 * side))),
                color: Some(HAND),
            }),
            Shape::Sphere { radius } => ball(&mut entity, &object_from_solid, *radius),
            Shape::Cylinder { radius, half } => cylinder(&mut entity, *radius, *half),
            Shape::Capsule { radius, half } => {
                cylinder(&mut entity, *radius, *half);
                for end in [-half, *half] {
                    ball(&mut entity, &(object_from_solid * IsometryMatrix3::translation(0.0, 0.0, end)), *radius);
                }
            }
            Shape::Mesh(mesh) => entity.triangles.push(TriangleListPrimitive {
                pose: Some(pose(&object_from_solid)),
                points: mesh.corners.iter().map(|p| foxglove::Point3 { x: p.x, y: p.y, z: p.z }).collect(),
                color: Some(HAND),
                indices: mesh.triangles.as_flattened().to_vec(),
                ..TriangleListPrimitive::default()
            }),
        }
    }
    entity
}

fn size([x, y, z]: [f64; 3]) -> foxglove::Vector3 {
    foxglove::Vector3 { x, y, z }
}

fn pose(frame: &IsometryMatrix3<f64>) -> foxglove::Pose {
    let (at, q) = (frame.translation.vector, UnitQuaternion::from_rotation_matrix(&frame.rotation).coords);
    foxglove::Pose {
        position: Some(foxglove::Vector3 { x: at.x, y: at.y, z: at.z }),
        orientation: Some(Quaternion { x: q.x, y: q.y, z: q.z, w: q.w }),
    }
}
