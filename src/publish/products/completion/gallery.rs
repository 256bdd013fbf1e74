//! Selection of the samples in a report, only by their ids and counts, so that every report shows the same ones.

use std::collections::BTreeMap;

use format::{PairFacts, dataset::LedgerRow};
use kernel::{
    ids::{Digest, ObjectId, SampleId, SampleIndex},
    words::Split,
};

/// Maximum number of samples in a report.
pub(crate) const GALLERY: usize = 16;

/// A sample to show, with the reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Pick {
    pub index: SampleIndex,
    pub why: String,
}

/// Collects candidates while rows go by; memory grows with the objects and the largest count, not with the samples.
#[derive(Default)]
pub(crate) struct Candidates {
    smallest: Best<u32>,
    largest: Best<std::cmp::Reverse<u32>>,
    cut_off: Best<ByBits>,
    least_seen: Best<ByBits>,
    most_seen: Best<std::cmp::Reverse<ByBits>>,
    of_split: BTreeMap<Split, Best<Digest>>,
    of_object: BTreeMap<ObjectId, Best<Digest>>,
    /// The first sample with each count of partial cells.
    first_with: BTreeMap<u32, SampleIndex>,
}

/// A share from 0 to 1 as bits: for non-negative numbers, bits sort like values.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct ByBits(u64);

/// The first sample with the smallest key.
struct Best<K>(Option<(K, SampleIndex)>);

impl<K> Default for Best<K> {
    fn default() -> Self {
        Self(None)
    }
}

impl<K: Ord> Best<K> {
    fn offer(&mut self, key: K, index: SampleIndex) {
        if self.0.as_ref().is_none_or(|(min, _)| key < *min) {
            self.0 = Some((key, index));
        }
    }
}

impl Candidates {
    /// Reads a kept sample.
    pub fn offer(&mut self, row: &LedgerRow, facts: &PairFacts, split: Split) {
        let index = row.index;
        let share = |value: f64| ByBits(value.max(0.0).to_bits());
        let seen = share(f64::from(facts.partial_cells) / f64::from(facts.complete_cells.max(1)));
        self.smallest.offer(facts.partial_cells, index);
        self.largest.offer(std::cmp::Reverse(facts.partial_cells), index);
        self.cut_off.offer(share(facts.solid_share), index);
        self.least_seen.offer(seen, index);
        self.most_seen.offer(std::cmp::Reverse(seen), index);
        // By digest: spread over views and independent of the rest of the dataset.
        let lot = lot(&row.sample);
        self.of_split.entry(split).or_default().offer(lot, index);
        self.of_object.entry(row.sample.subject).or_default().offer(lot, index);
        self.first_with.entry(facts.partial_cells).or_insert(index);
    }

    /// The samples to show; `median` is the median count of partial cells, `objects` are names in order.
    pub fn picks(&self, median: u32, objects: &[(ObjectId, &str)]) -> Vec<Pick> {
        let mut picks: Vec<Pick> = Vec::new();
        let mut add = |index: Option<SampleIndex>, why: &str| {
            let Some(index) = index else { return };
            if let Some(pick) = picks.iter_mut().find(|pick| pick.index == index) {
                pick.why = format!("{}; {why}", pick.why);
            } else if picks.len() < GALLERY {
                picks.push(Pick { index, why: why.to_owned() });
            }
        };
        let of_median = self.first_with.get(&median).copied();
        add(of_median, "median number of observed cells");
        add(self.smallest.0.as_ref().map(|best| best.1), "fewest observed cells");
        add(self.largest.0.as_ref().map(|best| best.1), "most observed cells");
        add(self.cut_off.0.as_ref().map(|best| best.1), "smallest part of the solid inside the grid");
        add(self.least_seen.0.as_ref().map(|best| best.1), "smallest observed part of the shape");
        add(self.most_seen.0.as_ref().map(|best| best.1), "largest observed part of the shape");
        for (split, best) in &self.of_split {
            add(best.0.as_ref().map(|best| best.1), &format!("drawn from {}", split.name().replace('_', " ")));
        }
        // The rest: objects at even steps through the names, with one random view per object.
        let shown = objects.len().min(GALLERY);
        for step in 0..shown {
            let (object, _) = objects[step * objects.len() / shown];
            add(self.of_object.get(&object).and_then(|best| Some(best.0.as_ref()?.1)), "drawn for its object");
        }
        picks
    }
}

fn lot(sample: &SampleId) -> Digest {
    Digest::hash(&sample.to_bytes())
}
