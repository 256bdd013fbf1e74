//! Colours of grasps by the outcome of trials among the neighbours.

use crate::picture::Colour;
use format::PickState;

/// Colour of a free grasp in pictures and previews.
pub fn state_colour(state: PickState) -> Colour {
    match state {
        PickState::Held => Colour::TOUCHED,
        PickState::Failed => Colour::HELD,
        PickState::Untried => Colour::EXPLORED,
    }
}
