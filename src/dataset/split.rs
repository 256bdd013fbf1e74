//! Who trains and who tests, as a dataset stores it.

use serde::{Deserialize, Serialize};

use super::DatasetError;
use crate::ids::{ObjectId, SampleId};

/// Which part of a dataset a sample belongs to.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// Training views of training models.
    Training,
    /// Views of training models that were held out.
    HoldoutViews,
    /// All views of the validation models.
    ValidationModels,
    /// All views of the test models.
    TestModels,
}

impl Split {
    /// Every split.
    pub const ALL: [Self; 4] = [Self::Training, Self::HoldoutViews, Self::ValidationModels, Self::TestModels];

    /// The name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Training => "training",
            Self::HoldoutViews => "holdout_views",
            Self::ValidationModels => "validation_models",
            Self::TestModels => "test_models",
        }
    }

    /// The split of a name; `None` for any other text.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|split| split.name() == name)
    }
}

/// `splits.json`: who trains and who tests.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SplitTable {
    /// Models in each nested training subset, smallest first.
    pub training_subsets: Vec<u32>,
    /// One row an object, sorted by its id.
    pub objects: Vec<ObjectSplit>,
}

/// Where an object's samples go.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectSplit {
    /// The object.
    pub object: ObjectId,
    /// Its side: training, validation or test models (never [`Split::HoldoutViews`]).
    pub models: Split,
    /// Of a training model: the views that are held out, sorted.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub holdout_views: Vec<u32>,
    /// Of a training model: the smallest nested subset that holds it, a place in `training_subsets`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subset: Option<u32>,
}

impl SplitTable {
    /// The row of an object.
    pub fn object(&self, object: &ObjectId) -> Option<&ObjectSplit> {
        let place = self.objects.binary_search_by(|row| row.object.cmp(object)).ok()?;
        self.objects.get(place)
    }

    /// The split of a sample; `None` when the table does not know its object.
    pub fn of(&self, sample: &SampleId) -> Option<Split> {
        let row = self.object(&sample.subject)?;
        let held_out = row.models == Split::Training && row.holdout_views.binary_search(&sample.view.0).is_ok();
        Some(if held_out { Split::HoldoutViews } else { row.models })
    }

    /// Sorts rows and views, and checks what the type can't say.
    pub(super) fn checked(mut self, path: &std::path::Path) -> Result<Self, DatasetError> {
        self.objects.sort_by_key(|row| row.object);
        for row in &mut self.objects {
            row.holdout_views.sort_unstable();
        }
        let subsets = self.training_subsets.len();
        let invalid = |problem: String| {
            Err(DatasetError::Invalid {
                path: path.to_owned(),
                problem,
                remedy: "`run` the job again to write it anew",
            })
        };
        if let Some(pair) = self.objects.windows(2).find(|pair| pair[0].object == pair[1].object) {
            return invalid(format!("object {} stands in two rows", pair[0].object));
        }
        for row in &self.objects {
            if row.models == Split::HoldoutViews {
                return invalid(format!("object {} can't be a holdout view", row.object));
            }
            if row.subset.is_some_and(|subset| subset as usize >= subsets) {
                return invalid(format!("object {} is in subset {:?} of {subsets}", row.object, row.subset));
            }
        }
        Ok(self)
    }
}
