//! From a decoded job file to settings that make sense: every mistake that the schema cannot see.

mod completion;
mod grasp;
mod patches;
mod reachability;
mod touch;

use std::path::Path as FilePath;

pub use completion::{SceneReader, no_scenes};
pub(super) use completion::{completion, split};
pub(super) use grasp::grasps;
pub(super) use patches::patches;
pub use patches::{GraspsReader, no_grasps};
pub(super) use reachability::reachability;
pub use reachability::{RobotFault, RobotKey, RobotReader, no_robots};
pub use touch::{HandReader, no_hands};

use super::{
    document::{Document, Path},
    errors::{JobError, Problem},
};
use crate::{
    assets::{Description, DescriptionError},
    ids::Digest,
};

/// Collects mistakes, each key once.
pub(super) struct Checker<'a> {
    pub document: &'a Document,
    pub errors: Vec<JobError>,
    pub wrong: Vec<Path>,
}

impl Checker<'_> {
    /// Reports a mistake unless the key is known to be wrong already.
    pub fn fail(&mut self, path: &Path, problem: Problem, help: Option<String>) {
        if self.wrong.iter().any(|wrong| wrong.holds(path) || path.holds(wrong)) {
            return;
        }
        self.wrong.push(path.clone());
        let place = self.document.place_of(path);
        self.errors.push(JobError { place, key: path.to_string(), problem, help });
    }

    fn senseless(&mut self, key: &str, expected: impl Into<String>, found: impl Into<String>) {
        self.fail(&Path::of(key), Problem::Senseless { expected: expected.into(), found: found.into() }, None);
    }

    fn contradiction(&mut self, key: &str, other: &str, because: &str) {
        let problem = Problem::Contradiction { other: other.to_owned(), because: because.to_owned() };
        self.fail(&Path::of(key), problem, None);
    }
}

/// What a description of `what` is that stands at `key`, where it can be read, held against the content that the job pins.
fn described(
    checker: &mut Checker<'_>,
    key: &str,
    what: &str,
    scene: &FilePath,
    read: Result<Description, DescriptionError>,
    pinned: Option<&str>,
) -> Option<Description> {
    let description = match read {
        Ok(description) => description,
        Err(error) => {
            let problem = Problem::NotFound { what: what.to_owned(), detail: error.to_string() };
            checker.fail(&Path::of(key).key("scene"), problem, Some(error.remedy().to_owned()));
            return None;
        }
    };
    let digest = description.digest;
    if let Some(pinned) = pinned.and_then(Digest::from_hex).filter(|pinned| *pinned != digest) {
        let expected = format!("a {what} of content {}", pinned.short());
        let found = format!("{}: {} has changed", digest.short(), scene.display());
        let help = "restore its files, or take `content` out of the job for a new dataset".to_owned();
        checker.fail(&Path::of(key).key("content"), Problem::Senseless { expected, found }, Some(help));
    }
    Some(description)
}
