//! Reasons for refusing a model, and inputs for it.

use std::{io, path::PathBuf};

use kernel::remedy;

use crate::sample::InputName;
use kernel::words::Show;

/// Reason why a folder is not a usable model.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", file.shown())]
pub struct ModelError {
    /// The file with the fault.
    pub file: PathBuf,
    /// The fault.
    #[source]
    pub problem: ModelProblem,
}

/// A fault in a model's folder.
#[derive(Debug, thiserror::Error)]
pub enum ModelProblem {
    /// A file cannot be read.
    #[error("it cannot be read{}", io_remedy(.0))]
    Io(#[from] io::Error),
    /// `model.json` does not match the format.
    #[error("line {line}, column {column}: {found}; docs/models.md lists the keys")]
    Json {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Message of the JSON reader.
        found: String,
    },
    /// A value of `model.json` that this program does not support.
    #[error("{key} = {found}; this program supports {wanted}")]
    Value {
        /// The key.
        key: &'static str,
        /// Value of the key.
        found: String,
        /// Supported values.
        wanted: String,
    },
    /// A file is not listed in `model.json`, or its name points outside the folder.
    #[error("{found} in `files` of model.json; list every file of the folder there by its plain name")]
    Files {
        /// Name and fault.
        found: String,
    },
    /// The digest of a file differs from that in `model.json`.
    #[error(
        "its SHA-256 is {calculated}, but model.json states {stated}: the file was changed or cut short; fetch the model again"
    )]
    Digest {
        /// SHA-256 of the file, in hexadecimal digits.
        calculated: String,
        /// SHA-256 in `model.json`.
        stated: String,
    },
    /// The file is not ONNX.
    #[error("it is not an ONNX model ({found}); export it again")]
    NotOnnx {
        /// Message of the library.
        found: String,
    },
    /// The network was exported with an unsupported operator set.
    #[error("operator set {found}; export the network with operator set {wanted}")]
    OperatorSet {
        /// Version in the file.
        found: String,
        /// Supported version.
        wanted: i64,
    },
    /// The network has an unsupported operator.
    #[error("operator {operator} at node '{node}' is not supported; networks may use {allowed}")]
    Operator {
        /// Name of the operator, with its domain if that is not ONNX's own.
        operator: String,
        /// Name of the node.
        node: String,
        /// Names of all supported operators.
        allowed: String,
    },
    /// An unsupported part, such as subgraphs and functions.
    #[error("it has {part}, which this program does not support; export the network without it")]
    Part {
        /// The part.
        part: &'static str,
    },
    /// A node that is not supported or does not fit its inputs.
    #[error("{operator} at node '{node}' is not supported: {found}; export the network as docs/models.md requires")]
    Node {
        /// Name of the operator.
        operator: String,
        /// Name of the node.
        node: String,
        /// Fault, with the values.
        found: String,
    },
    /// A network beyond the bounds.
    #[error("it has more than {most} {what}, which is the bound (docs/models.md); use a smaller network")]
    Bound {
        /// Noun of the counted items.
        what: &'static str,
        /// The bound.
        most: u64,
    },
    /// Weights in another file.
    #[error("weights '{tensor}' are in another file; export the network with its weights inside (external_data=False)")]
    ExternalData {
        /// Name of the tensor.
        tensor: String,
    },
    /// Inputs or outputs differ from those of `model.json`.
    #[error("{what} are {found}, but model.json states {stated}")]
    Ends {
        /// `inputs` or `outputs`.
        what: &'static str,
        /// Names in the network.
        found: String,
        /// Names in `model.json`.
        stated: String,
    },
    /// A tensor at the network's ends has another shape or type.
    #[error("{name} is {found}; it must be float32 of shape (batch, 1, {resolution}, {resolution}, {resolution})")]
    Shape {
        /// Name of the tensor.
        name: String,
        /// Type and shape found.
        found: String,
        /// Cells along each axis.
        resolution: u32,
    },
    /// The library could not prepare the network.
    #[error("the network cannot be run ({found}); export it again")]
    Network {
        /// Message of the library.
        found: String,
    },
    /// `golden.npz` does not match the format.
    #[error("{found}; it must contain the network's inputs and outputs by name, float32, as numpy.savez writes them")]
    Golden {
        /// Fault.
        found: String,
    },
}

/// Remedy for a file of a model that cannot be read.
fn io_remedy(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => {
            ": a model folder must contain model.json, model.onnx, golden.npz and card.md".to_owned()
        }
        _ => format!(" ({error}); {}", remedy::for_reading(error)),
    }
}

/// Reason why a network makes no prediction.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PredictError {
    /// A required input is missing.
    #[error("the network requires the input `{0}`; give it, or use a model without it")]
    MissingInput(InputName),
    /// A grid with a different resolution.
    #[error("the input `{input}` has {found} cells along each axis, but the network requires {wanted}")]
    Resolution {
        /// The input.
        input: InputName,
        /// Cells along each axis of the input.
        found: usize,
        /// Cells along each axis of the network.
        wanted: u32,
    },
    /// An input contains NaN or infinity.
    #[error("the input `{0}` has a value that is NaN or infinite")]
    NotFinite(InputName),
    /// The network returned a value that is not a probability.
    #[error("the network's output `{output}` has the value {value}, which is not a probability: the model is damaged")]
    NoProbability {
        /// The output.
        output: &'static str,
        /// The first invalid value, as text.
        value: String,
    },
    /// The library failed.
    #[error("the network could not be run: {0}")]
    Library(String),
}
