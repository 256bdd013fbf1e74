//! The ledger of a shard: identity, facts and fate of every sample index in its range.
//!
//! It consists of three attachments, so that a reader loads only what it needs: `ledger` (identity and fate, a few bytes per run
//! of items), `facts` (one column per fact) and `digests` (32 bytes per kept sample and channel).

use std::collections::BTreeMap;

use prost::Message;

use crate::{Channel, FORMAT_VERSION, FactKind, Facts, Product, codec::proto};
use kernel::ids::{Digest, ItemId, JobDigest, ObjectId, SampleId, SampleIndex, ShardId};

/// Fate of a sample.
#[derive(Clone, Debug, PartialEq)]
pub enum Fate {
    /// Stored; the digests of its payloads, in the order of the shard's channels.
    Kept(Vec<Digest>),
    /// Not stored, with the reason.
    Rejected {
        /// Short stable name, for counting.
        reason: String,
        /// Numbers, for people; the same on every machine.
        detail: String,
    },
}

/// One row of a ledger.
#[derive(Clone, Debug, PartialEq)]
pub struct LedgerRow {
    /// Index of the sample in the plan.
    pub index: SampleIndex,
    /// Identity of the sample.
    pub sample: SampleId,
    /// Facts of the sample; those of a reject are what was known when it was rejected. A fact whose channel the dataset
    /// does not store is 0.
    pub facts: Facts,
    /// Kept or rejected.
    pub fate: Fate,
}

/// The ledger of one shard.
#[derive(Clone, Debug, PartialEq)]
pub struct Ledger {
    /// Product of the samples.
    pub product: Product,
    /// The job.
    pub job: JobDigest,
    /// Index of the shard.
    pub shard: ShardId,
    /// Count of shards.
    pub shards: u32,
    /// Channels of every kept sample, in the order of the digests.
    pub channels: Vec<Channel>,
    /// Index of the first row.
    pub first: SampleIndex,
    /// One row per sample index, in order.
    pub rows: Vec<LedgerRow>,
}

/// Consecutive rows of one subject, instance and camera whose items follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    pub subject: ObjectId,
    pub instance: u32,
    pub camera: u32,
    pub first_item: u32,
    pub rows: u32,
}

/// Identity and fate of a shard's samples, without facts and digests.
#[derive(Debug)]
pub(crate) struct LedgerOutline {
    pub product: Product,
    pub job: JobDigest,
    pub shard: ShardId,
    pub shards: u32,
    pub channels: Vec<Channel>,
    pub first: SampleIndex,
    /// Count of rows.
    pub rows: u32,
    pub runs: Vec<Run>,
    /// Rejected rows, ascending: row, reason, detail.
    pub rejects: Vec<(u32, String, String)>,
}

/// The three attachments of a ledger.
pub(super) struct LedgerBytes {
    pub ledger: Vec<u8>,
    pub facts: Vec<u8>,
    pub digests: Vec<u8>,
}

/// Full name of the protobuf message of the attachment `ledger`.
pub(super) const LEDGER_MESSAGE: &str = "graspmill.Ledger";
/// Full name of the protobuf message of the attachment `facts`.
pub(super) const FACTS_MESSAGE: &str = "graspmill.FactTable";

/// Rows to allocate memory for before any is read, at most: a damaged ledger can state any number.
const MAX_FORESEEN: usize = 1 << 16;
/// Rows of a shard, at most.
const MAX_ROWS: u64 = 1 << 24;

