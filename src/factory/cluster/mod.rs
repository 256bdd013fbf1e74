//! Cluster engines: which of several tasks this is, how many processors it was granted,
//! and the scripts that have an engine run the tasks of a job. No scheduler of our own: engines run us.
//!
//! Nothing here reads the environment or starts a program; the command line does, and passes on what it found.

mod grant;
mod submission;
mod task;
mod template;

pub use grant::{Grant, granted_threads};
pub use submission::{Backend, PodContainer, Resources, Submission, SubmissionError, SubmissionFile, TaskPlan};
pub use task::{TaskChoice, TaskError, TaskFound};

/// Lookup of an environment variable's value.
pub type Variables<'a> = &'a dyn Fn(&str) -> Option<String>;
