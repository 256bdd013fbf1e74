//! Files that a new product and a new channel touch: a copy of the repository with one more product, `volume`, one more channel
//! of completion, `centroid`, and the first change of CONTRIBUTING.md is built and used. Files of product and channel are in
//! `tests/fixtures/`.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    sync::LazyLock,
};

use crate::support::{
    files::{ROOT, read_json, repository_path},
    first_change,
    jobs::NO_SPLIT,
    program::Program,
    schemas,
    workspace::Workspace,
};
use serde_json::Value;

/// Files of the repository that a build of the program takes.
const SOURCES: [&str; 11] = [
    ".cargo",
    "Cargo.lock",
    "Cargo.toml",
    "benches",
    "build.rs",
    "examples",
    "jobs",
    "proto",
    "rust-toolchain.toml",
    "scenes",
    "src",
];

/// An addition to the repository.
struct Extension {
    /// Folder of its files, below `tests/fixtures/`.
    fixture: &'static str,
    /// Files and folders that it owns, among them the descriptors that `make schemas` generates from its schema.
    own: &'static [&'static str],
    /// Files of the repository that it edits, with each old text and its replacement.
    edits: &'static [(&'static str, &'static [(&'static str, &'static str)])],
}

/// The types of all schemas, which `make schemas` regenerates for every extension.
const TYPES: &str = "src/format/generated/graspmill.rs";

/// One more product: the volume of each object's solid.
const PRODUCT: Extension = Extension {
    fixture: "new_product",
    own: &[
        "proto/volume.proto",
        "src/factory/products/volume",
        "src/format/generated/volume.bin",
        "src/format/products/volume",
        "src/publish/products/volume",
    ],
    edits: &[
        (
            "src/format/products/mod.rs",
            &[
                ("pub mod views;\n", "pub mod views;\npub mod volume;\n"),
                ("[&ProductFormat; 11]", "[&ProductFormat; 12]"),
                ("    &volumes::FORMAT,\n", "    &volumes::FORMAT,\n    &volume::FORMAT,\n"),
            ],
        ),
        (
            "src/format/products/checks.rs",
            &[
                ("views, volumes}", "views, volume, volumes}"),
                ("[&ProductChecks; 11]", "[&ProductChecks; 12]"),
                ("    &volumes::CHECKS,\n", "    &volumes::CHECKS,\n    &volume::CHECKS,\n"),
            ],
        ),
        (
            "src/factory/products/mod.rs",
            &[
                ("pub mod views;\n", "pub mod views;\npub mod volume;\n"),
                ("[&ProductFactory; 11]", "[&ProductFactory; 12]"),
                ("    &volumes::FACTORY,\n", "    &volumes::FACTORY,\n    &volume::FACTORY,\n"),
            ],
        ),
        (
            "src/publish/products/mod.rs",
            &[
                ("pub mod views;\n", "pub mod views;\npub mod volume;\n"),
                ("[&ProductPages; 11]", "[&ProductPages; 12]"),
                ("    &volumes::PAGES,\n", "    &volumes::PAGES,\n    &volume::PAGES,\n"),
            ],
        ),
    ],
};

