//! Measures what the samples of a job cost, by making a few of them.

use std::{
    collections::BTreeSet,
    ops::Range,
    path::Path,
    sync::atomic::{AtomicUsize, Ordering},
    time::Duration,
};

use serde::Serialize;

use super::{
    OpenJob,
    contain::{contain, item_words, subject_words},
    execute::store,
};
use crate::{
    MadeFate, MadeSample, RunContext, RunError, SampleSink,
    clock::processor_time,
    job::Job,
    plan::Plan,
    work::{OpenWork, Opening, Producer},
};
use format::{
    Channel, Facts,
    dataset::{DatasetError, FinishedShard, ShardHeader, ShardWriter, TableSizes},
};
use kernel::{
    files::Folder,
    ids::{ItemId, SampleId, SampleIndex, ShardId},
};
use tables::ParquetIndex;

/// Number of subjects that a pilot visits, if the job has that many.
const VISITED_SUBJECTS: usize = 32;
/// Items that follow each other, so that chunks hold samples as much alike as those of the dataset.
const BLOCK_ITEMS: u32 = 4;

/// Limits of a pilot: it ends at the first one reached. Each visited subject gets at least one item.
#[derive(Clone, Copy, Debug)]
pub struct PilotLimits {
    /// Samples in all.
    pub samples: u64,
    /// Processor time per thread.
    pub time: Duration,
}

/// Costs of the samples of a job, in processor time and in bytes of shards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PilotRate {
    /// Samples made, kept and rejected.
    pub samples: u64,
    /// Processor time of opening what all threads share: hands, robots, other datasets [s].
    pub seconds_of_opening: f64,
    /// Processor time of reading a subject and preparing it (voxelising and indexing an object) [s].
    pub seconds_per_subject: f64,
    /// Processor time of making and storing a sample, with as many threads at work as the run will have [s].
    pub seconds_per_sample: f64,
    /// Bytes of a shard without samples, with its row in the manifest.
    pub bytes_per_shard: f64,
    /// Bytes that a sample adds to its shard, kept or rejected, compressed.
    pub bytes_per_sample: f64,
    /// Bytes that a sample adds to the tables: its row in the index, its line where it is rejected.
    pub bytes_per_row: f64,
    /// Bytes that do not depend on the samples: tables of objects and splits, the job, files that only its product has.
    pub bytes_beside: f64,
    /// Processor time to write the files at the end, such as facts of every object [s].
    pub seconds_of_closing: f64,
}

/// Makes samples spread over the plan, on all threads, and stores them in shards in a separate folder, which is removed
/// at the end.
///
/// # Errors
/// Errors of [`run`](super::run).
pub fn pilot(open: &OpenJob, limits: PilotLimits, context: &RunContext<'_>) -> Result<PilotRate, RunError> {
    let OpenJob { job, plan, splits, .. } = open;
    let began = processor_time();
    let splits = splits.as_ref().map(|splits| &splits.table);
    let opened = job.work.open(Opening { seed: job.seed, level: context.parallelism.level, splits });
    let work = opened.map_err(|error| RunError::of_opening(error.into()))?;
    let opened = processor_time();
    let scratch = tempfile::tempdir().map_err(DatasetError::io("making", Path::new("a folder for the pilot")))?;
    let folder = Folder::at(scratch.path());
    let pilot = Pilot { job, plan, limits, work: work.as_ref(), folder: &folder, context };
    let visits = pilot.visits();
    let next = AtomicUsize::new(0);
    let on_thread = |_: rayon::BroadcastContext<'_>| pilot.work_through(&visits, &next);
    let tallies: Result<Vec<Tally>, RunError> = context.parallelism.pool()?.broadcast(on_thread).into_iter().collect();
    let tally = tallies?.into_iter().fold(Tally::default(), Tally::plus);
    let tables = TableSizes::measure(&folder, &tally.shards, &open.header(Path::new(".")), &ParquetIndex)?;
    let visited: Vec<usize> = visits.iter().map(|visit| visit.subject).collect::<BTreeSet<_>>().into_iter().collect();
    let side = work.side_cost(&visited, &folder)?;
    let per = |total: f64, count: u64| total / count.max(1) as f64;
    let producer = work.producer().map_err(|error| RunError::of_opening(error.into()))?;
    let bytes_per_shard = pilot.bytes_of_empty_shard(&producer.channels())? as f64;
    drop(producer);
    let stored = tally.bytes as f64 - tally.shards.len() as f64 * bytes_per_shard;
    Ok(PilotRate {
        samples: tally.samples,
        seconds_of_opening: (opened - began).as_secs_f64(),
        seconds_per_subject: per(tally.loading.as_secs_f64(), tally.loads),
        seconds_per_sample: per(tally.making.as_secs_f64(), tally.samples),
        bytes_per_shard: bytes_per_shard + tables.per_shard,
        bytes_per_sample: per(stored, tally.samples).max(0.0),
        bytes_per_row: tables.per_sample,
        bytes_beside: tables.fixed + side.bytes,
        seconds_of_closing: side.seconds,
    })
}

