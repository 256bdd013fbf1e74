//! The Python package `python/graspmill`, on datasets that the built program made.
#![cfg(feature = "sim")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
};

use fetch::ARM;
use python::PYTHON;

mod fetch;
mod python;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// What the program prints.
fn graspmill(arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_graspmill"));
    let output = command.current_dir(ROOT).args(arguments).output().expect("graspmill starts");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("it prints UTF-8")
}

fn made(job: &str, out: &Path, settings: &[&str]) {
    let out = out.to_string_lossy();
    let settings = settings.iter().flat_map(|setting| ["--set", setting]);
    let arguments: Vec<&str> = ["run", job, "--out", &out, "--progress", "none"].into_iter().chain(settings).collect();
    graspmill(&arguments);
}

/// Pairs with every channel and rays of touch; some views are refused, some objects are tested on.
const PAIRS: &[&str] = &[
    r#"objects=[{ built_in = ["bottle-01", "box-01", "mug-01", "cup-01", "can-01", "pan-01"] }]"#,
    "views={ even = 24 }",
    r#"channels={ depth = "u16", cloud = true, tsdf = true, coverage = true, implicit = true }"#,
    "touch.random_rays=true",
    "split={ validation_models = 1, test_models = 1, holdout_views = 0.2, training_subsets = [1, 2] }",
    "gate.min_partial_cells=300",
    "shards.samples=40",
];

/// What the exported pairs are of: the pairs and two channels.
fn exports(data: &Path) {
    let pairs = data.join("pairs");
    for (name, arguments) in [
        ("npy", &["--to", "npy"][..]),
        ("unpacked", &["--to", "npy", "--unpacked"]),
        ("parquet", &["--to", "parquet"]),
        ("webdataset", &["--to", "webdataset"]),
    ] {
        let (from, out) = (pairs.to_string_lossy(), data.join(name));
        let out = out.to_string_lossy();
        graspmill(&[&["export", &from, "--out", &out], arguments].concat());
    }
}

/// A coarse map of a Fetch, and what the program says of poses in and around it.
fn map(data: &Path, name: &str, orientations: &str) {
    let (folder, job) = (data.join(name), data.join(format!("{name}.toml")));
    let text = format!(
        "product = \"reachability\"\nname = \"{name}\"\nseed = 3\n[robot]\nscene = {:?}\njoints = {ARM:?}\n\
         target = \"wrist_roll_link\"\n[poses]\nx = {{ from = 0.4, to = 1.0, step = 0.2 }}\n\
         y = {{ from = -0.3, to = 0.4, step = 0.3 }}\nz = {{ from = 0.4, to = 1.2, step = 0.2 }}\n\
         {orientations}[shards]\npositions = 7\n",
        Path::new(ROOT).join("scenes/fetch.xml")
    );
    fs::write(&job, text).expect("a job file");
    made(&job.to_string_lossy(), &folder, &[]);
    // Poses in the grid, beyond it and turned several times; a Weyl sequence spreads them evenly.
    let share = |k: u32, axis: u32| (f64::from(k) * [0.618, 0.414, 0.732, 0.236, 0.646, 0.317][axis as usize]).fract();
    let spans = [(0.2, 1.2), (-0.6, 0.7), (0.2, 1.4), (-7.0, 7.0), (-4.0, 4.0), (-9.0, 9.0)];
    let line = |k: u32| {
        let value = |(axis, (low, high)): (u32, (f64, f64))| (low + (high - low) * share(k, axis)).to_string();
        (0..).zip(spans).map(value).collect::<Vec<_>>().join(",")
    };
    let csv = data.join(format!("{name}.csv"));
    fs::write(&csv, (1..=400).map(line).collect::<Vec<_>>().join("\n")).expect("poses");
    let answers = graspmill(&["query", "reach", &folder.to_string_lossy(), "--csv", &csv.to_string_lossy(), "--json"]);
    fs::write(data.join(format!("{name}.json")), answers).expect("answers");
}

/// A folder with small datasets of every product, made once.
fn data() -> &'static Path {
    static DATA: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, path) = DATA.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a scratch folder");
        let data = folder.path().to_owned();
        made("jobs/builtin.toml", &data.join("pairs"), PAIRS);
        exports(&data);
        // One size alone: hands are slow.
        made(
            "jobs/half-shapes.toml",
            &data.join("felt"),
            &[
                "objects=[{ built_in = { half_shapes_mm = [80], only = \"ambiguous\" } }]",
                "split={ validation_models = 0, test_models = 0 }",
            ],
        );
        made(
            "jobs/everything-quick.toml",
            &data.join("set"),
            &[
                "grasps:annealing.steps=1500",
                "grasps:keep.space=force",
                "grasps:physics={ perturbed = 1 }",
                "patches:images={ full = true, heatmaps = true }",
            ],
        );
        map(&data, "axes", "roll = 2\npitch = 4\nyaw = 4\n");
        map(&data, "sphere", "directions = { healpix = 2 }\nroll = 6\n");
        (folder, data)
    });
    path
}

fn pytest(python: &str, more: &[&str]) -> String {
    python::run(python, |command| {
        let python = Path::new(ROOT).join("python");
        command.current_dir(&python).env("PYTHONPATH", &python).env("GRASPMILL_DATA", data());
        command.env("PYTHONDONTWRITEBYTECODE", "1");
        command.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "-rs"]).args(more)
    })
}

#[test]
fn the_package_reads_what_the_program_writes() {
    let said = pytest(PYTHON, &[]);
    println!("{said}");
    assert!(said.contains(" passed"), "{said}");
}

#[test]
fn the_package_is_typed_and_of_this_version() {
    let python = Path::new(ROOT).join("python");
    let version = "import graspmill; print(graspmill.__version__)";
    let found = python::run(PYTHON, |command| command.args(["-c", version]).env("PYTHONPATH", &python));
    assert_eq!(found.trim(), env!("CARGO_PKG_VERSION"));
    python::run(PYTHON, |command| {
        // PyTorch, which these two import, is not there.
        let without = ["--exclude", r"^graspmill/torch\.py$", "--exclude", r"^examples/completion\.py$"];
        command.current_dir(&python).args(["-m", "mypy", "--strict", "--cache-dir", "/dev/null"]).args(without);
        command.args(["graspmill", "examples"])
    });
}

#[test]
#[ignore = "slow: needs PyTorch (3 GB)"]
fn pytorch_trains_on_it() {
    let said = pytest("torch/bin/python", &["tests/test_torch.py"]);
    println!("{said}");
    assert!(said.contains(" passed") && !said.contains("skipped"), "{said}");
}
