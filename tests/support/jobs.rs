//! Small jobs: a little of each product, in a second or two each; and an about file.

use std::{
    path::{Path, PathBuf},
    sync::LazyLock,
};

use super::{
    files::{copy_folder, repository_path},
    robots::{BARRETT, FETCH, FETCH_ARM, FETCH_SITE},
    workspace::Workspace,
};

/// An about file, for releases.
pub const ABOUT: &str = "title = \"Two\"\nversion = \"1\"\ndate = \"2026-01-01\"\ndescription = \"Two shapes.\"\n\
                     licence = \"CC-BY-4.0\"\n[[authors]]\nname = \"Nobody\"\n";

/// All objects train.
pub const NO_SPLIT: &str = "[split]\nvalidation_objects = 0\ntest_objects = 0\n";

/// Searches for grasps that take a second and keep some.
pub const SHORT_SEARCH: [&str; 2] = ["annealing.steps=1500", "keep.space=force"];

/// The table `[robot]` of a job for the Fetch's arm.
pub fn fetch_table(scene: &Path) -> String {
    format!("[robot]\nmodel = {scene:?}\njoints = {FETCH_ARM:?}\ntarget = \"{FETCH_SITE}\"\n")
}

/// The line `hand = ...` of a job for the Barrett hand.
pub fn barrett_line() -> String {
    format!("hand = {{ model = {:?} }}\n", repository_path(BARRETT))
}

/// Name and text of a job of each product, in the order in which they are made: the one for patches takes the dataset
/// `grasps` in `folder`.
pub fn small_jobs(folder: &Path) -> [(&'static str, String); 4] {
    let hand = barrett_line();
    let completion = format!(
        "objects = [{{ built_in = [\"box-01\"] }}]\nviews = {{ even = 3 }}\n[grid]\nresolution = 12\n[gate]\n\
         min_partial_cells = 1\n[channels]\ndepth = \"u16\"\ncloud = true\ntsdf = true\ncoverage = true\nimplicit = true\n\
         implicit_surface = 20\nimplicit_space = 20\n[touch]\nrandom_rays = true\nexploration = true\napproaches = 2\n\
         grasp = true\n{hand}[shards]\nsamples = 2\n{NO_SPLIT}"
    );
    let reachability = format!(
        "product = \"reachability\"\n{}[poses]\nx = {{ from = 0.4, to = 0.8, step = 0.2 }}\n\
         y = {{ from = 0.0, to = 0.2, step = 0.2 }}\nz = {{ from = 0.6, to = 1.0, step = 0.2 }}\n\
         roll = 2\npitch = 2\nyaw = 4\n[shards]\npositions = 3\n",
        fetch_table(&repository_path(FETCH))
    );
    let grasps = format!(
        "product = \"grasps\"\n{hand}objects = [{{ built_in = [\"box-01\"] }}]\n[grasps]\nseeds = 2\n\
         [annealing]\nsteps = 1500\n[keep]\nspace = \"force\"\n[physics]\n{NO_SPLIT}"
    );
    let patches = format!(
        "product = \"patches\"\n{hand}[grasps]\ndataset = {:?}\n[patches]\nside = 4\nlabel = \"epsilon\"\n[images]\n\
         full = true\nheatmaps = true\n[render]\ncolour = false\n",
        folder.join("grasps")
    );
    [("completion", completion), ("reachability", reachability), ("grasps", grasps), ("patches", patches)]
}

/// Text of the small job of a product.
pub fn small_job(product: &str) -> String {
    let mut jobs = small_jobs(Path::new("")).into_iter();
    jobs.find(|(name, _)| *name == product).unwrap_or_else(|| panic!("no small job makes {product}")).1
}

/// Makes the small dataset of each product, by its name.
pub fn make_small_datasets(workspace: &Workspace) -> Vec<(&'static str, PathBuf)> {
    let jobs = small_jobs(workspace.folder()).into_iter();
    jobs.map(|(name, job)| (name, workspace.make_dataset(name, &job, &[]))).collect()
}

/// The small dataset of each product, made once for all tests of a binary that only read them.
pub fn small_datasets() -> &'static [(&'static str, PathBuf)] {
    static MADE: LazyLock<Vec<(&str, PathBuf)>> = LazyLock::new(|| {
        let workspace = Workspace::with_datasets(&small_jobs(Path::new("")));
        small_jobs(Path::new("")).map(|(name, _)| (name, workspace.path(name))).into()
    });
    &MADE
}

/// The folder of [`small_datasets`]: [`small_jobs`] of it are theirs.
pub fn small_folder() -> &'static Path {
    small_datasets()[0].1.parent().expect("a folder")
}

/// Copies of [`small_datasets`], to change or to write next to. The paths in their jobs have no target from there.
pub fn copy_small_datasets(workspace: &Workspace) -> Vec<(&'static str, PathBuf)> {
    small_datasets().iter().map(|(name, _)| (*name, copy_small_dataset(name, &workspace.path(name)))).collect()
}

/// Copies the small dataset of a product into a folder, as [`copy_small_datasets`] does.
pub fn copy_small_dataset(product: &str, folder: &Path) -> PathBuf {
    let found = small_datasets().iter().find(|(name, _)| *name == product);
    copy_folder(&found.unwrap_or_else(|| panic!("no small dataset of {product}")).1, folder);
    folder.to_owned()
}
