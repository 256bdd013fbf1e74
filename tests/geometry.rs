//! Kernels, completion datasets, and shapes from pictures: meshes, solids, depth, touch, segmentation and completion.

mod completion;
mod kernel;
mod shapes;
mod support;
