//! Folders and shapes that jobs refer to by name.

use std::path::PathBuf;

use super::packages::packages_of_program;

/// Folders beyond its own that a job may refer to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JobContext {
    /// The folder that holds the packages of meshes.
    pub packages: PathBuf,
    /// The default set of built-in shapes and the half-shapes, which patterns with `*` and `?` choose from. Full names
    /// reach every shape.
    pub built_in: Vec<String>,
}

impl Default for JobContext {
    /// Packages and built-in shapes of the program, wherever it is called.
    fn default() -> Self {
        Self { packages: packages_of_program(), built_in: assets::built_in_names(assets::DEFAULT_BUILT_INS).collect() }
    }
}
