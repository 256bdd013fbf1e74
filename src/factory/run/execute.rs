//! Makes the shards of a plan that are missing, then closes the dataset.

use std::{
    sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering},
    time::Instant,
};

use serde::Serialize;

use super::contain::{contain, item_words, subject_words};
use crate::{
    Cancel, Event, Listener, MadeFate, MadeSample, ProduceError, Progress, RunContext, RunError, SampleSink,
    job::Job,
    plan::{Plan, ShardPlan, Share, WorkUnit},
    work::{Closing, OpenWork, Opening, Producer},
};
use format::{
    Product,
    dataset::{
        Begun, DatasetError, DatasetHeader, FinishedShard, Manifest, RunMark, ShardHeader, ShardScan, ShardWriter,
        abandon_run, begin_run, clear_away, clear_pending, finish_dataset, scan_shards, scan_some_shards,
        shards_folder, write_pending,
    },
};
use kernel::{
    files::Folder,
    ids::{ItemId, JobDigest, SampleIndex},
};
use tables::ParquetIndex;

/// Milliseconds between two progress events.
const PROGRESS_PAUSE: u64 = 100;

/// A dataset to make: the job, its plan, and the tables in addition to the samples.
pub struct RunTask<'a> {
    /// The job.
    pub job: &'a Job,
    /// Plan of the job.
    pub plan: &'a Plan,
    /// Digest of the job.
    pub digest: JobDigest,
    /// The tables.
    pub header: &'a DatasetHeader,
    /// The dataset's folder.
    pub folder: &'a Folder,
}

/// Result of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunSummary {
    /// Whether the dataset was finished before this run began.
    pub finished_before: bool,
    /// Product of the samples.
    pub product: Product,
    /// Samples made in this run, kept and rejected.
    pub made: u64,
    /// Time of making them, without preparing meshes and closing the dataset [s].
    pub seconds: f64,
    /// The finished dataset.
    pub manifest: Manifest,
}

/// Result of one task's share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ShareSummary {
    /// Shards of the share.
    pub shards: u32,
    /// Number of those that were finished before.
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
pub fn run(task: &RunTask, context: &RunContext<'_>) -> Result<RunSummary, RunError> {
    let (mark, product) = (task.mark(), task.job.product());
    let begun = begin_run(task.folder, &mark)?;
    let scan = scan_shards(task.folder, &mark)?;
    clear_away(task.folder, &scan)?;
    if begun == Begun::Finished && scan.done.len() == task.plan.shards.len() {
        let manifest = Manifest::read(task.folder)?;
        return Ok(RunSummary { finished_before: true, product, made: 0, seconds: 0.0, manifest });
    }
    let work = task.open(context).inspect_err(|_| {
        // The folder of a job that fails is free for the corrected one.
        if begun == Begun::New {
            abandon_run(task.folder);
        }
    })?;
    let all: Vec<&ShardPlan> = task.plan.shards.iter().collect();
    let made = make_missing(task, &all, &scan, work.as_ref(), context);
    let (made, seconds) = made.inspect_err(|error| {
        if begun == Begun::New && matches!(error, RunError::WrongJob(_)) {
            abandon_run(task.folder);
        }
    })?;
    let manifest = close(task, work, context)?;
    Ok(RunSummary { finished_before: false, product, made, seconds, manifest })
}

/// Makes what is missing of one task's share of the shards, and leaves the dataset open for [`merge`]. Any number of tasks
/// may fill a folder at the same time, and one may run twice: equal shards have equal names. Files that other tasks write are
/// neither read nor cleared away.
///
/// # Errors
/// Errors of [`run`].
pub fn run_share(task: &RunTask, share: Share, context: &RunContext<'_>) -> Result<ShareSummary, RunError> {
    let mark = task.mark();
    if begin_run(task.folder, &mark)? != Begun::Finished {
        write_pending(task.folder, task.header)?;
    }
    let mut scan = scan_some_shards(task.folder, &mark, &|shard| share.holds(shard))?;
    // On some file systems a lock is visible on one machine only: a temporary file can belong to another running task.
    scan.leftovers.clear();
    clear_away(task.folder, &scan)?;
    let own: Vec<&ShardPlan> = task.plan.shards.iter().filter(|shard| share.holds(shard.id)).collect();
    let (shards, shards_before) = (own.len() as u32, scan.done.len() as u32);
    if shards == shards_before {
        return Ok(ShareSummary { shards, shards_before, made: 0, seconds: 0.0 });
    }
    let work = task.open(context)?;
    let (made, seconds) = make_missing(task, &own, &scan, work.as_ref(), context)?;
    Ok(ShareSummary { shards, shards_before, made, seconds })
}

