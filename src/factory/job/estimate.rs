//! Cost of a job, before it runs.

use serde::{Deserialize, Serialize};

/// Counts are exact; bytes and seconds follow from the given rates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Subjects: objects, robots or scenes.
    pub subjects: u64,
    /// Samples, kept and rejected.
    pub samples: u64,
    /// Shards.
    pub shards: u64,
    /// Bytes on disk.
    pub bytes: f64,
    /// Wall-clock time [s]; infinite at a rate of 0.
    pub seconds: f64,
}

impl Estimate {
    /// An estimate from counts, bytes per stored sample and samples per second (over all threads).
    pub fn new(subjects: usize, samples: u64, shards: usize, bytes_per_sample: f64, samples_per_second: f64) -> Self {
        Self {
            subjects: subjects as u64,
            samples,
            shards: shards as u64,
            bytes: samples as f64 * bytes_per_sample,
            seconds: if samples == 0 { 0.0 } else { samples as f64 / samples_per_second },
        }
    }
}
