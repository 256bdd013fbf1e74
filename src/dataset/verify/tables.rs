//! What stands beside the shards: the tables against the ledgers and each other, field and shapes, and what does not belong.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, File},
    io::{BufRead, BufReader, Lines},
    path::Path,
};

use mcap::records::Record;

use super::{
    super::{
        Counts, DatasetError, Ledger, Manifest, Shapes, Split, SplitTable,
        durable::TEMPORARY,
        error::REWRITE,
        field,
        finish::{Objects, count_row, object_of, reject_line},
        folder::{hash_file, read_mark, sorted_entries},
        index::{IndexRow, IndexRows},
        layout::{ASSETS, FIELD, INDEX, MANIFEST, PREVIEW, REJECTS, RUN, SHAPES, SHARDS, SPLITS},
        shard_file::{parse, read_at, read_summary, records, unpack},
    },
    Problem, VerifyLevel, VerifyReport,
    shards::Context,
    whole,
};
use crate::{
    geom::PoseLabel,
    ids::{Digest, ObjectId, Product},
    record::ReachabilityField,
};

/// The field against the shards' blocks and itself, where the product has one: the digest of its payload. `Err` when it
/// can't be read.
pub(super) fn check_field(
    context: &Context,
    intact_shards: u32,
    problems: &mut Vec<Problem>,
) -> Result<Option<Digest>, ()> {
    let manifest = context.manifest;
    if manifest.product != Product::Reachability {
        return Ok(None);
    }
    let (field, digest) = match field::read_with_digest(context.folder) {
        Ok(read) => read,
        Err(error) => {
            let what = if let DatasetError::Invalid { problem, .. } = error { problem } else { error.to_string() };
            problems.push(whole(FIELD, what, REWRITE));
            return Err(());
        }
    };
    let mut wrong = |what: String| problems.push(whole(FIELD, what, REWRITE));
    // What the blocks say is known only where every shard is what it should be.
    if context.options.level == VerifyLevel::Full && intact_shards as usize == manifest.shards.len() {
        match field::labels_of(context.folder, &manifest.shards, field.header.grid.cells()) {
            Ok(labels) => compare_field(&field, &labels, &mut wrong),
            Err(error) => wrong(error.to_string()),
        }
    }
    Ok(Some(digest))
}

/// The shapes against the asset table.
pub(super) fn check_shapes(folder: &Path, rows: &AssetRows, problems: &mut Vec<Problem>) {
    let mut objects: Vec<ObjectId> = rows.objects.iter().filter_map(object_of).collect();
    objects.sort_unstable();
    let hand = rows.hands.first().and_then(object_of);
    let checked = Shapes::open(folder).and_then(|shapes| {
        shapes.check(hand, &objects)?;
        shapes.trial_hand()
    });
    if let Err(error) = checked {
        let what = if let DatasetError::Invalid { problem, .. } = error { problem } else { error.to_string() };
        problems.push(whole(SHAPES, what, REWRITE));
    }
}

/// Labels against the blocks', distances against those computed anew.
fn compare_field(field: &ReachabilityField, labels: &[PoseLabel], wrong: &mut impl FnMut(String)) {
    let others = field.labels.iter().zip(labels).filter(|(field, block)| field != block).count();
    if others > 0 {
        return wrong(format!("{others} of {} labels are not those of the shards", labels.len()));
    }
    let distances = field.header.distances(labels);
    let bits = |distance: &f32| distance.to_bits();
    let others = field.distances.iter().zip(&distances).filter(|(a, b)| bits(a) != bits(b)).count();
    if others > 0 {
        wrong(format!("{others} of {} distances are not those of its labels", distances.len()));
    }
}

