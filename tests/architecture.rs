//! The map that tests itself: which room may name which, and where each outside library may be named.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    sync::LazyLock,
};

use graspmill::format::Product;

/// Crates, each a folder of `src/`, with those that their manifests name. ARCHITECTURE.md shows the same table.
const CRATES: &[(&str, &[&str])] = &[
    ("kernel", &[]),
    ("assets", &["kernel"]),
    ("form", &[]),
    ("robot", &["assets", "form", "kernel"]),
    ("format", &["kernel"]),
    ("tables", &["format"]),
    ("surface", &["kernel"]),
    ("planner", &["kernel", "robot", "surface"]),
    ("perception", &["kernel"]),
    ("infer", &["kernel", "surface"]),
    ("measure", &["kernel"]),
    ("runtime", &["format", "infer", "kernel", "measure", "perception", "surface"]),
    ("sim", &["assets", "kernel", "robot"]),
    ("factory", &["assets", "form", "format", "kernel", "robot", "sim", "tables"]),
    ("publish", &["form", "format", "kernel", "tables"]),
    (
        "cli",
        &[
            "assets",
            "factory",
            "form",
            "format",
            "infer",
            "kernel",
            "measure",
            "perception",
            "publish",
            "robot",
            "runtime",
            "sim",
            "surface",
            "tables",
        ],
    ),
];

