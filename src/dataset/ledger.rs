//! The ledger that each shard carries: what became of every sample index of its range.

use std::collections::BTreeMap;

use prost::Message;

use crate::{
    ids::{Digest, JobDigest, ObjectId, SampleId, SampleIndex, ShardId, ViewId},
    record::{Channel, FORMAT_VERSION, proto},
};

/// Facts of a sample that make the index useful; counts of occupied cells and the share of the solid in the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleFacts {
    /// Occupied cells of the partial grid.
    pub partial_cells: u32,
    /// Occupied cells of the complete grid.
    pub complete_cells: u32,
    /// Cells occupied in both.
    pub both_cells: u32,
    /// Share of the solid's volume that lies inside the grid, 0 to 1.
    pub solid_share: f64,
}

/// What became of a sample.
#[derive(Clone, Debug, PartialEq)]
pub enum Fate {
    /// Stored; the digests of its payloads, in the order of the shard's channels.
    Kept(Vec<Digest>),
    /// Not stored, and why.
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
    /// Which place in the plan.
    pub index: SampleIndex,
    /// Which sample.
    pub sample: SampleId,
    /// Counts; those of a reject are what was known when it was rejected.
    pub facts: SampleFacts,
    /// Kept or rejected.
    pub fate: Fate,
}

/// The ledger of one shard.
#[derive(Clone, Debug, PartialEq)]
pub struct Ledger {
    /// Product: `completion`.
    pub product: String,
    /// The job.
    pub job: JobDigest,
    /// Which shard.
    pub shard: ShardId,
    /// Of how many.
    pub shards: u32,
    /// What every kept sample has, in the order of the digests.
    pub channels: Vec<Channel>,
    /// Index of the first row.
    pub first: SampleIndex,
    /// One row per sample index, in order.
    pub rows: Vec<LedgerRow>,
}

impl Ledger {
    pub(super) fn encode(&self) -> Vec<u8> {
        let mut places: BTreeMap<ObjectId, u32> = BTreeMap::new();
        let mut subjects = Vec::new();
        let rows = self.rows.iter().map(|row| {
            let subject = *places.entry(row.sample.subject).or_insert_with(|| {
                subjects.push(row.sample.subject.0.0.to_vec());
                subjects.len() as u32 - 1
            });
            let (digests, reason, detail) = match &row.fate {
                Fate::Kept(digests) => {
                    (digests.iter().flat_map(|digest| digest.0).collect(), String::new(), String::new())
                }
                Fate::Rejected { reason, detail } => (Vec::new(), reason.clone(), detail.clone()),
            };
            proto::LedgerRow {
                subject,
                instance: row.sample.instance,
                view: row.sample.view.0,
                camera: row.sample.camera,
                partial_cells: row.facts.partial_cells,
                complete_cells: row.facts.complete_cells,
                both_cells: row.facts.both_cells,
                solid_share: row.facts.solid_share,
                digests,
                reason,
                detail,
            }
        });
        let rows = rows.collect();
        proto::Ledger {
            format_version: FORMAT_VERSION,
            product: self.product.clone(),
            job: self.job.0.0.to_vec(),
            shard: self.shard.0,
            shards: self.shards,
            first_index: self.first.0,
            subjects,
            topics: self.channels.iter().map(|channel| channel.topic().to_owned()).collect(),
            rows,
        }
        .encode_to_vec()
    }

    /// Reads a ledger; `Err` says in words what is wrong.
    pub(super) fn decode(bytes: &[u8]) -> Result<Self, String> {
        let raw = proto::Ledger::decode(bytes).map_err(|error| format!("the ledger is no ledger: {error}"))?;
        if raw.format_version != FORMAT_VERSION {
            let found = raw.format_version;
            return Err(format!("the ledger has format version {found}, this program reads {FORMAT_VERSION}"));
        }
        let digest = |bytes: &[u8]| {
            bytes.try_into().map(Digest).map_err(|_| format!("a digest of the ledger has {} bytes", bytes.len()))
        };
        let channels = (raw.topics.iter())
            .map(|topic| Channel::from_topic(topic).ok_or_else(|| format!("unknown topic '{topic}'")))
            .collect::<Result<Vec<_>, _>>()?;
        let subjects = raw.subjects.iter().map(|bytes| digest(bytes).map(ObjectId)).collect::<Result<Vec<_>, _>>()?;
        let mut rows = Vec::with_capacity(raw.rows.len());
        for (index, row) in (raw.first_index..).zip(raw.rows) {
            let subject = *(subjects.get(row.subject as usize))
                .ok_or_else(|| format!("sample {index}: subject {} of {}", row.subject, subjects.len()))?;
            let fate = if row.reason.is_empty() {
                if row.digests.len() != 32 * channels.len() {
                    let (found, channels) = (row.digests.len(), channels.len());
                    return Err(format!("sample {index}: {found} bytes of digests for {channels} channels"));
                }
                Fate::Kept(row.digests.chunks_exact(32).map(digest).collect::<Result<_, _>>()?)
            } else {
                Fate::Rejected { reason: row.reason, detail: row.detail }
            };
            rows.push(LedgerRow {
                index: SampleIndex(index),
                sample: SampleId { subject, instance: row.instance, view: ViewId(row.view), camera: row.camera },
                facts: SampleFacts {
                    partial_cells: row.partial_cells,
                    complete_cells: row.complete_cells,
                    both_cells: row.both_cells,
                    solid_share: row.solid_share,
                },
                fate,
            });
        }
        Ok(Self {
            product: raw.product,
            job: JobDigest(digest(&raw.job)?),
            shard: ShardId(raw.shard),
            shards: raw.shards,
            channels,
            first: SampleIndex(raw.first_index),
            rows,
        })
    }
}
