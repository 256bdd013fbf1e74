//! The section of a job file that names a dataset of scenes.

use std::path::{Path as FilePath, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{found::FoundScenes, reader::read_scenes};
use crate::products::input::InputSection;
use form::Checker;

/// The section that names the dataset.
pub const SCENES: InputSection = InputSection {
    name: "scenes",
    make: "make one first, and name its folder: `graspmill run jobs/scenes-quick.toml --out datasets/scenes-quick`",
};

/// Source of the scenes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScenesSourceSpec {
    /// The folder of a finished dataset of scenes; relative to the job file. Its meshes are found by its own job.
    #[schemars(required, extend("examples" = ["../datasets/ycb-scenes"]))]
    pub dataset: Option<PathBuf>,
    /// The digest of its scenes (64 hexadecimal digits, `physics` in its manifest); a resolved job pins it.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub root: Option<String>,
}

/// The scenes, compared with the root that the job pins; `None` when something is wrong, which is reported.
pub fn found_scenes(checker: &mut Checker, spec: &ScenesSourceSpec, dataset: &FilePath) -> Option<FoundScenes> {
    let found = SCENES.found(checker, read_scenes(dataset))?;
    SCENES.has_root(checker, spec.root.as_deref(), found.root, dataset).then_some(found)
}
