//! From the text of a job file to a job with its splits and its plan, ready to run.

use std::{collections::BTreeMap, path::Path};

use super::{RunSummary, RunTask, prepare_assets, run};
use crate::{
    RunContext, RunError,
    job::{Job, JobContext, JobDraft, JobText},
    plan::{JobSplits, Plan},
    work::WorkTables,
};
use form::FormErrors;
use format::dataset::DatasetHeader;
use kernel::{files::Folder, ids::JobDigest, voxel::twins};

/// Intersection over union from which on two objects are twins, after pose and scale are taken out.
pub(crate) const TWIN_LIKENESS: f64 = 0.85;

/// A job, ready to run. The documentation of the crate `graspmill` begins with an example.
#[derive(Clone, Debug)]
pub struct OpenJob {
    /// The job.
    pub job: Job,
    /// Plan of the job.
    pub plan: Plan,
    /// Digest of the job.
    pub digest: JobDigest,
    /// Splits of its objects; `None` for a job without objects, and when another dataset has split them.
    pub splits: Option<JobSplits>,
}

/// Reason why a job cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The job file has mistakes.
    #[error(transparent)]
    Job(#[from] FormErrors),
    /// Meshes could not be prepared, or the user stopped the run.
    #[error(transparent)]
    Run(#[from] RunError),
}

impl OpenJob {
    /// Reads a job, prepares its meshes, finds twins among them, splits them and makes the plan.
    ///
    /// # Errors
    /// Every mistake of the job; or when the work is interrupted.
    pub fn open(text: &JobText, context: &JobContext, run: &RunContext<'_>) -> Result<Self, OpenError> {
        Self::resolve(JobDraft::read(text, context)?, run)
    }

    /// Continues from a job that has been read.
    ///
    /// # Errors
    /// When no usable object is left, the split names objects that the job does not have, or the work is interrupted.
    pub fn resolve(draft: JobDraft, run: &RunContext<'_>) -> Result<Self, OpenError> {
        let sources: Vec<_> = draft.sources().cloned().collect();
        let prepared = prepare_assets(&sources, draft.work.with_solids, run)?;
        let mut shapes = BTreeMap::new();
        for (record, shape) in prepared.records.iter().zip(prepared.shapes) {
            if let (Ok(record), Some(shape)) = (record, shape) {
                shapes.entry(record.object).or_insert(shape);
            }
        }
        let job = draft.resolve(prepared.records)?;
        let splits = job.divided().map(|divided| {
            // Shapes of the objects that made it into the job, in the job's order.
            let shapes: Vec<_> = divided.objects.iter().filter_map(|object| shapes.remove(&object.id())).collect();
            JobSplits::new(&divided, job.seed, &twins(&shapes, TWIN_LIKENESS))
        });
        let plan = Plan::new(&job.work.subjects(), job.shard_samples);
        Ok(Self { digest: job.digest(), plan, splits, job })
    }

    /// Everything that a user should know about the job: keys without effect, refused and repaired meshes, splits.
    pub fn warnings(&self) -> Vec<String> {
        let of_objects = self.job.work.objects().into_iter().flat_map(|objects| objects.warnings());
        let of_splits =
            self.splits.iter().flat_map(|JobSplits { notes, leaks, .. }| notes.iter().cloned().chain(leaks.warnings()));
        self.job.notes.iter().cloned().chain(of_objects).chain(of_splits).collect()
    }

    /// Tables of the job's dataset other than the samples; files in its job are named relative to `folder`.
    pub fn header(&self, folder: &Path) -> DatasetHeader {
        let WorkTables { class, channel_classes, platform, assets, subjects, hands, containers, splits } =
            self.job.work.tables(self.splits.as_ref());
        let refusal = |refusal| serde_json::to_value(refusal).expect("a refusal is plain data");
        DatasetHeader {
            product: self.job.product(),
            generator: concat!("graspmill ", env!("CARGO_PKG_VERSION")).to_owned(),
            job: self.digest,
            job_text: self.job.to_toml(folder),
            class,
            channel_classes,
            platform,
            assets,
            subjects,
            hands,
            containers,
            refused: self.job.refused().iter().map(refusal).collect(),
            splits,
            warnings: self.warnings(),
        }
    }

    /// The task of making the job's dataset in a folder.
    pub fn task<'a>(&'a self, header: &'a DatasetHeader, folder: &'a Folder) -> RunTask<'a> {
        RunTask { job: &self.job, plan: &self.plan, digest: self.digest, header, folder }
    }

    /// Makes the job's dataset in a folder, or the shards that are missing of it.
    ///
    /// # Errors
    /// When the folder belongs to another job or cannot be written, a mesh changed since the job was opened, or the run is
    /// interrupted. Finished shards stay; the same call resumes.
    pub fn run(&self, folder: &Folder, context: &RunContext<'_>) -> Result<RunSummary, RunError> {
        run(&self.task(&self.header(folder.path()), folder), context)
    }
}
