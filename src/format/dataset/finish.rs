//! Closing a dataset: from the shards' ledgers to index, tables, root digest and manifest.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{BufWriter, Write},
    path::Path,
};

use crate::{
    Channel, FORMAT_VERSION, FactKind, Product,
    extras::files_of_product,
    storage::{
        Counts, DatasetError, Fate, FileEntry, IndexFormat, IndexWriter, Ledger, LedgerRow, Manifest, RunMark,
        ShardEntry,
        durable::{self, TemporaryFile, json_text},
        error::REMAKE,
        folder::{hash_file, scan_shards, shards_folder},
        index::{IndexRow, index_columns},
        layout::{ASSETS, INDEX, JOB, MANIFEST, REJECTS, SHARDS, SPLITS, files_of},
        read_mark,
        reader::checked_splits,
        roots::{ClassChannels, Leaf, Roots},
        seal::sealed,
        shard_file::{ShardFile, invalid},
        subjects::{Subjects, asset_names, asset_tree, object_of},
    },
};
use kernel::{
    files::Folder,
    ids::{Digest, JobDigest, ShardId},
    words::{NumberClass, Split, SplitTable},
};

/// Content of a dataset's files other than its samples; plain data, independent of jobs.
#[derive(Clone, Debug, PartialEq)]
pub struct DatasetHeader {
    /// Product of the samples.
    pub product: Product,
    /// Program and version.
    pub generator: String,
    /// The job.
    pub job: JobDigest,
    /// The resolved job, the text of `job.toml`.
    pub job_text: String,
    /// Class of its channels' numbers: on which machines they are equal.
    pub class: NumberClass,
    /// Channels whose numbers are of another class, where they are stored.
    pub channel_classes: BTreeMap<Channel, NumberClass>,
    /// Facts of the machine that numbers of class physics and colour depend on; empty for exact ones.
    pub platform: BTreeMap<String, String>,
    /// The asset table: one JSON object per row, each with at least `object` (64 hexadecimal digits) and `name`. It must not
    /// contain paths or clocks: it is part of the root digest.
    pub assets: Vec<serde_json::Value>,
    /// Subjects that are not objects, in rows like those of the objects and part of the root digest like them; empty where the
    /// objects are the subjects.
    pub subjects: Vec<serde_json::Value>,
    /// The hands that touched, in rows like those of the objects and part of the root digest like them.
    pub hands: Vec<serde_json::Value>,
    /// The containers that are meshes, in rows like those of the objects and part of the root digest like them.
    pub containers: Vec<serde_json::Value>,
    /// Meshes that could not be used, in any form.
    pub refused: Vec<serde_json::Value>,
    /// Splits, of a product that has them; one row per subject.
    pub splits: Option<SplitTable>,
    /// Warnings for users.
    pub warnings: Vec<String>,
}

impl DatasetHeader {
    fn classes_of(&self, channels: &[Channel]) -> ClassChannels {
        let of = |channel| self.channel_classes.get(&channel).copied().unwrap_or(self.class);
        ClassChannels::new(channels, self.class, of)
    }
}

