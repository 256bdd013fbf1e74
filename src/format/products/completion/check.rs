//! Checks of the records of a completion sample.

use super::{Occlusion, TactileContacts, VoxelPair, facts::FIRST_OF_OCCLUSION};
use crate::{BrokenRule, Channel, CheckSample, CheckedRecord, Facts, Product, ProductChecks, RecordError};

/// Rule of jobs whose truth marks every cell that the object overlaps: partial cells and contacts are in complete cells.
pub const PARTIAL_INSIDE_COMPLETE: &str = "partial_inside_complete";

/// The checks of completion.
pub(crate) static CHECKS: ProductChecks =
    ProductChecks { product: Product::COMPLETION, samples: || Box::new(PairCheck::default()) };

/// Checks of one thread; remembers the pair of the sample.
#[derive(Default)]
struct PairCheck {
    pair: Option<VoxelPair>,
}

impl CheckSample for PairCheck {
    fn check(&mut self, channel: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        match channel {
            Channel::PAIR => self.check_pair(payload),
            Channel::OCCLUSION => check_occlusion(payload),
            touch => check_touch(touch, payload, self.pair.as_ref()),
        }
    }
}

impl PairCheck {
    fn check_pair(&mut self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        self.pair = None;
        let pair = self.pair.insert(VoxelPair::decode(payload)?);
        let facts = Facts::from(pair.facts());
        let mut checked = CheckedRecord::without_facts(pair.sample);
        checked.facts = facts.values().iter().copied().enumerate().take(FIRST_OF_OCCLUSION).collect();
        let outside = pair.partial_cells - pair.both_cells;
        if outside > 0 {
            let what = format!("{outside} of {} partial cells are not in complete", pair.partial_cells);
            checked.broken_rules.push(BrokenRule { rule: PARTIAL_INSIDE_COMPLETE, what });
        }
        Ok(checked)
    }
}

/// Checks a record of touch, and compares it with the pair of its sample if that is known.
pub(in crate::products) fn check_touch(
    channel: Channel,
    payload: &[u8],
    pair: Option<&VoxelPair>,
) -> Result<CheckedRecord, RecordError> {
    let touch = TactileContacts::decode_of(channel, payload)?;
    let mut checked = CheckedRecord::without_facts(touch.sample);
    let Some(pair) = pair.filter(|pair| pair.sample == touch.sample) else { return Ok(checked) };
    touch.check_beside(pair)?;
    let cells = touch.contacts.iter().filter_map(|contact| contact.cell);
    let outside = cells.filter(|cell| !pair.complete.get(*cell)).count();
    if outside > 0 {
        let what = format!("{outside} contacts are in cells that are not in complete");
        checked.broken_rules.push(BrokenRule { rule: PARTIAL_INSIDE_COMPLETE, what });
    }
    Ok(checked)
}

fn check_occlusion(payload: &[u8]) -> Result<CheckedRecord, RecordError> {
    let occlusion = Occlusion::decode(payload)?;
    let mut checked = CheckedRecord::without_facts(occlusion.sample);
    checked.facts = (FIRST_OF_OCCLUSION..).zip(occlusion.facts().values()).collect();
    Ok(checked)
}
