//! The program's own verification.

use std::path::Path;

use serde_json::Value;

use crate::support::program::Program;

/// An end of `verify --json`.
pub struct Verification {
    pub code: i32,
    /// Null if there is no report.
    pub report: Value,
    pub stderr: String,
}

impl Verification {
    pub fn run(dataset: &Path, arguments: &[&str]) -> Self {
        let outcome = Program::new("verify").arg("--json").arg(dataset).args(arguments).finish();
        let report = serde_json::from_str(&outcome.stdout).unwrap_or_default();
        Self { code: outcome.code.unwrap_or(-1), report, stderr: outcome.stderr }
    }

    pub fn problems(&self) -> Vec<&str> {
        let list = self.report["problems"].as_array().into_iter().flatten();
        list.map(|problem| problem.as_str().unwrap_or_default()).collect()
    }
}