/// Closes a dataset whose shards are all done: checks that every sample index is accounted for once, writes the index
/// and the tables, and the manifest last. Reads the shards' ledgers only, one at a time, and keeps 64 bytes per sample and
/// class. Files that only its product has were written before.
///
/// Equal shards and headers give equal files. A dataset that is already closed is closed again.
///
/// # Errors
/// When shards or files are missing or contradict each other, a subject is unknown, a sample is listed twice, or a file can't be
/// written.
pub fn finish_dataset(
    folder: &Folder,
    header: &DatasetHeader,
    index: &dyn IndexFormat,
) -> Result<Manifest, DatasetError> {
    let mark = checked_mark(folder, header)?;
    let subjects = asset_names(folder.path(), header.assets.iter().chain(&header.subjects))?;
    for rows in [&header.hands, &header.containers] {
        asset_names(folder.path(), rows)?;
    }
    let splits = header.splits.clone().filter(|_| header.product.has_splits);
    let splits = splits.map(|splits| checked_splits(splits, &folder.path_of(SPLITS))).transpose()?;
    let scan = scan_shards(folder, &mark)?;
    let missing: Vec<u32> = (0..mark.shards).filter(|shard| !scan.done.contains_key(&ShardId(*shard))).collect();
    if !missing.is_empty() {
        return Err(DatasetError::MissingShards { shards: mark.shards, missing });
    }

    // One pass over the ledgers writes the index and the rejects, and collects the leaves of the roots.
    let (index_file, index_temporary) = TemporaryFile::create(folder, INDEX)?;
    let copy = index_file.try_clone().map_err(DatasetError::io("writing", &index_temporary.path()))?;
    let index_path = index_temporary.path();
    let mut pass = Pass::begin(folder, &mark, &subjects, splits.as_ref(), header, &index_path)?;
    pass.table = Some((index, copy));
    for done in scan.done.values() {
        pass.shard(&ShardFile::open(&shards_folder(folder), &done.name)?, done.digest, done.bytes)?;
    }
    pass.complete()?;
    let Pass { index, rejects, sums, channels, classes, leaves, .. } = pass;
    rejects.finish()?;
    index.map_or(Ok(()), IndexWriter::finish).map_err(DatasetError::io("writing", &index_path))?;
    index_temporary.publish(&index_file, INDEX)?;

    let roots = Roots::new(leaves, &classes, &subjects)?;
    let files = root_parts(folder, header.product)?;
    let root = roots.dataset(
        &asset_tree(header.assets.iter().chain(&header.subjects).chain(&header.hands).chain(&header.containers)),
        &files,
        &header.job,
    );
    for (name, text) in table_texts(header, splits.as_ref()) {
        durable::write_file(folder, name, text.as_bytes())?;
    }
    let entry = |name: &&str| {
        let (digest, bytes) = hash_file(folder, name)?;
        Ok::<_, DatasetError>(((*name).to_owned(), FileEntry { digest, bytes }))
    };
    let manifest = Manifest {
        format_version: FORMAT_VERSION,
        generator: header.generator.clone(),
        product: mark.product,
        root,
        classes: roots.classes,
        class_topics: classes.topics(),
        platform: header.platform.clone(),
        job: header.job,
        topics: channels.iter().map(|channel| channel.topic.to_owned()).collect(),
        counts: Counts {
            objects: header.assets.len() as u64,
            refused_meshes: header.refused.len() as u64,
            ..sums.counts
        },
        shards: sums.shards,
        files: files_of(mark.product).iter().map(entry).collect::<Result<_, _>>()?,
        warnings: header.warnings.clone(),
    };
    durable::write_file(folder, MANIFEST, sealed(&json_text(&manifest)).as_bytes())?;
    Manifest::read(folder)
}

/// The folder's mark, if it was begun for this header's job and product.
fn checked_mark(folder: &Folder, header: &DatasetHeader) -> Result<RunMark, DatasetError> {
    let mark = read_mark(folder)?.ok_or_else(|| DatasetError::NotADataset {
        folder: folder.path().to_owned(),
        entry: "no run.json".to_owned(),
    })?;
    if mark.job != header.job {
        return Err(DatasetError::ForeignJob {
            folder: folder.path().to_owned(),
            found: mark.job,
            expected: header.job,
        });
    }
    if mark.product != header.product {
        let problem = format!("the folder was begun for {}, the tables are of {}", mark.product, header.product);
        return Err(DatasetError::Invalid { path: folder.path().to_owned(), problem, remedy: "give another --out" });
    }
    Ok(mark)
}

/// Words and digests of the files that enter the root of a product's datasets.
pub(super) fn root_parts(folder: &Folder, product: Product) -> Result<Vec<(&'static str, Digest)>, DatasetError> {
    let parts = files_of_product(product).filter_map(|file| file.in_root.as_ref());
    parts.map(|part| Ok((part.word, (part.digest)(folder)?))).collect()
}

