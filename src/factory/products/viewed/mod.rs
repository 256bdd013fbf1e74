//! A dataset of views for the jobs that read one: its scenes and views, their meshes, and the images, which are
//! rendered again where their exact depth is required.

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
