//! Grasps: how a hand can hold an object (thesis ch. 4 and 7.3).
//!
//! [`GraspWorker`] is one thread's workshop: it loads an object and makes its runs of annealing one by one, each from a seed
//! of its own ([`seeds`]). What annealing found ([`crate::grasp`]) becomes a record in `recorded`; where the
//! job asks for physics, what was kept is tried in MuJoCo (`trials`), and no grasp depends on what came of it.

mod hand;
mod recorded;
mod seeds;
mod shapes;
#[cfg(feature = "sim")]
mod trials;
mod worker;

pub use hand::GraspHand;
pub use seeds::seeds;
pub use shapes::{hand_shape, object_shape, trial_hand};
pub use worker::GraspWorker;
