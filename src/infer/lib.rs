//! Completion networks on a CPU: opens, checks and runs a model folder without Python and without a shared library.
//!
//! A model is a folder with `model.json`, `model.onnx`, `golden.npz` and `card.md`, as `docs/models.md` describes. Everything is
//! checked before it runs: digests, the network's inputs and outputs, its operators. The outputs of a network are of class
//! `inferred`: the same bits for the tuple of model, version of this program and level of the processor, with any number of
//! threads.
//!
//! ```no_run
//! use graspmill_infer::{CompletionModel, Inputs};
//! use surface::CubeField;
//!
//! let model = CompletionModel::open("models/standard".as_ref())?;
//! let partial = CubeField::filled(40, 0.0);
//! let prediction = model.predict(&Inputs { partial: Some(&partial), ..Inputs::default() })?;
//! assert_eq!(prediction.occupancy.side(), 40);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bundled;
mod error;
mod folder;
mod golden;
mod graph;
mod model;
mod npz;
mod onnx;
mod sample;
mod silence;
#[cfg(test)]
mod tests;

pub use error::{ModelError, ModelProblem, PredictError};
pub use folder::{DataSource, ModelFacts, PlacementRule, Thresholds};
pub use golden::{GOLDEN_TOLERANCE, GoldenCheck};
pub use model::CompletionModel;
pub use sample::{InputName, Inputs, Prediction};
