//! The Python package `python/graspmill`, on datasets that the built program made.

use std::{path::PathBuf, sync::LazyLock};

use crate::support::{
    files::repository_path,
    jobs::{NO_SPLIT, SHORT_SEARCH, barrett_line, fetch_table},
    program::Program,
    robots::{FETCH, PANDA_HAND},
    workspace::Workspace,
};

/// Pairs with every channel and rays of touch; some views are refused, some objects are tested on.
const PAIRS: &[&str] = &[
    r#"objects=[{ built_in = ["bottle-01", "box-01", "mug-01", "cup-01", "can-01", "pan-01"] }]"#,
    "views={ even = 24 }",
    r#"channels={ depth = "u16", cloud = true, tsdf = true, coverage = true, implicit = true }"#,
    "occlusion={ share = 0.3, max_hidden = 0.4 }",
    "touch.random_rays=true",
    "split={ validation_objects = 1, test_objects = 1, holdout_items = 0.2, training_subsets = [1, 2] }",
    "gate.min_partial_cells=300",
    "shards.samples=40",
];

/// Exports the pairs in every format that the package reads.
fn export_pairs(workspace: &Workspace) {
    for (name, arguments) in [
        ("npy", &["--to", "npy"][..]),
        ("unpacked", &["--to", "npy", "--unpacked"]),
        ("parquet", &["--to", "parquet"]),
        ("webdataset", &["--to", "webdataset"]),
    ] {
        let export = Program::on("export", workspace.path("pairs")).option("--out", workspace.path(name));
        export.args(arguments).succeed();
    }
}

/// Exports datasets of every product as tables of rows: `grasps` of `set/grasps` in `tables/grasps`, ...
fn export_tables(workspace: &Workspace) {
    for (name, dataset) in
        [("felt", "felt"), ("grasps", "set/grasps"), ("patches", "set/patches"), ("axes", "axes"), ("sphere", "sphere")]
    {
        let out = workspace.path(format!("tables/{name}"));
        let said = Program::on("export", workspace.path(dataset)).args(["--to", "parquet"]).option("--out", out);
        let said = said.succeed().stdout;
        assert!(said.contains(" files, in "), "{said}");
    }
}

/// Grasps of a Panda's hand: `pinched` tried in physics, `pads` not; exports of both in ACRONYM's layout. Other hands have none.
fn export_acronym(workspace: &Workspace) {
    for (name, physics) in [("pinched", "[physics]\nperturbed_runs = 1\n"), ("pads", "")] {
        let text = format!(
            "product = \"grasps\"\nname = \"{name}\"\nseed = 1\n[hand]\nmodel = {:?}\n[[objects]]\n\
             built_in = [\"box-01\", \"mug-01\"]\n[grasps]\nseeds = 4\nsampler = \"antipodal\"\n[antipodal]\npairs = 200\n\
             best = 4\n[keep]\ntorsion = 0.002\n{physics}{NO_SPLIT}",
            repository_path(PANDA_HAND)
        );
        let dataset = workspace.make_dataset(name, &text, &[]);
        let out = workspace.path(format!("acronym/{name}"));
        Program::on("export", dataset).args(["--to", "acronym"]).option("--out", out).succeed();
    }
    let out = workspace.path("acronym/barrett");
    let barrett = Program::on("export", workspace.path("set/grasps")).args(["--to", "acronym"]).option("--out", &out);
    let said = barrett.finish();
    assert!(said.code == Some(2) && said.stderr.contains("barrett") && !out.exists(), "{}", said.stderr);
    assert!(said.stderr.contains("parallel-jaw grippers") && said.stderr.contains("--to parquet"), "{}", said.stderr);
}