/// Rooms of the crates that have several, with the rooms of the same crate that each uses: those above it. ARCHITECTURE.md shows
/// the same table.
const ROOMS: &[(&str, &[&str])] = &[
    ("kernel/cancel", &[]),
    ("kernel/geom", &[]),
    ("kernel/ids", &[]),
    ("kernel/npy", &[]),
    ("kernel/seed", &["ids"]),
    ("kernel/words", &["ids"]),
    ("kernel/files", &["words"]),
    ("kernel/render", &["geom", "ids", "seed"]),
    ("kernel/voxel", &["geom", "seed"]),
    ("kernel/contact", &["geom", "voxel"]),
    ("kernel/remedy", &["files"]),
    ("kernel/description", &["files", "ids", "remedy", "words"]),
    ("assets/repair", &[]),
    ("assets/table", &["repair"]),
    ("assets/refuse", &["table"]),
    ("assets/read", &["refuse", "repair", "table"]),
    ("assets/built_in", &["read", "refuse", "repair", "table"]),
    ("assets/folder", &["read", "table"]),
    ("assets/prepare", &["built_in", "read", "refuse", "repair", "table"]),
    ("assets/check", &["folder", "prepare", "table"]),
    ("assets/object", &["prepare", "table"]),
    ("form/names", &[]),
    ("form/path", &[]),
    ("form/pattern", &[]),
    ("form/requirement", &[]),
    ("form/schema", &[]),
    ("form/source", &[]),
    ("form/errors", &["requirement", "source"]),
    ("form/reference", &["requirement", "schema"]),
    ("form/document", &["errors", "path", "requirement", "source"]),
    ("form/checker", &["document", "errors", "path", "requirement"]),
    ("form/walk", &["checker", "document", "errors", "names", "path", "requirement", "schema"]),
    ("form/decode", &["checker", "document", "errors", "path", "schema", "walk"]),
    ("robot/collision", &[]),
    ("robot/kinematics", &[]),
    ("robot/hand", &["kinematics"]),
    ("robot/grasp", &["collision", "hand", "kinematics"]),
    ("robot/suction", &["grasp"]),
    ("planner/energy", &[]),
    ("planner/motion", &[]),
    ("planner/plan", &["energy"]),
    ("format/codec", &[]),
    ("format/product_format", &["codec"]),
    ("format/products", &["codec", "product_format"]),
    ("format/storage", &["codec", "product_format", "products"]),
    ("format/extras", &["codec", "products", "storage"]),
    ("format/dataset", &["extras", "product_format", "products", "storage"]),
    ("tables/table", &[]),
    ("tables/index", &["table"]),
    ("surface/band", &[]),
    ("surface/cases", &[]),
    ("surface/field", &[]),
    ("surface/laplacian", &[]),
    ("surface/mjcf", &[]),
    ("surface/pieces", &[]),
    ("surface/seen", &[]),
    ("surface/volume", &[]),
    ("surface/write", &[]),
    ("surface/cubes", &["cases", "field"]),
    ("surface/smooth", &["band", "field", "volume"]),
    ("surface/joined", &["field", "seen", "smooth"]),
    ("surface/completed", &["cubes", "field", "joined", "pieces", "seen", "smooth", "volume"]),
    ("perception/camera", &[]),
    ("perception/rectification", &["camera"]),
    ("perception/frame", &["rectification"]),
    ("perception/plane", &["frame"]),
    ("perception/read", &["camera", "frame", "rectification"]),
    ("perception/sheet", &["frame"]),
    ("perception/clusters", &["frame", "plane"]),
    ("perception/input", &["clusters", "frame", "plane"]),
    ("perception/labels", &["clusters", "frame", "plane", "sheet"]),
    ("perception/score", &["clusters"]),
    ("perception/outline", &["clusters", "frame", "labels"]),
    ("perception/container", &["frame", "plane"]),
    ("perception/contact", &["clusters", "frame", "labels", "plane"]),
    ("perception/cuboid", &[]),
    ("perception/partition", &["clusters", "frame", "plane"]),
    (
        "perception/scene",
        &["clusters", "contact", "container", "cuboid", "frame", "input", "labels", "partition", "plane", "sheet"],
    ),
    ("infer/npz", &[]),
    ("infer/sample", &[]),
    ("infer/silence", &[]),
    ("infer/error", &["sample"]),
    ("infer/folder", &["error", "sample"]),
    ("infer/golden", &["error", "folder", "npz", "sample"]),
    ("infer/onnx", &["error", "folder"]),
    ("infer/graph", &["error", "folder", "onnx", "silence"]),
    ("infer/bundled", &["folder"]),
    ("infer/model", &["bundled", "error", "folder", "golden", "graph", "onnx", "sample"]),
    ("measure/inside", &[]),
    ("measure/interval", &[]),
    ("measure/learned", &[]),
    ("measure/overlap", &[]),
    ("measure/seen_cells", &[]),
    ("measure/seen_space", &[]),
    ("measure/thesis_rules", &[]),
    ("measure/mirror", &["seen_cells"]),
    ("measure/primitive", &["seen_cells"]),
    ("measure/surfaces", &["inside"]),
    ("measure/baseline", &["mirror", "primitive", "seen_cells"]),
    ("measure/geodesic", &["surfaces"]),
    ("measure/mesh_overlap", &["inside", "surfaces"]),
    ("runtime/completion", &[]),
    ("runtime/reachability", &[]),
    ("sim/convert", &[]),
    ("sim/error", &[]),
    ("sim/physics", &[]),
    ("sim/objects", &["convert", "error"]),
    ("sim/statements", &["error"]),
    ("sim/ffi", &["convert", "error", "objects"]),
    ("sim/description", &["convert", "error", "ffi", "statements"]),
    ("sim/probe", &["error", "ffi"]),
    ("sim/render", &["convert", "error", "ffi", "objects"]),
    ("sim/settle", &["convert", "ffi", "objects", "physics"]),
    ("sim/hand", &["convert", "description", "error", "ffi", "objects", "physics", "statements"]),
    ("sim/trial", &["convert", "error", "ffi", "hand", "objects", "physics"]),
    ("sim/clutter", &["convert", "error", "ffi", "hand", "objects", "physics", "trial"]),
    ("factory/clock", &[]),
    ("factory/cluster", &[]),
    ("factory/error", &[]),
    ("factory/event", &[]),
    ("factory/recent", &[]),
    ("factory/sections", &[]),
    ("factory/context", &["error", "event"]),
    ("factory/plan", &["sections"]),
    ("factory/sink", &["error"]),
    ("factory/work", &["context", "error", "plan", "sections", "sink"]),
    ("factory/objects", &["clock", "error", "sections", "work"]),
    ("factory/product", &["plan", "sections", "work"]),
    ("factory/products", &["clock", "error", "objects", "plan", "product", "recent", "sections", "sink", "work"]),
    ("factory/job", &["product", "products", "sections", "work"]),
    ("factory/run", &["clock", "context", "error", "event", "job", "plan", "sections", "sink", "work"]),
    ("factory/leaks", &["context", "error", "run"]),
    ("publish/asset", &[]),
    ("publish/escape", &[]),
    ("publish/grasp_types", &[]),
    ("publish/markup", &[]),
    ("publish/notes", &[]),
    ("publish/picture", &[]),
    ("publish/scene_objects", &[]),
    ("publish/tally", &[]),
    ("publish/chart", &["escape", "markup", "tally"]),
    ("publish/pick_colours", &["picture"]),
    ("publish/scene_samples", &["picture"]),
    ("publish/templates", &["escape"]),
    ("publish/touch_pictures", &["picture"]),
    ("publish/headline", &["chart"]),
    ("publish/inspection", &["chart", "notes"]),
    ("publish/export", &["inspection"]),
    ("publish/numbers", &["asset", "chart", "inspection", "tally"]),
    ("publish/page", &["chart", "inspection", "notes", "picture"]),
    ("publish/preview", &["inspection", "pick_colours", "picture"]),
    ("publish/evaluation", &["page", "picture", "templates"]),
    ("publish/product", &["asset", "inspection", "numbers", "picture", "preview", "scene_samples", "templates"]),
    ("publish/touch", &["chart", "numbers", "tally"]),
    (
        "publish/products",
        &[
            "asset",
            "chart",
            "escape",
            "grasp_types",
            "headline",
            "inspection",
            "markup",
            "numbers",
            "page",
            "pick_colours",
            "picture",
            "preview",
            "product",
            "scene_objects",
            "scene_samples",
            "tally",
            "templates",
            "touch",
            "touch_pictures",
        ],
    ),
    ("publish/counts", &["chart", "headline", "products"]),
    ("publish/inspect", &["inspection", "products"]),
    ("publish/panels", &["picture", "products"]),
    ("publish/report", &["product", "products"]),
    (
        "publish/release",
        &[
            "asset",
            "chart",
            "inspection",
            "markup",
            "notes",
            "numbers",
            "picture",
            "preview",
            "product",
            "products",
            "report",
            "tally",
            "templates",
        ],
    ),
    (
        "publish/set",
        &[
            "asset",
            "chart",
            "counts",
            "inspection",
            "page",
            "picture",
            "product",
            "products",
            "report",
            "scene_samples",
            "templates",
        ],
    ),
    ("publish/check", &["release"]),
    ("cli/exit", &[]),
    ("cli/local_path", &[]),
    ("cli/log", &[]),
    ("cli/parallel", &[]),
    ("cli/scene_picture", &[]),
    ("cli/completion_args", &["local_path"]),
    ("cli/contacts", &["exit"]),
    ("cli/folder", &["exit"]),
    ("cli/machine", &["exit"]),
    ("cli/pairs", &["exit"]),
    ("cli/printer", &["exit", "log"]),
    ("cli/args", &["completion_args", "local_path"]),
    ("cli/picture", &["completion_args", "exit"]),
    ("cli/stored_samples", &["exit", "folder"]),
    ("cli/diff", &["args", "exit", "folder", "printer"]),
    ("cli/docs", &["args", "exit", "printer"]),
    ("cli/doctor", &["args", "exit", "machine", "printer"]),
    ("cli/hand", &["args", "exit", "pairs", "printer"]),
    ("cli/jobs", &["args", "exit", "machine", "printer"]),
    ("cli/model", &["completion_args", "exit", "picture", "printer"]),
    ("cli/progress", &["args", "exit", "log", "printer"]),
    ("cli/query", &["args", "exit", "folder", "printer"]),
    ("cli/robot", &["args", "exit", "pairs", "printer"]),
    ("cli/segment", &["completion_args", "exit", "picture", "printer"]),
    ("cli/true_meshes", &["exit", "stored_samples"]),
    ("cli/completion_method", &["completion_args", "exit", "model", "stored_samples"]),
    ("cli/meshes", &["args", "exit", "printer", "segment"]),
    ("cli/init", &["args", "exit", "jobs", "local_path", "meshes", "printer"]),
    ("cli/run", &["args", "exit", "jobs", "local_path", "machine", "printer", "progress"]),
    ("cli/task", &["args", "exit", "jobs", "local_path", "machine", "printer", "progress"]),
    ("cli/verify", &["args", "exit", "jobs", "machine", "printer"]),
    (
        "cli/complete",
        &[
            "completion_args",
            "completion_method",
            "contacts",
            "exit",
            "machine",
            "model",
            "parallel",
            "picture",
            "printer",
            "scene_picture",
            "segment",
        ],
    ),
    ("cli/estimate", &["args", "exit", "jobs", "machine", "printer", "progress", "run"]),
    (
        "cli/evaluate",
        &[
            "completion_args",
            "completion_method",
            "exit",
            "machine",
            "parallel",
            "printer",
            "stored_samples",
            "true_meshes",
        ],
    ),
    ("cli/merge", &["args", "exit", "folder", "jobs", "machine", "printer", "run"]),
    ("cli/release", &["args", "exit", "folder", "machine", "printer", "run", "verify"]),
    (
        "cli/complete_dataset",
        &[
            "complete",
            "completion_args",
            "completion_method",
            "exit",
            "machine",
            "parallel",
            "picture",
            "printer",
            "segment",
            "stored_samples",
        ],
    ),
    ("cli/submit", &["args", "estimate", "exit", "jobs", "local_path", "machine", "printer", "progress"]),
    ("cli/dataset", &["args", "exit", "folder", "local_path", "machine", "printer", "submit"]),
    ("cli/set", &["args", "dataset", "exit", "jobs", "local_path", "machine", "printer", "progress", "run", "verify"]),
];

