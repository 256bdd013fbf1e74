//! Whether a dataset is what its manifest says; which shard, chunk and sample is not, and how to mend it.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt, fs,
    path::Path,
    sync::{
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
};

use super::{
    DatasetError, DatasetReader, Fate, Ledger, LedgerRow, Manifest, NumberClass, Shapes, ShardEntry,
    durable::TEMPORARY,
    error::{REMAKE, REWRITE},
    field,
    finish::{Objects, asset_names, asset_tree, object_of},
    folder::{hash_file, sorted_entries},
    layout::{ASSETS, FIELD, SHAPES, SHARDS},
    roots::{ClassChannels, Leaf, Roots},
    shard_file::{ShardFile, StoredMessage},
};
use crate::{
    geom::PoseLabel,
    ids::{Digest, ObjectId, Product, SampleIndex, ShardId},
    record::{Channel, Checker, PairFacts, ReachabilityField, SampleFacts},
};

/// How much to check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VerifyLevel {
    /// Digests of all files, ledgers, counts and the root: about 2 GB/s.
    Hashes,
    /// Every chunk's CRC, every payload's digest, fields, ranges and identity as well.
    Full,
}

/// What to check and with how many threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VerifyOptions {
    /// How much.
    pub level: VerifyLevel,
    /// The job's truth makes `partial` a part of `complete` (any overlap): check that it is.
    pub partial_inside_complete: bool,
    /// Threads, at least 1.
    pub threads: usize,
}

/// How far a verification is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VerifyProgress {
    /// Shards checked.
    pub shards: u32,
    /// Shards in all.
    pub of_shards: u32,
    /// Sample indices checked.
    pub samples: u64,
    /// Bytes of shards read.
    pub bytes: u64,
}

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Path inside the dataset's folder.
    pub file: String,
    /// Which shard, when it is one.
    pub shard: Option<ShardId>,
    /// Where in the file: chunk, sample, channel; empty for the file as a whole.
    pub place: String,
    /// What is wrong, with numbers.
    pub what: String,
    /// How to mend it.
    pub remedy: &'static str,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, place, what, remedy, .. } = self;
        if place.is_empty() {
            write!(f, "{file}: {what}; {remedy}")
        } else {
            write!(f, "{file}: {place}: {what}; {remedy}")
        }
    }
}

/// What a verification found.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifyReport {
    /// What the dataset holds.
    pub product: Product,
    /// Root digest in the manifest.
    pub saved: Digest,
    /// Root digest out of the ledgers and tables; `None` when one of them can't be read.
    pub calculated: Option<Digest>,
    /// What was looked at.
    pub checked: VerifyProgress,
    /// Payloads whose digest and fields were checked (level [`VerifyLevel::Full`]).
    pub payloads: u64,
    /// Shards without a problem.
    pub intact_shards: u32,
    /// Everything that is wrong, in order of files and places; at most [`VerifyReport::MOST`] a shard.
    pub problems: Vec<Problem>,
    /// Things that are no damage: leftovers of killed runs, files set aside.
    pub notes: Vec<String>,
}

impl VerifyReport {
    /// Problems listed of one shard; a count of the others follows.
    pub const MOST: usize = 20;

    /// Nothing is wrong.
    pub fn is_intact(&self) -> bool {
        self.problems.is_empty()
    }
}

