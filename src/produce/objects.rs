//! What producers of objects share: meshes and hands, read again and held against the job.

use crate::{
    assets::{self, AssetRecord, Description, InsideMethod, PreparedMesh},
    ids::ObjectId,
    job::{JobHand, JobObject},
    produce::ProduceError,
    voxel::InsideTest,
};

/// Prepares an object again and checks that it is still the one of the job.
///
/// # Errors
/// When it can't be prepared any more, or is another one.
pub fn prepared(object: &JobObject) -> Result<PreparedMesh, ProduceError> {
    let prepared = assets::prepare(&object.source)?;
    let (found, expected) = (prepared.record.object, object.id());
    if found == expected {
        return Ok(prepared);
    }
    Err(ProduceError::MeshChanged { name: object.source.name.clone(), found, expected })
}

/// How the voxel room finds the solid of an asset.
pub fn inside_test(record: &AssetRecord) -> InsideTest {
    match record.inside {
        InsideMethod::Crossings => InsideTest::Crossings,
        InsideMethod::WindingNumber => InsideTest::WindingNumber,
    }
}

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
