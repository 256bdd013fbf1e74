//! Output for people: facts and reports of datasets, pictures of samples, releases.
//!
//! Everything is drawn in plain Rust without a display, and two reports of one dataset have the same bytes. [`make_release`]
//! turns a dataset into a release: the same folder with card, datasheet, licences, metadata, provenance and digests;
//! [`check_release`] checks one. All texts and pages of a product are in its row of [`PRODUCTS`](products::PRODUCTS).

mod asset;
mod chart;
mod check;
mod counts;
mod escape;
mod evaluation;
pub mod export;
mod grasp_types;
mod headline;
mod inspect;
mod inspection;
mod markup;
mod notes;
mod numbers;
mod page;
mod panels;
mod pick_colours;
pub mod picture;
pub mod preview;
mod product;
pub mod products;
mod release;
mod report;
mod scene_objects;
mod scene_samples;
mod set;
mod tally;
#[cfg(test)]
mod template_tests;
mod templates;
mod touch;
mod touch_pictures;

pub use check::{ReleaseCheck, check_release};
pub use counts::{CountedParts, counted_parts, counts_in_words, warnings};
pub use evaluation::{EvaluatedMethod, EvaluatedSample, Evaluation};
pub use grasp_types::TypeFacts;
pub use inspect::inspect;
pub use inspection::{Inspection, InspectionHeader, dataset_name, has_perfect_sensor, remark_in_words};
pub use notes::{RunNotes, Speed};
pub use panels::draw_panels;
pub use product::{ProductPages, WritePreview};
pub use products::{
    completion::{CompletionInspection, CompletionObjectFacts, Setup, SplitFacts, inspect_completion},
    grasps::{
        Calibration, GraspObjectFacts, GraspsInspection, ReliabilityBin, TableFacts, TrialsInspection,
        VariantsInspection, inspect_grasps,
    },
    pages_of,
    patches::{ChosenType, PatchObjectFacts, PatchesInspection, inspect_patches},
    reachability::{
        AxisFacts, CoveringFacts, FieldFacts, ReachabilityFacts, ReachabilityRobotFacts, inspect_reachability,
    },
};
pub use release::{
    About, Author, LicenceStatement, LicenceTerms, Published, ReleaseError, ReleaseOptions, make_release,
};
pub use report::{ReportSummary, report};
pub use scene_objects::ScenesObject;
pub use set::{Cover, SetReportSummary, report_set};
pub use tally::Spread;
pub use touch::{HandFacts, TouchFacts, TouchKind};

use std::path::PathBuf;

use crate::preview::PreviewError;
use format::dataset::DatasetReader;
use kernel::{files::Folder, render::DepthSource};

/// Writes `preview.mcap` into the folder of a finished dataset: a few samples, or a map, in the well-known schemas that
/// Foxglove and Rerun draw. Depth images that the dataset does not store are taken from the source, where there is one.
///
/// # Errors
/// When the dataset is not finished or damaged, the file cannot be written, or the source fails.
pub fn write_preview(folder: &Folder, depth: Option<&mut dyn DepthSource>) -> Result<PathBuf, PreviewError> {
    let reader = DatasetReader::open(folder)?;
    (pages_of(reader.manifest().product).write_preview)(&reader, depth)
}
