//! Occupancy: meshes to solid grids, depth images to partial grids, binvox files.
