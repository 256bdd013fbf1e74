//! What a robot or a trainer links: dataset readers; no simulator, no job, no plan.
//!
//! Builds with `--no-default-features`.

pub use crate::dataset::{DatasetReader, Manifest, Sample, Samples, Selection, Split, SplitTable};
