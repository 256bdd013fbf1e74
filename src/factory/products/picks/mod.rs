//! Picks: grasps of the bodies of settled scenes, a stage behind scenes, and behind grasps where stored ones are used.
//!
//! [`PickWorker`] is the producer of one thread. It either takes stored grasps of a body's object, rotates those of a gripper about its
//! closing line and closes the hand on the object alone (`transferred`), or samples grasps on the body in its scene (`sampled`). The hand
//! is followed through the scene ([`robot::grasp::HandPassage`]), all of class `exact`. Some of the free grasps are then tried in MuJoCo
//! among the neighbours (`trials`), of class `physics`.

mod check;
mod followed;
mod grasps_reader;
mod keys;
mod loaded;
mod rotated;
mod row;
mod sampled;
mod scene;
mod settings;
pub mod spec;
mod transferred;
mod trials;
mod work;
mod worker;

pub use grasps_reader::{InvalidPickGrasps, read_pick_grasps};
pub use rotated::rotated_about_line;
pub use row::FACTORY;
pub use settings::{PickGrasps, PickJob, PickSettings, PickSource, ScenePoses, StoredGrasp};
pub use worker::PickWorker;
