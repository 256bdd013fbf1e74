//! Several datasets in one folder, made from the same objects: `set.json` lists them, and the samples of each object.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::{
    DatasetError, DatasetReader, Manifest, durable,
    folder::sorted_names,
    layout::{MANIFEST, REPORT, SET},
    seal::{sealed, unsealed},
};
use crate::{FORMAT_VERSION, Product};
use kernel::{
    files::{self, Bound, Folder},
    ids::{Digest, ObjectId},
    words::NumberClass,
};

/// `set.json`: the datasets to make, and, once all of them are finished, their content.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SetTable {
    /// Format on disk.
    pub format_version: u32,
    /// Name, for people.
    pub name: String,
    /// The datasets, in the order in which they are made; each is in the folder of its name.
    pub jobs: Vec<SetEntry>,
    /// Content of the finished datasets.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made: Option<SetContent>,
}

/// A dataset of a set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SetEntry {
    /// Name of the dataset and of its folder.
    pub name: String,
    /// Product of the dataset.
    pub product: Product,
}

/// Content of the finished datasets of a set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SetContent {
    /// Over names and roots of the datasets, by name.
    pub root: Digest,
    /// Root of each dataset, by name.
    pub roots: BTreeMap<String, Digest>,
    /// Roots of its classes of numbers.
    pub classes: BTreeMap<String, BTreeMap<NumberClass, Digest>>,
    /// The objects, by name and content, without robots.
    pub objects: Vec<SetObject>,
    /// Names with more than one content: their samples are not of one object.
    pub differing: BTreeSet<String>,
}

/// An object of a set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SetObject {
    /// Name of the object.
    pub name: String,
    /// Digest of the object: `SampleId.subject` in every dataset.
    pub object: ObjectId,
    /// Kept samples of the object, by dataset. Datasets without the object are omitted.
    pub samples: BTreeMap<String, u64>,
}

impl SetEntry {
    /// Whether a name is safe as a folder on every machine.
    pub fn is_name(name: &str) -> bool {
        let begins = name.starts_with(|first: char| first.is_ascii_lowercase() || first.is_ascii_digit());
        begins && name.bytes().all(|byte| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_'))
    }
}

impl SetTable {
    /// A set without finished datasets.
    pub fn new(name: &str, jobs: Vec<SetEntry>) -> Self {
        Self { format_version: FORMAT_VERSION, name: name.to_owned(), jobs, made: None }
    }

    /// Reads the `set.json` of a folder; `None` when it has none.
    ///
    /// # Errors
    /// When the file can't be read, is not such JSON, names a folder elsewhere, or is of another format version.
    pub fn read(folder: &Folder) -> Result<Option<Self>, DatasetError> {
        let path = folder.path_of(SET);
        let text = match folder.read(SET, Bound::DATASET_TABLE) {
            Ok(text) => text,
            Err(error) if files::is_absent(&error) => return Ok(None),
            Err(error) => return Err(DatasetError::io("reading", &path)(error)),
        };
        let invalid = |problem: String| DatasetError::Invalid {
            path: path.clone(),
            problem,
            remedy: "delete it and `run` the set again: what is made is kept",
        };
        let text = unsealed(&text).map_err(invalid)?;
        let table: Self = serde_json::from_slice(&text).map_err(|error| invalid(error.to_string()))?;
        if table.format_version != FORMAT_VERSION {
            return Err(DatasetError::Version { path, found: table.format_version, expected: FORMAT_VERSION });
        }
        // Reports are written into the folders of these names.
        if let Some(job) = table.jobs.iter().find(|job| !SetEntry::is_name(&job.name)) {
            return Err(invalid(format!("'{}' is not the name of a dataset in it", job.name)));
        }
        Ok(Some(table))
    }

    /// Marks `folder` as this set's, or finds that it is; makes it where missing. `set.json` may have been lost: folders of this
    /// set's datasets and its report are accepted.
    ///
    /// # Errors
    /// When it holds another set, or something else; when it can't be made or written.
    pub fn begin(&self, folder: &Folder) -> Result<(), DatasetError> {
        if let Some(found) = Self::read(folder)? {
            if found.jobs != self.jobs {
                return Err(DatasetError::ForeignSet {
                    folder: folder.path().to_owned(),
                    found: found.words(),
                    expected: self.words(),
                });
            }
            return Ok(());
        }
        folder.create().map_err(DatasetError::io("creating", folder.path()))?;
        let is_ours = |name: &String| {
            self.jobs.iter().any(|job| job.name == *name) || files::is_temporary_name(name) || name == REPORT
        };
        if let Some(entry) = sorted_names(folder)?.into_iter().find(|name| !is_ours(name)) {
            return Err(DatasetError::NotADataset { folder: folder.path().to_owned(), entry });
        }
        self.write(folder)
    }

