//! Sections as written: the one source of their keys, from which the decoder, the JSON Schema and the reference in the
//! documentation are all derived.
//!
//! Keys with a default are plain values here, since the profile's file fills them in before a job is read; an `Option`
//! is a key without a default. `x-unit` is the unit of a number.

mod built_in;
mod hand;
mod objects;
mod sensor;
mod split;

pub use built_in::{BuiltInSpec, HalfShapesSpec, OnlyHalfShapes};
pub use hand::HandSpec;
pub use objects::{BodiesSpec, LimitsSpec, MAX_WALL, MaterialSpec, MeshRow, ObjectsSpec, UnitSpec};
pub use sensor::SensorSpec;
pub use split::{ObjectChoiceSpec, SplitSpec, SubsetSpec};
