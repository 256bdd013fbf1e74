//! The keys of `split`, which every job about objects has.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Objects for training, for choosing checkpoints and for testing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SplitSpec {
    /// Share of the items of each training object, views or runs, that is held out.
    #[schemars(range(min = 0, max = 1))]
    pub holdout_items: f64,
    /// Objects for choosing checkpoints: a share (0.1), a count (12) or names.
    pub validation_objects: ObjectChoiceSpec,
    /// Objects for testing only: a share (0.1), a count (12) or names.
    pub test_objects: ObjectChoiceSpec,
    /// Splits whole groups (see `objects.group`) instead of single objects.
    pub by_group: bool,
    /// Objects whose shapes coincide after removing pose and scale stay in one split.
    pub keep_twins_together: bool,
    /// Twins in different splits are intended: the dataset's report notes them and does not warn of a leak. Requires
    /// `keep_twins_together = false`. Default: false. Changes neither data nor split, and no digest depends on it.
    #[schemars(extend("examples" = [true]))]
    pub twins_intended: Option<bool>,
    /// Views of one object with equal rotations stay in one split; if false, those in several splits are counted.
    pub keep_equal_views_together: bool,
    /// Nested subsets of the training objects, smallest first: counts (94) or shares (0.5).
    #[schemars(extend("examples" = [[14, 94]]))]
    pub training_subsets: Vec<SubsetSpec>,
}

/// A choice of objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ObjectChoiceSpec {
    /// Exactly this many.
    Count(u32),
    /// About this share; written with a decimal point.
    Share(#[schemars(range(min = 0, max = 1))] f64),
    /// By name; `*` matches any letters, `?` one letter.
    Named(Vec<String>),
}

/// Size of a subset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum SubsetSpec {
    /// Count of objects.
    Count(#[schemars(range(min = 1))] u32),
    /// Share of the training objects; written with a decimal point.
    Share(#[schemars(extend("exclusiveMinimum" = 0), range(max = 1))] f64),
}
