//! What stands beside grasps: the shapes of the hand and of every object, and how each object rests on a table.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::{Cancel, Crew, RunError, RunTask};
use crate::{
    dataset::ShapesWriter,
    geom::RestingPoses,
    ids::ObjectId,
    job::{GraspJob, JobObject},
    produce::grasp::{GraspHand, hand_shape, object_shape, trial_hand},
};

/// Writes `shapes.mcap`: a few meshes in memory at a time. How each object rests on a table.
pub(super) fn write_shapes(
    task: &RunTask,
    job: &GraspJob,
    hand: &GraspHand,
    crew: &Crew,
    cancel: &Cancel,
) -> Result<BTreeMap<ObjectId, RestingPoses>, RunError> {
    let mut resting = BTreeMap::new();
    let mut objects: Vec<&JobObject> = job.objects.iter().collect();
    objects.sort_by_key(|object| object.id());
    let mut writer = ShapesWriter::create(task.folder, &task.digest, &hand_shape(hand, job.hand.id))?;
    let pool = crew.pool()?;
    for few in objects.chunks(crew.threads.max(1)) {
        if cancel.is_cancelled() {
            return Err(RunError::Interrupted);
        }
        let shapes: Vec<_> =
            pool.install(|| few.par_iter().map(|object| object_shape(object)).collect::<Result<_, _>>())?;
        for (shape, poses) in shapes {
            writer.object(&shape)?;
            resting.insert(shape.object, poses);
        }
    }
    writer.finish(trial_hand(job)?.as_ref())?;
    Ok(resting)
}
