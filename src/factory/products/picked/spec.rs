//! The section of a job file that names a dataset of picks.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Source of the picks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PicksSourceSpec {
    /// The folder of a finished dataset of picks of the same scenes; relative to the job file.
    #[schemars(required, extend("examples" = ["../datasets/ycb-picks"]))]
    pub dataset: Option<PathBuf>,
    /// The digest of its exact numbers (64 hexadecimal digits); a resolved job pins it.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub root: Option<String>,
    /// The digest of its physics numbers (64 hexadecimal digits), if it has trials; a resolved job pins it.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub trials_root: Option<String>,
}
