//! Checks of blocks of poses and of the field that is made of them.

use super::{
    FIELD, ReachabilityBlock, ReachabilityField,
    field_file::{labels_of, payload_digest, read_field},
};
use crate::{
    Channel, CheckSample, CheckedRecord, Facts, FileCheck, FileContext, Product, ProductChecks, RecordError, RootPart,
    dataset::DatasetError,
};
use kernel::geom::PoseLabel;

/// The checks of reachability.
pub(crate) static CHECKS: ProductChecks = ProductChecks {
    product: Product::REACHABILITY,
    samples: || Box::new(BlockCheck),
    files: &[FileCheck {
        name: FIELD,
        in_root: Some(RootPart { word: "field", digest: payload_digest }),
        check: check_field,
    }],
};

/// Checks of one thread: a position has one record.
struct BlockCheck;

impl CheckSample for BlockCheck {
    fn check(&mut self, _: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let block = ReachabilityBlock::decode(payload)?;
        let facts = Facts::from(block.facts());
        let mut checked = CheckedRecord::of(block.sample);
        checked.facts = facts.values().iter().copied().enumerate().collect();
        Ok(checked)
    }
}

/// Checks the field against the shards' blocks and against itself.
fn check_field(context: &FileContext<'_>) -> Vec<String> {
    let words = |error: DatasetError| match error {
        DatasetError::Invalid { problem, .. } => problem,
        other => other.to_string(),
    };
    let field = match read_field(context.folder) {
        Ok(field) => field,
        Err(error) => return vec![words(error)],
    };
    // The blocks' labels are known only where every shard is intact.
    if !context.full || !context.shards_intact {
        return Vec::new();
    }
    match labels_of(context.folder, &context.manifest.shard_names(), &field.header) {
        Ok(labels) => compare_field(&field, &labels).into_iter().collect(),
        Err(error) => vec![error.to_string()],
    }
}

/// Labels against the blocks', distances against recomputed ones.
fn compare_field(field: &ReachabilityField, labels: &[PoseLabel]) -> Option<String> {
    let others = field.labels.iter().zip(labels).filter(|(field, block)| field != block).count();
    if others > 0 {
        return Some(format!("{others} of {} labels are not those of the shards", labels.len()));
    }
    let distances = field.header.distances(labels);
    let bits = |distance: &f32| distance.to_bits();
    let others = field.distances.iter().zip(&distances).filter(|(a, b)| bits(a) != bits(b)).count();
    (others > 0).then(|| format!("{others} of {} distances are not those of its labels", distances.len()))
}
