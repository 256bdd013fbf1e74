//! The keys of a set: a job file that names job files.

use std::{collections::BTreeMap, path::PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Several jobs, run one after another into one folder, with a separate dataset each: different data about the same
/// objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetSpec {
    /// A set of jobs.
    pub product: SetProduct,
    /// Name of the set, for readers. Default: the file's name.
    #[schemars(extend("examples" = ["ycb-everything"]))]
    pub name: Option<String>,
    /// The jobs, in the order of execution.
    #[schemars(length(min = 1))]
    pub jobs: Vec<MemberSpec>,
}

/// Value of `product` in a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SetProduct {
    /// Datasets of several jobs.
    Set,
}

/// One job of a set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MemberSpec {
    /// Name in the set, and of the folder of its dataset: small letters, digits, `-` and `_`.
    #[schemars(extend("examples" = ["grasps"]))]
    pub name: String,
    /// Job file; relative to this one.
    #[schemars(extend("examples" = ["ycb-grasps.toml"]))]
    pub job: PathBuf,
    /// Datasets that the job reads, by the section of its job file that names one: each is the name of an earlier job
    /// of the set.
    #[serde(default)]
    #[schemars(extend("examples" = [{ "grasps": "grasps" }]))]
    pub inputs: BTreeMap<String, String>,
    /// Settings that override its job file, each as for `--set`.
    #[serde(default)]
    #[schemars(extend("examples" = [["views={ even = 12 }"]]))]
    pub set: Vec<String>,
}
