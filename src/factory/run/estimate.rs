//! Size and duration of a job, before it runs.

use std::time::Duration;

use serde::Serialize;

use super::{OpenJob, PilotRate};

/// Size and duration of a job on this machine. Counts are exact; bytes and seconds follow from a pilot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Subjects: objects, robots or scenes.
    pub subjects: u64,
    /// Samples, kept and rejected.
    pub samples: u64,
    /// Shards.
    pub shards: u64,
    /// Bytes of the dataset, without its preview and its report.
    pub bytes: f64,
    /// Processor time of all of it [s].
    pub core_seconds: f64,
    /// Processor time of what every task pays: reading the meshes and preparing them, opening what threads share [s].
    pub opening_seconds: f64,
    /// Wall-clock time on the threads given [s].
    pub seconds: f64,
}

impl Estimate {
    /// The estimate for a job that took `opening` of processor time to be opened, by the rates of its pilot, on `threads`.
    pub fn new(open: &OpenJob, opening: Duration, rate: &PilotRate, threads: usize) -> Self {
        let OpenJob { job, plan, .. } = open;
        let (samples, shards, threads) = (plan.samples as f64, plan.shards.len() as f64, threads.max(1) as f64);
        let opening_seconds = opening.as_secs_f64() + rate.seconds_of_opening;
        // A subject with items in two shards is loaded for each.
        let loading = plan.units().count() as f64 * rate.seconds_per_subject;
        let making = samples * rate.seconds_per_sample + loading;
        // Threads take whole shards: of three shards, one of two threads makes two.
        let share = if shards > 0.0 { (shards / threads).ceil() / shards } else { 0.0 };
        Self {
            subjects: job.work.subjects().len() as u64,
            samples: plan.samples,
            shards: plan.shards.len() as u64,
            bytes: shards * rate.bytes_per_shard
                + samples * (rate.bytes_per_sample + rate.bytes_per_row)
                + rate.bytes_beside,
            core_seconds: opening_seconds + making + rate.seconds_of_closing,
            opening_seconds,
            seconds: (opening_seconds + rate.seconds_of_closing) / threads + making * share,
        }
    }
}
