//! Facts of the poses at one position.

use crate::{FactFormat, FactKind, Facts};
use kernel::geom::PoseLabel;

/// Counts of poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlockFacts {
    /// Cells with each label, in the order of [`PoseLabel::ALL`].
    pub labels: [u32; 3],
    /// Cells with each kind of proof, in the order of [`Proof::ALL`](kernel::geom::Proof::ALL).
    pub proofs: [u32; 5],
}

const fn count(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Count, topic: None, meaning }
}

/// Columns of the facts: labels in the order of [`PoseLabel::ALL`], proofs in the order of
/// [`Proof::ALL`](kernel::geom::Proof::ALL).
pub(super) const FACTS: [FactFormat; 8] = [
    count("no_solution", "Poses that no joint values reach."),
    count("colliding", "Poses that are reached only with a collision."),
    count("reachable", "Poses that are reached without a collision."),
    count("by_bound", "Poses whose label is proved by a bound."),
    count("by_interval_ends", "Poses whose label is proved by the ends of intervals of solutions."),
    count("by_swept", "Poses whose label is proved by a certificate over swept intervals."),
    count("by_searched", "Poses whose label is the result of a search, without a proof."),
    count("by_witness", "Poses whose label is proved by joint values."),
];

impl BlockFacts {
    /// Poses with a label.
    pub fn of_label(&self, label: PoseLabel) -> u32 {
        self.labels[label as usize]
    }
}

impl From<BlockFacts> for Facts {
    fn from(BlockFacts { labels, proofs }: BlockFacts) -> Self {
        Self::new(labels.into_iter().chain(proofs).map(f64::from))
    }
}

impl From<&Facts> for BlockFacts {
    fn from(facts: &Facts) -> Self {
        Self {
            labels: std::array::from_fn(|index| facts.integer(index)),
            proofs: std::array::from_fn(|index| facts.integer(PoseLabel::ALL.len() + index)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::geom::Proof;

    #[test]
    fn columns_are_named_after_labels_and_proofs() {
        let labels = PoseLabel::ALL.into_iter().map(|label| label.name().to_owned());
        let proofs = Proof::ALL.into_iter().map(|proof| format!("by_{}", proof.name()));
        let names: Vec<String> = labels.chain(proofs).collect();
        assert_eq!(FACTS.map(|fact| fact.name.to_owned()).to_vec(), names);
    }
}
