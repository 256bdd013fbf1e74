//! Scenes: bodies dropped or put down, and settled on their true meshes.
//!
//! [`SceneWorker`] is the producer of one thread: it draws the objects of a scene, lets them settle in a
//! [`SettleWorker`](sim::SettleWorker), and keeps what is an equilibrium.

mod check;
mod draw;
pub mod import;
mod keys;
mod loaded;
mod outcome;
mod overview;
mod packing;
mod placement;
mod room;
mod row;
mod settings;
pub mod spec;
mod vessel;
mod work;
mod worker;

pub use row::FACTORY;
pub use settings::{PileWalls, SceneJob, SceneSettings};
pub use worker::SceneWorker;