/// Checks a finished dataset; damage is in the report, not an error. Memory: a chunk a thread, 64 bytes a sample and
/// class.
///
/// # Errors
/// When there is no readable manifest, or the operating system refuses to list the folder.
pub fn verify(
    folder: &Path,
    options: VerifyOptions,
    mut progress: impl FnMut(&VerifyProgress),
) -> Result<VerifyReport, DatasetError> {
    let manifest = Manifest::read(folder)?;
    let mut problems = check_files(folder, &manifest);
    let reader = match DatasetReader::open(folder) {
        Ok(reader) => Some(reader),
        Err(error) => {
            let table = !problems.iter().any(|problem| problem.file.ends_with(".parquet"));
            if table {
                problems.push(whole("index.parquet", error.to_string(), REWRITE));
            }
            None
        }
    };
    let assets = read_assets(folder);
    let ranks = assets.as_ref().ok().and_then(|rows| asset_names(folder, &rows.objects).ok());
    if let Err(what) = &assets {
        problems.push(whole(ASSETS, what.clone(), REWRITE));
    }
    let mut notes = Vec::new();
    check_foreign(folder, &manifest, &mut problems, &mut notes)?;
    let context = Context { folder, manifest: &manifest, reader: reader.as_ref(), options };
    let of_shards = manifest.shards.len() as u32;
    let mut checked = VerifyProgress { of_shards, ..VerifyProgress::default() };
    let shards = check_shards(&context, |shard| {
        checked.shards += 1;
        checked.samples += shard.samples;
        checked.bytes += shard.bytes;
        progress(&checked);
    });
    let mut leaves = ranks.as_ref().map(|_| Vec::with_capacity(manifest.counts.samples as usize));
    let (mut payloads, mut intact_shards) = (0, 0);
    for shard in shards {
        payloads += shard.payloads;
        intact_shards += u32::from(shard.problems.is_empty());
        problems.extend(shard.problems);
        leaves = match (leaves, shard.ledger, &ranks) {
            (Some(leaves), Some(ledger), Some(ranks)) => with_leaves_of(leaves, &ledger, &manifest, ranks),
            _ => None,
        };
    }
    let field = check_field(&context, intact_shards, &mut problems);
    if let (Product::Grasps, VerifyLevel::Full, Ok(rows)) = (manifest.product, options.level, &assets) {
        check_shapes(folder, rows, &mut problems);
    }
    let mut calculated = None;
    if let (Some(leaves), Some(ranks), Ok(assets), Ok(field)) = (leaves, &ranks, &assets, field) {
        match Roots::new(leaves, &classes_of(&manifest.channels(), &manifest), ranks) {
            Ok(roots) => {
                let root = roots.dataset(
                    &asset_tree(assets.objects.iter().chain(&assets.hands)),
                    field.as_ref(),
                    &manifest.job,
                );
                calculated = Some(root);
                compare_roots(&manifest, &roots, &root, &mut problems);
            }
            Err(error) => problems.push(whole("manifest.json", error.to_string(), REWRITE)),
        }
    }
    let product = manifest.product;
    Ok(VerifyReport { product, saved: manifest.root, calculated, checked, payloads, intact_shards, problems, notes })
}

/// The class of each of a ledger's channels, as the manifest says it.
fn classes_of(channels: &[Channel], manifest: &Manifest) -> ClassChannels {
    let main = manifest.class_of(Channel::leading(manifest.product)).unwrap_or(NumberClass::Exact);
    ClassChannels::new(channels, main, |channel| manifest.class_of(channel).unwrap_or(main))
}

/// Takes the rows of a ledger; `None` when one's object is unknown.
fn with_leaves_of(mut leaves: Vec<Leaf>, ledger: &Ledger, manifest: &Manifest, ranks: &Objects) -> Option<Vec<Leaf>> {
    let channels = classes_of(&ledger.channels, manifest);
    for row in &ledger.rows {
        let (rank, _, _) = ranks.get(&row.sample.subject)?;
        leaves.extend(Leaf::of_row(*rank, row, &channels));
    }
    Some(leaves)
}

/// The root over all, and that of each class.
fn compare_roots(manifest: &Manifest, roots: &Roots, root: &Digest, problems: &mut Vec<Problem>) {
    let mut compare = |what: &str, saved: &Digest, calculated: Option<&Digest>| {
        if calculated != Some(saved) {
            let calculated = calculated.map_or_else(|| "none".to_owned(), Digest::short);
            let what = format!("{what}: saved {}, calculated {calculated}", saved.short());
            problems.push(whole("manifest.json", what, REWRITE));
        }
    };
    compare("root digest", &manifest.root, Some(root));
    for (class, saved) in &manifest.classes {
        compare(&format!("digest of class {}", class.name()), saved, roots.classes.get(class));
    }
}

