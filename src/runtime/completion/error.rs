//! Reasons why an object is not completed.

use infer::PredictError;
use measure::Baseline;
use perception::{InputError, Refusal};

/// Reason why an object has no completed mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CompletionError {
    /// The picture does not show it well enough.
    #[error("{0}")]
    Refused(#[from] Refusal),
    /// Too few points remain without outliers.
    #[error("{0}")]
    Input(#[from] InputError),
    /// Too few cells of the grid contain an observed point.
    #[error("its visible part fills {cells} of the grid's cells, but {needed} are required: move the camera closer")]
    FewCells {
        /// Cells with an observed point.
        cells: u32,
        /// Required number of cells.
        needed: u32,
    },
    /// Contacts were given to a model that has no input for them.
    #[error("the model has no input for contacts: use one that was trained with touch, or leave out --touch")]
    TakesNoTouch,
    /// All contacts are outside the object's grid.
    #[error("none of the contacts ({count}) is in the object's grid: give them in metres, in the camera's frame")]
    NoContactInside {
        /// Number of given contacts.
        count: usize,
    },
    /// The baseline needs the plane below the object.
    #[error("{0} needs the table: pass --plane, or leave out --no-plane")]
    NoTable(Baseline),
    /// The network or the baseline returned no occupied cell.
    #[error("nothing was completed: no occupied cell was found")]
    Nothing,
    /// The network could not be run.
    #[error("{0}")]
    Predict(#[from] PredictError),
}
