//! Depth images of triangle meshes on the CPU, and what a real sensor makes of them.

mod sensor;

pub use sensor::SensorModel;
