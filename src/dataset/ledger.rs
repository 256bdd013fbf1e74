//! The ledger that each shard carries: what became of every sample index of its range.

use std::collections::BTreeMap;

use prost::Message;

use crate::{
    ids::{Digest, JobDigest, ObjectId, Product, SampleId, SampleIndex, ShardId, ViewId},
    record::{BlockFacts, Channel, FORMAT_VERSION, GraspFacts, PairFacts, PatchFacts, SampleFacts, TrialFacts, proto},
};

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
    /// What the shard holds.
    pub product: Product,
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
    /// Name of the protobuf message.
    pub(super) fn schema_name(product: Product) -> &'static str {
        match product {
            Product::Completion => "graspmill.Ledger",
            Product::Reachability => "graspmill.ReachabilityLedger",
            Product::Grasps => "graspmill.GraspLedger",
            Product::Patches => "graspmill.PatchLedger",
        }
    }

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
            let PairFacts { partial_cells, complete_cells, both_cells, solid_share } =
                row.facts.pair().copied().unwrap_or_default();
            proto::LedgerRow {
                subject,
                instance: row.sample.instance,
                view: row.sample.view.0,
                camera: row.sample.camera,
                partial_cells,
                complete_cells,
                both_cells,
                solid_share,
                digests,
                reason,
                detail,
            }
        });
        let rows = rows.collect();
        let ledger = proto::Ledger {
            format_version: FORMAT_VERSION,
            product: self.product.to_string(),
            job: self.job.0.0.to_vec(),
            shard: self.shard.0,
            shards: self.shards,
            first_index: self.first.0,
            subjects,
            topics: self.channels.iter().map(|channel| channel.topic().to_owned()).collect(),
            rows,
        };
        match self.product {
            Product::Completion => ledger.encode_to_vec(),
            Product::Reachability => self.with_poses(ledger).encode_to_vec(),
            Product::Grasps => self.with_grasps(ledger).encode_to_vec(),
            Product::Patches => self.with_patches(ledger).encode_to_vec(),
        }
    }

    /// The same with counts of poses in its rows.
    fn with_poses(&self, ledger: proto::Ledger) -> proto::ReachabilityLedger {
        let proto::Ledger { format_version, product, job, shard, shards, first_index, subjects, topics, rows } = ledger;
        let rows = rows.into_iter().zip(&self.rows).map(|(raw, row)| {
            let proto::LedgerRow { subject, instance, view, camera, digests, reason, detail, .. } = raw;
            let BlockFacts { labels, proofs } = row.facts.block().copied().unwrap_or_default();
            let (labels, proofs) = (labels.to_vec(), proofs.to_vec());
            proto::ReachabilityLedgerRow { subject, instance, view, camera, digests, reason, detail, labels, proofs }
        });
        let rows = rows.collect();
        proto::ReachabilityLedger { format_version, product, job, shard, shards, first_index, subjects, topics, rows }
    }

    /// The same with counts of grasps in its rows.
    fn with_grasps(&self, ledger: proto::Ledger) -> proto::GraspLedger {
        let proto::Ledger { format_version, product, job, shard, shards, first_index, subjects, topics, rows } = ledger;
        let tries = self.channels.contains(&Channel::GraspTrials);
        let rows = rows.into_iter().zip(&self.rows).map(|(raw, row)| {
            let proto::LedgerRow { subject, instance, view, camera, digests, reason, detail, .. } = raw;
            let GraspFacts { verdicts, best_energy, best_epsilon, given_up, trials } =
                row.facts.grasps().copied().unwrap_or_default();
            proto::GraspLedgerRow {
                subject,
                instance,
                view,
                camera,
                digests,
                reason,
                detail,
                verdicts: verdicts.to_vec(),
                best_energy,
                best_epsilon,
                given_up,
                trials: if tries { vec![trials.tried, trials.held, trials.refused] } else { Vec::new() },
            }
        });
        let rows = rows.collect();
        proto::GraspLedger { format_version, product, job, shard, shards, first_index, subjects, topics, rows }
    }

    /// The same with the grasp of each row.
    fn with_patches(&self, ledger: proto::Ledger) -> proto::PatchLedger {
        let proto::Ledger { format_version, product, job, shard, shards, first_index, subjects, topics, rows } = ledger;
        let rows = rows.into_iter().zip(&self.rows).map(|(raw, row)| {
            let proto::LedgerRow { subject, instance, view, camera, digests, reason, detail, .. } = raw;
            let PatchFacts { kind, type_index, energy, epsilon } = row.facts.patches().copied().unwrap_or_default();
            proto::PatchLedgerRow {
                subject,
                instance,
                view,
                camera,
                digests,
                reason,
                detail,
                r#type: kind,
                type_index,
                energy,
                epsilon,
            }
        });
        let rows = rows.collect();
        proto::PatchLedger { format_version, product, job, shard, shards, first_index, subjects, topics, rows }
    }

    /// Reads a ledger; `Err` says in words what is wrong.
    pub(super) fn decode(bytes: &[u8]) -> Result<Self, String> {
        let raw = proto::Ledger::decode(bytes).map_err(|error| format!("the ledger is no ledger: {error}"))?;
        if raw.format_version != FORMAT_VERSION {
            let found = raw.format_version;
            return Err(format!("the ledger has format version {found}, this program reads {FORMAT_VERSION}"));
        }
        let product = Product::from_name(&raw.product).ok_or_else(|| format!("unknown product '{}'", raw.product))?;
        let digest = |bytes: &[u8]| {
            bytes.try_into().map(Digest).map_err(|_| format!("a digest of the ledger has {} bytes", bytes.len()))
        };
        let channels = (raw.topics.iter())
            .map(|topic| Channel::from_topic(topic).ok_or_else(|| format!("unknown topic '{topic}'")))
            .collect::<Result<Vec<_>, _>>()?;
        let subjects = raw.subjects.iter().map(|bytes| digest(bytes).map(ObjectId)).collect::<Result<Vec<_>, _>>()?;
        let facts = match product {
            Product::Completion => raw.rows.iter().map(pair_facts).collect(),
            Product::Reachability => block_facts(bytes)?,
            Product::Grasps => grasp_facts(bytes)?,
            Product::Patches => patch_facts(bytes)?,
        };
        let mut rows = Vec::with_capacity(raw.rows.len());
        for (index, (row, facts)) in (raw.first_index..).zip(raw.rows.into_iter().zip(facts)) {
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
                facts,
                fate,
            });
        }
        Ok(Self {
            product,
            job: JobDigest(digest(&raw.job)?),
            shard: ShardId(raw.shard),
            shards: raw.shards,
            channels,
            first: SampleIndex(raw.first_index),
            rows,
        })
    }
}

