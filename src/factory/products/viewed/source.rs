//! The section of a job file that names a dataset of views.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{found::FoundViews, reader::read_views};
use crate::products::input::InputSection;
use form::Checker;

/// The section that names the dataset.
pub const VIEWS: InputSection = InputSection {
    name: "views",
    make: "make one first, and name its folder: `graspmill run jobs/views-quick.toml --out datasets/views-quick`",
};

/// Source of the views.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ViewsSourceSpec {
    /// The folder of a finished dataset of views; relative to the job file. Its meshes are those of its `shapes.mcap`.
    #[schemars(required, extend("examples" = ["../datasets/ycb-views"]))]
    pub dataset: Option<PathBuf>,
    /// The digest of its views (64 hexadecimal digits, `exact` in its manifest); a resolved job pins it.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub root: Option<String>,
}

/// The views of a dataset, compared with the root that the job pins; `None` when something is wrong, which is reported.
pub fn found_views(checker: &mut Checker, spec: &ViewsSourceSpec, dataset: &Path) -> Option<FoundViews> {
    let found = VIEWS.found(checker, read_views(dataset))?;
    VIEWS.has_root(checker, spec.root.as_deref(), found.root, dataset).then_some(found)
}
