//! A refusal without its file, which the caller adds.

use std::fmt::Display;

use crate::MeshRefusal;

/// A [`MeshRefusal`] without its file.
#[derive(Debug, PartialEq)]
pub(super) struct Refuse {
    reason: &'static str,
    problem: String,
    location: Option<String>,
    remedy: String,
}

impl Refuse {
    pub(super) fn new(reason: &'static str, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { reason, problem: problem.into(), location: None, remedy: remedy.into() }
    }

    /// A coordinate that is NaN or infinite.
    pub(super) fn not_finite([x, y, z]: [f64; 3]) -> Self {
        let remedy = "delete that vertex and its faces, or export again";
        Self::new("not_finite", format!("the position ({x}, {y}, {z}) is not finite"), remedy)
    }

    /// Adds the location in the file.
    pub(super) fn at(self, location: impl Into<String>) -> Self {
        Self { location: Some(location.into()), ..self }
    }

    /// Adds a further fault to the problem.
    pub(super) fn noting(self, note: &str) -> Self {
        Self { problem: format!("{}; {note}", self.problem), ..self }
    }

    /// Adds the file or the built-in name.
    pub(super) fn about(self, file: impl Display) -> MeshRefusal {
        MeshRefusal {
            file: file.to_string(),
            reason: self.reason.to_owned(),
            problem: self.problem,
            location: self.location,
            remedy: self.remedy,
        }
    }
}
