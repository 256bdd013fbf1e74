//! A new product touches the tables of products alone: a copy of the repository with one more product, `volume`, is built
//! and used. The product's own files stand in `tests/fixtures/new_product/`.

#[path = "support/mod.rs"]
mod support;

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;
use support::{
    files::{ROOT, read_json, repository_path},
    jobs::NO_SPLIT,
    program::Program,
    schemas,
    workspace::Workspace,
};

/// Files of the repository that a build of the program takes.
const SOURCES: [&str; 10] = [
    ".cargo",
    "Cargo.lock",
    "Cargo.toml",
    "benches",
    "build.rs",
    "jobs",
    "proto",
    "rust-toolchain.toml",
    "scenes",
    "src",
];

/// The tables of products, with the texts that the new rows replace.
const TABLES: [(&str, &[(&str, &str)]); 4] = [
    (
        "src/format/products/mod.rs",
        &[
            ("pub mod reachability;\n", "pub mod reachability;\npub mod volume;\n"),
            ("[&ProductFormat; 4]", "[&ProductFormat; 5]"),
            ("&patches::FORMAT]", "&patches::FORMAT, &volume::FORMAT]"),
        ],
    ),
    (
        "src/format/products/checks.rs",
        &[
            ("patches, reachability}", "patches, reachability, volume}"),
            ("[&ProductChecks; 4]", "[&ProductChecks; 5]"),
            ("&patches::CHECKS]", "&patches::CHECKS, &volume::CHECKS]"),
        ],
    ),
    (
        "src/factory/products/mod.rs",
        &[
            ("pub mod reachability;\n", "pub mod reachability;\npub mod volume;\n"),
            ("[&ProductFactory; 4]", "[&ProductFactory; 5]"),
            ("&patches::FACTORY]", "&patches::FACTORY, &volume::FACTORY]"),
        ],
    ),
    (
        "src/publish/products/mod.rs",
        &[
            ("pub mod reachability;\n", "pub mod reachability;\npub mod volume;\n"),
            ("[&ProductPages; 4]", "[&ProductPages; 5]"),
            ("&patches::PAGES]", "&patches::PAGES, &volume::PAGES]"),
        ],
    ),
];

/// The types of all schemas, which `make schemas` writes anew.
const TYPES: &str = "src/format/generated/graspmill.rs";

/// Folders that are the new product's own, its schema and the descriptors that `make schemas` makes of it.
const OWN: [&str; 5] = [
    "proto/volume.proto",
    "src/factory/products/volume",
    "src/format/generated/volume.bin",
    "src/format/products/volume",
    "src/publish/products/volume",
];

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

/// The sources of a program with one more product: its own files, and its rows in the tables.
fn sources_with_product() -> Files {
    let mut files = sources();
    let before = files.len();
    let mut own = Files::new();
    read_files(&repository_path("tests/fixtures/new_product"), Path::new(""), &mut own);
    let count = own.len();
    files.append(&mut own);
    assert_eq!(files.len(), before + count, "a file of the new product replaces one of the repository");
    for (table, edits) in TABLES {
        let content = files.get_mut(Path::new(table)).unwrap_or_else(|| panic!("no table {table}"));
        let mut text = String::from_utf8(content.clone()).expect("source is UTF-8");
        for (old, new) in edits {
            assert_eq!(text.matches(old).count(), 1, "{table} has other rows than this test knows: {old}");
            text = text.replace(old, new);
        }
        *content = text.into_bytes();
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

/// [`read_files`] of what stands in a folder itself: the link to `.deps` is passed over.
fn read_files_but_links(root: &Path, path: &Path, files: &mut Files) {
    for entry in fs::read_dir(root.join(path)).expect("a folder") {
        let entry = entry.expect("an entry");
        if !entry.file_type().expect("a kind").is_symlink() {
            read_files(root, &path.join(entry.file_name()), files);
        }
    }
}

/// Builds the program with one more product.
fn build() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("new_product");
    write_files(&folder, &sources_with_product());
    // libmujoco is found by a path relative to the sources.
    let link = folder.join(".deps");
    if !link.exists() {
        std::os::unix::fs::symlink(repository_path(".deps"), link).expect("a link");
    }
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("new_product");
    Program::of_system(env!("CARGO"))
        .args(["build", "--locked", "--offline"])
        .env("CARGO_TARGET_DIR", &target)
        .current_dir(&folder)
        .succeed();
    target.join("debug/graspmill")
}

/// The entry of an object of this name.
fn named<'a>(objects: &'a Value, name: &str) -> &'a Value {
    let mut objects = objects.as_array().expect("objects").iter();
    objects.find(|object| object["name"] == name).unwrap_or_else(|| panic!("no object {name}"))
}

#[test]
fn a_new_product_edits_the_tables_alone() {
    let (before, after) = (sources(), sources_with_product());
    let edited: Vec<&Path> =
        before.iter().filter(|(path, content)| after[*path] != **content).map(|(path, _)| path.as_path()).collect();
    let mut expected: Vec<&Path> = TABLES.iter().map(|(table, _)| Path::new(table)).chain([Path::new(TYPES)]).collect();
    expected.sort();
    assert_eq!(edited, expected);
    for path in after.keys().filter(|path| !before.contains_key(*path)) {
        assert!(OWN.iter().any(|own| path.starts_with(own)), "{} is no file of the product's own", path.display());
    }
}

#[test]
#[ignore = "slow: make test-slow"]
fn a_new_product_is_run_verified_inspected_and_reported() {
    let program = build();
    let call = |verb: &str| Program::of_build(&program, verb);
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
