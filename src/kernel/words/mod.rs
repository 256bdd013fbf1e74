//! The project's shared vocabulary: one type per concept, used by every room from kernels to reports.

mod class;
mod counts;
mod equilibrium;
mod grasp;
mod length;
mod material;
mod ranges;
mod remark;
mod shown;
mod split;
mod way;

pub use class::NumberClass;
pub use counts::{counted, size_in_words};
pub use equilibrium::{MAX_DEPTHS, MAX_DRIFT};
pub use grasp::{GraspTypeCounts, GraspVerdict, PointScheme, STRETCHES, TYPE_BINS, TYPE_DIGITS, type_digits};
pub use length::LengthUnit;
pub use material::{MassSource, Material};
pub use ranges::number_ranges;
pub use remark::{MAY_OVERLAP, SEPARATE_BODIES, is_note};
pub use shown::{Show, Shown, capped, shown_json, shown_lines};
pub use split::{InvalidSplits, ObjectSplit, Split, SplitTable};
pub use way::{BothWays, FreeWays, PathStage};
