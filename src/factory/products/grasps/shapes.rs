//! Shapes of the hand and the objects for the dataset, so that grasps can be drawn and replayed.

use serde_json::{Map, Value};

use super::{
    hand::GraspHand,
    settings::{GraspJob, Physics},
};
use crate::{
    ProduceError,
    objects::{TrialObject, describe, prepared},
    sections::JobObject,
};
use format::{HandJoint, HandShape, LinkSolid, ObjectShape, TrialHand, extras::add_resting};
use kernel::ids::ObjectId;
use robot::kinematics::JointKind;
use sim::{HandModel, PlainHand, TrialProtocol, plain_hand};

/// The hand, whose content is `id`.
pub fn hand_shape(hand: &GraspHand, id: ObjectId) -> HandShape {
    let GraspHand { hand, bodies, .. } = hand;
    let joints = hand.tree().joints().iter().map(|joint| HandJoint {
        name: joint.joint.name.clone(),
        slides: joint.joint.kind == JointKind::Prismatic,
        carried_by: joint.carried_by,
        link_from_joint: joint.joint.origin,
        axis: joint.joint.axis,
    });
    let solids = bodies.bodies.iter().flat_map(|body| {
        body.geometries.iter().map(|part| LinkSolid {
            link: body.link,
            shape: part.shape.clone(),
            link_from_solid: part.link_from_shape,
        })
    });
    HandShape {
        name: hand.name().to_owned(),
        id,
        links: hand.links().to_vec(),
        joints: joints.collect(),
        solids: solids.collect(),
    }
}

/// An object's mesh, prepared again, with the data of its row in the asset table: its mass, its metadata, and how it
/// rests on a table.
///
/// # Errors
/// When it can't be prepared any more, or is another one than when the job was resolved.
pub fn object_shape(
    object: &JobObject,
    physics: Option<&Physics>,
) -> Result<(ObjectShape, Map<String, Value>), ProduceError> {
    let prepared = prepared(object)?;
    let mut row = Map::new();
    let trials = physics.map(|Physics { mass, friction, .. }| TrialObject { mass: *mass, friction: *friction });
    describe(object, &prepared, trials, &mut row);
    add_resting(&mut row, prepared.resting());
    Ok((ObjectShape { object: object.id(), mesh: prepared.mesh().clone() }, row))
}

/// The hand for trials, for plain MuJoCo; `None` if the job stores none, or the hand cannot be described without
/// further files.
///
/// # Errors
/// When the hand cannot be read any more.
pub fn trial_hand(job: &GraspJob) -> Result<Option<TrialHand>, ProduceError> {
    if job.settings.physics.is_none() {
        return Ok(None);
    }
    let scene = &job.hand.file;
    let plain = HandModel::open(scene).and_then(|model| plain_hand(&model, &TrialProtocol::STANDARD));
    let plain = plain.map_err(|error| ProduceError::unusable(scene.display().to_string(), error))?;
    Ok(plain.map(|PlainHand { mjcf, drive }| TrialHand { mjcf, drive }))
}
