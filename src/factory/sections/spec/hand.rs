//! The keys of a hand that a job names.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A hand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HandSpec {
    /// The hand's description, an MJCF or URDF file; relative to the job file. Its table has the same path with the
    /// extension `.toml`.
    #[schemars(extend("examples" = ["../scenes/barrett_bh8_280.xml"]))]
    pub model: PathBuf,
    /// Content that description and table must have (64 hexadecimal digits); a resolved job pins it.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub content: Option<String>,
}
