//! The keys of a set: a job file that names job files.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Several jobs made one after another in one folder, each a dataset of its own: what is known of the same objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetSpec {
    /// A set of jobs.
    pub product: SetProduct,
    /// Name of the set, for people. Without it, the file's name.
    #[schemars(extend("examples" = ["ycb-everything"]))]
    pub name: Option<String>,
    /// The jobs, in the order in which they are made.
    #[schemars(length(min = 1))]
    pub jobs: Vec<MemberSpec>,
}

/// What a set makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SetProduct {
    /// What its jobs make.
    Set,
}

/// One job of a set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MemberSpec {
    /// Its name in the set, and the folder of its dataset: small letters, digits, `-` and `_`.
    #[schemars(extend("examples" = ["grasps"]))]
    pub name: String,
    /// Its job file; relative to this one.
    #[schemars(extend("examples" = ["ycb-grasps.toml"]))]
    pub job: PathBuf,
    /// Of a job for patches: the name of the job further up that makes its grasps. It stands in for `grasps.dataset`.
    #[schemars(extend("examples" = ["grasps"]))]
    pub grasps: Option<String>,
    /// Settings laid over its job file, each as `--set` takes it.
    #[serde(default)]
    #[schemars(extend("examples" = [["views={ even = 12 }"]]))]
    pub set: Vec<String>,
}
