//! Makes the shards of a plan that are missing, then closes the dataset.

use std::{
    path::Path,
    sync::atomic::{AtomicU64, Ordering},
    time::Instant,
};

use rayon::prelude::*;
use serde::Serialize;

use super::{Cancel, Event, Listener, Progress, shapes::write_shapes, tables::add_resting, workshop::open_workshop};
use crate::{
    dataset::{
        BadShard, Begun, DatasetError, DatasetHeader, FinishedShard, Manifest, RunMark, ShardHeader, ShardScan,
        ShardWriter, begin_run, clear_away, clear_pending, finish_dataset, scan_shards, scan_some_shards,
        shards_folder, write_pending,
    },
    geom::SimdLevel,
    ids::{JobDigest, Product, ViewId, ranges},
    job::Job,
    plan::{Plan, ShardPlan, Share},
    produce::{Outcome, ProduceError, Workshop},
};

/// Milliseconds between two progress events.
const PROGRESS_PAUSE: u64 = 100;

/// Who works, and with which instructions; changes no byte.
#[derive(Clone, Copy, Debug)]
pub struct Crew {
    /// Threads.
    pub threads: usize,
    /// Vector instructions.
    pub level: SimdLevel,
}

impl Crew {
    pub(super) fn pool(&self) -> Result<rayon::ThreadPool, RunError> {
        rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads)
            .thread_name(|number| format!("worker-{number}"))
            .build()
            .map_err(|error| RunError::Threads(error.to_string()))
    }
}

/// Words for files that are no shards, after what is missing.
fn not_whole(bad: &[BadShard]) -> String {
    bad.iter().map(|bad| format!("\n{}: {}", bad.path.display(), bad.problem)).collect()
}

/// What to run, and what the dataset's tables say beside the samples.
pub struct RunTask<'a> {
    /// The job.
    pub job: &'a Job,
    /// Its plan.
    pub plan: &'a Plan,
    /// Its digest.
    pub digest: JobDigest,
    /// The tables.
    pub header: &'a DatasetHeader,
    /// The dataset's folder.
    pub folder: &'a Path,
}

/// Why a run ended early. What was finished before stays.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Somebody asked to stop.
    #[error("interrupted; run the same command again to resume")]
    Interrupted,
    /// The dataset could not be read or written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A sample could not be made.
    #[error(transparent)]
    Produce(#[from] ProduceError),
    /// A dataset cannot be closed: shards are missing.
    #[error("{} of {shards} shards are missing: {}{}", missing.len(), ranges(missing), not_whole(bad))]
    Gap {
        /// Which, in order.
        missing: Vec<u32>,
        /// Of how many.
        shards: u32,
        /// Files that claim to be shards and are none.
        bad: Vec<BadShard>,
    },
    /// The threads could not be started.
    #[error("starting threads: {0}; try fewer with --threads")]
    Threads(String),
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunSummary {
    /// Whether the dataset was finished before this run began.
    pub finished_before: bool,
    /// What is made.
    pub product: Product,
    /// Samples made in this run, kept and rejected.
    pub made: u64,
    /// Time of making them, without looking at meshes and closing the dataset [s].
    pub seconds: f64,
    /// The finished dataset.
    pub manifest: Manifest,
}

/// What a task did of its share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ShareSummary {
    /// Shards of the share.
    pub shards: u32,
    /// Of these, finished before.
    pub shards_before: u32,
    /// Samples made, kept and rejected.
    pub made: u64,
    /// Time of making them [s].
    pub seconds: f64,
}

/// Makes what is missing of the dataset, and closes it.
///
/// # Errors
/// When the folder belongs to another job, cannot be written, a mesh changed since the job was resolved, or the run is
/// interrupted. Finished shards stay; the same call resumes.
pub fn run(task: &RunTask, crew: &Crew, cancel: &Cancel, listener: &Listener) -> Result<RunSummary, RunError> {
    let (mark, product) = (task.mark(), task.job.product());
    let begun = begin_run(task.folder, &mark)?;
    let scan = scan_shards(task.folder, &mark)?;
    clear_away(&scan)?;
    if begun == Begun::Finished && scan.done.len() == task.plan.shards.len() {
        let manifest = Manifest::read(task.folder)?;
        return Ok(RunSummary { finished_before: true, product, made: 0, seconds: 0.0, manifest });
    }
    let workshop = open_workshop(task.job, crew.level)?;
    let all: Vec<&ShardPlan> = task.plan.shards.iter().collect();
    let (made, seconds) = make_missing(task, &all, &scan, &workshop, crew, cancel, listener)?;
    let manifest = close(task, &workshop, crew, cancel, listener)?;
    Ok(RunSummary { finished_before: false, product, made, seconds, manifest })
}

