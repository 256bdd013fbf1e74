//! Products as the factory makes them: rows of a table. The job reader depends only on the rows.

mod draft_work;

use std::path::Path;

pub use draft_work::{DraftWork, MakeWork, ShardSamples, default_shard_samples};

use crate::sections::JobContext;
use form::{Checker, FormErrors, Schema};
use format::Product;
use sim::{HandError, HandModel};

/// A product as the factory makes it: one row of the table of products.
pub struct ProductFactory {
    /// The product.
    pub product: Product,
    /// Schema of the product's own keys in a job file, under a title.
    pub keys: fn(&str) -> Schema,
    /// Default values of its keys: those of the profile `standard`, and the ones that `thesis` changes.
    pub profiles: [&'static str; 2],
    /// Paths of keys that people write and that no job has, each with a remedy.
    pub key_hints: &'static [(&'static str, &'static str)],
    /// Settings under which its jobs use a hand.
    pub hand_uses: &'static [HandUse],
    /// Datasets that its jobs read.
    pub inputs: &'static [InputDataset],
    /// Checks the keys of a job, in a folder that relative paths start from.
    pub draft: fn(&toml::Table, Checker, &Path, &JobContext) -> Result<DraftWork, FormErrors>,
}

/// A setting under which jobs of a product use a hand.
pub struct HandUse {
    /// The setting, as a job file has it.
    pub setting: &'static str,
    /// Whether a hand can be used so.
    pub check: fn(&HandModel) -> Result<(), HandError>,
}

/// A dataset that jobs of a product read.
pub struct InputDataset {
    /// Section of the job file that names its folder, under [`ProductFactory::INPUT_KEY`].
    pub section: &'static str,
    /// Product of the dataset.
    pub product: Product,
}

impl ProductFactory {
    /// Key of a section that names the folder of a dataset.
    pub const INPUT_KEY: &'static str = "dataset";
}
