//! A segmentation against labels of every point.

use std::collections::BTreeMap;

use crate::clusters::Cluster;

/// A cluster finds an object when both share at least this much of their union.
const FOUND: f64 = 0.5;
/// A cluster holds an object when it has at least this share of its points.
const HELD: f64 = 0.5;
/// An object is split when each of two clusters has at least this share of its points.
const PIECE: f64 = 0.1;

/// Agreement of clusters with labels.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct SegmentationScore {
    /// Share of clustered points that are labelled as objects.
    pub precision: f64,
    /// Share of points labelled as objects that are clustered.
    pub recall: f64,
    /// Harmonic mean of both.
    pub f_score: f64,
    /// One per labelled object, by label.
    pub objects: Vec<ObjectScore>,
    /// Objects with a cluster that shares at least half of their union.
    pub found: usize,
    /// Objects that share a cluster with another, each with at least half of its points in it.
    pub merged: usize,
    /// Objects with at least a tenth of their points in each of two clusters or more.
    pub split: usize,
    /// Clusters that hold the majority of their points outside of every object.
    pub spurious: usize,
}

/// Agreement of the clusters with one labelled object.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ObjectScore {
    /// Label of the object.
    pub label: u32,
    /// Count of its points with a return.
    pub points: usize,
    /// Largest intersection over union with a cluster.
    pub iou: f64,
    /// Whether another object shares its cluster.
    pub is_merged: bool,
    /// Whether several clusters share it.
    pub is_split: bool,
}

impl SegmentationScore {
    /// Scores clusters against labels; `has_return` selects the pixels that count.
    pub fn new(clusters: &[Cluster], labels: &[u32], has_return: impl Fn(usize) -> bool) -> Self {
        let mut sizes: BTreeMap<u32, usize> = BTreeMap::new();
        for (pixel, label) in labels.iter().enumerate().filter(|(pixel, _)| has_return(*pixel)) {
            *sizes.entry(*label).or_default() += usize::from(*label != 0 && pixel < labels.len());
        }
        sizes.remove(&0);
        // Points of each label in each cluster.
        let tables: Vec<BTreeMap<u32, usize>> = clusters
            .iter()
            .map(|cluster| {
                let mut table = BTreeMap::new();
                cluster.pixels.iter().for_each(|pixel| *table.entry(labels[*pixel as usize]).or_default() += 1);
                table
            })
            .collect();
        let shared = |table: &BTreeMap<u32, usize>, label: u32| table.get(&label).copied().unwrap_or(0);
        let holds =
            |table: &BTreeMap<u32, usize>, label: u32| shared(table, label) as f64 >= HELD * sizes[&label] as f64;
        let objects: Vec<ObjectScore> = sizes
            .iter()
            .map(|(label, points)| {
                let iou = clusters.iter().zip(&tables).map(|(cluster, table)| {
                    let both = shared(table, *label);
                    both as f64 / (cluster.pixels.len() + points - both) as f64
                });
                let pieces =
                    tables.iter().filter(|table| shared(table, *label) as f64 >= PIECE * *points as f64).count();
                let is_crowded = |table: &&BTreeMap<u32, usize>| {
                    holds(table, *label) && sizes.keys().any(|other| other != label && holds(table, *other))
                };
                ObjectScore {
                    label: *label,
                    points: *points,
                    iou: iou.fold(0.0, f64::max),
                    is_merged: tables.iter().any(|table| is_crowded(&table)),
                    is_split: pieces > 1,
                }
            })
            .collect();
        let clustered: usize = clusters.iter().map(|cluster| cluster.pixels.len()).sum();
        let outside: usize = tables.iter().map(|table| shared(table, 0)).sum();
        let labelled: usize = sizes.values().sum();
        let share = |part: usize, whole: usize| if whole == 0 { 0.0 } else { part as f64 / whole as f64 };
        let (precision, recall) = (share(clustered - outside, clustered), share(clustered - outside, labelled));
        let sum = precision + recall;
        Self {
            precision,
            recall,
            f_score: if sum > 0.0 { 2.0 * precision * recall / sum } else { 0.0 },
            found: objects.iter().filter(|object| object.iou >= FOUND).count(),
            merged: objects.iter().filter(|object| object.is_merged).count(),
            split: objects.iter().filter(|object| object.is_split).count(),
            spurious: clusters
                .iter()
                .zip(&tables)
                .filter(|(cluster, table)| 2 * shared(table, 0) > cluster.pixels.len())
                .count(),
            objects,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cluster(pixels: impl IntoIterator<Item = u32>) -> Cluster {
        Cluster { pixels: pixels.into_iter().collect(), touches_border: false }
    }

    #[test]
    fn found_merged_and_split_objects_are_counted() {
        // Pixels 0..10 background, 10..20 object 1, 20..30 object 2, 30..40 object 3, without return from 38.
        let labels: Vec<u32> = (0..40).map(|pixel| pixel / 10).collect();
        let score = |clusters: &[Cluster]| SegmentationScore::new(clusters, &labels, |pixel| pixel < 38);
        let perfect = score(&[cluster(10..20), cluster(20..30), cluster(30..38)]);
        assert_eq!((perfect.precision, perfect.recall, perfect.f_score), (1.0, 1.0, 1.0));
        assert_eq!((perfect.found, perfect.merged, perfect.split, perfect.spurious), (3, 0, 0, 0));
        let mixed = score(&[cluster(10..30), cluster(30..34), cluster(34..38), cluster(0..4)]);
        assert_eq!((mixed.merged, mixed.split, mixed.spurious), (2, 1, 1));
        // Half of the union is enough: objects 1 and 2 in one cluster, half of object 3 in each of two.
        assert_eq!(mixed.objects.iter().map(|object| object.iou).collect::<Vec<_>>(), [0.5; 3]);
        assert_eq!((mixed.precision, mixed.recall), (28.0 / 32.0, 1.0));
        let nothing = score(&[]);
        assert_eq!((nothing.precision, nothing.recall, nothing.found), (0.0, 0.0, 0));
    }
}