/// The tables that do not depend on the samples, each by its file name.
pub(super) fn table_texts(header: &DatasetHeader, splits: Option<&SplitTable>) -> Vec<(&'static str, String)> {
    let sorted = |rows: &[serde_json::Value]| {
        let mut rows = rows.to_vec();
        rows.sort_by_key(object_of);
        rows
    };
    let mut assets = serde_json::json!({
        "format_version": FORMAT_VERSION,
        "objects": sorted(&header.assets),
        "refused": header.refused,
    });
    // Tables without separate subjects, hands or containers keep the text of earlier versions.
    let more = [("subjects", &header.subjects), ("hands", &header.hands), ("containers", &header.containers)];
    for (name, rows) in more.into_iter().filter(|(_, rows)| !rows.is_empty()) {
        assets[name] = sorted(rows).into();
    }
    let mut texts = vec![(ASSETS, json_text(&assets))];
    texts.extend(splits.map(|splits| (SPLITS, json_text(splits))));
    texts.push((JOB, header.job_text.clone()));
    texts
}

/// Counts that grow with each shard.
#[derive(Default)]
struct Sums {
    counts: Counts,
    shards: Vec<ShardEntry>,
}

/// One pass over the ledgers.
struct Pass<'a> {
    mark: &'a RunMark,
    subjects: &'a Subjects,
    /// Split table, for a product that has splits.
    splits: Option<&'a SplitTable>,
    folder: &'a Folder,
    /// Format and file of the index, until the first ledger names the channels.
    table: Option<(&'a dyn IndexFormat, File)>,
    index: Option<Box<dyn IndexWriter + 'a>>,
    index_path: &'a Path,
    rejects: Rejects,
    header: &'a DatasetHeader,
    channels: Vec<Channel>,
    classes: ClassChannels,
    leaves: Vec<Leaf>,
    sums: Sums,
}

impl<'a> Pass<'a> {
    fn begin(
        folder: &'a Folder,
        mark: &'a RunMark,
        subjects: &'a Subjects,
        splits: Option<&'a SplitTable>,
        header: &'a DatasetHeader,
        index_path: &'a Path,
    ) -> Result<Self, DatasetError> {
        let (file, temporary) = TemporaryFile::create(folder, REJECTS)?;
        Ok(Self {
            mark,
            subjects,
            splits,
            folder,
            table: None,
            index: None,
            index_path,
            rejects: Rejects { out: BufWriter::new(file), temporary },
            header,
            channels: Vec::new(),
            classes: header.classes_of(&[]),
            leaves: Vec::with_capacity(mark.samples as usize),
            sums: Sums::default(),
        })
    }

    fn shard(&mut self, shard: &ShardFile, digest: Digest, bytes: u64) -> Result<(), DatasetError> {
        let ledger = shard.ledger()?;
        self.belongs(&ledger).map_err(|problem| invalid(&shard.path, problem))?;
        if let Some((format, file)) = self.table.take() {
            self.channels.clone_from(&ledger.channels);
            self.classes = self.header.classes_of(&ledger.channels);
            let columns = index_columns(self.mark.product, &ledger.channels);
            let index = format.begin(Box::new(BufWriter::new(file)), &columns);
            self.index = Some(index.map_err(DatasetError::io("writing", self.index_path))?);
        }
        let mut kept = 0;
        for row in &ledger.rows {
            kept += u64::from(self.row(shard, ledger.shard.0, row)?);
        }
        self.sums.shards.push(ShardEntry {
            file: shard.name().to_owned(),
            digest,
            bytes,
            first_sample: ledger.first.0,
            samples: ledger.rows.len() as u64,
            kept,
        });
        Ok(())
    }

    /// Whether a ledger is the next one of this run; `Err` has the reason in words.
    fn belongs(&self, ledger: &Ledger) -> Result<(), String> {
        let RunMark { product, job, samples, shards, shard_samples, .. } = self.mark;
        if ledger.job != *job {
            return Err(format!("it belongs to job {}, not {}", ledger.job.0.short(), job.0.short()));
        }
        let number = self.sums.shards.len() as u32;
        if (&ledger.product, ledger.shard.0, ledger.shards) != (product, number, *shards) {
            let Ledger { product, shard, shards, .. } = ledger;
            return Err(format!("its ledger is of {product} shard {shard} of {shards}, its name is of shard {number}"));
        }
        let first = self.sums.counts.samples;
        let max = u64::from(*shard_samples).min(samples.saturating_sub(first));
        if ledger.first.0 != first || !(1..=max).contains(&(ledger.rows.len() as u64)) {
            let (found, from) = (ledger.rows.len(), ledger.first);
            return Err(format!("it accounts for {found} samples from {from}, expected 1 to {max} from {first}"));
        }
        if !self.sums.shards.is_empty() && ledger.channels != self.channels {
            return Err(format!("it has the channels {:?}, the others {:?}", ledger.channels, self.channels));
        }
        Ok(())
    }

