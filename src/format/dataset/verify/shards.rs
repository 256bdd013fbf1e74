//! Shards: their content against their names, ledgers, manifest and index.

use std::{
    collections::BTreeMap,
    sync::{
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
};

use super::report::{Problem, VerifyLevel, VerifyOptions, VerifyReport};
use crate::{
    Channel, CheckSample, check_record, checks_of,
    storage::{
        DatasetError, Fate, Ledger, LedgerRow, Manifest, ShardEntry,
        error::REMAKE,
        folder::{Hashed, hash_grown, shards_folder},
        layout::SHARDS,
        shard_file::{ShardFile, StoredMessage},
    },
};
use kernel::{
    files::Folder,
    ids::{Digest, SampleIndex, ShardId},
};

/// Inputs of all checks.
pub(super) struct Context<'a> {
    pub folder: &'a Folder,
    pub manifest: &'a Manifest,
    pub options: VerifyOptions<'a>,
}

/// Findings of the check of one shard.
#[derive(Default)]
pub(super) struct ShardCheck {
    pub ledger: Option<Ledger>,
    pub problems: Vec<Problem>,
    pub samples: u64,
    pub bytes: u64,
    pub payloads: u64,
}

/// Checks every shard, on the given number of threads; calls `done` as they end; the result is in order.
pub(super) fn check_shards(context: &Context, mut done: impl FnMut(&ShardCheck)) -> Vec<ShardCheck> {
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
    let folder = shards_folder(context.folder);
    let mut findings = Findings {
        file: format!("{SHARDS}/{}", entry.file),
        shard: ShardId(shard as u32),
        problems: Vec::new(),
        more: 0,
    };
    let mut check = ShardCheck { samples: entry.samples, ..ShardCheck::default() };
    let mut changed = false;
    match hash_grown(&folder, &entry.file, entry.bytes) {
        Ok(Hashed::Grown(bytes)) => {
            check.bytes = bytes;
            changed = true;
            findings.push(String::new(), format!("it has {bytes} bytes, the manifest lists {}", entry.bytes));
        }
        Ok(Hashed::Whole(digest, bytes)) => {
            check.bytes = bytes;
            if digest == entry.digest && bytes != entry.bytes {
                findings.push(String::new(), format!("it has {bytes} bytes, the manifest lists {}", entry.bytes));
            }
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
    match ShardFile::open(&folder, &entry.file).and_then(|file| file.ledger().map(|ledger| (file, ledger))) {
        Ok((file, ledger)) => {
            file.oddities.iter().for_each(|oddity| findings.push(String::new(), oddity.clone()));
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
    fn push(&mut self, location: String, what: String) {
        if self.problems.len() == VerifyReport::MAX {
            self.more += 1;
            return;
        }
        let (file, shard) = (self.file.clone(), Some(self.shard));
        self.problems.push(Problem { file, shard, location, what, remedy: REMAKE });
    }

    fn end(mut self) -> Vec<Problem> {
        if self.more > 0 {
            let (file, shard, what) = (self.file, Some(self.shard), format!("and {} more problems", self.more));
            self.problems.push(Problem { file, shard, location: String::new(), what, remedy: REMAKE });
        }
        self.problems
    }
}

/// The ledger against the manifest.
fn check_ledger(context: &Context, entry: &ShardEntry, ledger: &Ledger, findings: &mut Findings) {
    let kept = ledger.rows.iter().filter(|row| matches!(row.fate, Fate::Kept(_))).count() as u64;
    let found = (ledger.first.0, ledger.rows.len() as u64, kept);
    let saved = (entry.first_sample, entry.samples, entry.kept);
    if found != saved {
        let words = |(first, samples, kept)| format!("{samples} samples from {first}, {kept} kept");
        findings.push("ledger".to_owned(), format!("it has {}, the manifest {}", words(found), words(saved)));
    }
    let named = (ledger.product, ledger.shard, ledger.shards as usize);
    let expected = (context.manifest.product, findings.shard, context.manifest.shards.len());
    if named != expected {
        let words = |(product, shard, shards)| format!("{product} shard {shard} of {shards}");
        findings
            .push("ledger".to_owned(), format!("it is of {}, the manifest lists {}", words(named), words(expected)));
    }
    if ledger.job != context.manifest.job {
        let (found, saved) = (ledger.job.0.short(), context.manifest.job.0.short());
        findings.push("ledger".to_owned(), format!("it is of job {found}, the manifest of job {saved}"));
    }
    if ledger.channels != context.manifest.channels() {
        let what = format!("it has the channels {:?}, the manifest {:?}", ledger.channels, context.manifest.channels());
        findings.push("ledger".to_owned(), what);
    }
}

/// Every chunk of a shard against its ledger; the count of payloads that were checked.
fn check_chunks(context: &Context, file: &ShardFile, ledger: &Ledger, findings: &mut Findings) -> u64 {
    let mut payloads = 0;
    let mut checker = (checks_of(ledger.product).samples)();
    // Every kept sample has each channel once, in order: the messages that must come.
    let mut expected = (ledger.rows.iter())
        .filter_map(|row| if let Fate::Kept(digests) = &row.fate { Some((row, digests)) } else { None })
        .flat_map(|(row, digests)| {
            ledger.channels.iter().zip(digests).map(move |(channel, digest)| (row, *channel, *digest))
        })
        .peekable();
    for chunk in 0..file.chunks.len() {
        let (first, last) = file.chunks[chunk].samples;
        match file.read_chunk(chunk) {
            Ok(messages) => {
                let indices = || messages.iter().map(|message| message.index.0);
                if indices().min().zip(indices().max()) != Some((first, last)) {
                    let what = format!("it does not hold samples {first} to {last}, which the shard's index lists");
                    findings.push(format!("chunk {chunk}"), what);
                }
                for message in messages {
                    while let Some((row, channel, _)) =
                        expected.next_if(|(row, channel, _)| (row.index, *channel) < (message.index, message.channel))
                    {
                        findings.push(location(row.index, channel), "the message is missing".to_owned());
                    }
                    let fits = |(row, channel, _): &(&LedgerRow, Channel, Digest)| {
                        (row.index, *channel) == (message.index, message.channel)
                    };
                    match expected.next_if(fits) {
                        Some((row, _, digest)) => {
                            payloads += 1;
                            check_payload(context, row, &message, &digest, checker.as_mut(), findings);
                        }
                        None => findings.push(
                            location(message.index, message.channel),
                            "a message that is not in the ledger, or out of order".to_owned(),
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
        findings.push(location(row.index, channel), "the message is missing".to_owned());
    }
    payloads
}

fn location(index: SampleIndex, channel: Channel) -> String {
    format!("sample {index}, {}", channel.topic)
}

fn check_payload(
    context: &Context,
    row: &LedgerRow,
    message: &StoredMessage,
    digest: &Digest,
    checker: &mut dyn CheckSample,
    findings: &mut Findings,
) {
    let at = || location(message.index, message.channel);
    let calculated = Digest::hash(&message.payload);
    if calculated != *digest {
        findings.push(at(), format!("payload digest: saved {}, calculated {}", digest.short(), calculated.short()));
    }
    match check_record(checker, message.channel, &message.payload) {
        Ok(checked) => {
            let facts = context.manifest.product.facts;
            for (index, value) in checked.facts {
                let stated = row.facts.values()[index];
                if value.to_bits() != stated.to_bits() {
                    let name = facts[index].name;
                    findings.push(at(), format!("it has {name} = {value}, the ledger {stated}"));
                }
            }
            if checked.sample != row.sample {
                findings.push(at(), format!("it is of sample {}, the ledger lists {}", checked.sample, row.sample));
            }
            let applies = |rule: &str| context.options.rules.contains(&rule);
            for broken in checked.broken_rules.into_iter().filter(|broken| applies(broken.rule)) {
                findings.push(at(), broken.what);
            }
        }
        Err(error) => findings.push(at(), error.to_string()),
    }
}
