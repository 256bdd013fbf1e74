//! The keys of `split`, which every job about objects has.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which objects train, choose checkpoints and test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SplitSpec {
    /// Share of the items of each training object that is held out: of its views, or of its runs.
    #[schemars(range(min = 0, max = 1))]
    pub holdout_items: f64,
    /// Objects that choose checkpoints: a share (0.1), a count (12) or names.
    pub validation_objects: ObjectChoiceSpec,
    /// Objects on which nothing is trained or chosen: a share (0.1), a count (12) or names.
    pub test_objects: ObjectChoiceSpec,
    /// Split whole groups (see `objects.group`) instead of single objects.
    pub by_group: bool,
    /// Objects whose shapes coincide after pose and scale are taken away stay on one side.
    pub keep_twins_together: bool,
    /// Twins on both sides of the split are what this job is about: the dataset's report says so and warns of no leak. Wants
    /// `keep_twins_together = false`. Without it, false. Changes neither data nor split, and no digest depends on it.
    #[schemars(extend("examples" = [true]))]
    pub twins_intended: Option<bool>,
    /// Views of one object with equal rotations stay on one side; where not, those that straddle are counted.
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
    /// By name; `*` and `?` stand for any letters.
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
