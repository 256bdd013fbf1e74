//! Object meshes: find, read, make, check, repair and hash them; objects whose derived parts are made once and shared.
//!
//! [`prepare`] is the only entry to a checked mesh: a [`MeshSource`] becomes a [`PreparedMesh`], or a
//! [`MeshRefusal`] with file, location and remedy. [`read_triangles`] reads a part of a robot unchanged from its
//! file. [`list_folder`] finds files, [`built_in_names`] lists shapes that need none. [`object::PreparedObject`] adds solid, surface, mass and resting
//! poses.

// Tests compare with what the C library computes.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod built_in;
mod check;
mod folder;
pub mod object;
mod prepare;
mod read;
mod refuse;
mod repair;
mod table;

pub use built_in::{DEFAULT_BUILT_INS, HalfShape, NoHalfShape, built_in_names, built_in_source};
pub use check::{MeshCheckCounts, MeshCheckReport, MeshCheckRow, UnionVolume, check_report};
pub use folder::{DuplicateOf, FolderError, duplicates, list_folder};
pub use prepare::{effort_words, object_id, parts, prepare, refuse_without_solid};
pub use read::read_triangles;
use refuse::Refuse;
pub use repair::bodies::LooseParts;

pub use table::{
    AssetRecord, InsideMethod, MeshOrigin, MeshRefusal, MeshSource, PreparedMesh, Repair, ScaleRule, SizeRule, Winding,
};
