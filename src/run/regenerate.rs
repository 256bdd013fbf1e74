//! Makes random samples of a finished dataset again and compares their bytes.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Cancel, Crew, RunError, workshop::open_workshop};
use crate::{
    dataset::{DatasetReader, Fate, Ledger, LedgerRow},
    ids::{Digest, SampleIndex},
    job::Job,
    plan::Plan,
    produce::{Outcome, Producer},
    seed::Stream,
};

/// One sample that came out differently.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Which sample.
    pub sample: u64,
    /// Its id.
    pub id: String,
    /// What differs, in words.
    pub what: String,
}

/// What a regeneration found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Regeneration {
    /// Samples made again.
    pub samples: u64,
    /// Samples of the dataset.
    pub of_samples: u64,
    /// Those that differ.
    pub differences: Vec<Difference>,
}

impl Regeneration {
    /// When all of K random samples agree, fewer than this share of the dataset differs, with 95 % confidence
    /// (1 - 0.05^(1/K), about 3/K; drawn without replacement it is less still).
    pub fn bound(&self) -> f64 {
        if self.samples >= self.of_samples { 0.0 } else { 1.0 - libm::pow(0.05, 1.0 / self.samples.max(1) as f64) }
    }
}

/// Makes `count` samples of the dataset again, chosen by `seed`, and compares the digests of every channel, or the
/// reason of a reject. `job` is the dataset's own resolved job, resolved anew.
///
/// # Errors
/// When the dataset cannot be read, a mesh is missing, or the work is interrupted; differences are no errors.
pub fn regenerate(
    reader: &DatasetReader,
    job: &Job,
    plan: &Plan,
    count: u64,
    seed: u64,
    crew: &Crew,
    cancel: &Cancel,
) -> Result<Regeneration, RunError> {
    let chosen = choose(plan.samples, count, seed);
    let mut by_subject: BTreeMap<usize, Vec<SampleIndex>> = BTreeMap::new();
    for index in &chosen {
        by_subject.entry(plan.locate(*index).0).or_default().push(*index);
    }
    let workshop = open_workshop(job, crew.level)?;
    let mut producer = workshop.producer()?;
    let mut differences = Vec::new();
    let mut ledger = None;
    for (subject, indices) in by_subject {
        producer.load(subject)?;
        for index in indices {
            if cancel.is_cancelled() {
                return Err(RunError::Interrupted);
            }
            let (id, outcome) = producer.produce(plan.locate(index).1)?;
            let row = row_of(reader, plan, &mut ledger, index)?;
            let made = match outcome {
                Outcome::Kept(_) => {
                    Fate::Kept(producer.payloads().into_iter().map(|(_, payload)| Digest::of(payload)).collect())
                }
                Outcome::Rejected { reason, detail, .. } => Fate::Rejected { reason: reason.to_owned(), detail },
            };
            if row.sample != id {
                let what = format!("the dataset holds {} at this index", row.sample);
                differences.push(Difference { sample: index.0, id: id.to_string(), what });
            } else if row.fate != made {
                let what = describe(&row.fate, &made, producer.as_ref());
                differences.push(Difference { sample: index.0, id: id.to_string(), what });
            }
        }
    }
    Ok(Regeneration { samples: chosen.len() as u64, of_samples: plan.samples, differences })
}

/// The dataset's own row of a sample; `ledger` keeps the last shard's, since samples come in order.
fn row_of(
    reader: &DatasetReader,
    plan: &Plan,
    ledger: &mut Option<Ledger>,
    index: SampleIndex,
) -> Result<LedgerRow, RunError> {
    let shard = plan.shard_of(index).expect("a sample of the plan stands in one of its shards").id;
    if ledger.as_ref().is_none_or(|ledger| ledger.shard != shard) {
        *ledger = Some(reader.ledger(shard.0 as usize)?);
    }
    let rows = ledger.as_ref().map_or(&[][..], |ledger| &ledger.rows);
    let first = ledger.as_ref().map_or(0, |ledger| ledger.first.0);
    Ok(rows[(index.0 - first) as usize].clone())
}

/// So many different sample indices, ascending: the first of a shuffle that is only as long as it must be.
fn choose(samples: u64, count: u64, seed: u64) -> Vec<SampleIndex> {
    let mut stream = Stream::of_job(seed, b"", "regenerate");
    let count = count.min(samples);
    let mut moved: BTreeMap<u64, u64> = BTreeMap::new();
    let mut chosen: Vec<SampleIndex> = (0..count)
        .map(|place| {
            let other = place + stream.below(samples - place);
            let value = moved.get(&other).copied().unwrap_or(other);
            let here = moved.get(&place).copied().unwrap_or(place);
            moved.insert(other, here);
            SampleIndex(value)
        })
        .collect();
    chosen.sort_unstable();
    chosen
}

fn describe(stored: &Fate, made: &Fate, producer: &dyn Producer) -> String {
    match (stored, made) {
        (Fate::Kept(stored), Fate::Kept(made)) => {
            let names = producer.channels().into_iter().zip(stored.iter().zip(made));
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
