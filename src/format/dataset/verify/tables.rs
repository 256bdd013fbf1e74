//! Checks of everything except the shards: the tables against the ledgers and each other, field and shapes, and foreign files.

use std::{
    collections::{BTreeMap, BTreeSet},
    io::{self, Write},
    sync::{Arc, Mutex},
};

use mcap::records::Record;

use super::{
    super::finish::{count_row, reject_line},
    report::{Problem, VerifyReport, whole},
};
use crate::{
    Channel, FORMAT_VERSION,
    storage::{
        Counts, DatasetError, IndexFormat, IndexWriter, Ledger, Manifest,
        error::REWRITE,
        folder::{Hashed, SET_ASIDE, hash_grown, mark_text, read_mark, shards_folder, sorted_names},
        index::{IndexRow, index_columns},
        layout::{ASSETS, INDEX, MANIFEST, PREVIEW, REJECTS, RUN, SHARDS, SPLITS, ShardName},
        shard_file::{parse, read_at, read_summary, records, unpack},
        subjects::{Subjects, object_of},
    },
};
use kernel::{
    files::{self, Bound, BoundedLines, Folder},
    ids::{Digest, ObjectId},
    words::{Split, SplitTable},
};

pub(super) fn check_files(folder: &Folder, manifest: &Manifest) -> Vec<Problem> {
    let mut problems = Vec::new();
    for (name, entry) in &manifest.files {
        // A file that has grown is another one, regardless of its digest.
        match hash_grown(folder, name, entry.bytes) {
            Ok(Hashed::Grown(bytes)) => {
                let what = format!("its content has changed: saved {} bytes, found {bytes} bytes", entry.bytes);
                problems.push(whole(name, what, REWRITE));
            }
            Ok(Hashed::Whole(digest, bytes)) if (digest, bytes) == (entry.digest, entry.bytes) => {}
            Ok(Hashed::Whole(digest, bytes)) => {
                let what = format!(
                    "its content has changed: saved digest {} ({} bytes), calculated {} ({bytes} bytes)",
                    entry.digest.short(),
                    entry.bytes,
                    digest.short()
                );
                problems.push(whole(name, what, REWRITE));
            }
            Err(error) => problems.push(whole(name, error.to_string(), REWRITE)),
        }
    }
    problems
}

/// The rows of the asset table that enter the root.
#[derive(serde::Deserialize)]
pub(super) struct AssetRows {
    format_version: u32,
    pub objects: Vec<serde_json::Value>,
    #[serde(default)]
    pub subjects: Vec<serde_json::Value>,
    #[serde(default)]
    pub hands: Vec<serde_json::Value>,
    #[serde(default)]
    pub containers: Vec<serde_json::Value>,
    pub refused: Vec<serde_json::Value>,
}

pub(super) fn read_assets(folder: &Folder) -> Result<AssetRows, String> {
    let text = folder.read(ASSETS, Bound::DATASET_TABLE).map_err(|error| error.to_string())?;
    let rows: AssetRows = serde_json::from_slice(&text).map_err(|error| error.to_string())?;
    match rows.format_version {
        FORMAT_VERSION => Ok(rows),
        found => Err(format!("it has format version {found}, the manifest {FORMAT_VERSION}")),
    }
}

pub(super) fn check_foreign(
    folder: &Folder,
    manifest: &Manifest,
    problems: &mut Vec<Problem>,
    notes: &mut Vec<String>,
) -> Result<(), DatasetError> {
    let known: BTreeSet<&str> = manifest.shards.iter().map(|shard| shard.file.as_str()).collect();
    if !folder.contains(SHARDS) {
        return Ok(());
    }
    for name in sorted_names(&shards_folder(folder))? {
        let file = format!("{SHARDS}/{name}");
        if files::is_temporary_name(&name) {
            notes.push(format!("{file} is a leftover of a run that was killed, or belongs to a run in progress"));
        } else if name.strip_suffix(SET_ASIDE).is_some_and(|name| ShardName::parse(name).is_some()) {
            notes.push(format!("{file} was set aside by a run; it can be deleted"));
        } else if !known.contains(name.as_str()) {
            let what = "this file is not in the manifest".to_owned();
            problems.push(whole(&file, what, "delete it or move it away"));
        }
    }
    Ok(())
}

