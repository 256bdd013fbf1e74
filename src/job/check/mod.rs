//! From a decoded job file to settings that make sense: every mistake that the schema cannot see.

mod completion;
mod reachability;

pub use completion::{SceneReader, no_scenes};
pub(super) use completion::{completion, split};
pub(super) use reachability::reachability;
pub use reachability::{RobotFault, RobotKey, RobotReader, no_robots};

use super::{
    document::{Document, Path},
    errors::{JobError, Problem},
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
