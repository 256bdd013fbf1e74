//! Notes about a run: its speed, and the findings of its leak check.
//!
//! `notes.json` is in the dataset's folder, but not part of any digest or manifest: two runs of one job differ only in this file.
//! Reports and inspections also work without it.

use std::{
    collections::{BTreeMap, BTreeSet},
    io,
};

use serde::{Deserialize, Serialize};

use format::dataset::DatasetError;
use kernel::files::{Bound, Folder, Temporary};

/// The file's name.
const NOTES: &str = "notes.json";

/// Notes about a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunNotes {
    /// Speed of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<Speed>,
    /// Findings of the leak check: counts by name (`straddling_views`, `twin_groups`, ...).
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub leaks: BTreeMap<String, u64>,
    /// Names of the counts that the job intends and that are not leaks.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub intended: BTreeSet<String>,
}

/// Speed of a run, or of the last part of an interrupted run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Speed {
    /// Samples made, kept or rejected.
    pub samples: u64,
    /// Wall time from start to the finished dataset [s].
    pub seconds: f64,
    /// Number of threads.
    pub threads: u32,
    /// Largest resident memory of the process, if known [bytes].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_memory: Option<u64>,
}

impl Speed {
    /// Samples per second.
    pub fn rate(&self) -> f64 {
        if self.seconds > 0.0 { self.samples as f64 / self.seconds } else { 0.0 }
    }
}

impl RunNotes {
    /// Text about a count of the leak check, from its name.
    pub fn leak_in_words(&self, name: &str) -> String {
        let words = count_in_words(name);
        if self.intended.contains(name) { format!("{words}, intended by the job") } else { words }
    }

    /// Whether a count of the leak check reports a leak. Groups that a job names may be on two sides, unless the job splits by
    /// them.
    pub fn is_leak(&self, name: &str, count: u64) -> bool {
        let may_straddle = name == "groups_straddling" || self.intended.contains(name);
        name.contains("straddling") && count > 0 && !may_straddle
    }

    /// Reads the notes of a dataset's folder; empty without such a file.
    ///
    /// # Errors
    /// When the file can't be read or is no such JSON.
    pub fn read(folder: &Folder) -> Result<Self, DatasetError> {
        let path = folder.path_of(NOTES);
        match folder.read(NOTES, Bound::NOTES) {
            Ok(text) => serde_json::from_slice(&text).map_err(|error| DatasetError::Invalid {
                path,
                problem: error.to_string(),
                remedy: "delete it: it contains only speed figures and the leak check's counts",
            }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Self::default()),
            Err(source) => Err(DatasetError::Io { action: "reading", path, source }),
        }
    }

    /// Writes the notes into a dataset's folder and replaces older ones.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn write(&self, folder: &Folder) -> Result<(), DatasetError> {
        let text = serde_json::to_string_pretty(self).expect("notes are plain data with text keys") + "\n";
        let written = Temporary::write(folder, NOTES, text.as_bytes());
        written.map_err(DatasetError::io("writing", &folder.path_of(NOTES)))
    }
}

/// A count of a run's leak check by its name.
fn count_in_words(name: &str) -> String {
    let words = match name {
        "views" => "views of each object",
        "distinct_rotations" => "different rotations of views",
        "repeated_rotations" => "views with the rotation of an earlier view",
        "straddling_views" => "holdout views with the rotation of a training view of the same object",
        "objects_straddling" => "objects on more than one side of the split",
        "geometries_straddling" => "geometries on more than one side of the split",
        "twin_groups" => "groups of objects of the same shape",
        "twin_groups_straddling" => "groups of objects of the same shape on more than one side of the split",
        "groups_straddling" => "groups named by the job on more than one side of the split",
        other => return other.replace('_', " "),
    };
    words.to_owned()
}