/// One more channel of completion pairs: the centroid of the complete grid.
const CHANNEL: Extension = Extension {
    fixture: "new_channel",
    own: &["proto/centroid.proto", "src/format/generated/centroid.bin", "src/format/products/completion/centroid"],
    edits: &[
        (
            "src/format/lib.rs",
            &[(
                "        Approach, ApproachEnd, BlockedProbe, Cloud,",
                "        Approach, ApproachEnd, BlockedProbe, Centroid, Cloud,",
            )],
        ),
        (
            "src/format/products/completion/mod.rs",
            &[
                ("mod channels;\n", "mod centroid;\nmod channels;\n"),
                ("pub use channels::{", "pub use centroid::Centroid;\npub use channels::{"),
            ],
        ),
        (
            "src/format/products/completion/row.rs",
            &[
                ("use super::{\n", "use super::{\n    centroid,\n"),
                ("[ChannelFormat; 11]", "[ChannelFormat; 12]"),
                (
                    "    ChannelFormat::new(\n        \"/completion/touch_rays\",",
                    "    centroid::FORMAT,\n    ChannelFormat::new(\n        \"/completion/touch_rays\",",
                ),
            ],
        ),
        (
            "src/factory/products/pair/channels.rs",
            &[
                ("format::{Channel, Cloud,", "format::{Centroid, Channel, Cloud,"),
                (
                    "    pub implicit_space: u32,\n",
                    "    pub implicit_space: u32,\n    /// Centroid of the complete grid.\n    pub centroid: bool,\n",
                ),
                (
                    "    pub implicit: Option<ImplicitSamples>,\n",
                    "    pub implicit: Option<ImplicitSamples>,\n    /// Centroid of the complete grid.\n    pub centroid: bool,\n",
                ),
                (
                    "            implicit: spec.implicit.then_some(implicit),\n",
                    "            implicit: spec.implicit.then_some(implicit),\n            centroid: spec.centroid,\n",
                ),
                (
                    "        spec.implicit = self.implicit.is_some();\n",
                    "        spec.implicit = self.implicit.is_some();\n        spec.centroid = self.centroid;\n",
                ),
                (
                    "            (Channel::IMPLICIT, self.implicit.is_some()),\n",
                    "            (Channel::IMPLICIT, self.implicit.is_some()),\n            (Channel::CENTROID, self.centroid),\n",
                ),
                (
                    "        // Channels of the mesh and its solid",
                    "        if let Some(payload) = payload(out, product, Channel::CENTROID) {\n            \
                     Centroid::of(sample, &pair.complete).encode(payload);\n        }\n\n        \
                     // Channels of the mesh and its solid",
                ),
            ],
        ),
        (
            "src/factory/products/pair/channels.toml",
            &[("implicit_space = 2048\n", "implicit_space = 2048\ncentroid = false\n")],
        ),
    ],
};

/// Built-in shapes that are measured.
const NAMES: [&str; 3] = ["box-01", "can-01", "cup-01"];

/// Prints each object's volume as the fact and as the record of its sample have it.
const READ: &str = "\
import json, sys, graspmill
data = graspmill.Dataset(sys.argv[1])
facts = data.column('object'), data.column('volume')
print(json.dumps({name: [fact, sample.message('solid')['volume']] for name, fact, sample in zip(*facts, data)}))
";

/// Content of files, by their paths from a root.
type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Adds a file, or all files of a folder, by their paths from the root.
fn read_files(root: &Path, path: &Path, files: &mut Files) {
    let found = root.join(path);
    if found.is_dir() {
        for entry in fs::read_dir(&found).expect("a folder") {
            read_files(root, &path.join(entry.expect("an entry").file_name()), files);
        }
    } else {
        let content = fs::read(&found).unwrap_or_else(|error| panic!("{}: {error}", found.display()));
        files.insert(path.to_owned(), content);
    }
}

/// The sources of the program.
fn sources() -> Files {
    let mut files = Files::new();
    SOURCES.iter().for_each(|path| read_files(Path::new(ROOT), Path::new(path), &mut files));
    files
}

/// The sources of a program with these extensions: their own files, and their edits.
fn extended_sources(extensions: &[Extension]) -> Files {
    let mut files = sources();
    for Extension { fixture, edits, .. } in extensions {
        let before = files.len();
        let mut own = Files::new();
        read_files(&repository_path("tests/fixtures").join(fixture), Path::new(""), &mut own);
        let count = own.len();
        files.append(&mut own);
        assert_eq!(files.len(), before + count, "a file of {fixture} replaces one of the repository");
        for (path, edits) in *edits {
            let content = files.get_mut(Path::new(path)).unwrap_or_else(|| panic!("no file {path}"));
            let mut text = String::from_utf8(content.clone()).expect("source is UTF-8");
            for (old, new) in *edits {
                assert_eq!(
                    text.matches(old).count(),
                    1,
                    "{path} does not contain the text that this test replaces: {old}"
                );
                text = text.replace(old, new);
            }
            *content = text.into_bytes();
        }
    }
    let workspace = Workspace::new();
    for (path, content) in files.iter().filter(|(path, _)| path.starts_with("proto")) {
        workspace.write(path.to_str().expect("a path in UTF-8"), content);
    }
    files.extend(schemas::generate(workspace.folder()));
    files
}

/// Makes a folder hold these files and no others. Files that stay the same keep their times, so that a second build is short.
fn write_files(folder: &Path, files: &Files) {
    fs::create_dir_all(folder).expect("a folder");
    let mut there = Files::new();
    read_files_but_links(folder, Path::new(""), &mut there);
    for path in there.keys().filter(|path| !files.contains_key(*path)) {
        fs::remove_file(folder.join(path)).expect("a file that goes");
    }
    for (path, content) in files.iter().filter(|(path, content)| there.get(*path) != Some(content)) {
        let path = folder.join(path);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(&path, content).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    }
}