/// Closes a dataset whose shards were made by tasks: checks each, and writes what [`run`] writes in the end. Makes no sample.
///
/// # Errors
/// Errors of [`run`], and [`RunError::Gap`] when shards are missing.
pub fn merge(task: &RunTask, context: &RunContext<'_>) -> Result<RunSummary, RunError> {
    let (mark, product) = (task.mark(), task.job.product());
    let begun = begin_run(task.folder, &mark)?;
    let scan = scan_shards(task.folder, &mark)?;
    let missing = scan.missing(mark.shards);
    if !missing.is_empty() {
        // Nothing is removed: other tasks can be running.
        return Err(RunError::Gap { missing, shards: mark.shards, bad: scan.bad });
    }
    clear_away(task.folder, &scan)?;
    let finished_before = begun == Begun::Finished;
    let manifest =
        if finished_before { Manifest::read(task.folder)? } else { close(task, task.open(context)?, context)? };
    Ok(RunSummary { finished_before, product, made: 0, seconds: 0.0, manifest })
}

impl<'a> RunTask<'a> {
    fn mark(&self) -> RunMark {
        let Self { job, plan, digest, .. } = *self;
        RunMark::new(job.product(), digest, plan.samples, plan.shards.len() as u32, job.shard_samples)
    }

    fn open(&self, context: &RunContext<'_>) -> Result<Box<dyn OpenWork + 'a>, RunError> {
        let (seed, level, splits) = (self.job.seed, context.parallelism.level, self.header.splits.as_ref());
        let open = || self.job.work.open(Opening { seed, level, splits });
        contain(|| "opening the job".to_owned(), open).map_err(RunError::of_opening)
    }
}

/// Makes those of `shards` that are not done: count of samples, and time that it took [s].
fn make_missing(
    task: &RunTask,
    shards: &[&ShardPlan],
    scan: &ShardScan,
    work: &dyn OpenWork,
    context: &RunContext<'_>,
) -> Result<(u64, f64), RunError> {
    let RunContext { parallelism, cancel, listener } = *context;
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
        threads: parallelism.threads,
    });
    let tally = Tally::new(to_make, listener);
    let (next, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    // Each thread keeps one producer for all of its shards and takes the next shard when it is done with one.
    let on_thread = |_: rayon::BroadcastContext<'_>| {
        let mut maker: Option<ShardMaker<'_>> = None;
        while !failed.load(Ordering::Relaxed)
            && let Some(shard) = missing.get(next.fetch_add(1, Ordering::Relaxed))
        {
            let made =
                ShardMaker::of_thread(&mut maker, work).and_then(|maker| maker.make(task, shard, cancel, &tally));
            failed.fetch_or(made.is_err(), Ordering::Relaxed);
            let made = made?;
            let (file, samples) = (made.file_name(), made.kept + made.rejected);
            listener(Event::ShardFinished { shard: shard.id.0, file, samples });
        }
        Ok::<_, RunError>(())
    };
    let ended = parallelism.pool()?.broadcast(on_thread).into_iter().collect::<Result<(), _>>();
    // Also before an error: a listener reports what is lost of unfinished shards.
    let seconds = tally.finish();
    ended.map(|()| (to_make, seconds))
}

/// Writes the product's own files, index, tables and manifest; all shards are complete. The memory of the work, such as meshes,
/// is free before index and manifest take theirs.
fn close(task: &RunTask, work: Box<dyn OpenWork + '_>, context: &RunContext<'_>) -> Result<Manifest, RunError> {
    let RunContext { parallelism, cancel, listener } = *context;
    listener(Event::Finishing);
    let (mark, mut header) = (task.mark(), task.header.clone());
    let mut closing =
        Closing { folder: task.folder, job: task.digest, mark: &mark, header: &mut header, parallelism, cancel };
    contain(|| "closing the dataset".to_owned(), || work.finish(&mut closing))?;
    drop(work);
    let manifest = finish_dataset(task.folder, &header, &ParquetIndex)?;
    clear_pending(task.folder)?;
    Ok(manifest)
}

