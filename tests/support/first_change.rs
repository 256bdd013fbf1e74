//! The first change that CONTRIBUTING.md walks through, by its own patches.

use std::{collections::BTreeMap, fs, path::PathBuf};

use super::{
    files::{read_text, repository_path},
    program::Program,
    workspace::Workspace,
};

/// The files of the repository that the change edits, as they are afterwards, by their paths from the root.
pub fn changed_files() -> BTreeMap<PathBuf, Vec<u8>> {
    let text = read_text(repository_path("CONTRIBUTING.md"));
    let blocks = text.split("```diff\n").skip(1).map(|rest| rest.split("```").next().unwrap_or_default());
    let patch: String = blocks.collect();
    let paths: Vec<&str> = patch.lines().filter_map(|line| line.strip_prefix("+++ b/")).collect();

    let workspace = Workspace::new();
    for path in &paths {
        workspace.write(path, fs::read(repository_path(path)).expect("a file"));
    }
    workspace.write("change.patch", &patch);
    Program::of_system("git").args(["apply", "change.patch"]).current_dir(workspace.folder()).succeed();
    paths.iter().map(|path| (PathBuf::from(path), fs::read(workspace.path(path)).expect("a file"))).collect()
}