    /// Content of the datasets as they are now, regardless of `set.json`.
    ///
    /// # Errors
    /// When some are not finished: all of these are named. When one can't be read.
    pub fn content(&self, folder: &Folder) -> Result<SetContent, DatasetError> {
        let mut missing = Vec::new();
        for SetEntry { name, .. } in &self.jobs {
            let dataset = folder.subfolder(name);
            let manifest = dataset.entry(MANIFEST).map_err(DatasetError::io("reading", dataset.path()))?;
            if manifest.is_none() {
                missing.push(name.clone());
            }
        }
        if missing.is_empty() {
            return SetContent::read(folder, &self.jobs);
        }
        Err(DatasetError::UnfinishedSet { folder: folder.path().to_owned(), missing })
    }

    /// Gathers the content of the datasets and writes it.
    ///
    /// # Errors
    /// When one is not finished or can't be read, or the file can't be written.
    pub fn finish(&mut self, folder: &Folder) -> Result<(), DatasetError> {
        self.made = Some(SetContent::read(folder, &self.jobs)?);
        self.write(folder)
    }

    fn write(&self, folder: &Folder) -> Result<(), DatasetError> {
        let text = serde_json::to_string_pretty(self).expect("a set is plain data with text keys") + "\n";
        durable::write_file(folder, SET, sealed(&text).as_bytes()).map(drop)
    }

    fn words(&self) -> String {
        let words = |job: &SetEntry| format!("{} ({})", job.name, job.product);
        self.jobs.iter().map(words).collect::<Vec<_>>().join(", ")
    }
}

impl SetContent {
    /// Gathers the content of the finished datasets in the folder of a set.
    ///
    /// # Errors
    /// When one is not finished or can't be read.
    pub fn read(folder: &Folder, jobs: &[SetEntry]) -> Result<Self, DatasetError> {
        let (mut roots, mut classes, mut objects) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        for SetEntry { name, product } in jobs {
            let folder = folder.subfolder(name);
            // A dataset of a map has a robot in place of objects.
            let manifest = if product.subjects_are_objects {
                let reader = DatasetReader::open(&folder)?;
                add_objects(&reader, name, &mut objects)?;
                reader.manifest().clone()
            } else {
                Manifest::read(&folder)?
            };
            roots.insert(name.clone(), manifest.root);
            classes.insert(name.clone(), manifest.classes);
        }
        let parts = roots.iter().flat_map(|(name, root)| [name.as_bytes(), &root.0]);
        let root = Digest::hash_parts(parts);
        let objects: Vec<SetObject> =
            objects.into_iter().map(|((name, object), samples)| SetObject { name, object, samples }).collect();
        let twice = objects.windows(2).filter(|pair| pair[0].name == pair[1].name);
        let differing = twice.map(|pair| pair[0].name.clone()).collect();
        Ok(Self { root, roots, classes, objects, differing })
    }

    /// Objects of which every dataset that is about objects has kept samples.
    pub fn complete_objects(&self, jobs: &[SetEntry]) -> usize {
        let about = jobs.iter().filter(|job| job.product.subjects_are_objects);
        let has =
            |object: &&SetObject| about.clone().all(|job| object.samples.get(&job.name).is_some_and(|kept| *kept > 0));
        self.objects.iter().filter(has).count()
    }
}

/// Samples of each object, by name and content.
type Samples = BTreeMap<(String, ObjectId), BTreeMap<String, u64>>;

fn add_objects(reader: &DatasetReader, job: &str, objects: &mut Samples) -> Result<(), DatasetError> {
    let mut kept: BTreeMap<ObjectId, u64> = BTreeMap::new();
    for id in reader.indices(super::Selection::default()).filter_map(|index| reader.id(index)) {
        *kept.entry(id.subject).or_default() += 1;
    }
    for row in reader.assets()?.objects {
        let count = kept.get(&row.object).copied().unwrap_or_default();
        objects.entry((row.name, row.object)).or_default().insert(job.to_owned(), count);
    }
    Ok(())
}
