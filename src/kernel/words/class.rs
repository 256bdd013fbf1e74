//! Classes of numbers: how equal they are on two machines.

use serde::{Deserialize, Serialize};

/// Class of a channel's numbers: how equal they are on two machines.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NumberClass {
    /// Identical bits on any machine: our own code.
    Exact,
    /// Identical bits for one physics library, C library and processor level.
    Physics,
    /// Identical bits for one graphics driver.
    Colour,
}

impl NumberClass {
    /// Name in files and in the root digest.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Physics => "physics",
            Self::Colour => "colour",
        }
    }
}
