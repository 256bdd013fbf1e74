//! Scenes: bodies that fall, are placed, and come to rest on true meshes.
//!
//! A [`SettleWorker`] is the state that one thread needs. Contacts between bodies, and between bodies and their
//! container, are those of [`kernel::contact`], found at their boxes by MuJoCo. Stepping is of class `physics`. A scene
//! is settled, then reset to the stored poses and stepped again from rest: if it moves then, it was not in equilibrium.

mod check;
mod model;
mod outcome;
mod release;
mod run;
mod settings;
#[cfg(test)]
mod tests;
mod walls;
mod worker;

pub use outcome::{Fault, SceneTouch, SettleOutcome, SettledBody};
pub use settings::{Placement, SettleSettings};
pub use walls::Walls;
pub use worker::SettleWorker;
