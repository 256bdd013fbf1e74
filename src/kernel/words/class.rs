//! Classes of numbers: how equal they are on two machines.

use serde::{Deserialize, Serialize};

/// How equal the numbers of a channel are on two machines.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NumberClass {
    /// The same bits on any machine: our own code.
    Exact,
    /// The same bits for one physics library, C library and processor level.
    Physics,
    /// The same bits for one graphics driver.
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