/// Compares the folder's mark with the manifest.
pub(super) fn check_mark(folder: &Folder, manifest: &Manifest, problems: &mut Vec<Problem>) {
    let remedy = "delete it and `run` the job again: finished shards are kept";
    let mark = match read_mark(folder) {
        Ok(Some(mark)) => mark,
        Ok(None) => return problems.push(whole(RUN, "the file is missing".to_owned(), remedy)),
        Err(error) => return problems.push(whole(RUN, error.to_string(), remedy)),
    };
    if !manifest.is_of(&mark) {
        let what = format!(
            "it was begun for job {}, {} samples in {} shards of {}; the manifest lists job {}, {} samples in {} shards",
            mark.job.0.short(),
            mark.samples,
            mark.shards,
            mark.shard_samples,
            manifest.job.0.short(),
            manifest.counts.samples,
            manifest.shards.len()
        );
        problems.push(whole(RUN, what, remedy));
    } else if folder.read(RUN, Bound::RUN).is_ok_and(|bytes| bytes != mark_text(&mark).as_bytes()) {
        problems.push(whole(RUN, "its bytes are not the ones that a run writes".to_owned(), remedy));
    }
}

/// The tables that are made of the ledgers, row by row.
pub(super) struct RowChecks<'a> {
    manifest: &'a Manifest,
    channels: Vec<Channel>,
    subjects: &'a Subjects,
    splits: Option<&'a SplitTable>,
    /// The index, written again.
    index: Option<Box<dyn IndexWriter + 'a>>,
    index_digest: Arc<Mutex<blake3::Hasher>>,
    rejects: Option<BoundedLines>,
    counts: Counts,
    /// All ledgers were there: counts can be compared with the manifest's.
    whole: bool,
    found: Vec<Problem>,
}

/// A sink that digests bytes.
struct DigestSink(Arc<Mutex<blake3::Hasher>>);

impl Write for DigestSink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().map_err(|_| io::ErrorKind::Other)?.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<'a> RowChecks<'a> {
    /// Opens the rejects, and begins to write the index again.
    pub fn open(
        folder: &Folder,
        manifest: &'a Manifest,
        (subjects, splits): (&'a Subjects, Option<&'a SplitTable>),
        index: Option<&'a dyn IndexFormat>,
        problems: &mut Vec<Problem>,
    ) -> Self {
        let channels = manifest.channels();
        let index_digest = Arc::new(Mutex::new(blake3::Hasher::new()));
        let sink = Box::new(DigestSink(Arc::clone(&index_digest)));
        let index = index.and_then(|format| format.begin(sink, &index_columns(manifest.product, &channels)).ok());
        let rejects = match folder.open(REJECTS) {
            Ok(file) => Some(BoundedLines::new(file, Bound::REJECTS_LINE)),
            Err(error) => {
                if !problems.iter().any(|problem| problem.file == REJECTS) {
                    problems.push(whole(REJECTS, error.to_string(), REWRITE));
                }
                None
            }
        };
        let (counts, found) = (Counts::default(), Vec::new());
        Self { manifest, channels, subjects, splits, index, index_digest, rejects, counts, whole: true, found }
    }

    /// The next shard's rows. Without a ledger nothing after it can be compared.
    pub fn shard(&mut self, ledger: Option<&Ledger>) {
        let Some(ledger) = ledger else {
            self.whole = false;
            // The number of its rejected samples is unknown.
            (self.rejects, self.index) = (None, None);
            return;
        };
        for row in &ledger.rows {
            let split = self.splits.and_then(|splits| splits.split_of(&row.sample));
            count_row(&mut self.counts, self.manifest.product, &self.channels, row, split);
            if let (Some(index), Some((_, name, id))) = (&mut self.index, self.subjects.get(&row.sample.subject)) {
                let row = IndexRow { row, subject: [name, id], split, shard: ledger.shard.0 };
                if index.push(&row.cells(self.manifest.product, &self.channels)).is_err() {
                    self.index = None;
                }
            }
            if let (Some(line), Some(rejects)) = (reject_line(row), &mut self.rejects) {
                let at = format!("sample {}", row.index);
                match rejects.next() {
                    Some(Ok(found)) if found == line.as_bytes() => {}
                    Some(Ok(_)) => self.push(REJECTS, at, format!("its line is not the ledger's: {line}")),
                    Some(Err(error)) => self.push(REJECTS, at, error.to_string()),
                    None => self.push(REJECTS, at, "its line is missing".to_owned()),
                }
            }
        }
    }

    fn push(&mut self, file: &str, location: String, what: String) {
        if self.found.iter().filter(|problem| problem.file == file).count() < VerifyReport::MAX {
            self.found.push(Problem { location, ..whole(file, what, REWRITE) });
        }
    }

