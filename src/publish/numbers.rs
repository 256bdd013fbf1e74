//! Measured numbers for a release's documents, from the same surveys as the report and `inspect`.

use std::fmt::Display;

use serde::Serialize;

use super::{asset::AssetKind, chart::grouped, inspection::dataset_name, tally::SpreadRow};
use format::dataset::{DatasetError, DatasetReader};
use kernel::words::{Split, size_in_words};

/// A count or a measurement.
#[derive(Serialize)]
pub(super) struct NumberRow {
    what: String,
    value: String,
    /// A digest after the value.
    code: Option<String>,
}

/// Numbers in documents; none depends on time, machine or path.
pub(super) struct Numbers {
    /// Name of the job.
    pub job_name: String,
    /// Headline.
    pub headline: String,
    /// Counts and measurements.
    pub rows: Vec<NumberRow>,
    /// Distributions over the stored samples.
    pub spreads: Vec<SpreadRow>,
    /// Stored samples and objects of each split; empty without splits.
    pub splits: Vec<SplitCounts>,
    /// Names of objects that share their geometry across the split.
    pub leaks: Vec<String>,
}

/// Counts of one split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SplitCounts {
    /// The split.
    pub split: Split,
    /// Stored samples.
    pub samples: u64,
    /// Objects with stored samples, if they were counted.
    pub objects: Option<u64>,
}

impl NumberRow {
    /// A row without a digest.
    pub fn new(what: impl Into<String>, value: impl Into<String>) -> Self {
        Self { what: what.into(), value: value.into(), code: None }
    }

    /// A row with a digest after the value.
    pub fn with_code(what: impl Into<String>, value: impl Into<String>, code: impl Display) -> Self {
        Self { code: Some(code.to_string()), ..Self::new(what, value) }
    }
}

impl Numbers {
    /// The numbers of a dataset's manifest, whose objects are assets of this kind; its survey adds those of its samples.
    pub fn of(reader: &DatasetReader, headline: String, assets: AssetKind) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        let counts = &manifest.counts;
        let product = manifest.product;
        let rejected: u64 = counts.rejected.values().sum();
        let bytes = manifest.shards.iter().map(|shard| shard.bytes).sum();
        let mut rows = vec![
            NumberRow::new(format!("{} planned", product.samples.many), grouped(counts.samples)),
            NumberRow::new("stored", grouped(counts.kept)),
            NumberRow::new("rejected", grouped(rejected)),
        ];
        rows.extend(
            counts
                .rejected
                .iter()
                .map(|(reason, count)| NumberRow::new(format!("rejected: {reason}"), grouped(*count))),
        );
        // The manifest counts the rows of the asset table (objects or robots), even if the subjects are scenes.
        rows.push(NumberRow::new(format!("{}s", assets.name()), grouped(counts.objects)));
        if counts.refused_meshes > 0 {
            rows.push(NumberRow::new("meshes that could not be used", grouped(counts.refused_meshes)));
        }
        rows.push(NumberRow::new(
            "shards",
            format!("{}, {}", grouped(manifest.shards.len() as u64), size_in_words(bytes)),
        ));
        let channels: Vec<&str> = manifest.channels().into_iter().map(|channel| channel.name()).collect();
        rows.push(NumberRow::new("channels", channels.join(", ")));
        let split = |split: Split| SplitCounts {
            split,
            samples: counts.splits.get(&split).copied().unwrap_or(0),
            objects: None,
        };
        let splits = if counts.splits.is_empty() { Vec::new() } else { Split::ALL.map(split).to_vec() };
        Ok(Self { job_name: dataset_name(reader)?, headline, rows, spreads: Vec::new(), splits, leaks: Vec::new() })
    }
}

#[cfg(test)]
impl Numbers {
    /// Rows of every kind, with this text.
    pub fn example_rows(name: &str) -> Vec<NumberRow> {
        vec![
            NumberRow::new("hand", name),
            NumberRow::with_code("robot", name, "0123"),
            NumberRow::with_code("root", "", "0123"),
        ]
    }
}
