//! Labels of end-effector poses: what a robot reaches without a collision (thesis ch. 7).
//!
//! [`ReachabilityWorker`] is one thread's workshop: it takes one position after the other and labels all its
//! orientations. Who decides a label is [`PoseLabeller`], which all threads share.

mod collisions;
mod contacts;
mod finite;
mod labeller;
mod search;
mod sweep;
mod worker;

pub use labeller::{LabelledPosition, PoseLabeller, Scratch};
pub use worker::ReachabilityWorker;
