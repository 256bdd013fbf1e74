//! A few samples for viewers.

use std::path::Path;

use super::{Crew, RunError};
use crate::{
    dataset::{
        DatasetReader, preview_samples, read_field, write_grasp_preview, write_map_preview, write_patch_preview,
        write_preview,
    },
    job::CompletionJob,
    produce::{Producer, completion::CompletionWorker},
};

/// Samples in `preview.mcap`.
const SAMPLES: u32 = 12;

/// Writes `preview.mcap` into a finished completion dataset: a few samples in the well-known schemas that Foxglove and Rerun draw.
/// Where depth is not stored, those few samples are made once more for their depth images.
///
/// # Errors
/// When the dataset cannot be read or the file not be written, or a mesh is gone.
pub fn preview(folder: &Path, job: &CompletionJob, seed: u64, crew: &Crew) -> Result<(), RunError> {
    let reader = DatasetReader::open(folder)?;
    let mut samples = preview_samples(&reader, SAMPLES)?;
    // Depth does not need what hands felt, which takes long to make.
    let job = job.without_hands();
    let mut worker = CompletionWorker::new(&job, seed, crew.level)?;
    for sample in samples.iter_mut().filter(|sample| sample.depth.is_none()) {
        let id = sample.pair.sample;
        if let Some(object) = job.objects.iter().position(|object| object.id() == id.subject) {
            worker.load(object)?;
            worker.produce(id.view)?;
            sample.depth = Some(worker.depth().clone());
        }
    }
    write_preview(folder, &samples)?;
    Ok(())
}

/// Writes `preview.mcap` into a finished dataset of grasps: the best grasp of a few objects in the well-known schemas.
///
/// # Errors
/// When the dataset cannot be read or the file not be written.
pub fn grasp_preview(folder: &Path) -> Result<(), RunError> {
    write_grasp_preview(&DatasetReader::open(folder)?, SAMPLES as usize)?;
    Ok(())
}

/// Writes `preview.mcap` into a finished dataset of patches: images and points in the well-known schemas.
///
/// # Errors
/// When the dataset cannot be read or the file not be written.
pub fn patch_preview(folder: &Path) -> Result<(), RunError> {
    write_patch_preview(&DatasetReader::open(folder)?, SAMPLES as usize)?;
    Ok(())
}

/// Writes `preview.mcap` into a finished reachability dataset: points and arrows in the well-known schemas.
///
/// # Errors
/// When the field cannot be read or the file not be written.
pub fn map_preview(folder: &Path) -> Result<(), RunError> {
    write_map_preview(folder, &read_field(folder)?)?;
    Ok(())
}