/// Library -> the folders and files that name it.
const HOMES: &[(&str, &[&str])] = &[
    ("mujoco_rs", &["src/sim/"]),
    ("khronos_egl", &["src/sim/"]),
    ("parry3d_f64", &["src/kernel/geom/query.rs"]),
    ("spade", &["src/assets/read/delaunay.rs"]),
    ("mcap", &["src/format/", "src/publish/preview/"]),
    ("parquet", &["src/tables/"]),
    ("tar", &["src/publish/export/"]),
    ("hdf5_pure", &["src/publish/export/"]),
    ("rayon", &["src/factory/"]),
    ("tract_onnx", &["src/infer/graph.rs"]),
    ("minijinja", &["src/publish/", "src/factory/cluster/"]),
    ("anyhow", &["src/cli/"]),
    ("clap", &["src/cli/"]),
];

/// Folders that may name a product: its rows in the three tables, and readers, previews and exports of one product each.
const PRODUCT_ROOMS: [&str; 6] = [
    "src/format/products/",
    "src/factory/products/",
    "src/publish/products/",
    "src/publish/preview/",
    "src/publish/export/",
    "src/runtime/",
];

/// Files outside [`PRODUCT_ROOMS`] that name a product, each with its reason.
const NAMES_A_PRODUCT: &[(&str, &str)] = &[
    (
        "src/factory/job/reference.rs",
        "sections of job files that are called like products, in the order of the reference",
    ),
    ("src/factory/job/spec/mod.rs", "an example of the key `product`"),
    ("src/factory/plan/split.rs", "views of one object as a kind of leak, and their random stream"),
    ("src/publish/notes.rs", "views of one object as a kind of leak"),
    ("src/factory/job/spec/set.rs", "examples of names in a set"),
    ("src/cli/init.rs", "jobs for a new user, a text for each of three products"),
];

/// Longest file, without its tests, that needs no reason.
const LONGEST_FILE: usize = 600;

