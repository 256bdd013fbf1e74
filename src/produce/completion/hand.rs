//! The hand that touches: whether it is still the one of the job.

use crate::{assets::Description, ids::ObjectId, job::JobHand, produce::ProduceError};

/// Reads the hand's files again.
///
/// # Errors
/// When one is gone, or they are others than when the job was resolved.
pub fn check_hand(hand: &JobHand) -> Result<(), ProduceError> {
    let description = Description::of_hand(&hand.scene).map_err(|source| ProduceError::HandGone { source })?;
    let (found, expected) = (ObjectId(description.digest), hand.id);
    if found == expected {
        return Ok(());
    }
    Err(ProduceError::HandChanged { name: hand.scene.display().to_string(), found, expected })
}