/// A pilot in progress.
struct Pilot<'a> {
    job: &'a Job,
    plan: &'a Plan,
    limits: PilotLimits,
    work: &'a dyn OpenWork,
    folder: &'a Folder,
    context: &'a RunContext<'a>,
}

/// Some items of one subject.
struct Visit {
    subject: usize,
    items: Vec<u32>,
}

/// Costs of what one thread made.
#[derive(Default)]
struct Tally {
    samples: u64,
    loads: u64,
    /// Names of their files.
    shards: Vec<String>,
    bytes: u64,
    loading: Duration,
    making: Duration,
}

impl Tally {
    fn plus(mut self, other: Self) -> Self {
        self.shards.extend(other.shards);
        Self {
            samples: self.samples + other.samples,
            loads: self.loads + other.loads,
            shards: self.shards,
            bytes: self.bytes + other.bytes,
            loading: self.loading + other.loading,
            making: self.making + other.making,
        }
    }
}

impl Pilot<'_> {
    /// Visits to subjects at even steps through the job, at least one for each thread. Several visits to one subject
    /// share its items.
    fn visits(&self) -> Vec<Visit> {
        let subjects = self.job.work.subjects();
        let visited = subjects.len().min(VISITED_SUBJECTS);
        if visited == 0 {
            return Vec::new();
        }
        let rounds = self.context.parallelism.threads.div_ceil(visited);
        let samples = self.limits.samples.div_ceil((visited * rounds) as u64);
        let of_round = |round: usize, subject: usize| {
            let items = samples.div_ceil(u64::from(subjects[subject].samples_per_item.max(1)));
            let blocks = spread_blocks(self.plan.items_of(subject), BLOCK_ITEMS).skip(round).step_by(rounds);
            Visit { subject, items: blocks.flatten().take(items as usize).collect() }
        };
        let mut visits = Vec::new();
        for round in 0..rounds {
            let chosen = spread_blocks(subjects.len() as u32, 1).take(visited);
            visits.extend(chosen.map(|block| of_round(round, block.start as usize)));
        }
        visits
    }

    /// Makes visits until none is left or the time is over.
    fn work_through(&self, visits: &[Visit], next: &AtomicUsize) -> Result<Tally, RunError> {
        let began = processor_time();
        let mut tally = Tally::default();
        let mut producer = self.work.producer()?;
        let mut sink = SampleSink::new(producer.channels());
        let slice = self.limits.time * self.context.parallelism.threads as u32 / visits.len().max(1) as u32;
        while processor_time() - began < self.limits.time || tally.samples == 0 {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(visit) = visits.get(index) else { break };
            tally = tally.plus(self.visit(index, visit, slice, producer.as_mut(), &mut sink)?);
        }
        Ok(tally)
    }

    /// Makes the items of a visit until its slice of time is over, and stores them in a shard.
    fn visit(
        &self,
        index: usize,
        visit: &Visit,
        slice: Duration,
        producer: &mut dyn Producer,
        sink: &mut SampleSink,
    ) -> Result<Tally, RunError> {
        let began = processor_time();
        let subject = || format!("preparing {}", subject_words(self.job, visit.subject));
        contain(subject, || producer.load(visit.subject, self.context.cancel))?;
        let loaded = processor_time();
        let mut samples: Vec<StoredSample> = Vec::new();
        for item in &visit.items {
            if self.context.cancel.is_cancelled() {
                return Err(RunError::Interrupted);
            }
            let mut take = |made: &MadeSample<'_>| {
                samples.push(StoredSample::new(made));
                Ok(())
            };
            let sample = || item_words(self.job, visit.subject, ItemId(*item));
            contain(sample, || producer.produce(ItemId(*item), &mut sink.writer(&mut take)))?;
            if processor_time() - began >= slice {
                break;
            }
        }
        let count = samples.len() as u64;
        let stored = if count > 0 { Some(self.store(index, &producer.channels(), &samples)?) } else { None };
        let bytes = stored.as_ref().map_or(0, |shard| shard.bytes);
        let (loading, making) = (loaded - began, processor_time() - loaded);
        let shards = stored.iter().map(FinishedShard::file_name).collect();
        Ok(Tally { samples: count, loads: 1, shards, bytes, loading, making })
    }

    /// Writes a shard of these samples.
    fn store(&self, index: usize, channels: &[Channel], samples: &[StoredSample]) -> Result<FinishedShard, RunError> {
        let mut writer = self.shard(index, channels, samples.len() as u64)?;
        for (index, sample) in (0..).map(SampleIndex).zip(samples) {
            store(&mut writer, index, &sample.as_made())?;
        }
        Ok(writer.finish()?)
    }

    /// Size of a shard that holds one reject and nothing else [bytes].
    fn bytes_of_empty_shard(&self, channels: &[Channel]) -> Result<u64, RunError> {
        let Some(subject) = self.job.work.subjects().first().map(|subject| subject.id) else { return Ok(0) };
        let mut writer = self.shard(0, channels, 1)?;
        let sample = SampleId::of_object(subject, ItemId(0));
        let facts = Facts::new(self.job.product().facts.iter().map(|_| 0.0));
        writer.reject(SampleIndex(0), &sample, facts, "empty", "")?;
        Ok(writer.finish()?.bytes)
    }

    fn shard(&self, index: usize, channels: &[Channel], samples: u64) -> Result<ShardWriter, DatasetError> {
        let header = ShardHeader {
            product: self.job.product(),
            job: self.job.digest(),
            shard: ShardId(index as u32),
            shards: u32::MAX,
            samples: 0..samples,
            channels: channels.to_vec(),
        };
        ShardWriter::create(self.folder, &header)
    }
}

