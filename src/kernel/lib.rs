//! Kernels of graspmill, below everything else: vocabulary, ids, geometry, voxels, depth images, contacts.

// Tests compare with what the C library computes.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod cancel;
pub mod contact;
pub mod description;
pub mod files;
pub mod geom;
pub mod ids;
pub mod npy;
pub mod remedy;
pub mod render;
pub mod seed;
#[cfg(test)]
mod test_shapes;
pub mod voxel;
pub mod words;
