//! Splits: which samples train, which choose hyper-parameters, which test.

use serde::{Deserialize, Serialize};

use crate::ids::{ObjectId, SampleId};

/// Part of a dataset that a sample belongs to.
///
/// An object as a whole belongs to `Training`, `Validation` or `Test`; in `Holdout` are single samples of training objects.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// Samples of training objects but the held-out ones.
    Training,
    /// Held-out samples of training objects: views or runs of a known object.
    Holdout,
    /// All samples of the validation objects.
    Validation,
    /// All samples of the test objects.
    Test,
}

impl Split {
    /// Every split.
    pub const ALL: [Self; 4] = [Self::Training, Self::Holdout, Self::Validation, Self::Test];

    /// Splits that a whole object can belong to.
    pub const OF_OBJECTS: [Self; 3] = [Self::Training, Self::Validation, Self::Test];

    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Training => "training",
            Self::Holdout => "holdout",
            Self::Validation => "validation",
            Self::Test => "test",
        }
    }

    /// The split of a name; `None` for any other text.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|split| split.name() == name)
    }
}

/// Table of the splits of a dataset: one row per object.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SplitTable {
    /// Objects per nested training subset, smallest first.
    pub training_subsets: Vec<u32>,
    /// One row per object, sorted by its id.
    pub objects: Vec<ObjectSplit>,
}

/// Split of one object's samples.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectSplit {
    /// The object.
    pub object: ObjectId,
    /// Split of the whole object: one of [`Split::OF_OBJECTS`].
    pub split: Split,
    /// Held-out items of a training object, ascending.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub holdout_items: Vec<u32>,
    /// Smallest nested subset that holds a training object, an index into `training_subsets`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subset: Option<u32>,
}

/// Reasons why a table is no table of splits.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidSplits {
    /// An object is listed in two rows.
    #[error("object {0} is listed in two rows")]
    Twice(ObjectId),
    /// A whole object is called held out.
    #[error("object {0} cannot be held out as a whole")]
    WholeHoldout(ObjectId),
    /// A row names a subset that the table does not have.
    #[error("object {object} is in subset {subset} of {subsets}")]
    NoSubset {
        /// The object.
        object: ObjectId,
        /// Subset that its row names.
        subset: u32,
        /// Number of subsets.
        subsets: usize,
    },
}

impl SplitTable {
    /// Sorts rows and items, and checks the rules that the type cannot express.
    ///
    /// # Errors
    /// When a row is doubled, or its split or subset is impossible.
    pub fn checked(mut self) -> Result<Self, InvalidSplits> {
        self.objects.sort_by_key(|row| row.object);
        for row in &mut self.objects {
            row.holdout_items.sort_unstable();
        }
        if let Some(pair) = self.objects.windows(2).find(|pair| pair[0].object == pair[1].object) {
            return Err(InvalidSplits::Twice(pair[0].object));
        }
        let subsets = self.training_subsets.len();
        for &ObjectSplit { object, split, subset, .. } in &self.objects {
            if split == Split::Holdout {
                return Err(InvalidSplits::WholeHoldout(object));
            }
            if let Some(subset) = subset.filter(|subset| *subset as usize >= subsets) {
                return Err(InvalidSplits::NoSubset { object, subset, subsets });
            }
        }
        Ok(self)
    }

    /// The row of an object.
    pub fn object(&self, object: &ObjectId) -> Option<&ObjectSplit> {
        let index = self.objects.binary_search_by(|row| row.object.cmp(object)).ok()?;
        self.objects.get(index)
    }

    /// The split of a sample; `None` when the table does not know its object.
    pub fn split_of(&self, sample: &SampleId) -> Option<Split> {
        Some(self.object(&sample.subject)?.split_of(sample.item.0))
    }
}

impl ObjectSplit {
    /// The split of one item of the object.
    pub fn split_of(&self, item: u32) -> Split {
        let held_out = self.split == Split::Training && self.holdout_items.binary_search(&item).is_ok();
        if held_out { Split::Holdout } else { self.split }
    }
}
