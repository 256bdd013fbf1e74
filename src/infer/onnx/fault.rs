//! Reasons why bytes are not a valid ONNX message that is read.

use std::fmt;

use crate::error::ModelProblem;

/// Reasons why bytes are not a valid ONNX message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// A field extends beyond the message.
    Cut,
    /// A wire type that protobuf does not define, or no longer defines.
    WireType(u64),
    /// A field with a type that differs from ONNX.
    Kind,
    /// A list is longer than this program supports.
    Long { most: usize },
    /// A field that ONNX does not define.
    Unknown { message: &'static str, number: u64 },
    /// A part that this program does not support.
    Forbidden(&'static str),
    /// A unique part is given twice.
    Twice(&'static str),
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cut => f.write_str("a field is cut short"),
            Self::WireType(kind) => write!(f, "a field has wire type {kind}"),
            Self::Kind => f.write_str("a field has the wrong type"),
            Self::Long { most } => write!(f, "a list has more than {most} entries"),
            Self::Unknown { message, number } => {
                write!(f, "{message} has a field {number}, which ONNX 1.17 does not define")
            }
            Self::Forbidden(part) => f.write_str(part),
            Self::Twice(part) => write!(f, "{part} is given twice"),
        }
    }
}

impl From<Fault> for ModelProblem {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::Forbidden(part) => Self::Part { part },
            other => Self::NotOnnx { found: other.to_string() },
        }
    }
}
