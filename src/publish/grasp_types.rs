//! Grasp types in tables.

use serde::{Deserialize, Serialize};

use kernel::words::type_digits;

/// A grasp type: the closed joints, binned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TypeFacts {
    /// Number of the type.
    pub kind: u32,
    /// Kept grasps of the type.
    pub grasps: u64,
    /// Grasps of the type that held in a trial; 0 without trials.
    pub held: u64,
    /// Digits to base 5: spread, proximal joints of three fingers, their distal joints, roll of the wrist.
    pub digits: [u8; 8],
}

impl TypeFacts {
    pub(super) fn new(kind: u32, [grasps, held]: [u64; 2]) -> Self {
        Self { kind, grasps, held, digits: type_digits(kind).map(|digit| digit as u8) }
    }

    /// Spread, proximal joints, distal joints and roll, for tables.
    pub(super) fn digits_in_words(&self) -> [String; 4] {
        let [spread, a, b, c, d, e, f, roll] = self.digits;
        [spread.to_string(), format!("{a} {b} {c}"), format!("{d} {e} {f}"), roll.to_string()]
    }
}
