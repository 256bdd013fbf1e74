//! Meshes and hands of a job, read again and compared with it.

use crate::{
    ProduceError,
    job::{JobHand, JobObject},
};
use kernel::{assets::Description, ids::ObjectId, object::PreparedObject};

/// Prepares an object again and checks that it is still the one of the job.
///
/// # Errors
/// When it can't be prepared any more, or is another one.
pub fn prepared(object: &JobObject) -> Result<PreparedObject, ProduceError> {
    let prepared = PreparedObject::prepare(&object.source).map_err(ProduceError::gone)?;
    let (found, expected) = (prepared.id(), object.id());
    if found == expected {
        return Ok(prepared);
    }
    Err(ProduceError::Changed { name: object.source.name.clone(), found, expected })
}

/// Reads the hand's files again and checks that they are still those of the job.
///
/// # Errors
/// When one is gone, or they are others than when the job was resolved.
pub fn check_hand(hand: &JobHand) -> Result<(), ProduceError> {
    let description = Description::of_hand(&hand.scene).map_err(ProduceError::gone)?;
    let (found, expected) = (ObjectId(description.digest), hand.id);
    if found == expected {
        return Ok(());
    }
    Err(ProduceError::Changed { name: hand.scene.display().to_string(), found, expected })
}
