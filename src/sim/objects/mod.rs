//! Things that hands and bodies touch in a model: meshes, free bodies, tables, things that stay fixed, and the bodies and
//! containers of scenes.

pub(crate) mod added_geom;
pub(crate) mod collider;
pub(crate) mod container;
pub(crate) mod free_object;
pub(crate) mod mesh;
pub(crate) mod native_mesh;
pub(crate) mod patch;
pub(crate) mod scene_body;
pub(crate) mod table;
pub(crate) mod thing;
pub(crate) mod true_mesh;