/// Makes what is missing of one task's share of the shards, and leaves the dataset open for [`merge`]. Any number of tasks
/// may fill a folder at the same time, and one may run twice: equal shards have equal names. What other tasks write is neither
/// read nor cleared away.
///
/// # Errors
/// As [`run`].
pub fn run_share(
    task: &RunTask,
    share: Share,
    crew: &Crew,
    cancel: &Cancel,
    listener: &Listener,
) -> Result<ShareSummary, RunError> {
    let mark = task.mark();
    if begin_run(task.folder, &mark)? != Begun::Finished {
        write_pending(task.folder, task.header)?;
    }
    let mut scan = scan_some_shards(task.folder, &mark, &|shard| share.holds(shard))?;
    // On some file systems a lock is seen on one machine only: a temporary file may be another task's, at work.
    scan.leftovers.clear();
    clear_away(&scan)?;
    let own: Vec<&ShardPlan> = task.plan.shards.iter().filter(|shard| share.holds(shard.id)).collect();
    let (shards, shards_before) = (own.len() as u32, scan.done.len() as u32);
    if shards == shards_before {
        return Ok(ShareSummary { shards, shards_before, made: 0, seconds: 0.0 });
    }
    let workshop = open_workshop(task.job, crew.level)?;
    let (made, seconds) = make_missing(task, &own, &scan, &workshop, crew, cancel, listener)?;
    Ok(ShareSummary { shards, shards_before, made, seconds })
}

/// Closes a dataset whose shards were made by tasks: checks each, and writes what [`run`] writes in the end. Makes no sample.
///
/// # Errors
/// As [`run`]; and [`RunError::Gap`] when shards are missing.
pub fn merge(task: &RunTask, crew: &Crew, cancel: &Cancel, listener: &Listener) -> Result<RunSummary, RunError> {
    let (mark, product) = (task.mark(), task.job.product());
    let begun = begin_run(task.folder, &mark)?;
    let scan = scan_shards(task.folder, &mark)?;
    let missing = scan.missing(mark.shards);
    if !missing.is_empty() {
        // Nothing is cleared away: tasks may be at work.
        return Err(RunError::Gap { missing, shards: mark.shards, bad: scan.bad });
    }
    clear_away(&scan)?;
    let finished_before = begun == Begun::Finished;
    let manifest = if finished_before {
        Manifest::read(task.folder)?
    } else {
        close(task, &open_workshop(task.job, crew.level)?, crew, cancel, listener)?
    };
    Ok(RunSummary { finished_before, product, made: 0, seconds: 0.0, manifest })
}

impl RunTask<'_> {
    fn mark(&self) -> RunMark {
        let Self { job, plan, digest, .. } = *self;
        RunMark::new(job.product(), digest, plan.samples, plan.shards.len() as u32, job.shard_samples)
    }
}

/// Makes those of `shards` that are not done: how many samples that were, and how long it took [s].
fn make_missing(
    task: &RunTask,
    shards: &[&ShardPlan],
    scan: &ShardScan,
    workshop: &Workshop,
    crew: &Crew,
    cancel: &Cancel,
    listener: &Listener,
) -> Result<(u64, f64), RunError> {
    let samples_of = |shard: &ShardPlan| shard.samples.end - shard.samples.start;
    let missing: Vec<&ShardPlan> = shards.iter().filter(|shard| !scan.done.contains_key(&shard.id)).copied().collect();
    let to_make = missing.iter().map(|shard| samples_of(shard)).sum();
    let samples: u64 = shards.iter().map(|shard| samples_of(shard)).sum();
    listener(Event::Planned {
        product: task.job.product(),
        samples,
        samples_before: samples - to_make,
        shards: shards.len() as u64,
        shards_before: scan.done.len() as u64,
        threads: crew.threads,
    });
    let tally = Tally::new(to_make, listener);
    let make = |shard: &&ShardPlan| {
        let made = make_shard(task, shard, workshop, cancel, &tally)?;
        let file = made.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        listener(Event::ShardFinished { shard: shard.id.0, file });
        Ok::<_, RunError>(())
    };
    // One shard a task: rayon may not hand a thread a run of them that another one then waits for.
    crew.pool()?.install(|| missing.par_iter().with_max_len(1).try_for_each(make))?;
    Ok((to_make, tally.finish()))
}

/// Writes index, tables and manifest; all shards are there.
fn close(
    task: &RunTask,
    workshop: &Workshop,
    crew: &Crew,
    cancel: &Cancel,
    listener: &Listener,
) -> Result<Manifest, RunError> {
    listener(Event::Finishing);
    let manifest = if let Workshop::Grasps { job, hand, .. } = workshop {
        let resting = write_shapes(task, job, hand, crew, cancel)?;
        let mut header = task.header.clone();
        header.assets.iter_mut().for_each(|row| add_resting(row, &resting));
        finish_dataset(task.folder, &header)?
    } else {
        finish_dataset(task.folder, task.header)?
    };
    clear_pending(task.folder)?;
    Ok(manifest)
}

