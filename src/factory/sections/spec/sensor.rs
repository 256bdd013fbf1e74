//! The keys of `sensor`, which every job that measures depth has.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The sensor model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorSpec {
    /// `none` for a perfect sensor, or the name of a sensor whose constants are known.
    #[schemars(extend("examples" = ["kinect-v1"]))]
    pub profile: String,
    /// Constants that differ from the profile's.
    pub constants: BTreeMap<String, f64>,
}
