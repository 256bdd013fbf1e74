//! Built-in shapes of a job.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Choice of built-in shapes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum BuiltInSpec {
    /// The first shapes of the series, in this number, one family after another.
    Count(#[schemars(range(min = 1, max = 100_000))] u32),
    /// By name: `FAMILY-NN`, `FAMILY-NN@16k` for at least 16,000 triangles, `half-FRONT-BACK` (100 mm) or
    /// `half-FRONT-BACK-80mm`; with `*` and `?`, those of the default set and of the nine half-shapes of 100 mm.
    Names(#[schemars(length(min = 1))] Vec<String>),
    /// The nine conjoined half-shapes (sphere, cube or diamond in front, one of them behind), in several sizes.
    HalfShapes(HalfShapesSpec),
}

/// Half-shapes by size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HalfShapesSpec {
    /// Sizes: diameter of a sphere, side of a cube, diagonal of a diamond. Each gives `half-FRONT-BACK-80mm` and so on.
    #[schemars(length(min = 1), inner(range(min = 20, max = 300)), extend("examples" = [[60, 80, 100]]))]
    pub half_shapes_mm: Vec<u32>,
    /// Choice of half-shapes. Default: all nine. `ambiguous`: the five whose back a head-on camera cannot distinguish
    /// from another, which is any behind a cube, and a sphere or a diamond behind a sphere.
    #[schemars(extend("examples" = ["ambiguous"]))]
    pub only: Option<OnlyHalfShapes>,
}

/// Choice of half-shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnlyHalfShapes {
    /// Shapes whose back a head-on camera cannot distinguish from another.
    Ambiguous,
}