/// Makes one shard from its first sample to its last.
fn make_shard(
    task: &RunTask,
    shard: &ShardPlan,
    workshop: &Workshop,
    cancel: &Cancel,
    tally: &Tally,
) -> Result<FinishedShard, RunError> {
    let mut producer = workshop.producer()?;
    let header = ShardHeader {
        product: task.job.product(),
        job: task.digest,
        shard: shard.id,
        shards: task.plan.shards.len() as u32,
        samples: shard.samples.clone(),
        channels: producer.channels(),
    };
    let mut writer = ShardWriter::create(&shards_folder(task.folder), &header)?;
    for unit in &shard.units {
        producer.load(unit.subject)?;
        for view in unit.views.clone() {
            if cancel.is_cancelled() {
                return Err(RunError::Interrupted);
            }
            let index = crate::ids::SampleIndex(unit.first.0 + u64::from(view - unit.views.start));
            let (sample, outcome) = producer.produce(ViewId(view))?;
            match &outcome {
                Outcome::Kept(facts) => {
                    for (channel, payload) in producer.payloads() {
                        writer.write(index, &sample, channel, payload)?;
                    }
                    writer.keep(index, &sample, *facts)?;
                }
                Outcome::Rejected { reason, detail, facts } => {
                    writer.reject(index, &sample, *facts, reason, detail)?;
                }
            }
            tally.count(matches!(outcome, Outcome::Kept(_)));
        }
    }
    Ok(writer.finish()?)
}

/// Seconds a sample on one thread, from up to `samples` samples spread over the plan; nothing is written.
///
/// # Errors
/// As [`run`].
pub fn pilot(job: &Job, plan: &Plan, samples: u64, level: SimdLevel, cancel: &Cancel) -> Result<PilotRate, RunError> {
    let workshop = open_workshop(job, level)?;
    let mut producer = workshop.producer()?;
    let subjects = job.subjects() as u64;
    let visited = subjects.min(8);
    let (mut made, mut bytes) = (0u64, 0u64);
    let (mut load_seconds, mut view_seconds) = (0.0, 0.0);
    for step in 0..visited {
        let began = Instant::now();
        let subject = (step * subjects / visited) as usize;
        let views = u64::from(plan.views_of(subject));
        let per_subject = (samples / visited.max(1)).clamp(1, views.max(1)).min(views);
        producer.load(subject)?;
        load_seconds += began.elapsed().as_secs_f64();
        let began = Instant::now();
        for place in 0..per_subject {
            if cancel.is_cancelled() {
                return Err(RunError::Interrupted);
            }
            producer.produce(ViewId((place * views / per_subject) as u32))?;
            bytes += producer.payloads().iter().map(|(_, payload)| payload.len() as u64).sum::<u64>();
            made += 1;
        }
        view_seconds += began.elapsed().as_secs_f64();
    }
    Ok(PilotRate {
        samples: made,
        seconds_per_subject: load_seconds / visited.max(1) as f64,
        seconds_per_sample: view_seconds / made.max(1) as f64,
        raw_bytes_per_sample: bytes as f64 / made.max(1) as f64,
    })
}

/// What a pilot measured, on one thread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PilotRate {
    /// Samples made.
    pub samples: u64,
    /// Reading a subject and making it ready (voxelising and indexing an object) [s].
    pub seconds_per_subject: f64,
    /// Making a sample, without writing it [s].
    pub seconds_per_sample: f64,
    /// Payload bytes a sample, before compression.
    pub raw_bytes_per_sample: f64,
}

/// Counts finished samples over all threads and tells the listener now and then.
struct Tally<'a> {
    listener: &'a Listener<'a>,
    began: Instant,
    to_make: u64,
    kept: AtomicU64,
    rejected: AtomicU64,
    /// Milliseconds after `began` at which the next event is due.
    next_event: AtomicU64,
}

impl<'a> Tally<'a> {
    fn new(to_make: u64, listener: &'a Listener<'a>) -> Self {
        let zero = || AtomicU64::new(0);
        Self { listener, began: Instant::now(), to_make, kept: zero(), rejected: zero(), next_event: zero() }
    }

    fn count(&self, kept: bool) {
        if kept { &self.kept } else { &self.rejected }.fetch_add(1, Ordering::Relaxed);
        let now = self.began.elapsed().as_millis() as u64;
        let due = self.next_event.load(Ordering::Relaxed);
        let claim =
            || self.next_event.compare_exchange(due, now + PROGRESS_PAUSE, Ordering::Relaxed, Ordering::Relaxed);
        if now >= due && claim().is_ok() {
            self.tell();
        }
    }

    fn tell(&self) {
        let (kept, rejected) = (self.kept.load(Ordering::Relaxed), self.rejected.load(Ordering::Relaxed));
        let seconds = self.began.elapsed().as_secs_f64();
        let made = kept + rejected;
        (self.listener)(Event::Progress(Progress { made, to_make: self.to_make, kept, rejected, seconds }));
    }

    /// Tells the end; returns the seconds since the beginning.
    fn finish(&self) -> f64 {
        self.tell();
        self.began.elapsed().as_secs_f64()
    }
}
