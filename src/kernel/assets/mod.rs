//! Object meshes: find, read, make, check, repair, hash.
//!
//! [`prepare`] is the only entry: a [`MeshSource`] becomes a [`PreparedMesh`] or a [`MeshRefusal`] with file, location and
//! remedy. [`read_triangles`] reads a part of a robot as its file has it. [`list_folder`] finds files, [`built_in_names`] names
//! shapes that need none.

mod bodies;
mod bounds;
mod built_in;
mod check;
mod digest;
mod edges;
mod folder;
mod holes;
mod mend;
mod prepare;
mod read;
mod refuse;
mod seams;
mod shells;
mod table;
mod thin;
mod undecided;
mod weld;

pub use bodies::LooseParts;
pub use built_in::{DEFAULT_BUILT_INS, HalfShape, NoHalfShape, built_in_names, built_in_source};
pub use check::{MeshCheckCounts, MeshCheckReport, MeshCheckRow, UnionVolume, check_report};
pub use digest::object as object_id;
pub use folder::{DuplicateOf, FolderError, duplicates, list_folder};
pub use prepare::{effort_words, is_note, parts, prepare};
pub use read::read_triangles;
use refuse::Refuse;
pub use thin::refuse_without_solid;

pub use table::{
    AssetRecord, InsideMethod, MeshOrigin, MeshRefusal, MeshSource, PreparedMesh, Repair, ScaleRule, SizeRule, Winding,
};
