//! Shapes from pictures: meshes of completed grids against trimesh, SciPy and MuJoCo, and real Kinect frames against labels.

mod camera_files;
mod complete;
mod evaluate;
mod evil_networks;
mod kinect;
mod lens;
mod meshes;
mod network;
mod onnx_file;
mod remedies;
mod seen_space;
mod segment;
mod table;
