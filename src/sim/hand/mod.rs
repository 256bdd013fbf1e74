//! Hands: their description, the model of a hand with an object, and a worker that moves, closes and feels.

mod clearance;
pub(crate) mod closing;
pub(crate) mod effort;
pub(crate) mod feeling;
pub(crate) mod link_touch;
pub(crate) mod model;
mod moved;
mod placed_table;
mod pressing;
pub(crate) mod sim;
mod still;
mod touches;
