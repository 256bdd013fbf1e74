//! Trials of grasps among other objects: a hand approaches, closes on one body of a settled scene, lifts it and keeps
//! it, while the neighbours can be pushed, toppled and lifted along.
//!
//! The scene is fixed in MuJoCo's world and the hand slides through it, with the position and velocity of its base
//! prescribed in each step, so that bodies at rest stay separate islands for the solver. At the grasp, the hand's base
//! is the world's origin.
//!
//! Bodies touch one another and the container as [scenes settle](super::settle), by their true meshes, and the hand by
//! theirs. Bodies that are [asleep](ClutterSim::new) are fixed in the container.

mod glide;
mod model;
mod outcome;
mod worker;

pub use model::{ClutterScene, ClutterSim};
pub use outcome::{ClutterOutcome, ClutterPhase, ClutterTouch, ClutterVerdict, NeighbourMotion};
pub use worker::{ClutterProtocol, ClutterWorker};
