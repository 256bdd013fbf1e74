//! A few samples for viewers.

use std::path::Path;

use super::{Crew, RunError};
use crate::{
    dataset::{DatasetReader, preview_samples, write_preview},
    job::Job,
    produce::completion::CompletionWorker,
};

/// Samples in `preview.mcap`.
const SAMPLES: u32 = 12;

/// Writes `preview.mcap` into a finished dataset: a few samples in the well-known schemas that Foxglove and Rerun draw.
/// Where depth is not stored, those few samples are made once more for their depth images.
///
/// # Errors
/// When the dataset cannot be read or the file not be written, or a mesh is gone.
pub fn preview(folder: &Path, job: &Job, crew: &Crew) -> Result<(), RunError> {
    let reader = DatasetReader::open(folder)?;
    let mut samples = preview_samples(&reader, SAMPLES)?;
    let mut worker = CompletionWorker::new(&job.completion, job.seed, crew.level)?;
    // Samples stand in the order of objects: a few of one object load it once.
    let mut last = None;
    for sample in samples.iter_mut().filter(|sample| sample.depth.is_none()) {
        let id = sample.pair.sample;
        let Some(object) = job.objects.iter().find(|object| object.id() == id.subject) else { continue };
        let loaded = match last.take() {
            Some((of, loaded)) if of == id.subject => loaded,
            _ => worker.load(object)?,
        };
        worker.produce(&loaded, id.view)?;
        sample.depth = Some(worker.depth().clone());
        last = Some((id.subject, loaded));
    }
    write_preview(folder, &samples)?;
    Ok(())
}
