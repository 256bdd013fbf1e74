//! Object meshes: find, read, make, check, repair, hash.

mod table;

pub use table::{
    AssetRecord, InsideMethod, MeshOrigin, MeshRefusal, MeshSource, PreparedMesh, Repair, ScaleRule, SizeRule, Winding,
};
