//! Distributions in bounded memory: a count for each value.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

/// A distribution in six numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Smallest value.
    pub min: f64,
    /// 5th percentile.
    pub p05: f64,
    /// Median.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Largest value.
    pub max: f64,
    /// Arithmetic mean.
    pub mean: f64,
}

impl Spread {
    /// The distribution of the finite values, by nearest rank; zeros without values.
    pub(super) fn of(mut values: Vec<f64>) -> Self {
        values.retain(|value| value.is_finite());
        values.sort_unstable_by(f64::total_cmp);
        let (Some(min), Some(max)) = (values.first().copied(), values.last().copied()) else {
            return Self::default();
        };
        let at = |share: f64| values[((values.len() as f64 * share).ceil() as usize).max(1) - 1];
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        Self { min, p05: at(0.05), median: at(0.5), p95: at(0.95), max, mean }
    }
}

/// A distribution in tables: its name, then minimum, 5 %, median, 95 %, maximum and mean.
#[derive(Clone, Debug, Serialize)]
pub(super) struct SpreadRow {
    name: &'static str,
    values: [String; 6],
}

impl SpreadRow {
    /// The row of a distribution, with this number of decimals.
    pub fn new(name: &'static str, digits: usize, spread: &Spread) -> Self {
        let Spread { min, p05, median, p95, max, mean } = *spread;
        Self { name, values: [min, p05, median, p95, max, mean].map(|value| format!("{value:.digits$}")) }
    }

    /// The cells of a table's row.
    pub fn into_cells(self) -> Vec<String> {
        std::iter::once(self.name.to_owned()).chain(self.values).collect()
    }
}

impl fmt::Display for SpreadRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "  {:<18}", self.name)?;
        self.values.iter().try_for_each(|value| write!(f, " {value:>10}"))
    }
}

/// Counts of finite values that are at least 0, in steps; other values are skipped. Memory grows only with the number of
/// different steps.
#[derive(Clone, Debug)]
pub(super) struct Tally {
    step: f64,
    /// Count of the values in each step, by its number.
    counts: BTreeMap<u64, u64>,
    total: u64,
    sum: f64,
    min: f64,
    max: f64,
}

impl Tally {
    /// A tally that distinguishes values which differ by `step`.
    pub fn with_step(step: f64) -> Self {
        Self { step, counts: BTreeMap::new(), total: 0, sum: 0.0, min: f64::INFINITY, max: f64::NEG_INFINITY }
    }

    pub fn add(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        let bin = (value.max(0.0) / self.step + 1e-9) as u64;
        *self.counts.entry(bin).or_default() += 1;
        self.total += 1;
        self.sum += value;
        self.min = self.min.min(value);
        self.max = self.max.max(value);
    }

    /// The value below or at which `share` of all values lie (nearest rank); 0 without values.
    pub fn quantile(&self, share: f64) -> f64 {
        let rank = ((self.total as f64 * share).ceil() as u64).max(1);
        let mut seen = 0;
        for (bin, count) in &self.counts {
            seen += count;
            if seen >= rank {
                return (*bin as f64 * self.step).clamp(self.min, self.max);
            }
        }
        0.0
    }

    pub fn spread(&self) -> Spread {
        if self.total == 0 {
            return Spread::default();
        }
        Spread {
            min: self.min,
            p05: self.quantile(0.05),
            median: self.quantile(0.5),
            p95: self.quantile(0.95),
            max: self.max,
            mean: self.sum / self.total as f64,
        }
    }

    /// Values in [low, high).
    pub fn count_between(&self, low: f64, high: f64) -> u64 {
        let bin = |value: f64| (value / self.step - 1e-9).ceil().max(0.0) as u64;
        let (from, to) = (bin(low), bin(high));
        self.counts.range(from.min(to)..to).map(|(_, count)| count).sum()
    }

    /// Counts over bins of equal width that begin at `start`.
    pub fn bins(&self, start: f64, width: f64, bins: usize) -> Vec<u64> {
        (0..bins).map(|bin| self.count_between(start + width * bin as f64, start + width * (bin + 1) as f64)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_nearest_ranks() {
        let mut tally = Tally::with_step(1.0);
        (1..=100).rev().for_each(|value| tally.add(f64::from(value)));
        let Spread { min, p05, median, p95, max, mean } = tally.spread();
        assert_eq!((min, p05, median, p95, max, mean), (1.0, 5.0, 50.0, 95.0, 100.0, 50.5));
        assert_eq!(tally.bins(0.0, 25.0, 5), [24, 25, 25, 25, 1]);
        assert_eq!(Spread::of((1..=100).rev().map(f64::from).collect()), tally.spread());
        let Spread { min, p05, median, p95, max, mean } = Spread::of(vec![0.5, -2.0, 3.0]);
        assert_eq!((min, p05, median, p95, max, mean), (-2.0, -2.0, 0.5, 3.0, 3.0, 0.5));
    }

    #[test]
    fn shares_up_to_one_are_told_apart() {
        let mut tally = Tally::with_step(1e-3);
        [0.0, 0.9895, 0.99, 0.9999, 1.0, 1.0].into_iter().for_each(|share| tally.add(share));
        assert_eq!(tally.count_between(0.0, 0.99), 2);
        assert_eq!(tally.count_between(0.99, 1.0), 2);
        assert_eq!(tally.count_between(1.0, 2.0), 2);
    }

    #[test]
    fn values_that_are_not_finite_are_skipped_and_huge_ones_take_no_memory() {
        let values = [f64::NAN, 0.25, f64::INFINITY, 0.75, f64::NEG_INFINITY, -0.0, 1e300];
        let mut tally = Tally::with_step(1e-3);
        values.into_iter().for_each(|value| tally.add(value));
        let Spread { min, p05, median, max, .. } = tally.spread();
        assert_eq!((min, p05, median, max), (0.0, 0.0, 0.25, 1e300));
        assert_eq!(tally.count_between(0.0, 1.0), 3);
        assert_eq!((Spread::of(values.to_vec()).min, Spread::of(values.to_vec()).max), (0.0, 1e300));
        let mut nothing = Tally::with_step(1.0);
        nothing.add(f64::NAN);
        assert_eq!((nothing.spread(), Spread::of(vec![f64::NAN])), (Spread::default(), Spread::default()));
    }

    #[test]
    fn nothing_is_no_number() {
        assert_eq!(Tally::with_step(1.0).spread(), Spread::default());
        assert_eq!(Spread::of(Vec::new()), Spread::default());
    }
}
