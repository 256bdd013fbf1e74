//! Reasons for refusing a model, and inputs for it.

use std::{io, path::PathBuf};

use kernel::remedy;

use crate::sample::InputName;
use kernel::words::Show;

/// Why a folder is no model that this program runs.
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
    /// `model.json` is not what the format says.
    #[error("line {line}, column {column}: {found}; docs/models.md lists the keys")]
    Json {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Words of the JSON reader.
        found: String,
    },
    /// A value of `model.json` that this program cannot serve.
    #[error("{key} = {found}; this program takes {wanted}")]
    Value {
        /// The key.
        key: &'static str,
        /// Value of the key.
        found: String,
        /// Values that would do.
        wanted: String,
    },
    /// A file is not listed in `model.json`, or under a name that leads elsewhere.
    #[error("{found} in `files` of model.json; every file of the folder is listed there by its plain name")]
    Files {
        /// Name and fault.
        found: String,
    },
    /// A file has other bytes than `model.json` says.
    #[error(
        "its SHA-256 is {calculated}, model.json says {stated}: the file was changed or cut short; fetch the model again"
    )]
    Digest {
        /// SHA-256 of the file, in hexadecimal digits.
        calculated: String,
        /// SHA-256 in `model.json`.
        stated: String,
    },
    /// The file is no ONNX.
    #[error("it is no ONNX model ({found}); export it again")]
    NotOnnx {
        /// Words of the library.
        found: String,
    },
    /// The network was exported with another set of operators.
    #[error("operator set {found}; export the network with operator set {wanted}")]
    OperatorSet {
        /// Version in the file.
        found: String,
        /// The version that is read.
        wanted: i64,
    },
    /// The network has an operator that is not run.
    #[error("operator {operator} at node '{node}' is not run; networks may use {allowed}")]
    Operator {
        /// Name of the operator, with its domain where that is not ONNX's own.
        operator: String,
        /// Name of the node.
        node: String,
        /// Names of all operators that are run.
        allowed: String,
    },
    /// A part that is not run, such as subgraphs and functions.
    #[error("it has {part}, which this program does not run; export the network without it")]
    Part {
        /// The part.
        part: &'static str,
    },
    /// A node that is not run, or that does not fit what it takes.
    #[error("{operator} at node '{node}' is not run: {found}; docs/models.md says what is run, export the network so")]
    Node {
        /// Name of the operator.
        operator: String,
        /// Name of the node.
        node: String,
        /// Fault, with the values.
        found: String,
    },
    /// A network beyond the bounds.
    #[error(
        "it has more than {most} {what}, the most that is run; docs/models.md lists the bounds, use a smaller network"
    )]
    Bound {
        /// Noun of what is too many.
        what: &'static str,
        /// The bound.
        most: u64,
    },
    /// Weights in another file.
    #[error("weights '{tensor}' lie in another file; export the network with its weights inside (external_data=False)")]
    ExternalData {
        /// Name of the tensor.
        tensor: String,
    },
    /// Inputs or outputs are not those of `model.json`.
    #[error("{what} are {found}; model.json says {stated}")]
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
    /// The library could not make a program of the network.
    #[error("the network cannot be run ({found}); export it again")]
    Network {
        /// Words of the library.
        found: String,
    },
    /// `golden.npz` is not what the format says.
    #[error("{found}; it holds the network's inputs and outputs by name, float32, as numpy.savez writes them")]
    Golden {
        /// Fault.
        found: String,
    },
}

/// Remedy for a file of a model that cannot be read.
fn io_remedy(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => {
            ": is it a model's folder, with model.json, model.onnx, golden.npz and card.md?".to_owned()
        }
        _ => format!(" ({error}); {}", remedy::for_reading(error)),
    }
}

/// Why a network gives no prediction.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PredictError {
    /// The network needs an input that was not given.
    #[error("the network needs the input `{0}`; give it, or use a model without it")]
    MissingInput(InputName),
    /// A grid of another resolution.
    #[error("the input `{input}` has {found} cells along each axis, the network {wanted}")]
    Resolution {
        /// The input.
        input: InputName,
        /// Cells along each axis of the input.
        found: usize,
        /// Cells along each axis of the network.
        wanted: u32,
    },
    /// An input holds a number that is none.
    #[error("the input `{0}` has a value that is NaN or infinite")]
    NotFinite(InputName),
    /// The network gave something that is no probability.
    #[error("the network's output `{output}` has the value {value}, which is no probability: the model is damaged")]
    NoProbability {
        /// The output.
        output: &'static str,
        /// The first value that is none, as text.
        value: String,
    },
    /// The library failed.
    #[error("the network could not be run: {0}")]
    Library(String),
}
