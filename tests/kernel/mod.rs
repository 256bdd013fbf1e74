//! Kernels against truth that the library did not compute: meshes, solids, views, depth, sensors, fields and contacts.

mod clean;
mod contacts;
mod defects;
mod depths;
mod field;
mod hostile;
mod meshes;
mod polygons;
mod seams;
mod sensors;
mod solids;
mod symmetries;
mod twins;
mod views;
mod weights;