pub(super) fn check_files(folder: &Path, manifest: &Manifest) -> Vec<Problem> {
    let mut problems = Vec::new();
    for (name, entry) in &manifest.files {
        match hash_file(&folder.join(name)) {
            Ok((digest, bytes)) if (digest, bytes) == (entry.digest, entry.bytes) => {}
            Ok((digest, bytes)) => {
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

/// The rows of the asset table that stand in the root.
#[derive(serde::Deserialize)]
pub(super) struct AssetRows {
    pub objects: Vec<serde_json::Value>,
    #[serde(default)]
    pub hands: Vec<serde_json::Value>,
    #[serde(default)]
    pub refused: Vec<serde_json::Value>,
}

pub(super) fn read_assets(folder: &Path) -> Result<AssetRows, String> {
    let text = fs::read(folder.join(ASSETS)).map_err(|error| error.to_string())?;
    serde_json::from_slice(&text).map_err(|error| error.to_string())
}

pub(super) fn check_foreign(
    folder: &Path,
    manifest: &Manifest,
    problems: &mut Vec<Problem>,
    notes: &mut Vec<String>,
) -> Result<(), DatasetError> {
    let known: BTreeSet<&str> = manifest.shards.iter().map(|shard| shard.file.as_str()).collect();
    let shards = folder.join(SHARDS);
    if !shards.exists() {
        return Ok(());
    }
    for path in sorted_entries(&shards)? {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let file = format!("{SHARDS}/{name}");
        if name.ends_with(TEMPORARY) {
            notes.push(format!("{file} is a leftover of a run that was killed, or of one at work"));
        } else if name.ends_with(".bad") {
            notes.push(format!("{file} was set aside by a run; it can be deleted"));
        } else if !known.contains(name.as_str()) {
            let what = "the manifest does not know this file".to_owned();
            problems.push(whole(&file, what, "delete it or move it away"));
        }
    }
    Ok(())
}

/// What the folder was begun for, against the manifest. Of a dataset of one shard the size of shards cannot be told.
pub(super) fn check_mark(folder: &Path, manifest: &Manifest, problems: &mut Vec<Problem>) {
    let remedy = "delete it and `run` the job again: finished shards are kept";
    let mark = match read_mark(folder) {
        Ok(Some(mark)) => mark,
        Ok(None) => return problems.push(whole(RUN, "the file is missing".to_owned(), remedy)),
        Err(error) => return problems.push(whole(RUN, error.to_string(), remedy)),
    };
    let shards = manifest.shards.len();
    let size = match &manifest.shards[..] {
        [first, _, ..] => u64::from(mark.shard_samples) == first.samples,
        [only] => u64::from(mark.shard_samples) >= only.samples,
        [] => true,
    };
    let found = (mark.product, mark.job, mark.samples, mark.shards as usize);
    if found != (manifest.product, manifest.job, manifest.counts.samples, shards) || !size {
        let what = format!(
            "it was begun for job {}, {} samples in {} shards of {}; the manifest says job {}, {} samples in {shards} shards",
            mark.job.0.short(),
            mark.samples,
            mark.shards,
            mark.shard_samples,
            manifest.job.0.short(),
            manifest.counts.samples
        );
        problems.push(whole(RUN, what, remedy));
    }
}

/// The tables that are made of the ledgers, row by row.
pub(super) struct RowChecks<'a> {
    manifest: &'a Manifest,
    objects: &'a Objects,
    splits: Option<&'a SplitTable>,
    index: Option<IndexRows>,
    rejects: Option<Lines<BufReader<File>>>,
    counts: Counts,
    /// Patches: samples of each type.
    kinds: BTreeMap<u32, u64>,
    /// All ledgers were there: counts can be held against the manifest.
    whole: bool,
    found: Vec<Problem>,
}

impl<'a> RowChecks<'a> {
    /// Opens index and rejects.
    pub fn open(
        folder: &Path,
        manifest: &'a Manifest,
        objects: &'a Objects,
        splits: Option<&'a SplitTable>,
        problems: &mut Vec<Problem>,
    ) -> Self {
        let known = |problems: &[Problem], name: &str| problems.iter().any(|problem| problem.file == name);
        let index = match IndexRows::open(&folder.join(INDEX), manifest.product, &manifest.channels()) {
            Ok(index) => Some(index),
            Err(what) => {
                if !known(problems, INDEX) {
                    problems.push(whole(INDEX, what, REWRITE));
                }
                None
            }
        };
        let rejects = match File::open(folder.join(REJECTS)) {
            Ok(file) => Some(BufReader::new(file).lines()),
            Err(error) => {
                if !known(problems, REJECTS) {
                    problems.push(whole(REJECTS, error.to_string(), REWRITE));
                }
                None
            }
        };
        let (counts, kinds, found) = (Counts::default(), BTreeMap::new(), Vec::new());
        Self { manifest, objects, splits, index, rejects, counts, kinds, whole: true, found }
    }

    /// The next shard's rows; without a ledger, `samples` rows cannot be held against anything.
    pub fn shard(&mut self, ledger: Option<&Ledger>, samples: u64) {
        let Some(ledger) = ledger else {
            self.whole = false;
            // Nobody knows how many of them were rejected.
            self.rejects = None;
            if let Some(index) = &mut self.index {
                index.skip(samples);
            }
            return;
        };
        for row in &ledger.rows {
            let split = self.splits.and_then(|splits| splits.of(&row.sample));
            count_row(&mut self.counts, row, split);
            if let Some(facts) = row.facts.patches() {
                *self.kinds.entry(facts.kind).or_default() += 1;
            }
            let at = format!("sample {}", row.index);
            if let (Some(index), Some((_, object, subject))) = (&mut self.index, self.objects.get(&row.sample.subject))
            {
                let row = IndexRow { row, object, subject, split, shard: ledger.shard.0 };
                if let Err(what) = index.compare(&row) {
                    self.push(INDEX, at.clone(), what);
                }
            }
            if let (Some(line), Some(rejects)) = (reject_line(row), &mut self.rejects) {
                match rejects.next() {
                    Some(Ok(found)) if found == line => {}
                    Some(Ok(_)) => self.push(REJECTS, at, format!("its line is not the ledger's: {line}")),
                    Some(Err(error)) => self.push(REJECTS, at, error.to_string()),
                    None => self.push(REJECTS, at, "its line is missing".to_owned()),
                }
            }
        }
    }

    fn push(&mut self, file: &str, place: String, what: String) {
        if self.found.iter().filter(|problem| problem.file == file).count() < VerifyReport::MOST {
            self.found.push(Problem { place, ..whole(file, what, REWRITE) });
        }
    }

    /// What is wrong with the rows, and the manifest's counts against them and the asset table.
    pub fn finish(mut self, assets: &AssetRows) -> Vec<Problem> {
        if self.rejects.as_mut().is_some_and(|rejects| rejects.next().is_some()) {
            self.push(REJECTS, String::new(), "it has more lines than the ledgers have rejects".to_owned());
        }
        let said = &self.manifest.counts;
        let counts = Counts {
            objects: assets.objects.len() as u64,
            refused_meshes: assets.refused.len() as u64,
            types: said.types.clone(),
            ..self.counts.clone()
        };
        if self.whole && counts != *said {
            let what = format!("its counts are {said:?}, those of ledgers and tables {counts:?}");
            self.found.push(whole(MANIFEST, what, REWRITE));
        }
        let chosen = said.types.iter().flat_map(|types| &types.chosen);
        let of_types: BTreeMap<u32, u64> = chosen
            .map(|kind| (*kind, said.types.as_ref().and_then(|types| types.counts.get(kind)).copied().unwrap_or(0)))
            .collect();
        if self.whole && of_types != self.kinds {
            let what =
                format!("its grasps of the chosen types are {of_types:?}, those of the ledgers {:?}", self.kinds);
            self.found.push(whole(MANIFEST, what, REWRITE));
        }
        self.found
    }
}

/// The splits against the objects, and what stands on two sides. A leak that the dataset announces is a note.
pub(super) fn check_splits(
    splits: &SplitTable,
    assets: &AssetRows,
    manifest: &Manifest,
    problems: &mut Vec<Problem>,
    notes: &mut Vec<String>,
) {
    let objects: BTreeSet<ObjectId> = assets.objects.iter().filter_map(object_of).collect();
    let divided: BTreeSet<ObjectId> = splits.objects.iter().map(|row| row.object).collect();
    if objects != divided {
        let (more, fewer) = (divided.difference(&objects).count(), objects.difference(&divided).count());
        let what = format!("it has {more} objects that assets.json lacks and lacks {fewer} that stand there");
        problems.push(whole(SPLITS, what, REWRITE));
    }
    for (subset, said) in (0u32..).zip(&splits.training_subsets) {
        let found = splits.objects.iter().filter(|row| row.subset.is_some_and(|of| of <= subset)).count();
        if found != *said as usize {
            let what = format!("training subset {subset} has {found} objects, it says {said}");
            problems.push(whole(SPLITS, what, REWRITE));
        }
    }
    let mut sides: BTreeMap<&str, (BTreeSet<Split>, Vec<&str>)> = BTreeMap::new();
    for row in &assets.objects {
        let geometry = row.get("geometry").and_then(|geometry| geometry.as_str());
        let split = object_of(row).and_then(|object| splits.object(&object));
        if let (Some(geometry), Some(split)) = (geometry, split) {
            let (models, names) = sides.entry(geometry).or_default();
            models.insert(split.models);
            names.push(row.get("name").and_then(|name| name.as_str()).unwrap_or_default());
        }
    }
    // The sides of patches are those of their grasps, whose dataset announces its leaks itself.
    let announced = manifest.product == Product::Patches
        || manifest.warnings.iter().any(|warning| warning.starts_with("leak: ") && warning.contains("geometries"));
    for (models, names) in sides.into_values().filter(|(models, _)| models.len() > 1) {
        let models: Vec<&str> = models.into_iter().map(Split::name).collect();
        let what = format!("leak: {} are of one shape and stand in {}", names.join(", "), models.join(" and "));
        match announced {
            true => notes.push(what),
            false => problems.push(whole(SPLITS, what, "divide the objects anew: give them one group in the job")),
        }
    }
}

/// The preview, which is no part of the dataset: what is wrong with it is a note.
pub(super) fn check_preview(folder: &Path, notes: &mut Vec<String>) {
    let path = folder.join(PREVIEW);
    let read = || -> Result<(), String> {
        let file = File::open(&path).map_err(|error| error.to_string())?;
        let bytes = file.metadata().map_err(|error| error.to_string())?.len();
        let summary = read_summary(&file, bytes).map_err(|error| error.to_string())?;
        for record in records(&summary) {
            let record = record.and_then(|(opcode, body)| parse(opcode, body));
            if let Record::ChunkIndex(chunk) = record.map_err(|error| error.to_string())? {
                let packed =
                    read_at(&path, chunk.chunk_start_offset, chunk.chunk_length).map_err(|error| error.to_string())?;
                unpack(&packed).map_err(|error| error.to_string())?;
            }
        }
        Ok(())
    };
    if let (true, Err(error)) = (path.exists(), read()) {
        notes
            .push(format!("{PREVIEW} (no part of the dataset) is damaged: {error}; delete it and `run` the job again"));
    }
}