/// Reasons why bytes are not a ledger.
#[derive(Debug, thiserror::Error)]
pub(crate) enum InvalidLedger {
    /// Not a message of this type.
    #[error("the attachment {attachment} cannot be decoded: {source}")]
    Protobuf { attachment: &'static str, source: prost::DecodeError },
    /// Another version of the format.
    #[error("the ledger has format version {found}, this program reads {FORMAT_VERSION}")]
    Version { found: u32 },
    /// A product that this version does not know.
    #[error("unknown product '{0}'")]
    Product(String),
    /// A topic that this version does not know.
    #[error("unknown topic '{0}'")]
    Topic(String),
    /// A digest of another length.
    #[error("a digest of the ledger has {0} bytes")]
    Digest(usize),
    /// A run that names no subject, or no row.
    #[error("run {run}: subject {subject} of {subjects}, {rows} rows")]
    Run { run: usize, subject: u32, subjects: usize, rows: u32 },
    /// Items beyond the largest number, or more rows than a shard may have.
    #[error("run {run}: its items or rows are too many")]
    TooMany { run: usize },
    /// A reject that is not a row, out of order, or without a reason.
    #[error("reject {reject}: row {row} of {rows}, reason '{reason}'")]
    Reject { reject: usize, row: u32, rows: u32, reason: String },
    /// A column of facts is missing, unknown or short.
    #[error("the fact {name} has {found} values for {rows} rows")]
    Column { name: String, found: usize, rows: u32 },
    /// A fact outside of the range that its product declares.
    #[error("the fact {name} of row {row} is {value}, not of its kind ({wanted})")]
    Range { name: &'static str, row: usize, value: f64, wanted: FactKind },
    /// Digests that do not fit the kept rows.
    #[error("{found} bytes of digests, {expected} for {kept} kept rows of {channels} channels")]
    Digests { found: usize, expected: usize, kept: u64, channels: usize },
}

impl Ledger {
    pub(super) fn encode(&self) -> LedgerBytes {
        let mut subject_index: BTreeMap<ObjectId, u32> = BTreeMap::new();
        let mut subjects = Vec::new();
        let runs = runs_of(self.rows.iter().map(|row| row.sample));
        let runs = runs.into_iter().map(|run| {
            let subject = *subject_index.entry(run.subject).or_insert_with(|| {
                subjects.push(run.subject.0.0.to_vec());
                subjects.len() as u32 - 1
            });
            let Run { first_item, instance, camera, rows, .. } = run;
            proto::LedgerRun { subject, first_item, instance, camera, rows }
        });
        let runs = runs.collect();
        let rejects = (0..).zip(&self.rows).filter_map(|(row, ledger_row)| match &ledger_row.fate {
            Fate::Kept(_) => None,
            Fate::Rejected { reason, detail } => {
                Some(proto::LedgerReject { row, reason: reason.clone(), detail: detail.clone() })
            }
        });
        let ledger = proto::Ledger {
            format_version: FORMAT_VERSION,
            product: self.product.to_string(),
            job: self.job.0.0.to_vec(),
            shard: self.shard.0,
            shards: self.shards,
            first_index: self.first.0,
            subjects,
            topics: self.channels.iter().map(|channel| channel.topic.to_owned()).collect(),
            runs,
            rejects: rejects.collect(),
        };
        let kept =
            self.rows.iter().filter_map(|row| if let Fate::Kept(digests) = &row.fate { Some(digests) } else { None });
        LedgerBytes {
            ledger: ledger.encode_to_vec(),
            facts: self.fact_table().encode_to_vec(),
            digests: kept.flatten().flat_map(|digest| digest.0).collect(),
        }
    }

    fn fact_table(&self) -> proto::FactTable {
        let columns = self.product.facts_of(&self.channels).map(|(index, fact)| {
            let values = self.rows.iter().map(|row| row.facts.values()[index]);
            let mut column = proto::FactColumn { name: fact.name.to_owned(), ..proto::FactColumn::default() };
            match fact.kind {
                FactKind::Count | FactKind::Integer => column.integers = values.map(|value| value as u32).collect(),
                FactKind::Number(_) => column.numbers = values.collect(),
            }
            column
        });
        proto::FactTable { columns: columns.collect() }
    }

    /// Reads a ledger from its three attachments.
    pub(super) fn decode(bytes: &LedgerBytes) -> Result<Self, InvalidLedger> {
        let outline = LedgerOutline::decode(&bytes.ledger)?;
        let facts = outline.facts(&bytes.facts)?;
        let mut fates = outline.fates(&bytes.digests)?.into_iter();
        let LedgerOutline { product, job, shard, shards, channels, first, runs, .. } = outline;
        let samples = runs.iter().flat_map(|run| {
            let Run { subject, instance, camera, first_item, rows } = *run;
            (0..rows).map(move |row| SampleId { subject, item: ItemId(first_item + row), instance, camera })
        });
        let rows = (first.0..).zip(samples).zip(facts).map(|((index, sample), facts)| LedgerRow {
            index: SampleIndex(index),
            sample,
            facts,
            fate: fates.next().expect("one fate per row"),
        });
        let rows = rows.collect();
        Ok(Self { product, job, shard, shards, channels, first, rows })
    }
}

/// Joins consecutive samples into runs.
fn runs_of(samples: impl Iterator<Item = SampleId>) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for SampleId { subject, item, instance, camera } in samples {
        match runs.last_mut() {
            Some(run)
                if (run.subject, run.instance, run.camera) == (subject, instance, camera)
                    && run.first_item.checked_add(run.rows) == Some(item.0) =>
            {
                run.rows += 1;
            }
            _ => runs.push(Run { subject, instance, camera, first_item: item.0, rows: 1 }),
        }
    }
    runs
}

impl LedgerOutline {
    /// Reads the attachment `ledger`.
    pub fn decode(bytes: &[u8]) -> Result<Self, InvalidLedger> {
        let raw =
            proto::Ledger::decode(bytes).map_err(|source| InvalidLedger::Protobuf { attachment: "ledger", source })?;
        if raw.format_version != FORMAT_VERSION {
            return Err(InvalidLedger::Version { found: raw.format_version });
        }
        let product = Product::from_name(&raw.product).ok_or(InvalidLedger::Product(raw.product))?;
        let digest = |bytes: &[u8]| bytes.try_into().map(Digest).map_err(|_| InvalidLedger::Digest(bytes.len()));
        let channel = |topic: String| Channel::from_topic(&topic).ok_or(InvalidLedger::Topic(topic));
        let channels = raw.topics.into_iter().map(channel).collect::<Result<Vec<_>, _>>()?;
        let subjects = raw.subjects.iter().map(|bytes| digest(bytes).map(ObjectId)).collect::<Result<Vec<_>, _>>()?;
        let (mut runs, mut rows) = (Vec::with_capacity(raw.runs.len()), 0u64);
        for (index, run) in raw.runs.into_iter().enumerate() {
            let proto::LedgerRun { subject, first_item, instance, camera, rows: count } = run;
            let known = subjects.get(subject as usize).filter(|_| count > 0);
            let subject =
                *known.ok_or(InvalidLedger::Run { run: index, subject, subjects: subjects.len(), rows: count })?;
            rows += u64::from(count);
            if first_item.checked_add(count - 1).is_none() || rows > MAX_ROWS {
                return Err(InvalidLedger::TooMany { run: index });
            }
            runs.push(Run { subject, instance, camera, first_item, rows: count });
        }
        let rows = rows as u32;
        let mut rejects: Vec<(u32, String, String)> = Vec::with_capacity(raw.rejects.len());
        for (index, proto::LedgerReject { row, reason, detail }) in raw.rejects.into_iter().enumerate() {
            let in_order = rejects.last().is_none_or(|(last, ..)| *last < row);
            if row >= rows || reason.is_empty() || !in_order {
                return Err(InvalidLedger::Reject { reject: index, row, rows, reason });
            }
            rejects.push((row, reason, detail));
        }
        Ok(Self {
            product,
            job: JobDigest(digest(&raw.job)?),
            shard: ShardId(raw.shard),
            shards: raw.shards,
            channels,
            first: SampleIndex(raw.first_index),
            rows,
            runs,
            rejects,
        })
    }

