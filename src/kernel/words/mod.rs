//! The project's shared vocabulary: one type per concept, used by every room from kernels to reports.

mod class;
mod grasp;
mod ranges;
mod split;

pub use class::NumberClass;
pub use grasp::{GraspTypeCounts, GraspVerdict, STRETCHES, TYPE_BINS, TYPE_DIGITS, type_digits};
pub use ranges::number_ranges;
pub use split::{InvalidSplits, ObjectSplit, Split, SplitTable};
