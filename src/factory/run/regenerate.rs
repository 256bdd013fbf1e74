//! Makes random samples of a finished dataset again and compares their bytes.

use std::collections::BTreeMap;

use serde::Serialize;

use super::contain::{contain, item_words, subject_words};
use crate::{MadeFate, MadeSample, RunContext, RunError, SampleSink, job::Job, plan::Plan, work::Opening};
use format::{
    Channel,
    dataset::{DatasetReader, Fate, Ledger, LedgerRow, other_platform},
};
use kernel::{
    ids::{Digest, ItemId, SampleId, SampleIndex},
    seed::Stream,
};

/// One sample that came out differently.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Which sample.
    pub sample: u64,
    /// Id of the sample.
    pub id: String,
    /// Difference, in words.
    pub what: String,
}

/// Result of a regeneration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Regeneration {
    /// Samples made again.
    pub samples: u64,
    /// Samples of the dataset.
    pub of_samples: u64,
    /// Samples that differ.
    pub differences: Vec<Difference>,
    /// Facts of the platform by which numbers of class physics and colour were made, and what they are here, where that is something
    /// else.
    pub platform: BTreeMap<String, [Option<String>; 2]>,
}

impl Regeneration {
    /// When all of K random samples agree, less than this share of the dataset differs, with 95 % confidence
    /// (1 - 0.05^(1/K), about 3/K; drawn without replacement it is less still).
    pub fn bound(&self) -> f64 {
        if self.samples >= self.of_samples { 0.0 } else { 1.0 - libm::pow(0.05, 1.0 / self.samples.max(1) as f64) }
    }
}

/// Makes `count` samples of the dataset again, chosen by `seed`, and compares the digests of every channel, or the
/// reason of a reject. `job` is the dataset's own resolved job, resolved again.
///
/// # Errors
/// When the dataset cannot be read, a mesh is missing, or the work is interrupted; differences are no errors.
pub fn regenerate(
    reader: &DatasetReader,
    job: &Job,
    plan: &Plan,
    count: u64,
    seed: u64,
    context: &RunContext<'_>,
) -> Result<Regeneration, RunError> {
    let chosen = choose(plan.samples, count, seed);
    let mut by_item: BTreeMap<(usize, ItemId), Vec<SampleIndex>> = BTreeMap::new();
    for index in &chosen {
        by_item.entry(plan.locate(*index)).or_default().push(*index);
    }
    let (seed, level) = (job.seed, context.parallelism.level);
    let work = job.work.open(Opening { seed, level, splits: Some(reader.splits()) })?;
    let mut producer = work.producer()?;
    let channels = producer.channels();
    let mut sink = SampleSink::new(channels.iter().copied());
    let (mut differences, mut ledger) = (Vec::new(), None);
    for ((subject, item), indices) in by_item {
        if context.cancel.is_cancelled() {
            return Err(RunError::Interrupted);
        }
        contain(|| format!("preparing {}", subject_words(job, subject)), || producer.load(subject, context.cancel))?;
        let mut made: BTreeMap<SampleId, Fate> = BTreeMap::new();
        let mut take = |sample: &MadeSample<'_>| {
            made.insert(sample.sample, fate_of(sample));
            Ok(())
        };
        contain(|| item_words(job, subject, item), || producer.produce(item, &mut sink.writer(&mut take)))?;
        for index in indices {
            let row = row_of(reader, plan, &mut ledger, index)?;
            let what = match made.get(&row.sample) {
                None => "the job makes no such sample at this index".to_owned(),
                Some(made) if *made == row.fate => continue,
                Some(made) => describe(&row.fate, made, &channels),
            };
            differences.push(Difference { sample: index.0, id: row.sample.to_string(), what });
        }
    }
    let platform = other_platform(&reader.manifest().platform, &job.work.tables(None).platform);
    Ok(Regeneration { samples: chosen.len() as u64, of_samples: plan.samples, differences, platform })
}

fn fate_of(made: &MadeSample<'_>) -> Fate {
    match made.fate {
        MadeFate::Kept(payloads) => Fate::Kept(payloads.iter().map(|(_, payload)| Digest::hash(payload)).collect()),
        MadeFate::Rejected { reason, detail } => {
            Fate::Rejected { reason: reason.to_owned(), detail: detail.to_owned() }
        }
    }
}

/// The dataset's own row of a sample; `ledger` keeps the last shard's, since samples come in order.
fn row_of(
    reader: &DatasetReader,
    plan: &Plan,
    ledger: &mut Option<Ledger>,
    index: SampleIndex,
) -> Result<LedgerRow, RunError> {
    let shard = plan.shard_of(index).expect("a sample of the plan is in one of its shards").id;
    if ledger.as_ref().is_none_or(|ledger| ledger.shard != shard) {
        *ledger = Some(reader.ledger(shard.0 as usize)?);
    }
    let rows = ledger.as_ref().map_or(&[][..], |ledger| &ledger.rows);
    let first = ledger.as_ref().map_or(0, |ledger| ledger.first.0);
    Ok(rows[(index.0 - first) as usize].clone())
}

/// Draws this number of different sample indices, ascending: the beginning of a Fisher-Yates shuffle.
fn choose(samples: u64, count: u64, seed: u64) -> Vec<SampleIndex> {
    let mut stream = Stream::of_job(seed, b"", "regenerate");
    let count = count.min(samples);
    let mut moved: BTreeMap<u64, u64> = BTreeMap::new();
    let mut chosen: Vec<SampleIndex> = (0..count)
        .map(|draw| {
            let other = draw + stream.below(samples - draw);
            let value = moved.get(&other).copied().unwrap_or(other);
            let here = moved.get(&draw).copied().unwrap_or(draw);
            moved.insert(other, here);
            SampleIndex(value)
        })
        .collect();
    chosen.sort_unstable();
    chosen
}

fn describe(stored: &Fate, made: &Fate, channels: &[Channel]) -> String {
    match (stored, made) {
        (Fate::Kept(stored), Fate::Kept(made)) => {
            let names = channels.iter().zip(stored.iter().zip(made));
            let changed: Vec<_> = names.filter(|(_, (a, b))| a != b).map(|(channel, _)| channel.name()).collect();
            format!("other bytes in {}", changed.join(", "))
        }
        (Fate::Kept(_), Fate::Rejected { reason, .. }) => format!("stored, but made again it is rejected: {reason}"),
        (Fate::Rejected { reason, .. }, Fate::Kept(_)) => format!("rejected ({reason}), but made again it is kept"),
        (Fate::Rejected { reason: a, detail: b }, Fate::Rejected { reason: c, detail: d }) => {
            format!("rejected for {a} ({b}), made again for {c} ({d})")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choice_is_distinct_and_complete() {
        let all: Vec<u64> = choose(20, 50, 3).into_iter().map(|index| index.0).collect();
        assert_eq!(all, (0..20).collect::<Vec<_>>());
        let some = choose(1_000_000, 100, 3);
        assert_eq!(some.len(), 100);
        assert!(some.windows(2).all(|pair| pair[0] < pair[1]));
        assert_ne!(some, choose(1_000_000, 100, 4));
    }
}