/// The producer of one thread, and the sink that it fills.
struct ShardMaker<'w> {
    producer: Box<dyn Producer + 'w>,
    sink: SampleSink,
}

impl<'w> ShardMaker<'w> {
    /// The maker of a thread, opened for the thread's first shard.
    fn of_thread<'m>(maker: &'m mut Option<Self>, work: &'w dyn OpenWork) -> Result<&'m mut Self, RunError> {
        if maker.is_none() {
            let opened = contain(
                || "opening the job for a thread".to_owned(),
                || {
                    let producer = work.producer()?;
                    let sink = SampleSink::new(producer.channels());
                    Ok::<_, RunError>(Self { producer, sink })
                },
            );
            *maker = Some(opened.map_err(RunError::of_opening)?);
        }
        Ok(maker.as_mut().expect("a maker was opened for the first shard"))
    }

    /// Makes one shard from its first sample to its last.
    fn make(
        &mut self,
        task: &RunTask,
        shard: &ShardPlan,
        cancel: &Cancel,
        tally: &Tally<'_>,
    ) -> Result<FinishedShard, RunError> {
        let header = ShardHeader {
            product: task.job.product(),
            job: task.digest,
            shard: shard.id,
            shards: task.plan.shards.len() as u32,
            samples: shard.samples.clone(),
            channels: self.producer.channels(),
        };
        let mut writer = ShardWriter::create(&shards_folder(task.folder), &header)?;
        for unit in &shard.units {
            let subject = || format!("preparing {}", subject_words(task.job, unit.subject));
            contain(subject, || self.producer.load(unit.subject, cancel))?;
            let mut next = unit.first;
            for item in unit.items.clone().map(ItemId) {
                if cancel.is_cancelled() {
                    return Err(RunError::Interrupted);
                }
                let expected = next.0 + u64::from(unit.samples_per_item);
                let mut take = |made: &MadeSample<'_>| {
                    store(&mut writer, next, made)?;
                    tally.count(matches!(made.fate, MadeFate::Kept(_)));
                    next.0 += 1;
                    Ok(())
                };
                let sample = || item_words(task.job, unit.subject, item);
                contain(sample, || self.producer.produce(item, &mut self.sink.writer(&mut take)))?;
                check_count(unit, item, next, expected)?;
            }
        }
        Ok(writer.finish()?)
    }
}

/// Refuses a producer that makes more or fewer samples of an item than its job plans: every index after it would shift.
fn check_count(unit: &WorkUnit, item: ItemId, next: SampleIndex, expected: u64) -> Result<(), RunError> {
    if next.0 == expected {
        return Ok(());
    }
    let made = next.0 + u64::from(unit.samples_per_item) - expected;
    let expected = format!("{} samples of item {item}", unit.samples_per_item);
    let shard = format!("subject {}", unit.subject);
    Err(DatasetError::Sequence { shard, expected, found: made.to_string() }.into())
}

/// Stores a sample, or accounts for its reject.
pub(super) fn store(writer: &mut ShardWriter, index: SampleIndex, made: &MadeSample<'_>) -> Result<(), ProduceError> {
    let MadeSample { sample, facts, fate } = made;
    match fate {
        MadeFate::Kept(payloads) => {
            for (channel, payload) in *payloads {
                writer.write(index, sample, *channel, payload)?;
            }
            writer.keep(index, sample, facts.clone())?;
        }
        MadeFate::Rejected { reason, detail } => writer.reject(index, sample, facts.clone(), reason, detail)?,
    }
    Ok(())
}

/// Counts finished samples over all threads and informs the listener now and then.
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

    /// Reports the end; returns the seconds since the beginning.
    fn finish(&self) -> f64 {
        self.tell();
        self.began.elapsed().as_secs_f64()
    }
}