    /// Checks that the shards account for every sample.
    fn complete(&self) -> Result<(), DatasetError> {
        let found = self.sums.counts.samples;
        if found == self.mark.samples {
            return Ok(());
        }
        let problem = format!("the shards account for {found} samples, the plan has {}", self.mark.samples);
        Err(DatasetError::Invalid { path: self.folder.path_of(SHARDS), problem, remedy: REMAKE })
    }

    /// Takes a row; returns whether it was kept.
    fn row(&mut self, shard: &ShardFile, number: u32, row: &LedgerRow) -> Result<bool, DatasetError> {
        let unknown = |table: &str| {
            let LedgerRow { index, sample, .. } = row;
            invalid(&shard.path, format!("sample {index} is {sample}, whose subject is in no row of the {table}"))
        };
        let (rank, name, id) = self.subjects.get(&row.sample.subject).ok_or_else(|| unknown("asset table"))?;
        let split = self.splits.map(|splits| splits.split_of(&row.sample).ok_or_else(|| unknown("split table")));
        let split: Option<Split> = split.transpose()?;
        self.leaves.extend(Leaf::of_row(*rank, row, &self.classes));
        count_row(&mut self.sums.counts, self.mark.product, &self.channels, row, split);
        if let Some(line) = reject_line(row) {
            let Rejects { out, temporary } = &mut self.rejects;
            writeln!(out, "{line}").map_err(DatasetError::io("writing", &temporary.path()))?;
        }
        if let Some(index) = &mut self.index {
            let cells = IndexRow { row, subject: [name, id], split, shard: number };
            let written = index.push(&cells.cells(self.mark.product, &self.channels));
            written.map_err(DatasetError::io("writing", self.index_path))?;
        }
        Ok(matches!(row.fate, Fate::Kept(_)))
    }
}

/// Counts a row of a ledger; `split` is its sample's, where the product has splits. Facts of rejected samples count, too: a
/// search that was given up is rejected.
pub(super) fn count_row(
    counts: &mut Counts,
    product: Product,
    channels: &[Channel],
    row: &LedgerRow,
    split: Option<Split>,
) {
    counts.samples += 1;
    for (index, fact) in product.facts_of(channels).filter(|(_, fact)| fact.kind == FactKind::Count) {
        *counts.facts.entry(fact.name.to_owned()).or_default() += u64::from(row.facts.integer(index));
    }
    match &row.fate {
        Fate::Kept(_) => {
            counts.kept += 1;
            if let Some(split) = split {
                *counts.splits.entry(split).or_default() += 1;
            }
        }
        Fate::Rejected { reason, .. } => *counts.rejected.entry(reason.clone()).or_default() += 1,
    }
}

/// The line of a rejected sample in `rejects.jsonl`; `None` of a kept one.
pub(super) fn reject_line(row: &LedgerRow) -> Option<String> {
    let Fate::Rejected { reason, detail } = &row.fate else { return None };
    let line = serde_json::json!({
        "sample_index": row.index.0,
        "subject": row.sample.subject,
        "item": row.sample.item.0,
        "instance": row.sample.instance,
        "camera": row.sample.camera,
        "reason": reason,
        "detail": detail,
    });
    Some(line.to_string())
}

/// `rejects.jsonl` while it grows.
struct Rejects {
    out: BufWriter<File>,
    temporary: TemporaryFile,
}

impl Rejects {
    fn finish(self) -> Result<(), DatasetError> {
        let file = self.out.into_inner();
        let file = file.map_err(|error| DatasetError::io("writing", &self.temporary.path())(error.into_error()))?;
        self.temporary.publish(&file, REJECTS).map(|_| ())
    }
}
