//! A small dataset of each of the eleven products, made once for all tests of a binary, and its job, so that it can be made again.

use std::{
    path::{Path, PathBuf},
    sync::LazyLock,
};

use super::{
    files::repository_path,
    jobs::{small_datasets, small_jobs},
    program::{Program, print_root},
    workspace::Workspace,
};

/// A dataset and the job that makes it again.
pub struct MadeProduct {
    pub product: &'static str,
    pub job: PathBuf,
    /// Settings over the job, such as the datasets that it reads.
    pub settings: Vec<String>,
    pub dataset: PathBuf,
    pub root: String,
}

impl MadeProduct {
    /// Makes it again into a folder.
    pub fn run_into(&self, folder: &Path) -> Program {
        Program::run_job(&self.job, folder).set(&self.settings)
    }

    /// Words of a shell that make it again into a folder: the program is `$0`.
    pub fn shell_words(&self, folder: &str) -> String {
        let settings: String = self.settings.iter().map(|setting| format!(" --set {}", quoted(setting))).collect();
        format!("$0 run {}{settings} --out {folder} --progress none", quoted(&self.job.display().to_string()))
    }
}

fn quoted(word: &str) -> String {
    shlex::try_quote(word).expect("no zero byte").into_owned()
}

/// A job of clutter: product, job file, settings, and the datasets that it reads by section.
type ClutterJob = (&'static str, &'static str, &'static [&'static str], &'static [(&'static str, &'static str)]);

/// Jobs of clutter, in the order in which they are made.
const CLUTTER: [ClutterJob; 7] = [
    ("scenes", "scenes-quick", &["scenes={training=4}", "count=3", "shards.scenes=1"], &[]),
    (
        "views",
        "views-quick",
        &["views.cameras=[{overhead={height=0.8},width=320,height=240,fx=280}]", "shards.samples=1"],
        &[("scenes", "scenes")],
    ),
    ("amodal", "amodal-quick", &["shards.samples=2"], &[("views", "views")]),
    (
        "volumes",
        "volumes-quick",
        &["fusion.resolution=32", "fusion.views=[1,1]", "shards.samples=1"],
        &[("views", "views")],
    ),
    ("picks", "picks-quick", &["shards.samples=2"], &[("scenes", "scenes"), ("grasps", "clutter-grasps")]),
    ("heatmaps", "heatmaps-quick", &["shards.samples=1"], &[("views", "views"), ("picks", "picks")]),
    ("suction", "suction-quick", &["suction.poses=200", "suction.free=4", "shards.samples=2"], &[("scenes", "scenes")]),
];

/// The small dataset of a product of [`small_jobs`], without those of the other products.
pub fn small_product(name: &str) -> MadeProduct {
    let &(product, ref folder) = small_datasets().iter().find(|(product, _)| *product == name).expect("a small job");
    MadeProduct {
        product,
        job: folder.with_extension("toml"),
        settings: Vec::new(),
        dataset: folder.clone(),
        root: print_root(folder),
    }
}

/// The small dataset of each product.
pub fn made_products() -> &'static [MadeProduct] {
    static MADE: LazyLock<(Workspace, Vec<MadeProduct>)> = LazyLock::new(|| {
        let workspace = Workspace::kept(concat!("products-", env!("CARGO_CRATE_NAME")));
        let mut made = Vec::new();
        for (product, text) in small_jobs(workspace.folder()) {
            let job = workspace.write(format!("{product}.toml"), text);
            made.push(make(&workspace, product, product, job, Vec::new()));
        }
        let job = |name: &str| repository_path(format!("jobs/{name}.toml"));
        make(&workspace, "grasps", "clutter-grasps", job("clutter-grasps-quick"), Vec::new());
        for (product, name, settings, inputs) in CLUTTER {
            let dataset = |(section, name): &(&str, &str)| format!("{section}.dataset={:?}", workspace.path(name));
            let settings = settings.iter().map(|setting| (*setting).to_owned()).chain(inputs.iter().map(dataset));
            made.push(make(&workspace, product, product, job(name), settings.collect()));
        }
        (workspace, made)
    });
    &MADE.1
}

fn make(workspace: &Workspace, product: &'static str, name: &str, job: PathBuf, settings: Vec<String>) -> MadeProduct {
    let dataset = workspace.path(name);
    let mut made = MadeProduct { product, job, settings, dataset: dataset.clone(), root: String::new() };
    let outcome = made.run_into(&dataset).finish();
    assert!(matches!(outcome.code, Some(0 | 3)), "{name}: {}", outcome.text());
    made.root = print_root(&dataset);
    made
}