    /// Reads the attachment `facts`: the facts of every row.
    fn facts(&self, bytes: &[u8]) -> Result<Vec<Facts>, InvalidLedger> {
        let raw = proto::FactTable::decode(bytes)
            .map_err(|source| InvalidLedger::Protobuf { attachment: "facts", source })?;
        let rows = self.rows;
        let wrong = |name: &str, found| InvalidLedger::Column { name: name.to_owned(), found, rows };
        let mut columns = vec![None; self.product.facts.len()];
        let mut stored = raw.columns.into_iter();
        for (index, fact) in self.product.facts_of(&self.channels) {
            let column = stored.next().filter(|column| column.name == fact.name).ok_or_else(|| wrong(fact.name, 0))?;
            let values: Vec<f64> = match fact.kind {
                FactKind::Count | FactKind::Integer => column.integers.into_iter().map(f64::from).collect(),
                FactKind::Number(_) => column.numbers,
            };
            if values.len() != rows as usize {
                return Err(wrong(fact.name, values.len()));
            }
            if let Some(row) = values.iter().position(|value| !fact.kind.holds(*value)) {
                let (value, wanted) = (values[row], fact.kind);
                return Err(InvalidLedger::Range { name: fact.name, row, value, wanted });
            }
            columns[index] = Some(values);
        }
        if let Some(column) = stored.next() {
            return Err(wrong(&column.name, column.integers.len().max(column.numbers.len())));
        }
        let value = |column: &Option<Vec<f64>>, row: usize| column.as_ref().map_or(0.0, |values| values[row]);
        Ok((0..rows as usize).map(|row| Facts::new(columns.iter().map(|column| value(column, row)))).collect())
    }

