//! The resolved job as text, and its digests.

use std::path::Path;

use serde::Serialize;

use super::{Job, renamed::with_old_names, spec::HeadSpec};
use kernel::ids::{Digest, JobDigest};

/// Changes when the canonical text changes without the job changing.
const CANONICAL_FORM: &str = "graspmill job 2";

/// Everything that a digest names, as one JSON text with sorted keys.
#[derive(Serialize)]
struct Canonical<'a> {
    form: &'static str,
    product: &'static str,
    seed: u64,
    settings: toml::Table,
    #[serde(skip_serializing_if = "Option::is_none")]
    subjects: Option<&'a toml::Table>,
}

impl Canonical<'_> {
    fn digest(&self) -> Digest {
        Digest::hash(&serde_json::to_vec(self).expect("keys of a job are plain data"))
    }
}

impl Job {
    /// The job as a job file: every default filled in, every file pinned by content, overrides listed. Reading it back
    /// where the files are gives a job of the same digest.
    ///
    /// Paths are written relative to `folder`, the future folder of the file; meshes of packages by package and name.
    pub fn to_toml(&self, folder: &Path) -> String {
        let head = HeadSpec {
            product: self.product(),
            name: Some(self.name.clone()),
            seed: self.seed as i64,
            profile: self.profile,
            overrides: self.overrides.clone(),
        };
        let head = toml::to_string(&head).expect("the head of a job is plain data");
        let keys = self.work.resolved(folder, self.shard_samples);
        let keys = toml::to_string_pretty(&keys).expect("keys of a job are plain data");
        let digest = self.digest();
        format!(
            "# A resolved job: every default filled in, every file pinned by its content.\n# Job digest {digest}\n{head}{keys}"
        )
    }

    /// Names the job by everything that data or split depend on: settings, seed, and subjects with what is known of them; files
    /// by content. It does not depend on the job's name, paths, profile (every switch is a setting), shard size, threads or
    /// clock.
    pub fn digest(&self) -> JobDigest {
        let subjects = self.work.subject_keys();
        JobDigest(self.canonical(self.work.sample_keys(), Some(&subjects)).digest())
    }

    /// Digest of everything that a sample depends on except its subject and its item: seed and settings of the product.
    /// Equal in two jobs whose common subjects make the same samples.
    pub fn sample_settings(&self) -> Digest {
        self.canonical(self.work.sample_keys(), None).digest()
    }

    /// Keys have the names that format 3 gave them, whatever job files call them today: a rename changes no digest.
    fn canonical<'a>(&self, settings: toml::Table, subjects: Option<&'a toml::Table>) -> Canonical<'a> {
        let settings = with_old_names(settings);
        Canonical { form: CANONICAL_FORM, product: self.product().name, seed: self.seed, settings, subjects }
    }
}
