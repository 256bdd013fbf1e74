//! Work of a job behind a few traits, the only interface of the scheduler, the estimate and the command line.

use std::{any::Any, collections::BTreeMap, fmt, ops::Add, path::Path};

use serde_json::Value;

use super::{
    Cancel, Parallelism, ProduceError, RunError, SampleWriter,
    plan::{JobSplits, SubjectItems},
    sections::{JobObjects, SplitInput},
};
use format::{
    Channel, Product,
    dataset::{DatasetHeader, RunMark},
};
use kernel::{
    files::Folder,
    geom::SimdLevel,
    ids::{ItemId, JobDigest},
    render::DepthSource,
    words::{NumberClass, SplitTable},
};

/// The checked work of a job: settings and subjects of its product. All reading and hashing is done.
pub trait Work: Any + fmt::Debug + Send + Sync {
    /// Product of the samples.
    fn product(&self) -> Product;

    /// Subjects in the order of the plan, with their counts of items.
    fn subjects(&self) -> Vec<SubjectItems>;

    /// Keys of the job file other than its head, resolved: every default filled in, files relative to `folder` and
    /// pinned by content.
    fn resolved(&self, folder: &Path, shard_samples: u32) -> toml::Table;

    /// Keys that samples depend on in addition to their subject and the seed, files by content alone.
    fn sample_keys(&self) -> toml::Table;

    /// The subjects by content, and everything that decides their splits.
    fn subject_keys(&self) -> toml::Table;

    /// Objects that the job prepares, with the meshes that it refused.
    fn objects(&self) -> Option<&JobObjects> {
        None
    }

    /// Objects to be split; `None` without objects, or if another dataset has split them.
    fn divided(&self) -> Option<SplitInput<'_>> {
        None
    }

    /// Contribution of the product to the tables of its dataset.
    fn tables(&self, splits: Option<&JobSplits>) -> WorkTables;

    /// Opens the parts that all threads share: hands, robots, other datasets.
    ///
    /// # Errors
    /// When one is gone, another one than when the job was resolved, or cannot be worked with.
    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError>;

    /// Facts about the work for `estimate`, for people.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }

    /// Figures about the work for `estimate`, for programs, by name; each name ends with its unit where it has one.
    fn figures(&self) -> BTreeMap<&'static str, f64> {
        BTreeMap::new()
    }

    /// Source of depth images that are not stored, for previews; `None` for a product without.
    ///
    /// # Errors
    /// When the job's renderer is not available.
    fn depth_source(&self, _seed: u64, _level: SimdLevel) -> Result<Option<Box<dyn DepthSource + '_>>, ProduceError> {
        Ok(None)
    }
}

/// Seed, level and splits with which the parts that all threads share are opened.
#[derive(Clone, Copy, Debug)]
pub struct Opening<'a> {
    /// Seed of the job.
    pub seed: u64,
    /// SIMD level of this run.
    pub level: SimdLevel,
    /// Splits of the subjects, of a job that has some.
    pub splits: Option<&'a SplitTable>,
}

/// Contribution of a product to the tables of its dataset.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkTables {
    /// Class of the numbers of its channels.
    pub class: NumberClass,
    /// Channels of another class.
    pub channel_classes: BTreeMap<Channel, NumberClass>,
    /// Facts of the machine that numbers of class physics and colour depend on.
    pub platform: BTreeMap<String, String>,
    /// Rows of the asset table.
    pub assets: Vec<Value>,
    /// Rows of subjects that are not objects, such as the scenes of a split.
    pub subjects: Vec<Value>,
    /// Rows of hands.
    pub hands: Vec<Value>,
    /// Rows of containers that are meshes.
    pub containers: Vec<Value>,
    /// Splits of the subjects.
    pub splits: Option<SplitTable>,
}

/// Cost of files that a product writes in addition to its samples, at the end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SideCost {
    /// Bytes of its own files, and of its additions to the tables.
    pub bytes: f64,
    /// Processor time [s].
    pub seconds: f64,
}

impl Add for SideCost {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { bytes: self.bytes + other.bytes, seconds: self.seconds + other.seconds }
    }
}

/// Work whose shared parts are open.
pub trait OpenWork: Sync {
    /// A producer for one thread.
    ///
    /// # Errors
    /// When the job's renderer is not available, or its hand cannot be read.
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError>;

    /// Expected cost of the files that only this product has and of its additions to the dataset's tables, from a few
    /// of the job's subjects, given by their indices. `folder` is not a dataset: files can be written there for
    /// measurement.
    ///
    /// # Errors
    /// When a subject is gone or another one than when the job was resolved.
    fn side_cost(&self, _visited: &[usize], _folder: &Folder) -> Result<SideCost, ProduceError> {
        Ok(SideCost::default())
    }

    /// Writes the files that only this product has and adds to the dataset's tables, after all shards are done.
    ///
    /// # Errors
    /// When a shard or mesh cannot be read, a file cannot be written, or the run is cancelled.
    fn finish(&self, _closing: &mut Closing<'_>) -> Result<(), RunError> {
        Ok(())
    }
}

/// A dataset that is being closed.
pub struct Closing<'a> {
    /// Folder of the dataset.
    pub folder: &'a Folder,
    /// Digest of the job.
    pub job: JobDigest,
    /// Mark of the folder: count of shards and samples.
    pub mark: &'a RunMark,
    /// Tables of the dataset, to be added to.
    pub header: &'a mut DatasetHeader,
    /// Threads to use.
    pub parallelism: &'a Parallelism,
    /// Wish to stop.
    pub cancel: &'a Cancel,
}

/// The producer of one thread; its memory is reused from sample to sample. Producers never call each other and never write
/// files.
pub trait Producer {
    /// Channels of every kept sample, in order.
    fn channels(&self) -> Vec<Channel>;

    /// Loads a subject of the job, by its index; one that is loaded already stays. What takes seconds looks at `cancel`
    /// meanwhile.
    ///
    /// # Errors
    /// When the subject is gone or differs from the resolved job, or the run is stopped.
    fn load(&mut self, subject: usize, cancel: &Cancel) -> Result<(), ProduceError>;

    /// Makes the samples of one item of the loaded subject.
    ///
    /// # Errors
    /// When a tool that it needs fails, or a sample cannot be stored.
    ///
    /// # Panics
    /// When no subject is loaded.
    fn produce(&mut self, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError>;
}
