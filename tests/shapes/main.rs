//! Shapes from pictures: meshes of completed grids against trimesh, SciPy and MuJoCo, and real Kinect frames against labels.

mod complete;
mod evaluate;
mod evil_networks;
mod kinect;
mod meshes;
mod network;
mod onnx_file;
mod segment;
#[path = "../support/mod.rs"]
mod support;
mod table;
