//! Samples that a page of a comparison shows: the best, the median and the worst of each method.

use std::collections::BTreeMap;

use super::outcome::Outcome;
use crate::{completion_method::CompletionMethod, exit::Failure, stored_samples::StoredSample};
use format::dataset::DatasetReader;
use kernel::ids::{ObjectId, SampleIndex};
use publish::{EvaluatedMethod, EvaluatedSample};

/// Completes the samples on the page again. `details` is the number of rows per method, and `by_sample` the rows of each chosen
/// sample.
pub(super) fn samples_to_show(
    methods: &[CompletionMethod],
    details: usize,
    by_sample: &[Vec<Outcome>],
    (reader, chosen): (&DatasetReader, &[SampleIndex]),
) -> Result<Vec<EvaluatedMethod>, Failure> {
    let names: BTreeMap<ObjectId, String> =
        reader.assets()?.objects.into_iter().map(|row| (row.object, row.name)).collect();
    let shown = |(method, completes): (usize, &CompletionMethod)| {
        let overlaps: Vec<f64> = by_sample.iter().map(|rows| rows[method * details].overlap.iou).collect();
        let samples = ranked(&overlaps).into_iter().map(|(rank, sample)| {
            let stored = StoredSample::read(reader, chosen[sample])?;
            let completed = completes.complete(&stored)?.cells();
            let object = stored.object;
            let name = names.get(&object).cloned().unwrap_or_else(|| object.to_string());
            let caption = format!(
                "{rank}: {name}, view {}, IoU {:.3}, of the cells without an observed point {:.3}",
                stored.pair.sample.item,
                overlaps[sample],
                by_sample[sample][method * details].overlap.unseen
            );
            let (partial, truth) = (stored.pair.partial, stored.pair.complete);
            Ok(EvaluatedSample { caption, partial, completed, truth })
        });
        Ok(EvaluatedMethod { name: completes.name(), samples: samples.collect::<Result<_, Failure>>()? })
    };
    methods.iter().enumerate().map(shown).collect()
}

/// Indices of the best, the median and the worst score, without repetition; among equal scores the first.
fn ranked(scores: &[f64]) -> Vec<(&'static str, usize)> {
    let mut order: Vec<usize> = (0..scores.len()).collect();
    order.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]));
    let mut ranked: Vec<(&'static str, usize)> = Vec::new();
    for (rank, at) in [("Best", 0), ("Median", order.len() / 2), ("Worst", order.len().saturating_sub(1))] {
        let Some(index) = order.get(at).copied() else { continue };
        if ranked.iter().all(|(_, known)| *known != index) {
            ranked.push((rank, index));
        }
    }
    ranked
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn best_median_and_worst_are_shown_once() {
        assert_eq!(ranked(&[0.2, 0.9, 0.5, 0.4, 0.7]), [("Best", 1), ("Median", 2), ("Worst", 0)]);
        assert_eq!(ranked(&[0.5, 0.5]), [("Best", 0), ("Median", 1)]);
        assert_eq!(ranked(&[0.5]), [("Best", 0)]);
        assert_eq!(ranked(&[]), []);
    }
}