/// Makes a coarse map of a Fetch, and the program's answers about poses in and around it.
fn make_map(workspace: &Workspace, name: &str, orientations: &str) {
    let text = format!(
        "product = \"reachability\"\nname = \"{name}\"\nseed = 3\n{}[poses]\n\
         x = {{ from = 0.4, to = 1.0, step = 0.2 }}\ny = {{ from = -0.3, to = 0.4, step = 0.3 }}\n\
         z = {{ from = 0.4, to = 1.2, step = 0.2 }}\n{orientations}[shards]\npositions = 7\n",
        fetch_table(&repository_path(FETCH))
    );
    let map = workspace.make_dataset(name, &text, &[]);
    // Poses in the grid, outside it and with several full turns added; a Weyl sequence spreads them evenly.
    let share = |k: u32, axis: u32| (f64::from(k) * [0.618, 0.414, 0.732, 0.236, 0.646, 0.317][axis as usize]).fract();
    let spans = [(0.2, 1.2), (-0.6, 0.7), (0.2, 1.4), (-7.0, 7.0), (-4.0, 4.0), (-9.0, 9.0)];
    let line = |k: u32| {
        let value = |(axis, (low, high)): (u32, (f64, f64))| (low + (high - low) * share(k, axis)).to_string();
        (0..).zip(spans).map(value).collect::<Vec<_>>().join(",")
    };
    let csv = workspace.write(format!("{name}.csv"), (1..=400).map(line).collect::<Vec<_>>().join("\n"));
    let answers = Program::new("query").arg("reach").arg(map).option("--csv", csv).arg("--json").succeed().stdout;
    workspace.write(format!("{name}.json"), answers);
}

/// Patches in `held`, of grasps with trials on shapes, two of them for validation: only for the trainer of heatmaps,
/// since trials take a while.
fn make_held_patches(workspace: &Workspace) {
    let hand = barrett_line();
    let grasps = format!(
        "product = \"grasps\"\nname = \"tried\"\nseed = 1\n{hand}[[objects]]\n\
         built_in = [\"bottle-01\", \"box-01\", \"mug-01\", \"can-01\", \"cup-01\", \"box-02\"]\n[grasps]\nseeds = 2\n\
         sampler = \"uniform\"\n[uniform]\nposes = \"any\"\n[physics]\nperturbed_runs = 0\n[split]\nvalidation_objects = 2\n\
         test_objects = 1\n"
    );
    let grasps = workspace.make_dataset("tried", &grasps, &[]);
    let patches = format!(
        "product = \"patches\"\nname = \"held\"\nseed = 1\n{hand}[grasps]\ndataset = {grasps:?}\n[images]\nfull = true\n\
         [render]\ncolour = false\n"
    );
    workspace.make_dataset("held", &patches, &[]);
}

/// Pairs of bodies in bins in `cluttered`, for the trainer alone, since bodies take a while to settle.
fn make_cluttered(workspace: &Workspace) {
    let scenes =
        ["count=2", "scenes={ training = 4, validation = 2 }", "split={ validation_objects = 3, test_objects = 0 }"];
    Program::run_job("jobs/scenes-quick.toml", workspace.path("bins")).set(scenes).succeed();
    let from = |key: &str, dataset: &str| format!("{key}.dataset={:?}", workspace.path(dataset));
    Program::run_job("jobs/views-quick.toml", workspace.path("bin-views")).set([from("scenes", "bins")]).succeed();
    let channels = "channels={ visibility = true, coverage = true }".to_owned();
    let amodal = Program::run_job("jobs/amodal-quick.toml", workspace.path("cluttered"));
    amodal.set([from("views", "bin-views"), channels]).succeed();
}

/// A folder with small datasets of every product, made once.
static DATA: LazyLock<Workspace> = LazyLock::new(|| {
    let workspace = Workspace::kept("python_package");
    Program::run_job("jobs/builtin.toml", workspace.path("pairs")).set(PAIRS).succeed();
    export_pairs(&workspace);
    // One size alone: hands are slow.
    let one_size = [
        "objects=[{ built_in = { half_shapes_mm = [80], only = \"ambiguous\" } }]",
        "split={ validation_objects = 0, test_objects = 0 }",
    ];
    Program::run_job("jobs/half-shapes.toml", workspace.path("felt")).set(one_size).succeed();
    let set = Program::run_job("jobs/everything-quick.toml", workspace.path("set"));
    let set = set.set(SHORT_SEARCH.map(|setting| format!("grasps:{setting}")));
    set.set([
        "grasps:physics={ perturbed_runs = 1, series_share = 0.3 }",
        "patches:images={ full = true, heatmaps = true }",
        "patches:patches.label=trial",
    ])
    .succeed();
    make_map(&workspace, "axes", "roll = 2\npitch = 4\nyaw = 4\n");
    make_map(&workspace, "sphere", "directions = { healpix = 2 }\nroll = 6\n");
    export_tables(&workspace);
    export_acronym(&workspace);
    workspace
});

