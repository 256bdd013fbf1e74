//! Profiles of jobs.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A named set of defaults; every quirk is a separate switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// Good practice.
    Standard,
    /// Faithful to the thesis, quirks included.
    Thesis,
}
