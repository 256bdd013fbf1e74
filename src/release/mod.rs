//! What people look at: pictures of samples, charts, `report.html`, and the same facts as text or JSON.
//!
//! Everything here is drawn in plain Rust without a display, and two reports of one dataset have the same bytes.
//! [`publish`] makes a release out of a dataset: the same folder with card, datasheet, licences, metadata, provenance and
//! digests; [`check_release`] checks one.

mod calibration;
mod card;
mod chart;
mod check;
mod facts;
mod gallery;
mod grasp_report;
mod grasps;
mod notes;
mod page;
mod patch_report;
mod patches;
pub mod picture;
mod publish;
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
pub use check::{ReleaseCheck, check_release};
pub use facts::{Inspection, ObjectFacts, Setup, SplitFacts, inspect};
pub use grasps::{GraspedObject, GraspsInspection, TableFacts, TypeFacts, grasp_counts_in_words, inspect_grasps};
pub use notes::{RunNotes, Speed};
pub use patches::{ChosenType, LookedAtObject, PatchesInspection, inspect_patches, types_in_words};
pub use publish::{About, Author, LicenceStatement, LicenceTerms, Published, ReleaseError, ReleaseOptions, publish};
pub use reachability::{
    AxisFacts, CoveringFacts, FieldFacts, ReachabilityFacts, RobotFacts, inspect_reachability, pose_counts_in_words,
};
pub use report::{ReportSummary, report};
pub use tally::Spread;
pub use touch_facts::{HandFacts, TouchFacts, TouchKind};
pub use trials::TrialsInspection;