/// The folder of the package, from which its own tests and checks run.
fn package() -> PathBuf {
    repository_path("python")
}

fn run_pytest(python: Program, arguments: &[&str]) -> String {
    let pytest = python.current_dir(package()).env("PYTHONPATH", package()).env("GRASPMILL_DATA", DATA.folder());
    let pytest =
        pytest.env("PYTHONDONTWRITEBYTECODE", "1").args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "-rs"]);
    pytest.args(arguments).succeed().stdout
}

#[test]
fn the_package_reads_what_the_program_writes() {
    let said = run_pytest(Program::python(), &[]);
    println!("{said}");
    assert!(said.contains(" passed"), "{said}");
}

#[test]
fn the_package_is_typed_and_of_this_version() {
    let version = "import graspmill; print(graspmill.__version__)";
    let found = Program::python_lines(version).env("PYTHONPATH", package()).succeed().stdout;
    assert_eq!(found.trim(), env!("CARGO_PKG_VERSION"));
    // PyTorch, which these import, is not there.
    let without = ["--exclude", r"^graspmill/torch\.py$", "--exclude", r"^examples/completion\.py$"];
    let modules = "__main__|loop|networks|completing|export|completion_export|heatmaps|heatmap_networks|heatmap_export";
    let trainer = ["--exclude", &format!(r"^graspmill/train/({modules})\.py$")];
    let mypy = Program::python().current_dir(package()).args(["-m", "mypy", "--strict", "--cache-dir", "/dev/null"]);
    mypy.args(without).args(trainer).args(["graspmill", "examples"]).succeed();
}

/// A descriptor for each of 1,100 shards would be too many under common limits, and 48 are too few even for those that are kept open.
#[test]
fn any_number_of_shards_is_read_under_a_limit_of_open_files() {
    const READ: &str = "import sys, numpy, graspmill\n\
                        data = graspmill.Dataset(sys.argv[1], cached_chunks=1)\n\
                        order = numpy.random.default_rng(1).permutation(len(data))\n\
                        found = [data[place].index for place in order.tolist()]\n\
                        assert found == data.indices[order].tolist()\n\
                        assert sorted(s.index for s in graspmill.ShuffledChunks(data)) == data.indices.tolist()\n\
                        print(len(data.folder.shards), len(data.index['digest_pair']))\n";
    let workspace = Workspace::new();
    let job = [
        "objects=[{ built_in = [\"box-01\", \"can-01\"] }]",
        "views={ even = 550 }",
        "shards.samples=1",
        "split={ validation_objects = 0, test_objects = 0 }",
    ];
    Program::run_job("jobs/builtin.toml", workspace.path("pairs")).set(job).succeed();
    for limit in ["--nofile=48", "--nofile=1024"] {
        let python = Program::of_system("prlimit").arg(limit).arg(repository_path(".deps/venv/bin/python"));
        let python = python.option("-c", READ).arg(workspace.path("pairs")).env("PYTHONPATH", package());
        assert_eq!(python.succeed().stdout.trim(), "1100 1100", "{limit}");
        // The program opens a shard for each read alone.
        let verify = Program::of_system("prlimit").arg(limit).arg(env!("CARGO_BIN_EXE_graspmill"));
        verify.arg("verify").arg(workspace.path("pairs")).succeed();
    }
}

#[test]
#[ignore = "slow: needs PyTorch (3 GB)"]
fn pytorch_trains_on_it() {
    make_held_patches(&DATA);
    make_cluttered(&DATA);
    let tests = ["tests/test_torch.py", "tests/test_train.py", "tests/test_heatmaps.py"];
    let said = run_pytest(Program::peer("torch/bin/python"), &tests);
    println!("{said}");
    assert!(said.contains(" passed") && !said.contains("skipped"), "{said}");
}