    /// Reads the attachment `digests`: the fate of every row.
    fn fates(&self, bytes: &[u8]) -> Result<Vec<Fate>, InvalidLedger> {
        let (found, channels) = (bytes.len(), self.channels.len());
        let kept = u64::from(self.rows) - self.rejects.len() as u64;
        let expected = kept as usize * channels * 32;
        if found != expected {
            return Err(InvalidLedger::Digests { found, expected, kept, channels });
        }
        let mut digests = bytes.chunks_exact(32).map(|bytes| Digest(bytes.try_into().expect("32 bytes")));
        let mut rejects = self.rejects.iter().peekable();
        let mut fates = Vec::with_capacity((self.rows as usize).min(MAX_FORESEEN));
        for row in 0..self.rows {
            fates.push(match rejects.next_if(|(rejected, ..)| *rejected == row) {
                Some((_, reason, detail)) => Fate::Rejected { reason: reason.clone(), detail: detail.clone() },
                None => Fate::Kept(digests.by_ref().take(channels).collect()),
            });
        }
        Ok(fates)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn row(index: u64, item: u32, subject: u8, reason: Option<&str>) -> LedgerRow {
        let sample = SampleId { subject: ObjectId(Digest([subject; 32])), item: ItemId(item), instance: 0, camera: 0 };
        LedgerRow {
            index: SampleIndex(index),
            sample,
            facts: Facts::new([1.0, f64::from(item), 3.0, 0.5, 0.0, 0.0]),
            fate: reason.map_or(Fate::Kept(vec![Digest([item as u8; 32])]), |reason| Fate::Rejected {
                reason: reason.to_owned(),
                detail: "0 cells".to_owned(),
            }),
        }
    }

    fn ledger(rows: Vec<LedgerRow>) -> Ledger {
        Ledger {
            product: Channel::PAIR.product(),
            job: JobDigest(Digest([9; 32])),
            shard: ShardId(1),
            shards: 3,
            channels: vec![Channel::PAIR],
            first: SampleIndex(10),
            rows,
        }
    }

    proptest! {
        #[test]
        fn a_ledger_comes_back(shape in prop::collection::vec((0u32..5, 0u8..3, any::<bool>()), 1..40)) {
            let rows = shape.iter().zip(10..).map(|((item, subject, kept), index)| {
                row(index, *item, *subject, (!kept).then_some("few_partial_cells"))
            });
            let ledger = ledger(rows.collect());
            prop_assert_eq!(Ledger::decode(&ledger.encode()).expect("a ledger"), ledger);
        }

        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..200), at in 0usize..300, byte in any::<u8>()) {
            let _ = LedgerOutline::decode(&bytes);
            let mut encoded = ledger((10..20).map(|index| row(index, index as u32, 1, None)).collect()).encode();
            let index = at % encoded.ledger.len();
            encoded.ledger[index] = byte;
            let _ = Ledger::decode(&encoded);
        }
    }