fn pair_facts(row: &proto::LedgerRow) -> SampleFacts {
    let proto::LedgerRow { partial_cells, complete_cells, both_cells, solid_share, .. } = *row;
    PairFacts { partial_cells, complete_cells, both_cells, solid_share }.into()
}

/// The counts of poses of all rows: what a [`proto::Ledger`] passes over.
fn block_facts(bytes: &[u8]) -> Result<Vec<SampleFacts>, String> {
    let raw = proto::ReachabilityLedger::decode(bytes).map_err(|error| format!("the ledger is no ledger: {error}"))?;
    let facts = |row: proto::ReachabilityLedgerRow| {
        let counts = (row.labels.as_slice().try_into(), row.proofs.as_slice().try_into());
        let (Ok(labels), Ok(proofs)) = counts else {
            return Err(format!("a row with {} labels and {} proofs", row.labels.len(), row.proofs.len()));
        };
        Ok(BlockFacts { labels, proofs }.into())
    };
    raw.rows.into_iter().map(facts).collect()
}

/// The counts of grasps of all rows, likewise.
fn grasp_facts(bytes: &[u8]) -> Result<Vec<SampleFacts>, String> {
    let raw = proto::GraspLedger::decode(bytes).map_err(|error| format!("the ledger is no ledger: {error}"))?;
    let facts = |row: proto::GraspLedgerRow| {
        let proto::GraspLedgerRow { verdicts, best_energy, best_epsilon, given_up, trials, .. } = row;
        let trials = match trials[..] {
            [] => TrialFacts::default(),
            [tried, held, refused] => TrialFacts { tried, held, refused },
            _ => return Err(format!("a row with {} counts of trials", trials.len())),
        };
        let mut counts = GraspFacts::default().verdicts;
        // Before tables were watched, there was a verdict less.
        let known =
            counts.get_mut(..verdicts.len()).ok_or_else(|| format!("a row with {} verdicts", verdicts.len()))?;
        known.copy_from_slice(&verdicts);
        let verdicts = counts;
        Ok(GraspFacts { verdicts, best_energy, best_epsilon, given_up, trials }.into())
    };
    raw.rows.into_iter().map(facts).collect()
}

/// The grasps of all rows, likewise.
fn patch_facts(bytes: &[u8]) -> Result<Vec<SampleFacts>, String> {
    let raw = proto::PatchLedger::decode(bytes).map_err(|error| format!("the ledger is no ledger: {error}"))?;
    let facts = |row: &proto::PatchLedgerRow| {
        let proto::PatchLedgerRow { r#type: kind, type_index, energy, epsilon, .. } = *row;
        PatchFacts { kind, type_index, energy, epsilon }.into()
    };
    Ok(raw.rows.iter().map(facts).collect())
}
