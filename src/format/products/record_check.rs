//! Checks of each sample's records, which products contribute to `verify`.

use super::{Channel, Product};
use crate::RecordError;
use kernel::ids::SampleId;

/// Checks the records of one sample after another, on one thread, except for channels whose
/// [decoder](crate::ChannelFormat::decode) checks everything. Records of a sample come in the order of their channels, so that a
/// record can be checked against the ones before it.
pub trait CheckSample {
    /// Decodes and checks the next payload.
    ///
    /// # Errors
    /// When the payload is not a valid record of its channel, or contradicts another record of its sample.
    fn check(&mut self, channel: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError>;
}

/// Statements of a record that its sample's ledger row repeats.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckedRecord {
    /// The record's sample.
    pub sample: SampleId,
    /// Facts that the record states: indices into the product's facts, and values.
    pub facts: Vec<(usize, f64)>,
    /// Rules of this kind of dataset that the record breaks; whether a rule applies, the dataset's job decides.
    pub broken_rules: Vec<BrokenRule>,
}

impl CheckedRecord {
    /// A record that states no facts.
    pub fn without_facts(sample: SampleId) -> Self {
        Self { sample, facts: Vec::new(), broken_rules: Vec::new() }
    }
}

/// Decodes and checks the next payload of a sample: by its channel's own decoder, or by the product's checks.
///
/// # Errors
/// When the payload is not a valid record of its channel, or contradicts another record of its sample.
pub fn check_record(
    checks: &mut dyn CheckSample,
    channel: Channel,
    payload: &[u8],
) -> Result<CheckedRecord, RecordError> {
    match channel.decode {
        Some(decode) => decode(payload).map(CheckedRecord::without_facts),
        None => checks.check(channel, payload),
    }
}

/// A rule that a record breaks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BrokenRule {
    /// Name of the rule.
    pub rule: &'static str,
    /// Numbers, for people.
    pub what: String,
}

/// Checks that a product contributes to `verify`: one row of the table of checks.
pub struct ProductChecks {
    /// The product.
    pub product: Product,
    /// Makes the checks of one thread.
    pub samples: fn() -> Box<dyn CheckSample>,
}
