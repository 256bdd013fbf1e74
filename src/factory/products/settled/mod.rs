//! A dataset of settled scenes for the jobs that read one: its scenes and bodies, and the meshes of their objects,
//! which its own job names.

mod found;
mod objects;
mod passage;
mod reader;
mod source;

pub use found::{FoundScenes, SettledScene};
pub use objects::{
    ObjectKeys, add_meshes, by_content, cost_of_meshes, draft_objects, object_keys, rolling_friction, write_meshes,
};
pub use passage::recorded_passage;
pub use reader::{InvalidScenes, read_scenes};
pub use source::{SCENES, ScenesSourceSpec, found_scenes};
