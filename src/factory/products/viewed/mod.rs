//! A dataset of views as every job that is made of one reads it: which scenes and views it has, the images, and the meshes beside
//! them.

mod found;
mod meshes;
mod reader;
mod source;

pub use found::{FoundViews, ViewedScene};
pub use meshes::ViewMeshes;
pub use reader::{InvalidViews, open_views, read_views};
pub use source::{VIEWS, ViewsSourceSpec};
