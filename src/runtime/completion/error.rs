//! Reasons why an object is not completed.

use infer::PredictError;
use perception::{InputError, Refusal};

/// Why an object has no completed mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CompletionError {
    /// The picture does not show it well enough.
    #[error("{0}")]
    Refused(#[from] Refusal),
    /// Too little of it is left without outliers.
    #[error("{0}")]
    Input(#[from] InputError),
    /// Only a few cells of its grid hold a seen point.
    #[error("its visible part fills {cells} of the grid's cells, {needed} are needed: bring the camera nearer")]
    FewCells {
        /// Cells with a seen point.
        cells: u32,
        /// Cells that are needed.
        needed: u32,
    },
    /// Contacts were given to a model that has no input for them.
    #[error("the model has no input for contacts: take one that was trained with touch, or leave out --touch")]
    TakesNoTouch,
    /// All contacts lie outside of the object's grid.
    #[error("none of the contacts ({count}) lies in the object's grid: they are in metres, in the camera's frame")]
    NoContactInside {
        /// Contacts that were given.
        count: usize,
    },
    /// The network or the baseline gave nothing that could be meshed.
    #[error("nothing was completed: no occupied cell was found")]
    Nothing,
    /// The network could not be run.
    #[error("{0}")]
    Predict(#[from] PredictError),
}
