//! Why bytes are no message of ONNX that is read.

use std::fmt;

use crate::error::ModelProblem;

/// Why bytes are no message of ONNX.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// A field ends behind the message.
    Cut,
    /// A wire type that protobuf does not have, or has no more.
    WireType(u64),
    /// A field of another type than ONNX says.
    Kind,
    /// A list is longer than this program reads.
    Long { most: usize },
    /// A field that ONNX does not have.
    Unknown { message: &'static str, number: u64 },
    /// A part that this program does not run.
    Forbidden(&'static str),
    /// A part that may stand once stands twice.
    Twice(&'static str),
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cut => f.write_str("a field is cut short"),
            Self::WireType(kind) => write!(f, "a field has wire type {kind}"),
            Self::Kind => f.write_str("a field is of another type"),
            Self::Long { most } => write!(f, "a list has more than {most} entries"),
            Self::Unknown { message, number } => {
                write!(f, "{message} has a field {number}, which ONNX 1.17 does not know")
            }
            Self::Forbidden(part) => f.write_str(part),
            Self::Twice(part) => write!(f, "{part} is there twice"),
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