    /// Problems of the rows, of the index as a whole, and of the manifest's counts.
    pub fn finish(mut self, assets: &AssetRows) -> Vec<Problem> {
        if self.rejects.as_mut().is_some_and(|rejects| rejects.next().is_some()) {
            self.push(REJECTS, String::new(), "it has more lines than the ledgers have rejects".to_owned());
        }
        self.check_index();
        let said = &self.manifest.counts;
        let counts = Counts {
            objects: assets.objects.len() as u64,
            refused_meshes: assets.refused.len() as u64,
            ..self.counts.clone()
        };
        if self.whole && counts != *said {
            let what = format!("its counts are {said:?}, those of ledgers and tables {counts:?}");
            self.found.push(whole(MANIFEST, what, REWRITE));
        }
        self.found
    }

    /// Equal ledgers give an equal index: its bytes are compared, not its cells.
    fn check_index(&mut self) {
        let Some(index) = self.index.take().filter(|_| self.whole) else { return };
        if index.finish().is_err() {
            return;
        }
        let hash = |hasher: &blake3::Hasher| Digest(*hasher.finalize().as_bytes());
        let calculated = self.index_digest.lock().ok().map(|hasher| hash(&hasher));
        let saved = self.manifest.files.get(INDEX).map(|entry| entry.digest);
        if calculated.is_some() && calculated != saved {
            let what = "it is not the table made from the ledgers".to_owned();
            self.push(INDEX, String::new(), what);
        }
    }
}

/// Compares the splits with the objects, and finds shapes in two splits. A leak that the dataset announces is a note.
pub(super) fn check_splits(
    splits: &SplitTable,
    assets: &AssetRows,
    manifest: &Manifest,
    problems: &mut Vec<Problem>,
    notes: &mut Vec<String>,
) {
    let objects: BTreeSet<ObjectId> = assets.objects.iter().chain(&assets.subjects).filter_map(object_of).collect();
    let divided: BTreeSet<ObjectId> = splits.objects.iter().map(|row| row.object).collect();
    if objects != divided {
        let (more, fewer) = (divided.difference(&objects).count(), objects.difference(&divided).count());
        let what = format!("it has {more} objects that assets.json lacks, and lacks {fewer} that assets.json has");
        problems.push(whole(SPLITS, what, REWRITE));
    }
    for (subset, said) in (0u32..).zip(&splits.training_subsets) {
        let found = splits.objects.iter().filter(|row| row.subset.is_some_and(|of| of <= subset)).count();
        if found != *said as usize {
            let what = format!("training subset {subset} has {found} objects, it states {said}");
            problems.push(whole(SPLITS, what, REWRITE));
        }
    }
    let mut sides: BTreeMap<&str, (BTreeSet<Split>, Vec<&str>)> = BTreeMap::new();
    for row in &assets.objects {
        let geometry = row.get("geometry").and_then(|geometry| geometry.as_str());
        let split = object_of(row).and_then(|object| splits.object(&object));
        if let (Some(geometry), Some(split)) = (geometry, split) {
            let (found, names) = sides.entry(geometry).or_default();
            found.insert(split.split);
            names.push(row.get("name").and_then(|name| name.as_str()).unwrap_or_default());
        }
    }
    // Inherited splits are announced by the dataset that they come from.
    let announced = manifest.product.inherits_splits
        || manifest.warnings.iter().any(|warning| warning.starts_with("leak: ") && warning.contains("geometries"));
    for (found, names) in sides.into_values().filter(|(found, _)| found.len() > 1) {
        let found: Vec<&str> = found.into_iter().map(Split::name).collect();
        let what = format!("leak: {} have the same shape and are in {}", names.join(", "), found.join(" and "));
        match announced {
            true => notes.push(what),
            false => problems.push(whole(SPLITS, what, "divide the objects again: give them one group in the job")),
        }
    }
}

/// Checks the preview, which is not part of the dataset: damage in it is a note.
pub(super) fn check_preview(folder: &Folder, notes: &mut Vec<String>) {
    let read = || -> Result<(), String> {
        let file = folder.open(PREVIEW).map_err(|error| error.to_string())?;
        let bytes = file.metadata().map_err(|error| error.to_string())?.len();
        let summary = read_summary(&file, bytes).map_err(|error| error.to_string())?;
        for record in records(&summary) {
            let record = record.and_then(|(opcode, body)| parse(opcode, body));
            if let Record::ChunkIndex(chunk) = record.map_err(|error| error.to_string())? {
                let packed = read_at(folder, PREVIEW, chunk.chunk_start_offset, chunk.chunk_length)
                    .map_err(|error| error.to_string())?;
                unpack(&packed).map_err(|error| error.to_string())?;
            }
        }
        Ok(())
    };
    if let (true, Err(error)) = (folder.contains(PREVIEW), read()) {
        notes.push(format!(
            "{PREVIEW} (not part of the dataset) is damaged: {error}; delete it and `run` the job again"
        ));
    }
}
