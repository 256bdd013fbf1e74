//! Picks: grasps of the bodies of settled scenes, a stage behind scenes and grasps, about a dataset of each.
//!
//! [`PickWorker`] is the producer of one thread: it takes stored grasps of a body's object, rotates those of a gripper about its closing line,
//! closes the hand on the object alone, and follows it through the scene ([`robot::grasp::HandPassage`]), all of class `exact`. Some of
//! the free grasps are then tried in MuJoCo among the neighbours (`trials`), of class `physics`.

mod check;
mod grasps_reader;
mod keys;
mod loaded;
mod rotated;
mod row;
mod scene;
mod settings;
pub mod spec;
mod trials;
mod work;
mod worker;

pub use grasps_reader::{InvalidPickGrasps, read_pick_grasps};
pub use rotated::rotated_about_line;
pub use row::FACTORY;
pub use settings::{PickGrasps, PickJob, PickSettings, StoredGrasp};
pub use worker::PickWorker;
