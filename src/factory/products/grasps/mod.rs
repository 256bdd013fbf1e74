//! Grasps: how a hand can hold an object (thesis ch. 4 and 7.3).
//!
//! [`GraspWorker`] is the producer of one thread: it loads an object and makes its runs one by one, each from a
//! separate seed ([`seeds`]). A state that the search found ([`robot::grasp`]) becomes a record in `recorded`; with
//! `[physics]` the kept grasps are tried in MuJoCo (`trials`, or `ladders` for graded labels), and no grasp depends on the outcome.

mod check;
mod hand;
mod keys;
mod ladders;
mod recorded;
mod recorded_trial;
mod row;
mod series;
mod settings;
mod shapes;
pub mod spec;
mod trials;
mod work;
mod worker;

pub use hand::GraspHand;
pub use robot::grasp::seeds;
pub use row::FACTORY;
pub use settings::{GraspJob, GraspSettings, Labels, Physics};
pub use shapes::{hand_shape, object_shape, trial_hand};
pub use worker::GraspWorker;