/// The sources of a folder that were written by hand: `make schemas` writes those in folders named `generated`.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("src is readable") {
        let path = entry.expect("src is readable").path();
        if path.is_dir() && !path.ends_with("generated") {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Whether a file is a module of tests alone.
fn is_for_tests(path: &Path) -> bool {
    let parent =
        ["mod.rs", "lib.rs"].map(|name| fs::read_to_string(path.with_file_name(name)).unwrap_or_default()).concat();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    ["mod", "pub(crate) mod"].iter().any(|word| parent.contains(&format!("#[cfg(test)]\n{word} {stem};")))
}

/// A file's code: no comment lines, nothing from its inline test module on.
fn code_of(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("source is UTF-8");
    let inline = text.match_indices("#[cfg(test)]\nmod ").find(|(at, _)| {
        let line = text[at + "#[cfg(test)]\n".len()..].lines().next().unwrap_or_default();
        line.ends_with('{')
    });
    let code = &text[..inline.map_or(text.len(), |(at, _)| at)];
    code.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// The crate of a file.
fn crate_of(path: &Path) -> String {
    let inside = path.strip_prefix("src").expect("path below src");
    inside.iter().next().expect("a crate").to_string_lossy().into_owned()
}

/// Crates of the house and rooms of a crate that its code names.
fn rooms_named(code: &str, krate: &str) -> BTreeSet<String> {
    let (imports, body) = split_imports(code);
    let paths = imports.into_iter().map(|import| import.path).chain(paths_in(&body));
    let named = paths.filter_map(|path| match (path.first()?.as_str(), path.get(1)) {
        ("crate", Some(room)) => Some(format!("{krate}/{room}")),
        (first, _) => CRATES.iter().find(|(name, _)| *name == first).map(|(name, _)| (*name).to_owned()),
    });
    named.collect()
}

#[test]
fn paths_are_read_as_rust_reads_them() {
    let named = rooms_named(
        "use crate::{geom::{Pose, World}, ids,\n    voxel::solid};\nuse format::Product;\nlet x = crate::seed::Stream::new();",
        "kernel",
    );
    assert_eq!(
        named.into_iter().collect::<Vec<_>>(),
        ["format", "kernel/geom", "kernel/ids", "kernel/seed", "kernel/voxel"]
    );
}

#[test]
fn crates_use_only_what_the_map_says() {
    let crates: BTreeMap<&str, &[&str]> = CRATES.iter().copied().collect();
    let mut wrong = Vec::new();
    for path in sources(Path::new("src")) {
        // The facade names every crate, and tests may use crates above their own.
        if path.parent() == Some(Path::new("src")) || is_for_tests(&path) {
            continue;
        }
        let krate = crate_of(&path);
        let Some(allowed) = crates.get(krate.as_str()) else {
            wrong.push(format!("{}: crate '{krate}' is not on the map", path.display()));
            continue;
        };
        for used in rooms_named(&code_of(&path), &krate).iter().filter(|used| !used.contains('/')) {
            // A module next to or below the file may have the same name as a crate.
            let beside = [path.with_file_name(used), path.with_extension("").join(used)];
            let is_own = beside.iter().any(|module| module.with_extension("rs").exists());
            if *used != krate && !allowed.contains(&used.as_str()) && !is_own {
                wrong.push(format!("{}: {krate} must not use {used}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The rooms of every crate with the rooms of the same crate that each uses, and a file that uses them. A path counts for the
/// room that it names and for the room that defines what it names, so that a re-export hides nothing.
fn rooms_used(modules: &Modules, graph: &Graph) -> BTreeMap<String, BTreeMap<String, PathBuf>> {
    let mut rooms: BTreeMap<String, BTreeMap<String, PathBuf>> = BTreeMap::new();
    for (module, file) in modules.files.iter().filter(|(module, _)| module.len() > 1) {
        let (krate, room) = (&module[0], module[..2].join("/"));
        let named = rooms_named(&code_of(file), krate);
        let defining = graph[module].iter().filter(|used| used.len() > 1).map(|used| used[..2].join("/"));
        let uses = rooms.entry(room.clone()).or_default();
        for used in named.into_iter().chain(defining).filter(|used| *used != room) {
            let Some((other, name)) = used.split_once('/') else { continue };
            if other == krate && modules.files.contains_key(&vec![other.to_owned(), name.to_owned()]) {
                uses.entry(name.to_owned()).or_insert_with(|| file.clone());
            }
        }
    }
    rooms
}

/// Every room of a crate with several rooms has a row, which names exactly the rooms that it uses.
#[test]
fn rooms_use_what_the_map_says() {
    let (modules, graph) = &*MODULES;
    let used = rooms_used(modules, graph);
    let map: BTreeMap<&str, &[&str]> = ROOMS.iter().copied().collect();
    let krate = |room: &str| room.split('/').next().unwrap_or_default().to_owned();
    let is_alone = |room: &str| used.keys().filter(|other| krate(other) == krate(room)).count() == 1;
    let mut wrong = Vec::new();
    for (room, uses) in &used {
        let Some(allowed) = map.get(room.as_str()) else {
            if !is_alone(room) {
                let names: Vec<String> = uses.keys().map(|name| format!("{name:?}")).collect();
                wrong.push(format!("no row in ROOMS: (\"{room}\", &[{}])", names.join(", ")));
            }
            continue;
        };
        let more = uses.iter().filter(|(name, _)| !allowed.contains(&name.as_str()));
        wrong.extend(more.map(|(name, file)| format!("{}: {room} must not use {name}", file.display())));
        let unused = allowed.iter().filter(|name| !uses.contains_key(**name));
        wrong
            .extend(unused.map(|name| format!("{room} does not use {name}: remove it from ROOMS and ARCHITECTURE.md")));
    }
    wrong.extend(map.keys().filter(|room| !used.contains_key(**room)).map(|room| format!("there is no room {room}")));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn manifests_name_the_crates_of_the_map() {
    for (krate, uses) in CRATES {
        let text = fs::read_to_string(format!("src/{krate}/Cargo.toml")).expect("a manifest");
        let manifest: toml::Table = text.parse().expect("TOML");
        let named = manifest["dependencies"].as_table().expect("dependencies").keys();
        let named: Vec<&str> =
            named.map(String::as_str).filter(|name| CRATES.iter().any(|(other, _)| other == name)).collect();
        assert_eq!(named, *uses, "src/{krate}/Cargo.toml");
    }
}

/// Doors of the facade, with libraries that a program behind one does not link. `src/lib.rs` promises the same.
const DOORS: &[(&str, &[&str])] = &[
    ("read", &["clap", "khronos-egl", "mujoco-rs", "parquet", "rayon", "tract-onnx"]),
    ("runtime", &["clap", "khronos-egl", "mujoco-rs", "parquet", "rayon"]),
    ("make", &["clap", "tract-onnx"]),
    ("publish", &["clap", "khronos-egl", "mujoco-rs", "rayon", "tract-onnx"]),
];

/// Dependencies of a crate's manifest.
fn dependencies_of(manifest: &toml::Table) -> Vec<String> {
    manifest["dependencies"].as_table().expect("dependencies").keys().cloned().collect()
}

/// Everything that a feature of the facade links: crates of this repository, and the libraries that their manifests name.
fn linked_by(feature: &str, features: &toml::Table) -> BTreeSet<String> {
    let (mut linked, mut open) = (BTreeSet::new(), vec![feature.to_owned()]);
    while let Some(name) = open.pop() {
        let more = match name.strip_prefix("dep:") {
            Some(krate) if !linked.insert(krate.to_owned()) => continue,
            Some(krate) => {
                let text = fs::read_to_string(format!("src/{krate}/Cargo.toml"));
                let manifest = text.map(|text| text.parse::<toml::Table>().expect("TOML"));
                manifest.map_or(Vec::new(), |manifest| dependencies_of(&manifest))
            }
            None => {
                let named = features[name.as_str()].as_array().expect("a list of features");
                open.extend(named.iter().map(|name| name.as_str().expect("a name").to_owned()));
                continue;
            }
        };
        open.extend(more.into_iter().map(|krate| format!("dep:{krate}")));
    }
    linked
}

#[test]
fn doors_link_only_what_they_need() {
    let root: toml::Table = fs::read_to_string("Cargo.toml").expect("a manifest").parse().expect("TOML");
    let features = root["features"].as_table().expect("features");
    let optional = |name: &String| root["dependencies"][name]["optional"].as_bool() == Some(true);
    assert!(dependencies_of(&root).iter().all(optional), "a crate that every door links");
    for (door, absent) in DOORS {
        let linked = linked_by(door, features);
        let found: Vec<_> = absent.iter().filter(|library| linked.contains(**library)).collect();
        assert!(linked.contains("mcap") && found.is_empty(), "`{door}` links {found:?}");
    }
    let all = linked_by("default", features);
    assert!(DOORS.iter().flat_map(|(_, absent)| *absent).all(|library| all.contains(*library)), "{all:?}");
    let default = features["default"].as_array().expect("default features");
    assert_eq!(default.len() + 1, features.len(), "every door is open by default");
}

/// Metadata, README and licences that each crate needs to be published.
#[test]
fn manifests_are_fit_to_be_published() {
    let read = |path: &str| -> toml::Table { fs::read_to_string(path).expect("a manifest").parse().expect("TOML") };
    let (root, inherited) = (read("Cargo.toml"), toml::toml! { workspace = true });
    let workspace = &root["workspace"];
    for (krate, _) in CRATES {
        let folder = format!("src/{krate}");
        assert_eq!(
            workspace["dependencies"][krate]["version"], workspace["package"]["version"],
            "{krate} in Cargo.toml"
        );
        let manifest = read(&format!("{folder}/Cargo.toml"));
        let package = manifest["package"].as_table().expect("a package");
        for key in ["version", "edition", "rust-version", "license"] {
            assert_eq!(package[key].as_table(), Some(&inherited), "{folder}: {key}");
        }
        assert!(package.contains_key("keywords") && package.contains_key("categories"), "{folder}");
        assert!(package["description"].as_str().is_some_and(|text| text.len() > 40), "{folder}: describe the crate");
        let readme = fs::read_to_string(format!("{folder}/README.md")).expect("a README");
        assert!(readme.starts_with(&format!("# graspmill-{krate}\n")), "{folder}/README.md");
        for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
            let text = |path: &str| fs::read(path).unwrap_or_else(|error| panic!("{path}: {error}"));
            assert_eq!(text(&format!("{folder}/{licence}")), text(licence), "{folder}/{licence}");
        }
    }
}

/// A package holds the folder of its crate and nothing else.
#[test]
fn crates_compile_in_files_of_their_own_folders() {
    let mut wrong = Vec::new();
    for path in sources(Path::new("src")).into_iter().filter(|path| !is_for_tests(path)) {
        let code = code_of(&path);
        let included =
            ["include!(", "include_str!(", "include_bytes!("].into_iter().flat_map(|call| code.split(call).skip(1));
        for name in included.filter_map(|rest| rest.split('"').nth(1)) {
            let depth = path.components().count().saturating_sub(3);
            let climbs = name.matches("../").count();
            if climbs > depth {
                wrong.push(format!(
                    "{}: {name} is outside of the crate: link to it from the crate's folder",
                    path.display()
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn one_version_is_named_everywhere() {
    let text = |path: &str| fs::read_to_string(path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let root: toml::Table = text("Cargo.toml").parse().expect("TOML");
    let version = root["workspace"]["package"]["version"].as_str().expect("a version");
    assert!(text("CITATION.cff").contains(&format!("\nversion: {version}\n")), "CITATION.cff: {version}");
    let python = "python/graspmill/__init__.py";
    assert!(text(python).contains(&format!("\n__version__ = \"{version}\"\n")), "{python}: {version}");
}

/// The fuzzer has its own lockfile, which builds of the crates do not update.
#[test]
fn the_lockfile_of_the_fuzzer_has_what_the_crates_ask_for() {
    let read = |path: &str| -> toml::Table { fs::read_to_string(path).expect("a file").parse().expect("TOML") };
    let lock = read("fuzz/Cargo.lock");
    let packages = lock["package"].as_array().expect("packages");
    for (krate, _) in CRATES {
        let manifest = read(&format!("src/{krate}/Cargo.toml"));
        let asked = manifest["dependencies"].as_table().expect("dependencies").len();
        let is_own = |package: &&toml::Value| package["name"] == manifest["package"]["name"];
        let own = packages.iter().find(is_own).expect("a crate of the fuzzer");
        let locked = own["dependencies"].as_array().expect("dependencies").len();
        assert_eq!(asked, locked, "src/{krate}: `cargo metadata --manifest-path fuzz/Cargo.toml` updates the lockfile");
    }
}

#[test]
fn every_dependency_is_named_in_the_code() {
    let crates = CRATES.iter().map(|(krate, _)| (format!("src/{krate}/Cargo.toml"), vec![format!("src/{krate}")]));
    let facade =
        ["src/lib.rs", "src/main.rs", "tests", "benches", "examples", "fuzz/targets"].map(str::to_owned).to_vec();
    let mut unused = Vec::new();
    for (manifest, folders) in crates.chain([("Cargo.toml".to_owned(), facade)]) {
        let text = fs::read_to_string(&manifest).expect("a manifest");
        let table: toml::Table = text.parse().expect("TOML");
        let mut code = String::new();
        for folder in folders.iter().map(Path::new) {
            let files = if folder.is_dir() { sources(folder) } else { vec![folder.to_owned()] };
            // Tests are part of the same files.
            files.iter().for_each(|file| code += &fs::read_to_string(file).expect("source is UTF-8"));
        }
        for section in ["dependencies", "build-dependencies", "dev-dependencies"] {
            let names = table.get(section).and_then(toml::Value::as_table).into_iter().flat_map(toml::Table::keys);
            for name in names.map(|name| name.replace('-', "_")) {
                let named = [format!("{name}::"), format!("use {name};"), format!("use {name} as ")];
                if !named.iter().any(|word| code.contains(word.as_str())) {
                    unused.push(format!("{manifest}: {name}"));
                }
            }
        }
    }
    assert!(unused.is_empty(), "{}", unused.join("\n"));
}

/// Files that touch the file system past `kernel::files`: the system's own files, a library's, and scratch folders of
/// measurements.
const TOUCH_FILES: [&str; 5] = [
    "src/cli/doctor.rs",
    "src/cli/machine.rs",
    "src/sim/probe.rs",
    "src/sim/build.rs",
    "src/format/dataset/measure.rs",
];

/// Functions of `kernel::files` that follow links, with the files that may call each: what they open was named by a user, on the
/// command line, in a job or in a description.
const FOLLOW_LINKS: &[(&str, &[&str])] = &[
    ("files::open(", &[]),
    ("files::open_bounded(", &["src/assets/", "src/kernel/description/", "src/perception/read/"]),
    ("files::read(", &["src/kernel/description/", "src/publish/set/cover.rs"]),
    (
        "files::read_text(",
        &[
            "src/kernel/description/packages.rs",
            "src/robot/hand/table/",
            "src/perception/camera/",
            "src/factory/job/",
            "src/factory/sections/",
            "src/factory/products/scenes/import/",
            "src/factory/products/views/check.rs",
            "src/publish/release/mod.rs",
            "src/cli/contacts.rs",
            "src/cli/query.rs",
        ],
    ),
    ("files::replace(", &["src/cli/init.rs", "src/publish/report.rs", "src/publish/evaluation/"]),
    ("files::open_log(", &["src/cli/log.rs"]),
    ("files::list(", &["src/assets/folder.rs", "src/cli/doctor.rs"]),
    (
        "Folder::at(",
        &[
            "src/kernel/files/",
            "src/cli/local_path.rs",
            "src/cli/complete_dataset.rs",
            "src/cli/hand.rs",
            "src/factory/products/",
            "src/factory/run/pilot.rs",
            "src/format/storage/new_folder.rs",
            "src/infer/folder.rs",
        ],
    ),
];

#[test]
fn files_are_touched_in_one_room() {
    // `fs` in any spelling, and methods of paths that query the file system.
    let touching = [
        "fs::",
        "File::open(",
        "File::create",
        "File::options(",
        "OpenOptions",
        ".is_file()",
        ".is_dir()",
        ".exists()",
        ".canonicalize()",
        ".read_dir()",
        ".symlink_metadata()",
        ".read_link()",
    ];
    // Types and traits of files that are open, and a file system's free space.
    let harmless = [
        "unix::fs::",
        "fs::File,",
        "fs::File;",
        "fs::{File, TryLockError}",
        "rustix::fs::statvfs",
        "rustix::fs::access",
    ];
    for path in sources(Path::new("src")) {
        let name = path.to_string_lossy();
        let code = harmless.iter().fold(code_of(&path), |code, word| code.replace(word, ""));
        let found = touching.iter().find(|call| {
            let mut befores = code.match_indices(**call).map(|(at, _)| &code[..at]);
            befores.any(|before| call.starts_with('.') || !before.ends_with(|c: char| c.is_alphanumeric() || c == '_'))
        });
        let is_free = TOUCH_FILES.contains(&name.as_ref()) || name.starts_with("src/kernel/files/");
        assert!(
            is_free || is_for_tests(&path) || found.is_none(),
            "{name} uses {found:?}: `kernel::files` refuses what is no regular file, and follows no link inside a folder"
        );
    }
}

#[test]
fn links_are_followed_for_users_alone() {
    for path in sources(Path::new("src")).into_iter().filter(|path| !is_for_tests(path)) {
        let (name, code) = (path.to_string_lossy().into_owned(), code_of(&path));
        for (call, allowed) in FOLLOW_LINKS {
            let is_allowed = name.starts_with("src/kernel/files/") || allowed.iter().any(|home| name.starts_with(home));
            assert!(
                is_allowed || !code.contains(call),
                "{name} calls {call}...): inside a folder a `Folder` opens files; what a user names is opened in {allowed:?}"
            );
        }
        // A path for messages is no way back to a file.
        for way in [".path().join(", "Folder::at(folder.path", "Folder::at(&folder.path"] {
            assert!(!code.contains(way), "{name}: `{way}` leads around the folder: use `subfolder` and `path_of`");
        }
    }
}

#[test]
fn paths_are_shown_with_escapes() {
    for path in sources(Path::new("src")).into_iter().filter(|path| !is_for_tests(path) && !path.ends_with("build.rs"))
    {
        let code: String = code_of(&path).split_whitespace().collect();
        let plain = code.matches(".display()").count() - code.matches(".display().to_string()").count();
        let is_shown = |context: &str| !context.split(';').next().unwrap_or_default().contains(".display()");
        assert!(code.split(".context(").skip(1).all(is_shown), "{}: a context of an error", path.display());
        assert_eq!(
            plain,
            0,
            "{}: messages show a path by `.shown()`, which escapes control characters; `.display().to_string()` is for JSON",
            path.display()
        );
    }
}

#[test]
fn the_map_has_no_cycle() {
    // Each uses those above it alone.
    for (index, (krate, uses)) in CRATES.iter().enumerate() {
        assert!(uses.iter().all(|used| CRATES[..index].iter().any(|(above, _)| above == used)), "{krate}");
    }
    for (index, (room, uses)) in ROOMS.iter().enumerate() {
        let krate = room.split('/').next().unwrap_or_default();
        let stands_above = |used: &&str| ROOMS[..index].iter().any(|(above, _)| *above == format!("{krate}/{used}"));
        assert!(uses.iter().all(stands_above), "{room}");
    }
}

#[test]
fn the_map_in_the_architecture_document_is_this_one() {
    let text = fs::read_to_string("ARCHITECTURE.md").expect("ARCHITECTURE.md is at the root");
    for (name, uses) in CRATES.iter().chain(ROOMS) {
        let row = format!("| `{name}` | {} |", if uses.is_empty() { "-".to_owned() } else { uses.join(" ") });
        assert!(text.contains(&row), "ARCHITECTURE.md lacks the row: {row}");
    }
}

#[test]
fn each_library_has_one_home() {
    let mut wrong = Vec::new();
    for path in sources(Path::new("src")) {
        let (name, code) = (path.to_string_lossy().into_owned(), code_of(&path));
        for (library, homes) in HOMES {
            let named = code.match_indices(&format!("{library}::")).any(|(at, _)| {
                // `crate::format::mcap::` and the like are our own modules.
                !code[..at].ends_with("::") && !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_')
            });
            if named && !homes.iter().any(|home| name.starts_with(home)) {
                wrong.push(format!("{name} names {library}, whose home is {}", homes.join(" and ")));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn only_the_command_line_prints_and_reads_the_environment() {
    let mut wrong = Vec::new();
    let is_build = |path: &Path| path.ends_with("build.rs");
    for path in sources(Path::new("src"))
        .into_iter()
        .filter(|path| !path.starts_with("src/cli") && !is_for_tests(path) && !is_build(path))
    {
        let code = code_of(&path);
        for word in ["println!", "print!(", "env::var", "process::exit"] {
            if code.contains(word) {
                wrong.push(format!("{} uses {word}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn geom_and_plan_do_not_serialise() {
    for path in sources(Path::new("src")) {
        if ["src/kernel/geom", "src/factory/plan"].iter().any(|folder| path.starts_with(folder)) {
            assert!(!code_of(&path).contains("Serialize"), "{} derives Serialize", path.display());
        }
    }
}

#[test]
fn no_file_grows_without_a_reason() {
    for path in sources(Path::new("src")) {
        let text = fs::read_to_string(&path).expect("source is UTF-8");
        let lines = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default().lines().count();
        assert!(
            lines <= LONGEST_FILE || text.contains("// Long because:"),
            "{}: {lines} lines; split it, or add '// Long because: ...'",
            path.display()
        );
    }
}

/// Names of products in a text: a constant of one, or a text that is one's name.
fn products_named(code: &str) -> BTreeSet<String> {
    let words = |product: Product| [format!("Product::{}", product.name.to_uppercase()), format!("\"{product}\"")];
    Product::all().flat_map(words).filter(|word| code.contains(word)).collect()
}

#[test]
fn only_the_tables_name_a_product() {
    let exceptions: BTreeMap<&str, &str> = NAMES_A_PRODUCT.iter().copied().collect();
    let (mut wrong, mut used) = (Vec::new(), BTreeSet::new());
    for path in sources(Path::new("src")).into_iter().filter(|path| !is_for_tests(path)) {
        let name = path.to_string_lossy().into_owned();
        let named = products_named(&code_of(&path)).into_iter().collect::<Vec<_>>().join(", ");
        if named.is_empty() || PRODUCT_ROOMS.iter().any(|room| name.starts_with(room)) {
            continue;
        }
        match exceptions.get_key_value(name.as_str()) {
            Some((file, _)) => _ = used.insert(*file),
            None => wrong.push(format!("{name} names {named}")),
        }
    }
    wrong.extend(
        exceptions.keys().filter(|file| !used.contains(**file)).map(|file| format!("{file} needs no exception")),
    );
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A module's path, its crate first: `["kernel", "geom", "field"]`.
type ModulePath = Vec<String>;

/// The modules that each module uses.
type Graph = BTreeMap<ModulePath, BTreeSet<ModulePath>>;

/// All modules, read once for all tests.
static MODULES: LazyLock<(Modules, Graph)> = LazyLock::new(|| {
    let modules = Modules::read(Path::new("src"));
    let graph = modules.files.keys().map(|module| (module.clone(), modules.used_by(module))).collect();
    (modules, graph)
});

/// The files of all crates as modules, and the imports of each.
struct Modules {
    files: BTreeMap<ModulePath, PathBuf>,
    imports: BTreeMap<ModulePath, Vec<Import>>,
    /// Code of each file without its imports.
    bodies: BTreeMap<ModulePath, String>,
}

/// One name that a `use` brings into a file.
#[derive(Clone, Debug, PartialEq)]
struct Import {
    name: String,
    path: Vec<String>,
    is_public: bool,
}

/// The single paths of a `use` tree.
fn flatten(tree: &str) -> Vec<String> {
    let (mut parts, mut depth, mut start) = (Vec::new(), 0, 0);
    for (at, character) in tree.char_indices() {
        match character {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&tree[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&tree[start..]);
    let parts = parts.into_iter().map(str::trim).filter(|part| !part.is_empty());
    let paths = parts.flat_map(|part| match part.strip_suffix('}').and_then(|part| part.split_once('{')) {
        Some((head, inside)) => flatten(inside).into_iter().map(|rest| format!("{head}{rest}")).collect(),
        None => vec![part.to_owned()],
    });
    paths.collect()
}

/// The imports of a file, and its code without them.
fn split_imports(code: &str) -> (Vec<Import>, String) {
    let (mut imports, mut body, mut rest) = (Vec::new(), String::new(), code);
    let is_use = |line: &str| {
        let line = line.trim_start();
        let line = line.strip_prefix("pub").map_or(line, |line| match line.strip_prefix('(') {
            Some(scope) => scope.split_once(')').map_or(line, |(_, line)| line).trim_start(),
            None => line.trim_start(),
        });
        line.starts_with("use ")
    };
    while !rest.is_empty() {
        let line = rest.split_inclusive('\n').next().unwrap_or(rest);
        if !is_use(line) {
            body.push_str(line);
            rest = &rest[line.len()..];
            continue;
        }
        let end = rest.find(';').expect("a use ends");
        let (head, tree) = rest[..end].split_once("use ").expect("a use");
        for path in flatten(&tree.split_whitespace().collect::<Vec<_>>().join(" ")) {
            let (path, alias) =
                path.split_once(" as ").map_or((path.as_str(), None), |(path, name)| (path, Some(name)));
            let mut path: Vec<String> = path.split("::").map(|part| part.trim().to_owned()).collect();
            if path.last().is_some_and(|last| last == "self") {
                path.pop();
            }
            let name = alias.map(str::to_owned).or_else(|| path.last().cloned()).unwrap_or_default();
            imports.push(Import { name, path, is_public: head.contains("pub") });
        }
        rest = &rest[end + 1..];
    }
    (imports, body)
}

impl Modules {
    fn read(folder: &Path) -> Self {
        let mut modules = Self { files: BTreeMap::new(), imports: BTreeMap::new(), bodies: BTreeMap::new() };
        for path in sources(folder).into_iter().filter(|path| !is_for_tests(path)) {
            let inside = path.strip_prefix(folder).expect("below").with_extension("");
            let mut module: ModulePath = inside.iter().map(|part| part.to_string_lossy().into_owned()).collect();
            match module.last().map(String::as_str) {
                Some("main" | "build") => continue,
                Some("mod" | "lib") => _ = module.pop(),
                _ => {}
            }
            let (imports, body) = split_imports(&code_of(&path));
            modules.imports.insert(module.clone(), imports);
            modules.bodies.insert(module.clone(), body);
            modules.files.insert(module, path);
        }
        modules
    }

    /// The module that defines what a path in a module names; `None` for what another crate defines.
    fn find(&self, module: &ModulePath, path: &[String], depth: usize) -> Option<ModulePath> {
        let (mut at, mut rest) = match path.first()?.as_str() {
            "crate" => (module.first().cloned().into_iter().collect(), &path[1..]),
            "self" => (module.clone(), &path[1..]),
            "super" => {
                let count = path.iter().take_while(|part| *part == "super").count();
                (module[..module.len().checked_sub(count)?].to_vec(), &path[count..])
            }
            first if self.files.contains_key(&child(module, first)) => (module.clone(), path),
            first if CRATES.iter().any(|(name, _)| *name == first) => (vec![first.to_owned()], &path[1..]),
            _ => return None,
        };
        while let Some((first, others)) = rest.split_first() {
            let inner = child(&at, first);
            if self.files.contains_key(&inner) {
                (at, rest) = (inner, others);
                continue;
            }
            // A name that the file only passes on is defined where it comes from.
            let import = self.imports.get(&at)?.iter().find(|import| import.name == *first && depth < 16);
            let Some(import) = import else { break };
            let path: Vec<String> = import.path.iter().chain(others).cloned().collect();
            return self.find(&at, &path, depth + 1);
        }
        Some(at)
    }

    /// The modules whose names a module uses. A `mod.rs` that passes on names of its children does not use them.
    fn used_by(&self, module: &ModulePath) -> BTreeSet<ModulePath> {
        let mut used = BTreeSet::new();
        for import in &self.imports[module] {
            let found = self.find(module, &import.path, 0);
            used.extend(found.filter(|found| !(import.is_public && found.starts_with(module))));
        }
        for path in paths_in(&self.bodies[module]) {
            let first = &path[0];
            let imported = self.imports[module].iter().find(|import| import.name == *first);
            let path = match imported {
                Some(import) => import.path.iter().chain(&path[1..]).cloned().collect(),
                None => path,
            };
            used.extend(self.find(module, &path, 0));
        }
        used.remove(module);
        used
    }
}

fn child(module: &ModulePath, name: &str) -> ModulePath {
    module.iter().cloned().chain([name.to_owned()]).collect()
}

/// Paths of two parts and more in code, such as `super::look::corner`.
fn paths_in(code: &str) -> Vec<Vec<String>> {
    let is_word = |character: char| character.is_alphanumeric() || character == '_';
    let mut paths = Vec::new();
    for text in code.split(|character: char| !is_word(character) && character != ':') {
        let parts: Vec<String> = text.split("::").map(str::to_owned).collect();
        let is_path = parts.len() > 1 && parts.iter().all(|part| !part.is_empty() && part.chars().all(is_word));
        if is_path && parts[0].starts_with(|first: char| first.is_lowercase()) {
            paths.push(parts);
        }
    }
    paths
}

/// Groups of files of which each reaches every other (Tarjan's algorithm, by two searches from each file: the graph is
/// small), as sorted names.
fn circles(graph: &Graph) -> BTreeSet<Vec<ModulePath>> {
    let reach = |start: &ModulePath| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(at) = open.pop() {
            open.extend(graph.get(at).into_iter().flatten().filter(|next| seen.insert((*next).clone())));
        }
        seen
    };
    let reached: BTreeMap<&ModulePath, BTreeSet<ModulePath>> =
        graph.keys().map(|start| (start, reach(start))).collect();
    let in_circle = reached.iter().filter(|(start, seen)| seen.contains(**start));
    let group = |(start, seen): (&&ModulePath, &BTreeSet<ModulePath>)| {
        seen.iter().filter(|other| reached.get(other).is_some_and(|back| back.contains(*start))).cloned().collect()
    };
    in_circle.map(group).collect()
}

/// The shortest way from a file back to itself.
fn shortest_circle(graph: &Graph, start: &ModulePath) -> Vec<ModulePath> {
    let mut paths = vec![vec![start.clone()]];
    let mut seen = BTreeSet::new();
    loop {
        let mut longer = Vec::new();
        for path in paths {
            for next in graph.get(path.last().expect("a start")).into_iter().flatten() {
                let path: Vec<ModulePath> = path.iter().chain([next]).cloned().collect();
                if next == start {
                    return path;
                }
                if seen.insert(next.clone()) {
                    longer.push(path);
                }
            }
        }
        assert!(!longer.is_empty(), "{start:?} is part of no circle");
        paths = longer;
    }
}

#[test]
fn imports_are_read_as_rust_reads_them() {
    let code =
        "pub use a::{self, b::{C, D as E}};\nuse super::x;\npub(in crate::y) use z::*;\nfn f() { x::g(crate::h::I) }\n";
    let (imports, body) = split_imports(code);
    let read: Vec<_> = imports.iter().map(|each| (each.name.as_str(), each.path.join("::"), each.is_public)).collect();
    let expected = [
        ("a", "a", true),
        ("C", "a::b::C", true),
        ("E", "a::b::D", true),
        ("x", "super::x", false),
        ("*", "z::*", true),
    ];
    assert_eq!(read, expected.map(|(name, path, is_public)| (name, path.to_owned(), is_public)));
    assert_eq!(paths_in(&body), [vec!["x", "g"], vec!["crate", "h", "I"]]);
}

#[test]
fn files_stand_in_no_circle() {
    let (modules, graph) = &*MODULES;
    let name = |module: &ModulePath| modules.files[module].to_string_lossy().into_owned();
    let in_circles = circles(graph).into_iter().flatten();
    let paths = in_circles.map(|file| shortest_circle(graph, &file).iter().map(name).collect::<Vec<String>>());
    let wrong: Vec<String> = paths.map(|path| path.join(" -> ")).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
