//! Means over objects with intervals: views of one object are not independent, so objects are resampled, never samples.

use std::collections::BTreeMap;

use kernel::seed::Stream;

/// Resamples of the objects.
const DRAWS: usize = 10_000;
/// Shares of the resampled means below and above the interval.
const TAILS: [f64; 2] = [0.025, 0.975];

/// A mean over objects with its interval.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Interval {
    /// Mean of the objects' means.
    pub mean: f64,
    /// Lower end of the 95 % interval by bootstrap.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Count of objects.
    pub objects: usize,
}

/// Values of samples by object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scores(BTreeMap<String, Vec<f64>>);

impl Scores {
    /// Adds the value of one sample of an object.
    pub fn add(&mut self, object: &str, value: f64) {
        self.0.entry(object.to_owned()).or_default().push(value);
    }

    /// Count of samples.
    pub fn samples(&self) -> usize {
        self.0.values().map(Vec::len).sum()
    }

    /// Mean of the objects' means with its interval; `None` without objects.
    pub fn interval(&self, seed: u64) -> Option<Interval> {
        let means: Vec<f64> = self.0.values().map(|values| mean(values)).collect();
        bootstrap(&means, seed)
    }

    /// Interval of this less the other, paired by object; `None` if they share none.
    pub fn paired_difference(&self, other: &Self, seed: u64) -> Option<Interval> {
        let difference = |(object, values): (&String, &Vec<f64>)| Some(mean(values) - mean(other.0.get(object)?));
        let differences: Vec<f64> = self.0.iter().filter_map(difference).collect();
        bootstrap(&differences, seed)
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn bootstrap(values: &[f64], seed: u64) -> Option<Interval> {
    if values.is_empty() {
        return None;
    }
    let mut draw = Stream::of_job(seed, b"", "bootstrap over objects");
    let mut means: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let sum: f64 = (0..values.len()).map(|_| values[draw.below(values.len() as u64) as usize]).sum();
            sum / values.len() as f64
        })
        .collect();
    means.sort_by(f64::total_cmp);
    let at = |share: f64| means[((share * DRAWS as f64) as usize).min(DRAWS - 1)];
    Some(Interval { mean: mean(values), low: at(TAILS[0]), high: at(TAILS[1]), objects: values.len() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normal values of `objects` objects, with ten similar samples each.
    fn scores(objects: usize, shift: f64, name: &str) -> Scores {
        let mut draw = Stream::of_job(1, b"", "objects");
        let mut noise = Stream::of_job(1, b"", name);
        let mut scores = Scores::default();
        for object in 0..objects {
            let middle = draw.normal();
            (0..10).for_each(|_| scores.add(&format!("object {object}"), middle + shift + 0.1 * noise.normal()));
        }
        scores
    }

    #[test]
    fn intervals_are_those_of_objects_and_not_of_samples() {
        let scores = scores(100, 0.0, "a");
        let found = scores.interval(0).expect("objects");
        assert_eq!((found.objects, scores.samples()), (100, 1000));
        // The standard error of the mean of 100 values of deviation 1 is .1, and 95 % lie within 1.96 of it. By samples it would
        // be a third of that.
        let half = (found.high - found.low) / 2.0;
        assert!((half / 0.196 - 1.0).abs() < 0.2, "{found:?}");
        assert!((found.low..found.high).contains(&found.mean));
        assert_eq!(scores.interval(0), Some(found));
        assert_ne!(scores.interval(1), Some(found));
    }

    #[test]
    fn pairs_find_what_unpaired_means_do_not() {
        let (one, other) = (scores(60, 0.1, "a"), scores(60, 0.0, "b"));
        let [a, b] = [&one, &other].map(|scores| scores.interval(0).expect("objects"));
        assert!(a.low < b.high, "unpaired, the intervals overlap: {a:?} {b:?}");
        let difference = one.paired_difference(&other, 0).expect("objects");
        assert!(difference.low > 0.05 && difference.high < 0.15, "{difference:?}");
        // Objects of one side alone do not count.
        let mut more = one.clone();
        more.add("another", 1e6);
        assert_eq!(more.paired_difference(&other, 0), Some(difference));
        assert_eq!(one.paired_difference(&Scores::default(), 0), None);
        assert_eq!(Scores::default().interval(0), None);
    }
}