/// The field against the shards' blocks and itself, where the product has one: the digest of its payload. `Err` when it
/// can't be read.
fn check_field(context: &Context, intact_shards: u32, problems: &mut Vec<Problem>) -> Result<Option<Digest>, ()> {
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
fn check_shapes(folder: &Path, rows: &AssetRows, problems: &mut Vec<Problem>) {
    let mut objects: Vec<ObjectId> = rows.objects.iter().filter_map(object_of).collect();
    objects.sort_unstable();
    let hand = rows.hands.first().and_then(object_of);
    if let Err(error) = Shapes::open(folder).and_then(|shapes| shapes.check(hand, &objects)) {
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

fn whole(file: &str, what: String, remedy: &'static str) -> Problem {
    Problem { file: file.to_owned(), shard: None, place: String::new(), what, remedy }
}

fn check_files(folder: &Path, manifest: &Manifest) -> Vec<Problem> {
    let mut problems = Vec::new();
    for (name, entry) in &manifest.files {
        match hash_file(&folder.join(name)) {
            Ok((digest, _)) if digest == entry.digest => {}
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
struct AssetRows {
    objects: Vec<serde_json::Value>,
    #[serde(default)]
    hands: Vec<serde_json::Value>,
}

fn read_assets(folder: &Path) -> Result<AssetRows, String> {
    let text = fs::read(folder.join(ASSETS)).map_err(|error| error.to_string())?;
    serde_json::from_slice(&text).map_err(|error| error.to_string())
}

fn check_foreign(
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

struct Context<'a> {
    folder: &'a Path,
    manifest: &'a Manifest,
    reader: Option<&'a DatasetReader>,
    options: VerifyOptions,
}

/// What the check of one shard found.
#[derive(Default)]
struct ShardCheck {
    ledger: Option<Ledger>,
    problems: Vec<Problem>,
    samples: u64,
    bytes: u64,
    payloads: u64,
}

/// Every shard, on as many threads as asked for; `done` is called as they end, the result is in order.
fn check_shards(context: &Context, mut done: impl FnMut(&ShardCheck)) -> Vec<ShardCheck> {
    let count = context.manifest.shards.len();
    let next = AtomicUsize::new(0);
    let mut checks: BTreeMap<usize, ShardCheck> = BTreeMap::new();
    std::thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        for _ in 0..context.options.threads.clamp(1, count.max(1)) {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                loop {
                    let shard = next.fetch_add(1, Ordering::Relaxed);
                    if shard >= count || sender.send((shard, check_shard(context, shard))).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        for (shard, check) in receiver {
            done(&check);
            checks.insert(shard, check);
        }
    });
    checks.into_values().collect()
}

fn check_shard(context: &Context, shard: usize) -> ShardCheck {
    let entry = &context.manifest.shards[shard];
    let path = context.manifest.shard_path(context.folder, shard);
    let mut findings = Findings {
        file: format!("{SHARDS}/{}", entry.file),
        shard: ShardId(shard as u32),
        problems: Vec::new(),
        more: 0,
    };
    let mut check = ShardCheck { samples: entry.samples, ..ShardCheck::default() };
    let mut changed = false;
    match hash_file(&path) {
        Ok((digest, bytes)) => {
            check.bytes = bytes;
            changed = digest != entry.digest;
            if changed {
                findings.push(
                    String::new(),
                    format!(
                        "its content has changed: saved digest {} ({} bytes), calculated {} ({bytes} bytes)",
                        entry.digest.short(),
                        entry.bytes,
                        digest.short()
                    ),
                );
            }
        }
        Err(DatasetError::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
            findings.push(String::new(), "the file is missing".to_owned());
            check.problems = findings.end();
            return check;
        }
        Err(error) => findings.push(String::new(), error.to_string()),
    }
    match ShardFile::open(&path).and_then(|file| file.ledger().map(|ledger| (file, ledger))) {
        Ok((file, ledger)) => {
            check_ledger(context, entry, &ledger, &mut findings);
            // A file that has changed is read whole at any level: that names the chunk.
            if changed || context.options.level == VerifyLevel::Full {
                check.payloads = check_chunks(context, &file, &ledger, &mut findings);
            }
            check.ledger = Some(ledger);
        }
        Err(DatasetError::Invalid { problem, .. }) => findings.push(String::new(), problem),
        Err(error) => findings.push(String::new(), error.to_string()),
    }
    check.problems = findings.end();
    check
}

/// Problems of one shard.
struct Findings {
    file: String,
    shard: ShardId,
    problems: Vec<Problem>,
    more: usize,
}

impl Findings {
    fn push(&mut self, place: String, what: String) {
        if self.problems.len() == VerifyReport::MOST {
            self.more += 1;
            return;
        }
        let (file, shard) = (self.file.clone(), Some(self.shard));
        self.problems.push(Problem { file, shard, place, what, remedy: REMAKE });
    }

    fn end(mut self) -> Vec<Problem> {
        if self.more > 0 {
            let (file, shard, what) = (self.file, Some(self.shard), format!("and {} more problems", self.more));
            self.problems.push(Problem { file, shard, place: String::new(), what, remedy: REMAKE });
        }
        self.problems
    }
}

/// The ledger against the manifest and the index.
fn check_ledger(context: &Context, entry: &ShardEntry, ledger: &Ledger, findings: &mut Findings) {
    let kept = ledger.rows.iter().filter(|row| matches!(row.fate, Fate::Kept(_))).count() as u64;
    let found = (ledger.first.0, ledger.rows.len() as u64, kept);
    let saved = (entry.first_sample, entry.samples, entry.kept);
    if found != saved {
        let words = |(first, samples, kept)| format!("{samples} samples from {first}, {kept} kept");
        findings.push("ledger".to_owned(), format!("it says {}, the manifest {}", words(found), words(saved)));
    }
    if ledger.job != context.manifest.job {
        let (found, saved) = (ledger.job.0.short(), context.manifest.job.0.short());
        findings.push("ledger".to_owned(), format!("it is of job {found}, the manifest of job {saved}"));
    }
    if ledger.channels != context.manifest.channels() {
        let what = format!("it has the channels {:?}, the manifest {:?}", ledger.channels, context.manifest.channels());
        findings.push("ledger".to_owned(), what);
    }
    let Some(reader) = context.reader else { return };
    for LedgerRow { index, sample, fate, .. } in &ledger.rows {
        let kept = matches!(fate, Fate::Kept(_));
        if reader.id(*index) != Some(*sample) || reader.is_kept(*index) != kept {
            let what = format!("the ledger says {sample}, kept {kept}; index.parquet says otherwise");
            findings.push(format!("sample {index}"), what);
        } else if reader.splits().of(sample) != reader.split(*index) {
            findings.push(format!("sample {index}"), "splits.json and index.parquet name different splits".to_owned());
        }
    }
}

/// Every chunk of a shard against its ledger; the count of payloads that were checked.
fn check_chunks(context: &Context, file: &ShardFile, ledger: &Ledger, findings: &mut Findings) -> u64 {
    let (mut payloads, mut checker) = (0, Checker::default());
    // Every kept sample has each channel once, in order: the messages that must come.
    let mut expected = (ledger.rows.iter())
        .filter_map(|row| if let Fate::Kept(digests) = &row.fate { Some((row, digests)) } else { None })
        .flat_map(|(row, digests)| {
            ledger.channels.iter().zip(digests).map(move |(channel, digest)| (row, *channel, *digest))
        })
        .peekable();
    for chunk in 0..file.chunks.len() {
        let (_, last) = file.chunks[chunk].samples;
        match file.read_chunk(chunk) {
            Ok(messages) => {
                for message in messages {
                    while let Some((row, channel, _)) =
                        expected.next_if(|(row, channel, _)| (row.index, *channel) < (message.index, message.channel))
                    {
                        findings.push(place(row.index, channel), "the message is missing".to_owned());
                    }
                    let fits = |(row, channel, _): &(&LedgerRow, Channel, Digest)| {
                        (row.index, *channel) == (message.index, message.channel)
                    };
                    match expected.next_if(fits) {
                        Some((row, _, digest)) => {
                            payloads += 1;
                            check_payload(context, row, &message, &digest, &mut checker, findings);
                        }
                        None => findings.push(
                            place(message.index, message.channel),
                            "a message that the ledger does not know, or out of order".to_owned(),
                        ),
                    }
                }
            }
            Err(DatasetError::Invalid { problem, .. }) => {
                findings.push(String::new(), problem);
                // What the chunk should have held is accounted for by that one problem.
                while expected.next_if(|(row, _, _)| row.index.0 <= last).is_some() {}
            }
            Err(error) => findings.push(format!("chunk {chunk}"), error.to_string()),
        }
    }
    for (row, channel, _) in expected {
        findings.push(place(row.index, channel), "the message is missing".to_owned());
    }
    payloads
}

fn place(index: SampleIndex, channel: Channel) -> String {
    format!("sample {index}, {}", channel.topic())
}

fn check_payload(
    context: &Context,
    row: &LedgerRow,
    message: &StoredMessage,
    digest: &Digest,
    checker: &mut Checker,
    findings: &mut Findings,
) {
    let at = || place(message.index, message.channel);
    let calculated = Digest::of(&message.payload);
    if calculated != *digest {
        findings.push(at(), format!("payload digest: saved {}, calculated {}", digest.short(), calculated.short()));
    }
    match checker.check(message.channel, &message.payload) {
        Ok(checked) => {
            if let Some(facts) = checked.facts {
                check_facts(context, row, &facts, &at(), findings);
            }
            let trials = row.facts.grasps().map(|facts| facts.trials);
            if checked.trials.is_some() && checked.trials != trials {
                findings.push(at(), format!("it says {:?}, the ledger {trials:?}", checked.trials));
            }
            if checked.sample != row.sample {
                findings.push(at(), format!("it is of sample {}, the ledger says {}", checked.sample, row.sample));
            }
            if context.options.partial_inside_complete && checked.touched_outside_complete > 0 {
                let count = checked.touched_outside_complete;
                findings.push(at(), format!("{count} contacts stand in cells that are not in complete"));
            }
        }
        Err(error) => findings.push(at(), error.to_string()),
    }
}

fn check_facts(context: &Context, row: &LedgerRow, found: &SampleFacts, at: &str, findings: &mut Findings) {
    if *found != row.facts.without_trials() {
        findings.push(at.to_owned(), format!("it says {found:?}, the ledger {:?}", row.facts));
    }
    if let SampleFacts::Pair(PairFacts { partial_cells, both_cells, .. }) = found
        && context.options.partial_inside_complete
        && both_cells != partial_cells
    {
        let what = format!("{} of {partial_cells} partial cells are not in complete", partial_cells - both_cells);
        findings.push(at.to_owned(), what);
    }
}
