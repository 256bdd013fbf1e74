//! Parts that all pages share, as their templates take them.

use serde::Serialize;

use super::{chart::grouped, inspection::InspectionHeader, notes::Speed, picture::Picture};
use kernel::words::{NumberClass, size_in_words};

/// A dataset as the head of its page shows it.
#[derive(Serialize)]
pub(super) struct DatasetView<'a> {
    name: &'a str,
    root: String,
    generator: &'a str,
    format: u32,
    job: String,
    /// Count and size of the shards.
    shards: String,
    classes: Vec<ClassView>,
    warnings: &'a [String],
}

/// The digest of a class of numbers.
#[derive(Serialize)]
struct ClassView {
    name: &'static str,
    /// The first few digits.
    digest: String,
}

impl<'a> DatasetView<'a> {
    pub fn of(header: &'a InspectionHeader) -> Self {
        let classes = header.classes.iter();
        let class = |(class, digest): (&NumberClass, &kernel::ids::Digest)| ClassView {
            name: class.name(),
            digest: digest.short().to_string(),
        };
        Self {
            name: &header.name,
            root: header.root.to_string(),
            generator: &header.generator,
            format: header.format_version,
            job: header.job.to_string(),
            shards: format!("{} · {}", grouped(header.shards), size_in_words(header.shard_bytes)),
            classes: classes.map(class).collect(),
            warnings: &header.warnings,
        }
    }
}

/// Speed of a run.
#[derive(Serialize)]
pub(super) struct SpeedView {
    samples: String,
    /// Things that the run made.
    what: &'static str,
    seconds: String,
    threads: u32,
    /// Samples per second.
    rate: String,
    /// Peak memory, where known.
    memory: Option<String>,
}

impl SpeedView {
    /// The figures that a run left; `None` where it left none.
    pub fn of(header: &InspectionHeader, what: &'static str) -> Option<Self> {
        let speed: &Speed = header.notes.speed.as_ref()?;
        Some(Self {
            samples: grouped(speed.samples),
            what,
            seconds: format!("{:.1}", speed.seconds),
            threads: speed.threads,
            rate: grouped(speed.rate().round() as u64),
            memory: speed.peak_memory.map(size_in_words),
        })
    }
}

/// A picture inside a page.
#[derive(Serialize)]
pub(super) struct ImageView {
    /// Content as a `data:` address.
    uri: String,
    /// Size on the page [px].
    width: u32,
    height: u32,
}

impl ImageView {
    /// A picture, shown `width` x `height` pixels large.
    pub fn of(picture: &Picture, width: u32, height: u32) -> Self {
        Self { uri: picture.to_data_uri(), width, height }
    }
}
