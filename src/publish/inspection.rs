//! Facts that the inspections of all products share.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize, Serializer};
use serde_json::Value;

use super::{chart::grouped, notes::RunNotes};
use format::{
    Product,
    dataset::{DatasetError, DatasetReader, layout},
};
use kernel::{
    files::Folder,
    ids::{Digest, JobDigest},
    words::{NumberClass, Show, capped, is_note},
};

/// Maximum number of remarks in the text form.
const MOST_REMARKS: usize = 50;

/// Line for a warning of a dataset; warnings about valid meshes are notes.
pub fn remark_in_words(warning: &str) -> String {
    let kind = if is_note(warning) { "note" } else { "warning" };
    format!("{kind}: {}", warning.shown())
}

/// Facts that the inspections of all products share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InspectionHeader {
    /// The job's name; the folder's when the job has none.
    pub name: String,
    /// Headline.
    #[serde(default)]
    pub headline: String,
    /// Program and version that made it.
    pub generator: String,
    /// Product of the dataset.
    pub product: Product,
    /// Format on disk.
    pub format_version: u32,
    /// Root digest of the dataset.
    pub root: Digest,
    /// Digest of the samples of each class of numbers.
    pub classes: BTreeMap<NumberClass, Digest>,
    /// The job.
    pub job: JobDigest,
    /// Shards.
    pub shards: u64,
    /// Size of all shards [bytes].
    pub shard_bytes: u64,
    /// Warnings for the user.
    pub warnings: Vec<String>,
    /// Notes about the run, not part of any digest.
    pub notes: RunNotes,
}

impl InspectionHeader {
    /// The header of a finished dataset: reads job, manifest and notes.
    pub(super) fn of(reader: &DatasetReader, headline: String) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        Ok(Self {
            name: dataset_name(reader)?,
            headline,
            generator: manifest.generator.clone(),
            product: manifest.product,
            format_version: manifest.format_version,
            root: manifest.root,
            classes: manifest.classes.clone(),
            job: manifest.job,
            shards: manifest.shards.len() as u64,
            shard_bytes: manifest.shards.iter().map(|shard| shard.bytes).sum(),
            warnings: manifest.warnings.clone(),
            notes: RunNotes::read(reader.folder())?,
        })
    }

    /// Writes the name of the dataset, its headline and its root digest.
    pub(super) fn write_names(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {}, format {}, made by {}",
            self.name.shown(),
            self.product,
            self.format_version,
            self.generator.shown()
        )?;
        writeln!(f, "  {}", self.headline)?;
        writeln!(f, "  root      {}", self.root)
    }

    /// Writes a line for each reason of rejected samples.
    pub(super) fn write_rejected(f: &mut fmt::Formatter<'_>, rejected: &BTreeMap<String, u64>) -> fmt::Result {
        rejected.iter().try_for_each(|(reason, count)| {
            writeln!(f, "            {:>9} rejected: {}", grouped(*count), reason.shown())
        })
    }

    /// Writes the line about shards, without the line end.
    pub(super) fn write_shards(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "  shards    {} with {} bytes", grouped(self.shards), grouped(self.shard_bytes))
    }

    /// Writes a line for each warning.
    pub(super) fn write_warnings(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lines = self.warnings.iter().map(|line| remark_in_words(line));
        capped(lines, MOST_REMARKS, "remarks").iter().try_for_each(|line| writeln!(f, "{line}"))
    }
}

/// The facts of a dataset of any product. `Display` writes text; serialising gives JSON.
#[derive(Clone, Debug, PartialEq)]
pub struct Inspection {
    text: String,
    facts: Value,
}

impl Inspection {
    /// Creates an inspection from the facts of a product.
    pub(super) fn of(facts: &(impl fmt::Display + Serialize)) -> Self {
        Self {
            text: facts.to_string(),
            facts: serde_json::to_value(facts).expect("facts are plain data with text keys"),
        }
    }
}

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Serialize for Inspection {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.facts.serialize(serializer)
    }
}

/// Opens a finished dataset of one product.
///
/// # Errors
/// When the dataset is not finished, damaged, or of another product.
pub(super) fn open_of(folder: &Folder, product: Product) -> Result<DatasetReader, DatasetError> {
    let reader = DatasetReader::open(folder)?;
    let found = reader.manifest().product;
    if found == product {
        return Ok(reader);
    }
    Err(DatasetError::Invalid {
        path: folder.path().to_owned(),
        problem: format!("a dataset of {found}, not of {product}"),
        remedy: "use `graspmill inspect`, which supports every product",
    })
}

/// At most `most` members of a list at even steps: the middle one of each of as many equal runs.
pub(super) fn evenly<T: Copy>(list: &[T], most: usize) -> Vec<T> {
    let count = list.len().min(most);
    (0..count).map(|number| list[(2 * number + 1) * list.len() / (2 * count)]).collect()
}

/// The resolved job of a dataset.
///
/// # Errors
/// When it is missing or damaged.
pub(crate) fn job_table(reader: &DatasetReader) -> Result<toml::Table, DatasetError> {
    reader.job_text()?.parse().map_err(|error: toml::de::Error| DatasetError::Invalid {
        path: reader.folder().path_of(layout::JOB),
        problem: error.message().to_owned(),
        remedy: "delete manifest.json and `run` the job again: the shards are kept",
    })
}

/// Whether the job of a dataset measures depth with a perfect sensor, which has a return wherever there is a surface. Jobs
/// without depth have none.
///
/// # Errors
/// When the job is missing or damaged.
pub fn has_perfect_sensor(reader: &DatasetReader) -> Result<bool, DatasetError> {
    let job = job_table(reader)?;
    let profile = job.get("sensor").and_then(|sensor| sensor.get("profile")).and_then(|profile| profile.as_str());
    Ok(profile == Some("none"))
}

/// Name of a dataset's job from its text, or else the name of the folder.
///
/// # Errors
/// When the job is missing or damaged.
pub fn dataset_name(reader: &DatasetReader) -> Result<String, DatasetError> {
    let job = job_table(reader)?;
    let named = (job.get("name")).or_else(|| job.get("job")?.get("name")).and_then(|name| name.as_str());
    let folder = || reader.folder().path().file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(named.map_or_else(folder, str::to_owned))
}
