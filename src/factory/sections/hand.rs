//! Hands that jobs name.

use std::path::{Path as FilePath, PathBuf};

use super::{
    description::pinned_description,
    paths::{relative_to, tidy, with_slashes},
    spec::HandSpec,
};
use form::{Checker, Path};
use kernel::{description::Description, ids::ObjectId, words::Show};
use sim::{HandError, HandModel, RobotError};

/// A hand that a job names.
#[derive(Clone, Debug, PartialEq)]
pub struct JobHand {
    /// Description of the hand, MJCF or URDF; its table is next to it.
    pub file: PathBuf,
    /// Name in the description, for people.
    pub name: String,
    /// Content of description and table, with all files that the description includes, in any folder.
    pub id: ObjectId,
}

impl JobHand {
    /// The hand as keys of a job file: with its file, relative to `folder`, or by content alone.
    pub fn spec(&self, folder: Option<&FilePath>) -> HandSpec {
        let model = folder.map(|folder| with_slashes(&relative_to(&self.file, folder)).into());
        HandSpec { model: model.unwrap_or_default(), content: Some(self.id.0.hex()) }
    }

    /// The hand as a row of the asset table.
    pub fn row(&self) -> serde_json::Value {
        serde_json::json!({ "object": self.id, "name": self.name })
    }
}

/// Reads the hand at `key` and checks that it supports the job. `None` when something is wrong with it, which is
/// reported.
pub fn read_hand(
    checker: &mut Checker,
    key: &str,
    spec: &HandSpec,
    folder: &FilePath,
    can: impl Fn(&HandModel) -> Result<(), HandError>,
) -> Option<JobHand> {
    let before = checker.count();
    let file = tidy(&folder.join(&spec.model));
    if file.extension().is_some_and(|ending| ending == "toml") {
        let expected = "the hand's description: its table is found beside it";
        checker.invalid(&format!("{key}.model"), expected, format!("a table, {}", file.shown()));
        return None;
    }
    let read = Description::of_hand(&file);
    let Description { name, digest } = pinned_description(checker, key, "hand", &file, read, spec.content.as_deref())?;
    match HandModel::open(&file).and_then(|model| can(&model)) {
        // Without memory nothing is known of it: the run ends with this error.
        Ok(()) | Err(HandError::Robot(RobotError::Memory { .. })) => {}
        Err(error) => {
            checker.invalid(Path::from(key).key("model"), "a hand that supports this job", error.to_string());
        }
    }
    (checker.count() == before).then_some(JobHand { file, name, id: ObjectId(digest) })
}
