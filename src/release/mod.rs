//! What people look at: pictures of samples, charts, `report.html`, and the same facts as text or JSON.
//!
//! Everything here is drawn in plain Rust without a display, and two reports of one dataset have the same bytes.
//! Releases (checksums, cards, provenance) join this room later.

mod calibration;
mod card;
mod chart;
mod facts;
mod gallery;
mod grasp_report;
mod grasps;
mod notes;
mod page;
mod patch_report;
mod patches;
pub mod picture;
mod reach_report;
mod reachability;
mod replayed;
mod report;
mod sections;
mod survey;
mod tally;
mod text;
mod touch_facts;
mod trials;

pub use calibration::{Calibration, ReliabilityBin};
pub use facts::{Inspection, ObjectFacts, Setup, SplitFacts, inspect};
pub use grasps::{GraspedObject, GraspsInspection, TableFacts, TypeFacts, grasp_counts_in_words, inspect_grasps};
pub use notes::{RunNotes, Speed};
pub use patches::{ChosenType, LookedAtObject, PatchesInspection, inspect_patches, types_in_words};
pub use reachability::{
    AxisFacts, CoveringFacts, FieldFacts, ReachabilityFacts, RobotFacts, inspect_reachability, pose_counts_in_words,
};
pub use report::{ReportSummary, report};
pub use tally::Spread;
pub use touch_facts::{HandFacts, TouchFacts, TouchKind};
pub use trials::TrialsInspection;
