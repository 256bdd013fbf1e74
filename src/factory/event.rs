//! Progress as typed events: one source feeds a bar, lines, JSON or silence.

use std::time::Duration;

use serde::Serialize;

use format::Product;

/// Something that happened in a run. Counts are of finished work only.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "event")]
pub enum Event {
    /// A mesh was prepared or refused.
    Prepared {
        /// Meshes prepared or refused so far.
        done: u64,
        /// Meshes of the job.
        total: u64,
    },
    /// A mesh whose solid takes much longer to make than that of a closed mesh.
    CostlyMesh {
        /// Name of the mesh.
        mesh: String,
        /// About how many times as long.
        times: u32,
    },
    /// The plan is complete and finished shards have been found.
    Planned {
        /// Product of the samples.
        product: Product,
        /// Samples of the job.
        samples: u64,
        /// Samples of these in shards that were finished before.
        samples_before: u64,
        /// Shards of the job.
        shards: u64,
        /// Shards of these that were finished before.
        shards_before: u64,
        /// Threads at work.
        threads: usize,
    },
    /// Samples went by.
    Progress(Progress),
    /// A shard is finished and on disk.
    ShardFinished {
        /// Index of the shard.
        shard: u32,
        /// File name of the shard.
        file: String,
        /// Samples of the shard, kept and rejected.
        samples: u64,
    },
    /// All shards are there; field, index, manifest and digest are being made.
    Finishing,
}

/// Progress of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Progress {
    /// Samples made in this run.
    pub made: u64,
    /// Samples to make in this run.
    pub to_make: u64,
    /// Samples made and kept.
    pub kept: u64,
    /// Samples made and rejected.
    pub rejected: u64,
    /// Time since the first sample was begun [s].
    pub seconds: f64,
}

impl Progress {
    /// Samples per second so far.
    pub fn rate(&self) -> f64 {
        if self.seconds > 0.0 { self.made as f64 / self.seconds } else { 0.0 }
    }

    /// Time left at this rate; `None` before anything is made.
    pub fn time_left(&self) -> Option<Duration> {
        let rate = self.rate();
        (rate > 0.0).then(|| Duration::from_secs_f64(self.to_make.saturating_sub(self.made) as f64 / rate))
    }
}

/// Listener to a run; called from any thread.
pub type Listener<'a> = dyn Fn(Event) + Sync + 'a;
