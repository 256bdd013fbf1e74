//! Trials of grasps among other objects: a hand comes along its approach, closes on one body of a settled scene, lifts it and
//! keeps it, with the neighbours free to be pushed, toppled and lifted along.
//!
//! The scene stands in MuJoCo's world and the hand slides through it, its base's position and velocity prescribed in each step,
//! so that bodies at rest stay islands of their own for the solver. Where the hand grasps, its base is the world's origin.
//!
//! Bodies touch one another and the container as [scenes settle](super::settle), by their true meshes, and the hand by theirs.
//! Bodies that are [asleep](ClutterSim::new) stand still in the container.

mod glide;
mod model;
mod outcome;
mod worker;

pub use model::{ClutterScene, ClutterSim};
pub use outcome::{ClutterOutcome, ClutterPhase, ClutterVerdict, NeighbourMotion, SceneContact};
pub use worker::{ClutterProtocol, ClutterWorker};
