//! Depth images of triangle meshes on the CPU, occluders in front of them, and the errors of a real sensor.

mod layers;
mod occluder;
mod raster;
mod raster_kernels;
mod sensor;
mod sensor_apply;
mod sensor_field;
mod sensor_kernels;
mod source;

pub use layers::{LayeredImage, Silhouette};
pub use occluder::{Occluder, OccluderKind, OccluderModel};
pub use raster::Rasteriser;
pub use sensor::{CONSTANTS as SENSOR_CONSTANTS, InvalidConstant, SensorConstant, SensorModel};
pub use sensor_apply::SensorScratch;
pub use source::{DepthError, DepthSource};

pub use crate::geom::RenderMesh;
