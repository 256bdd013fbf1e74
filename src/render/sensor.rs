//! The sensor model: from a perfect depth image to what a structured-light or stereo camera returns.

/// Constants of a depth sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorModel {}
