//! Shapes to draw and replay grasps with: those of a hand, and the meshes of objects.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3, Unit, Vector3};
use prost::Message;

use crate::codec::{
    RecordError,
    fields::{broken, lengthy, pose, ranged, triples},
    proto, wire,
};
use kernel::{
    geom::{HandBase, Object, Pose, Shape, TriMesh, Triangles},
    ids::{Digest, ObjectId},
};

const HAND: &str = "HandShape";
const OBJECT: &str = "ObjectShape";

/// Shapes of a hand that can touch, and the joints that move them.
#[derive(Clone, Debug, PartialEq)]
pub struct HandShape {
    /// Name of the hand.
    pub name: String,
    /// Digest of the description and table.
    pub id: ObjectId,
    /// Names of its links; the base is the first.
    pub links: Vec<String>,
    /// Joints, each after the one that carries it; joint k moves link k + 1.
    pub joints: Vec<HandJoint>,
    /// Shapes of the links.
    pub solids: Vec<LinkSolid>,
}

/// A joint of a hand.
#[derive(Clone, Debug, PartialEq)]
pub struct HandJoint {
    /// Name of the joint.
    pub name: String,
    /// Whether it is prismatic; else it is revolute.
    pub slides: bool,
    /// The link that carries it.
    pub carried_by: usize,
    /// Frame at value 0, expressed in that link's frame.
    pub link_from_joint: IsometryMatrix3<f64>,
    /// Direction in the joint's frame.
    pub axis: Unit<Vector3<f64>>,
}

/// A shape that a link carries.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkSolid {
    /// The link.
    pub link: usize,
    /// The shape.
    pub shape: Shape,
    /// Frame of the shape, expressed in the link's.
    pub link_from_solid: IsometryMatrix3<f64>,
}

/// Inputs to repeat trials in plain MuJoCo, in addition to the object's mesh: both are texts, for other programs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrialHand {
    /// The hand as trials compile it, without an object: MJCF with a servo for each joint.
    pub mjcf: String,
    /// JSON of the motors' control of the servos and of the protocol of a trial (docs/format.md).
    pub drive: String,
}

/// An object's mesh as it was prepared.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectShape {
    /// Digest of the content.
    pub object: ObjectId,
    /// Mesh of the object.
    pub mesh: TriMesh,
}

impl HandShape {
    /// MCAP topic.
    pub const TOPIC: &str = "/grasps/hand";
    /// Full name of the protobuf message.
    pub const SCHEMA: &str = "graspmill.HandShape";

    /// The frame of each link, expressed in the base frame, at values of all joints [rad or m].
    ///
    /// # Panics
    /// When there is not one value per joint.
    pub fn link_frames(&self, values: &[f64]) -> Vec<IsometryMatrix3<f64>> {
        assert_eq!(values.len(), self.joints.len(), "one value a joint");
        let mut frames = vec![IsometryMatrix3::identity()];
        for (joint, value) in self.joints.iter().zip(values) {
            let motion = if joint.slides {
                Translation3::from(joint.axis.into_inner() * *value) * Rotation3::identity()
            } else {
                IsometryMatrix3::from_parts(Translation3::identity(), Rotation3::from_axis_angle(&joint.axis, *value))
            };
            frames.push(frames[joint.carried_by] * joint.link_from_joint * motion);
        }
        frames
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        wire::bytes(out, 1, self.name.as_bytes());
        wire::bytes(out, 2, &self.id.0.0);
        self.links.iter().for_each(|link| wire::element(out, 3, link.as_bytes()));
        let mut message = Vec::new();
        for joint in &self.joints {
            message.clear();
            wire::bytes(&mut message, 1, joint.name.as_bytes());
            wire::bytes(&mut message, 2, if joint.slides { b"prismatic" } else { b"revolute" });
            wire::uint32(&mut message, 3, joint.carried_by as u32);
            wire::doubles(&mut message, 4, &rows(&joint.link_from_joint));
            wire::doubles(&mut message, 5, joint.axis.as_slice());
            wire::element(out, 4, &message);
        }
        for solid in &self.solids {
            message.clear();
            solid.encode(&mut message);
            wire::element(out, 5, &message);
        }
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length or index does not fit, a number is not finite, a pose is not a rigid motion, or a kind is unknown.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let hand = proto::HandShape::decode(payload).map_err(broken(HAND))?;
        let id = digest(HAND, "digest", &hand.digest)?;
        lengthy(HAND, "links", hand.joints.len() + 1, hand.links.len())?;
        let links = hand.links.len();
        let joints = hand.joints.iter().enumerate().map(|(index, joint)| {
            let slides = kind(HAND, "joints.kind", &joint.kind, &["revolute", "prismatic"])? == 1;
            let carried_by = joint.carried_by as usize;
            ranged(HAND, "joints.carried_by", carried_by as f64, carried_by <= index, "a link before its own")?;
            lengthy(HAND, "joints.axis", 3, joint.axis.len())?;
            let axis = Vector3::from_column_slice(&joint.axis);
            ranged(HAND, "joints.axis", axis.norm(), (axis.norm() - 1.0).abs() < 1e-9, "of unit length")?;
            Ok(HandJoint {
                name: joint.name.clone(),
                slides,
                carried_by,
                link_from_joint: frame("joints.link_from_joint", &joint.link_from_joint)?,
                axis: Unit::new_unchecked(axis),
            })
        });
        Ok(Self {
            name: hand.name.clone(),
            id,
            joints: joints.collect::<Result<_, RecordError>>()?,
            solids: hand.solids.iter().map(|solid| LinkSolid::of(solid, links)).collect::<Result<_, _>>()?,
            links: hand.links,
        })
    }
}

