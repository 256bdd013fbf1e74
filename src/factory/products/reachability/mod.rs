//! Labels of end-effector poses: the poses that a robot reaches without a collision (thesis ch. 7).
//!
//! [`ReachabilityWorker`] is the producer of one thread: it takes one position after the other and labels all its
//! orientations. [`PoseLabeller`], which all threads share, decides each label.

mod check;
mod collisions;
mod contacts;
mod finite;
mod keys;
mod labeller;
mod robot_faults;
mod row;
mod search;
mod settings;
pub mod spec;
mod sweep;
mod work;
mod worker;

pub use labeller::{LabelledPosition, PoseLabeller, Scratch};
pub use row::FACTORY;
pub use settings::{CollisionTest, IkSolver, ReachabilityJob, Robot, WORLD};
pub use worker::ReachabilityWorker;