/// [`read_files`] for a folder's own content: skips the link to `.deps`.
fn read_files_but_links(root: &Path, path: &Path, files: &mut Files) {
    for entry in fs::read_dir(root.join(path)).expect("a folder") {
        let entry = entry.expect("an entry");
        if !entry.file_type().expect("a kind").is_symlink() {
            read_files(root, &path.join(entry.file_name()), files);
        }
    }
}

/// The program with both extensions, and with the first change of CONTRIBUTING.md.
static PROGRAM: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("extended");
    let mut files = extended_sources(&[PRODUCT, CHANNEL]);
    // What the change edits in tests is no part of the program.
    files.extend(first_change::changed_files().into_iter().filter(|(path, _)| path.starts_with("src")));
    write_files(&folder, &files);
    // libmujoco is found by a path relative to the sources.
    let link = folder.join(".deps");
    if !link.exists() {
        std::os::unix::fs::symlink(repository_path(".deps"), link).expect("a link");
    }
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("extended");
    Program::of_system(env!("CARGO"))
        .args(["build", "--locked", "--offline"])
        .env("CARGO_TARGET_DIR", &target)
        .current_dir(&folder)
        .succeed();
    target.join("debug/graspmill")
});

/// A verb of the program with both extensions.
fn call(verb: &str) -> Program {
    Program::of_build(PROGRAM.as_path(), verb)
}

/// Files of the repository that an extension changes; its other files are its own.
fn edited_files(extension: Extension) -> Vec<PathBuf> {
    let own = extension.own;
    let (before, after) = (sources(), extended_sources(&[extension]));
    for path in after.keys().filter(|path| !before.contains_key(*path)) {
        assert!(own.iter().any(|own| path.starts_with(own)), "{} is no file of the extension's own", path.display());
    }
    before.into_iter().filter(|(path, content)| after[path] != *content).map(|(path, _)| path).collect()
}

/// The entry of an object of this name.
fn named<'a>(objects: &'a Value, name: &str) -> &'a Value {
    let mut objects = objects.as_array().expect("objects").iter();
    objects.find(|object| object["name"] == name).unwrap_or_else(|| panic!("no object {name}"))
}

#[test]
fn a_new_product_edits_the_tables_alone() {
    let tables = PRODUCT.edits.iter().map(|(path, _)| *path);
    let expected: Vec<PathBuf> =
        tables.chain([TYPES]).map(PathBuf::from).collect::<BTreeSet<_>>().into_iter().collect();
    assert_eq!(edited_files(PRODUCT), expected);
    assert!(PRODUCT.edits.iter().all(|(path, _)| path.contains("/products/")));
}

#[test]
fn a_new_channel_edits_six_files() {
    let edited = edited_files(CHANNEL);
    assert!(edited.len() <= 6, "{edited:#?}");
}

#[test]
#[ignore = "slow: make test-all"]
fn a_new_product_is_run_verified_inspected_and_reported() {
    let workspace = Workspace::new();
    let text = format!("product = \"volume\"\n[[objects]]\nbuilt_in = {NAMES:?}\n{NO_SPLIT}");
    let job = workspace.write("volumes.toml", text);
    let out = workspace.path("volumes");

    let schema: Value = call("schema").succeed().json();
    let products = schema["oneOf"].as_array().expect("a schema per product").iter();
    assert!(products.map(|keys| &keys["properties"]["product"]["const"]).any(|name| name == "volume"));

    call("run").arg(&job).option("--out", &out).option("--progress", "none").succeed();
    call("verify").arg(&out).option("--regenerate", "3").succeed();
    let status = call("status").arg(&out).succeed();
    assert!(status.stdout.contains("3 solids"), "{}", status.stdout);
    call("report").arg(&out).succeed();
    let page = workspace.read("volumes/report.html");
    assert!(NAMES.iter().all(|name| page.contains(name)));
    assert!(out.join("preview.mcap").is_file());

    let facts = call("inspect").arg(&out).read_json();
    assert_eq!((&facts["product"], &facts["kept"]), (&"volume".into(), &3.into()));
    let volume = |name: &str| named(&facts["objects"], name)["volume"].as_f64().expect("a volume");
    let assets = read_json(out.join("assets.json"));
    let asset = |name: &str| named(&assets["objects"], name);
    // Closed form of a box: the product of its sides.
    let sides = asset("box-01")["extents"].as_array().expect("sides");
    let of_box: f64 = sides.iter().map(|side| side.as_f64().expect("a side")).product();
    assert!((volume("box-01") / of_box - 1.0).abs() < 0.001, "{} and {of_box} m^3", volume("box-01"));
    // The volume of a mesh by the divergence theorem, which counts no cells.
    for name in NAMES {
        let of_mesh = asset(name)["volume"].as_f64().expect("a volume");
        assert!((volume(name) / of_mesh - 1.0).abs() < 0.01, "{name}: {} and {of_mesh} m^3", volume(name));
    }
    // Facts and records, as the Python package reads them without knowing the product.
    let read: BTreeMap<String, [f64; 2]> =
        Program::python_lines(READ).arg(&out).env("PYTHONPATH", repository_path("python")).succeed().json();
    assert_eq!(read, NAMES.map(|name| (name.to_owned(), [volume(name); 2])).into());
}

