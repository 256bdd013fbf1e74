//! Labels of end-effector poses: what a robot reaches without a collision (thesis ch. 7).

mod labeller;
mod sweep;

pub use labeller::{LabelledPosition, PoseLabeller, Scratch};