    #[test]
    fn numbers_outside_of_their_range_are_refused_with_fact_and_row() {
        let whole = ledger((0..4).map(|item| row(10 + u64::from(item), item, 1, None)).collect());
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1e-300, 1.0 + f64::EPSILON, 1e300] {
            let mut forged = whole.clone();
            forged.rows[2].facts.set(3, value);
            let error = Ledger::decode(&forged.encode()).expect_err("a number that is no share");
            let text = error.to_string();
            assert!(matches!(error, InvalidLedger::Range { name: "solid_share", row: 2, .. }), "{text}");
            assert!(text.contains("number, 0 to 1"), "{text}");
        }
        // Zero has two signs, and both are in the range.
        let mut signed = whole.clone();
        signed.rows[2].facts.set(3, -0.0);
        assert_eq!(Ledger::decode(&signed.encode()).expect("a ledger"), signed);
    }

    #[test]
    fn every_number_of_every_product_is_read_in_its_range_alone() {
        let values = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.0, 0.5, 1.5, -1.0, 1e300, f64::MIN_POSITIVE];
        let mut refused = 0;
        for product in Product::all() {
            let channels: Vec<Channel> = product.channels().collect();
            let zeros = Facts::new(product.facts.iter().map(|_| 0.0));
            let whole = Ledger {
                product,
                channels: channels.clone(),
                rows: vec![LedgerRow {
                    facts: zeros.clone(),
                    fate: Fate::Kept(channels.iter().map(|_| Digest([1; 32])).collect()),
                    ..row(10, 0, 1, None)
                }],
                ..ledger(Vec::new())
            };
            for (index, fact) in product.facts_of(&channels) {
                let FactKind::Number(range) = fact.kind else { continue };
                for value in values {
                    let mut forged = whole.clone();
                    forged.rows[0].facts.set(index, value);
                    let read = Ledger::decode(&forged.encode());
                    assert_eq!(read.is_ok(), range.holds(value), "{product}: {} = {value}", fact.name);
                    refused += u32::from(read.is_err());
                }
                assert!(!range.holds(f64::NAN) && !range.holds(f64::NEG_INFINITY), "{product}: {}", fact.name);
            }
        }
        assert!(refused > 50, "{refused}");
    }

    #[test]
    fn views_of_one_object_are_one_run() {
        let ledger = ledger((0..50).map(|item| row(10 + u64::from(item), item, 1, None)).collect());
        let outline = LedgerOutline::decode(&ledger.encode().ledger).expect("a ledger");
        assert_eq!((outline.runs.len(), outline.rows), (1, 50));
    }

    #[test]
    fn columns_and_digests_have_to_fit_the_rows() {
        let whole = ledger((0..4).map(|item| row(10 + u64::from(item), item, 1, None)).collect());
        let shorter = ledger(whole.rows[..3].to_vec());
        let mut mixed = whole.encode();
        mixed.facts = shorter.encode().facts;
        assert!(matches!(Ledger::decode(&mixed), Err(InvalidLedger::Column { found: 3, rows: 4, .. })));
        let mut mixed = whole.encode();
        mixed.digests.truncate(96);
        assert!(matches!(Ledger::decode(&mixed), Err(InvalidLedger::Digests { found: 96, expected: 128, .. })));
    }
}