/// Prints, per sample, the largest difference between the stored centroid and the one of the complete grid as NumPy has it
/// [cells], and the number of samples.
const READ_CENTROIDS: &str = "\
import json, sys, graspmill, numpy
data = graspmill.Dataset(sys.argv[1])
stored = [[sample.message('centroid')[axis] for axis in 'xyz'] for sample in data]
expected = [(numpy.argwhere(sample.complete) + 0.5).mean(axis=0) for sample in data]
print(json.dumps([float(numpy.abs(numpy.array(stored) - expected).max()), len(data)]))
";

#[test]
#[ignore = "slow: make test-all"]
fn a_new_channel_is_made_verified_and_read_and_moves_no_other() {
    let workspace = Workspace::new();
    let text = format!("views = {{ even = 5 }}\n[[objects]]\nbuilt_in = {NAMES:?}\n{NO_SPLIT}");
    let (with, without) = (workspace.path("with"), workspace.path("without"));
    let job = workspace.write("pairs.toml", text);
    let run = |program: Program, out: &Path| program.arg(&job).option("--out", out).option("--progress", "none");
    run(call("run"), &with).option("--set", "channels.centroid=true").succeed();
    call("verify").arg(&with).option("--regenerate", "3").succeed();
    let (difference, samples): (f64, u32) =
        Program::python_lines(READ_CENTROIDS).arg(&with).env("PYTHONPATH", repository_path("python")).succeed().json();
    assert_eq!(samples, 15);
    // Sums of up to 64,000 numbers below 40, in another order.
    assert!(difference < 1e-9, "{difference} cells");

    // Without the channel the dataset is the one of the unchanged program.
    run(call("run"), &without).succeed();
    let standing = workspace.path("standing");
    run(Program::new("run"), &standing).succeed();
    // The job has one key more, so its digest is another; the samples are the same.
    let found = Program::on("diff", &without).arg(&standing).arg("--json").finish();
    let found: Value = serde_json::from_str(&found.stdout).expect("a report");
    assert_eq!(found["both"]["same"], 15, "{found}");
    let keys: Vec<&Value> = found["settings"].as_array().into_iter().flatten().map(|setting| &setting["key"]).collect();
    assert_eq!(keys, ["channels.centroid"], "{found}");
}

/// Prints the column that the first change adds, and the same shares as NumPy has them from the exported grids.
const READ_SHARES: &str = "\
import csv, json, sys, numpy
out = sys.argv[1]
with open(out + '/samples.csv', encoding='utf-8', newline='') as table:
    column = [float(row['seen_share']) for row in csv.DictReader(table)]
partial, complete = (numpy.unpackbits(numpy.load(f'{out}/{kind}.npy'), axis=1) for kind in ['partial', 'complete'])
print(json.dumps([column, ((partial & complete).sum(axis=1) / complete.sum(axis=1)).tolist()]))
";

#[test]
#[ignore = "slow: make test-all"]
fn the_first_change_of_contributing_adds_its_column() {
    let workspace = Workspace::new();
    let text = format!("views = {{ even = 3 }}\n[[objects]]\nbuilt_in = {NAMES:?}\n{NO_SPLIT}");
    let job = workspace.write("pairs.toml", text);
    let (data, arrays) = (workspace.path("data"), workspace.path("arrays"));
    call("run").arg(&job).option("--out", &data).option("--progress", "none").succeed();
    call("export").arg(&data).option("--to", "npy").option("--out", &arrays).succeed();
    let [column, expected]: [Vec<f64>; 2] = Program::python_lines(READ_SHARES).arg(&arrays).succeed().json();
    assert_eq!(column.len(), 9);
    assert_eq!(column, expected);
}
