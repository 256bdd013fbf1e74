//! Job files as text.

use format::dataset::layout::JOB;
use kernel::files::{self, Bound, Folder};
use std::{
    io,
    path::{Path, PathBuf},
};

/// A job file as text, and the overrides laid over it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JobText {
    /// Name of the file in messages.
    pub label: String,
    /// The folder that relative paths in it start from.
    pub folder: PathBuf,
    /// Text of the job file.
    pub text: String,
    /// Overrides by `--set`, each `dotted.key=value`; later ones win.
    pub overrides: Vec<String>,
}

impl JobText {
    /// Default samples per shard of a resolved job, which `[shards]` can override; `None` where the text has none.
    pub fn shard_samples(&self) -> Option<i64> {
        let keys: toml::Table = self.text.parse().ok()?;
        keys.get("shards")?.as_table()?.values().next()?.as_integer()
    }

    /// Reads a job file.
    ///
    /// # Errors
    /// When the file cannot be read as UTF-8 text.
    pub fn open(path: &Path, overrides: &[String]) -> io::Result<Self> {
        Ok(Self {
            label: path.display().to_string(),
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            text: files::read_text(path, Bound::JOB)?,
            overrides: overrides.to_vec(),
        })
    }
}

impl JobText {
    /// Reads the resolved job of a dataset.
    ///
    /// # Errors
    /// When the file cannot be read as UTF-8 text.
    pub fn of_dataset(dataset: &Folder, overrides: &[String]) -> io::Result<Self> {
        Ok(Self {
            label: dataset.path_of(JOB).display().to_string(),
            folder: dataset.path().to_owned(),
            text: dataset.read_text(JOB, Bound::JOB)?,
            overrides: overrides.to_vec(),
        })
    }
}
