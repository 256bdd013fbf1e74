//! The workshop of a job, with what it takes from other datasets.

use crate::{
    dataset::Shapes,
    geom::SimdLevel,
    job::{Job, Work},
    produce::{Workshop, patches::MeshReader},
    run::RunError,
};

/// Prepares what the job's producers share.
pub(super) fn open_workshop(job: &Job, level: SimdLevel) -> Result<Workshop<'_>, RunError> {
    let Work::Patches(work) = &job.work else { return Ok(Workshop::new(job, level)?) };
    // Objects of the job are sorted by content, as those of the shapes are; who reads one holds it against its content.
    let shapes = Shapes::open(&work.dataset)?;
    let meshes: Box<MeshReader> = Box::new(move |place| {
        if place >= shapes.objects() {
            return Err(format!("shapes.mcap of the grasps has {} objects", shapes.objects()));
        }
        shapes.object(place).map(|shape| shape.mesh).map_err(|error| error.to_string())
    });
    Ok(Workshop::of_patches(work, job.seed, meshes, level)?)
}