const KINDS: [&str; 5] = ["box", "sphere", "capsule", "cylinder", "mesh"];

impl LinkSolid {
    fn encode(&self, out: &mut Vec<u8>) {
        let (kind, size) = match &self.shape {
            Shape::Box { half } => (0, half.to_vec()),
            Shape::Sphere { radius } => (1, vec![*radius]),
            Shape::Capsule { radius, half } => (2, vec![*radius, *half]),
            Shape::Cylinder { radius, half } => (3, vec![*radius, *half]),
            Shape::Mesh(_) => (4, Vec::new()),
        };
        wire::uint32(out, 1, self.link as u32);
        wire::bytes(out, 2, KINDS[kind].as_bytes());
        wire::doubles(out, 3, &size);
        wire::doubles(out, 4, &rows(&self.link_from_solid));
        if let Shape::Mesh(mesh) = &self.shape {
            wire::doubles_of(out, 5, mesh.corners.iter().flat_map(|corner| [corner.x, corner.y, corner.z]));
            let indices: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
            wire::uint32s(out, 6, indices.iter().copied());
        }
    }

    fn of(solid: &proto::LinkSolid, links: usize) -> Result<Self, RecordError> {
        let link = solid.link as usize;
        ranged(HAND, "solids.link", link as f64, link < links, "an index into links")?;
        let kind = kind(HAND, "solids.kind", &solid.kind, &KINDS)?;
        lengthy(HAND, "solids.size", [3, 1, 2, 2, 0][kind], solid.size.len())?;
        let bad = solid.size.iter().find(|size| !(**size >= 0.0 && size.is_finite()));
        ranged(HAND, "solids.size", bad.copied().unwrap_or_default(), bad.is_none(), "0 or positive, and finite")?;
        let size = |index: usize| solid.size[index];
        let shape = match kind {
            0 => Shape::Box { half: [size(0), size(1), size(2)] },
            1 => Shape::Sphere { radius: size(0) },
            2 => Shape::Capsule { radius: size(0), half: size(1) },
            3 => Shape::Cylinder { radius: size(0), half: size(1) },
            _ => {
                let wild = solid.corners.iter().find(|value| !value.is_finite());
                ranged(HAND, "solids.corners", wild.copied().unwrap_or_default(), wild.is_none(), "finite")?;
                let count = solid.corners.len() / 3;
                lengthy(HAND, "solids.corners", 3 * count, solid.corners.len())?;
                let corners = solid.corners.chunks_exact(3).map(Point3::from_slice).collect();
                let triangles = indices(HAND, "solids.triangles", &solid.triangles, count)?;
                Shape::Mesh(Arc::new(Triangles { corners, triangles }))
            }
        };
        Ok(Self { link, shape, link_from_solid: frame("solids.link_from_solid", &solid.link_from_solid)? })
    }
}

impl ObjectShape {
    /// MCAP topic.
    pub const TOPIC: &str = "/grasps/object";
    /// Full name of the protobuf message.
    pub const SCHEMA: &str = "graspmill.ObjectShape";

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        wire::bytes(out, 1, &self.object.0.0);
        wire::floats(out, 2, self.mesh.vertices.as_flattened());
        wire::uint32s(out, 3, self.mesh.triangles.as_flattened().iter().copied());
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length or index does not fit, or a number is not finite.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let shape = proto::ObjectShape::decode(payload).map_err(broken(OBJECT))?;
        let object = digest(OBJECT, "object", &shape.object)?;
        let vertices = triples(OBJECT, "vertices", &shape.vertices)?;
        let triangles = indices(OBJECT, "triangles", &shape.triangles, vertices.len())?;
        Ok(Self { object, mesh: TriMesh { vertices, triangles } })
    }
}

fn rows(frame: &IsometryMatrix3<f64>) -> [f64; 12] {
    Pose::<Object, HandBase>::from_isometry(*frame).to_rows()
}

fn frame(field: &'static str, rows: &[f64]) -> Result<IsometryMatrix3<f64>, RecordError> {
    Ok(*pose::<Object, HandBase>(HAND, field, rows)?.isometry())
}

fn digest(message: &'static str, field: &'static str, bytes: &[u8]) -> Result<ObjectId, RecordError> {
    lengthy(message, field, 32, bytes.len())?;
    Ok(ObjectId(Digest(bytes.try_into().unwrap_or_default())))
}

/// Index of a name among those that are known.
fn kind(message: &'static str, field: &'static str, found: &str, known: &[&str]) -> Result<usize, RecordError> {
    let unknown = || RecordError::Name { message, field, found: found.to_owned(), expected: known.join(" or ") };
    known.iter().position(|name| *name == found).ok_or_else(unknown)
}

/// Three indices each, all below `count`.
fn indices(
    message: &'static str,
    field: &'static str,
    indices: &[u32],
    count: usize,
) -> Result<Vec<[u32; 3]>, RecordError> {
    lengthy(message, field, indices.len() / 3 * 3, indices.len())?;
    if let Some(beyond) = indices.iter().find(|index| **index as usize >= count) {
        ranged(message, field, f64::from(*beyond), false, "an index of a corner")?;
    }
    Ok(indices.as_chunks::<3>().0.to_vec())
}
