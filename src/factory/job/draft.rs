//! A job file, read and checked in every setting, with the meshes that it names found but not yet read.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use super::{
    Job, JobText,
    decode::{self, Decoded},
};
use crate::{
    product::{DraftWork, ProductFactory},
    sections::{JobContext, ObjectsDraft, Profile, with_slashes},
};
use assets::{AssetRecord, MeshRefusal, MeshSource};
use form::FormErrors;

/// A checked job whose meshes are found but not yet read.
#[derive(Debug)]
pub struct JobDraft {
    /// Name, for people.
    pub name: String,
    /// Seed of every random stream.
    pub seed: u64,
    /// Profile whose defaults were taken.
    pub profile: Profile,
    /// Overrides by `--set`, those of the file first.
    pub overrides: Vec<String>,
    /// Checked keys of the product.
    pub work: DraftWork,
}

impl JobDraft {
    /// Reads and checks a job file and lists its meshes, without opening one. All mistakes are reported at once.
    ///
    /// # Errors
    /// Every mistake of the file and of its overrides.
    pub fn read(job: &JobText, context: &JobContext) -> Result<Self, FormErrors> {
        let Decoded { head, factory, keys, checker } = decode::decode(&job.label, &job.text, &job.overrides)?;
        let work = (factory.draft)(&keys, checker, &job.folder, context)?;
        let file_name = Path::new(&job.label).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        Ok(Self {
            name: head.name.or(file_name).unwrap_or_else(|| "job".to_owned()),
            seed: u64::try_from(head.seed).expect("the schema requires a seed from 0"),
            profile: head.profile,
            overrides: head.overrides.into_iter().chain(job.overrides.iter().cloned()).collect(),
            work,
        })
    }

    /// [`JobDraft::read`] of a job that reads the given datasets, regardless of the file: folders by the section that
    /// names one, such as `grasps` for `grasps.dataset`. The resolved job contains them as if the file had named them.
    ///
    /// # Errors
    /// Every mistake of the file and of its overrides.
    pub fn read_with_inputs(
        job: &JobText,
        inputs: &BTreeMap<String, PathBuf>,
        context: &JobContext,
    ) -> Result<Self, FormErrors> {
        let mut job = job.clone();
        let given = job.overrides.len();
        let key = |(section, folder): (&String, &PathBuf)| {
            format!("{section}.{} = {}", ProductFactory::INPUT_KEY, toml::Value::from(with_slashes(folder)))
        };
        job.overrides.extend(inputs.iter().map(key));
        let mut draft = Self::read(&job, context)?;
        // Those of the file come first, then those of the caller, then these.
        draft.overrides.truncate(draft.overrides.len() - (job.overrides.len() - given));
        Ok(draft)
    }

    /// The meshes to prepare, in order: [`JobDraft::resolve`] takes the results in the same order.
    pub fn sources(&self) -> impl Iterator<Item = &MeshSource> {
        self.work.objects.iter().flat_map(ObjectsDraft::sources)
    }

    /// The job from the results of preparing [`JobDraft::sources`].
    ///
    /// Meshes that could not be prepared, whose content is not the pinned one, or whose content or geometry another
    /// mesh (earlier by name) has already, are refused with a reason; the others make the job.
    ///
    /// # Errors
    /// When no usable object is left, or the split names objects that the job does not have.
    ///
    /// # Panics
    /// If `assets` is not as long as the draft's meshes.
    pub fn resolve(self, assets: Vec<Result<AssetRecord, MeshRefusal>>) -> Result<Job, FormErrors> {
        let DraftWork { shard_samples, mut notes, objects, with_masses, of_one_body, make, .. } = self.work;
        let objects = objects.map(|objects| objects.resolve(assets, with_masses, of_one_body)).transpose()?;
        let work = make(objects, &mut notes);
        let shard_samples = shard_samples.per_shard(&work.subjects());
        let Self { name, profile, overrides, seed, .. } = self;
        Ok(Job { name, profile, overrides, seed, notes, shard_samples, work })
    }
}