/// Blocks of `size` consecutive numbers below `count`, in an order in which any first few are spread over all.
fn spread_blocks(count: u32, size: u32) -> impl Iterator<Item = Range<u32>> {
    let blocks = count.div_ceil(size);
    // Steps of the golden section; coprime with the count, so that each block comes once.
    let nearest = (f64::from(blocks) * 0.618) as u32;
    let step = (nearest.max(1)..).find(|step| greatest_common_divisor(*step, blocks.max(1)) == 1).unwrap_or(1);
    (0..blocks).map(move |index| {
        let first = (u64::from(index) * u64::from(step) % u64::from(blocks)) as u32 * size;
        first..count.min(first + size)
    })
}

fn greatest_common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// Fate of a finished sample: its payloads, or the reason of its reject with details.
enum StoredFate {
    Kept(Vec<(Channel, Vec<u8>)>),
    Rejected { reason: &'static str, detail: String },
}

/// A finished sample with its payloads.
struct StoredSample {
    sample: SampleId,
    facts: Facts,
    fate: StoredFate,
}

impl StoredSample {
    fn new(made: &MadeSample<'_>) -> Self {
        let fate = match made.fate {
            MadeFate::Kept(payloads) => StoredFate::Kept(payloads.to_vec()),
            MadeFate::Rejected { reason, detail } => StoredFate::Rejected { reason, detail: detail.to_owned() },
        };
        Self { sample: made.sample, facts: made.facts.clone(), fate }
    }

    fn as_made(&self) -> MadeSample<'_> {
        let fate = match &self.fate {
            StoredFate::Kept(payloads) => MadeFate::Kept(payloads),
            StoredFate::Rejected { reason, detail } => MadeFate::Rejected { reason, detail },
        };
        MadeSample { sample: self.sample, facts: self.facts.clone(), fate }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_hold_every_item_once_and_the_first_few_lie_apart() {
        for (count, size) in [(0, 16), (1, 16), (15, 16), (16, 16), (17, 16), (726, 16), (5280, 16), (78, 1)] {
            let mut all: Vec<u32> = spread_blocks(count, size).flatten().collect();
            all.sort_unstable();
            assert_eq!(all, (0..count).collect::<Vec<_>>(), "{count}");
        }
        // Gaps between the first four of the golden section's steps: at most 0.382 of the whole.
        let starts: BTreeSet<u32> = spread_blocks(1600, 16).take(4).map(|block| block.start).chain([1600]).collect();
        let starts = Vec::from_iter(starts);
        assert!(starts.windows(2).all(|pair| pair[1] - pair[0] <= 640), "{starts:?}");
    }
}
