//! A dataset of views as every job that is made of one reads it: which scenes and views it has, the meshes beside
//! them, and the images, which are drawn again where their exact depth is asked for.

mod found;
mod meshes;
mod reader;
mod redrawn;
mod source;

pub use found::{FoundViews, ViewedScene};
pub use meshes::ViewMeshes;
pub use reader::{InvalidViews, changed_view, open_views};
pub use redrawn::redraw;
pub use source::{VIEWS, ViewsSourceSpec, found_views};
