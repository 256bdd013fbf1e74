//! The map that tests itself: which room may name which, and where each outside library may be named.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

/// Room -> rooms that it uses. ARCHITECTURE.md shows the same table.
const USES: &[(&str, &[&str])] = &[
    ("ids", &[]),
    ("seed", &["ids"]),
    ("geom", &[]),
    ("assets", &["geom", "ids", "seed", "voxel"]),
    ("voxel", &["geom", "seed"]),
    ("render", &["geom", "seed"]),
    ("record", &["geom", "ids"]),
    ("dataset", &["record", "geom", "ids"]),
    ("job", &["geom", "ids", "seed", "assets", "render", "voxel", "grasp"]),
    ("plan", &["job", "ids", "seed", "geom", "voxel"]),
    ("kinematics", &["geom"]),
    ("collision", &["geom", "kinematics"]),
    ("cluster", &["ids"]),
    ("contact", &["geom", "voxel"]),
    ("hand", &["geom", "kinematics"]),
    ("grasp", &["record", "geom", "ids", "seed", "collision", "contact", "hand", "kinematics"]),
    ("sim", &["ids", "seed", "geom", "assets", "kinematics", "collision", "contact", "hand"]),
    (
        "produce",
        &[
            "ids",
            "seed",
            "geom",
            "assets",
            "voxel",
            "render",
            "record",
            "job",
            "plan",
            "kinematics",
            "collision",
            "contact",
            "hand",
            "grasp",
            "sim",
        ],
    ),
    ("run", &["plan", "produce", "record", "dataset", "ids", "seed", "job", "assets", "geom", "voxel", "sim"]),
    ("export", &["dataset", "record", "geom", "voxel", "ids"]),
    ("release", &["dataset", "record", "geom", "voxel", "ids", "job"]),
    ("runtime", &["dataset", "record", "geom", "voxel", "ids"]),
    (
        "cli",
        &[
            "ids",
            "seed",
            "geom",
            "assets",
            "voxel",
            "render",
            "record",
            "dataset",
            "job",
            "plan",
            "cluster",
            "kinematics",
            "collision",
            "hand",
            "sim",
            "produce",
            "run",
            "export",
            "release",
            "runtime",
        ],
    ),
];

/// Library -> the only place that names it.
const HOMES: &[(&str, &str)] = &[
    ("mujoco_rs", "src/sim/"),
    ("khronos_egl", "src/sim/"),
    ("parry3d_f64", "src/geom/query.rs"),
    ("mcap", "src/dataset/"),
    ("parquet", "src/dataset/"),
    ("tar", "src/export/"),
    ("rayon", "src/run/"),
    ("anyhow", "src/cli/"),
    ("clap", "src/cli/"),
];

/// Longest file, without its tests, that needs no word of excuse.
const LONGEST_FILE: usize = 600;

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("src is readable") {
        let path = entry.expect("src is readable").path();
        if path.is_dir() {
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
    let parent = fs::read_to_string(path.with_file_name("mod.rs")).unwrap_or_default();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    parent.contains(&format!("#[cfg(test)]\nmod {stem};"))
}

/// A file's code: no comment lines, nothing from its test module on.
fn code_of(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("source is UTF-8");
    let code = text.split("#[cfg(test)]").next().unwrap_or_default();
    code.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

fn room_of(path: &Path) -> String {
    let inside = path.strip_prefix("src").expect("path below src");
    let first = inside.components().next().expect("a file").as_os_str().to_string_lossy().into_owned();
    first.trim_end_matches(".rs").to_owned()
}

fn word_at_start(text: &str) -> String {
    text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

/// Rooms that a text names, as `crate::room` or in `crate::{room::..., room}`.
fn rooms_named(code: &str) -> BTreeSet<String> {
    let mut rooms = BTreeSet::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        let Some(list) = rest.strip_prefix('{') else {
            rooms.insert(word_at_start(rest));
            continue;
        };
        rooms.insert(word_at_start(list));
        let mut depth = 0;
        for (place, character) in list.char_indices() {
            match character {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    rooms.insert(word_at_start(&list[place + 1..]));
                }
                _ => {}
            }
        }
    }
    rooms
}

#[test]
fn paths_are_read_as_rust_reads_them() {
    let named =
        rooms_named("use crate::{geom::{Pose, World}, ids,\n    voxel::solid};\nlet x = crate::seed::Stream::new();");
    assert_eq!(named.into_iter().collect::<Vec<_>>(), ["geom", "ids", "seed", "voxel"]);
}

#[test]
fn rooms_use_only_what_the_map_says() {
    let map: BTreeMap<&str, &[&str]> = USES.iter().copied().collect();
    let mut wrong = Vec::new();
    for path in sources(Path::new("src")) {
        let room = room_of(&path);
        if room == "lib" || room == "main" {
            continue;
        }
        let Some(allowed) = map.get(room.as_str()) else {
            wrong.push(format!("{}: room '{room}' is not on the map", path.display()));
            continue;
        };
        for used in rooms_named(&code_of(&path)) {
            if used != room && map.contains_key(used.as_str()) && !allowed.contains(&used.as_str()) {
                wrong.push(format!("{}: {room} must not use {used}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_map_has_no_cycle() {
    fn visit<'a>(room: &'a str, map: &BTreeMap<&'a str, &'a [&'a str]>, path: &mut Vec<&'a str>) {
        assert!(!path.contains(&room), "cycle: {path:?} -> {room}");
        path.push(room);
        for next in map[room] {
            visit(next, map, path);
        }
        path.pop();
    }
    let map: BTreeMap<&str, &[&str]> = USES.iter().copied().collect();
    for (room, _) in USES {
        visit(room, &map, &mut Vec::new());
    }
}

#[test]
fn the_map_in_the_architecture_document_is_this_one() {
    let text = fs::read_to_string("ARCHITECTURE.md").expect("ARCHITECTURE.md stands at the top");
    for (room, uses) in USES {
        let row = format!("| `{room}` | {} |", if uses.is_empty() { "-".to_owned() } else { uses.join(" ") });
        assert!(text.contains(&row), "ARCHITECTURE.md lacks the row: {row}");
    }
}

#[test]
fn each_library_has_one_home() {
    let mut wrong = Vec::new();
    for path in sources(Path::new("src")) {
        let (name, code) = (path.to_string_lossy().into_owned(), code_of(&path));
        for (library, home) in HOMES {
            let named = code.match_indices(&format!("{library}::")).any(|(at, _)| {
                // `crate::dataset::mcap::` and the like are our own modules.
                !code[..at].ends_with("::") && !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_')
            });
            if named && !name.starts_with(home) {
                wrong.push(format!("{name} names {library}, whose home is {home}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn only_the_command_line_prints_and_reads_the_environment() {
    let mut wrong = Vec::new();
    for path in sources(Path::new("src")).into_iter().filter(|path| !path.starts_with("src/cli") && !is_for_tests(path))
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
        if ["geom", "plan"].contains(&room_of(&path).as_str()) {
            assert!(!code_of(&path).contains("Serialize"), "{} derives Serialize", path.display());
        }
    }
}

#[test]
fn no_file_grows_without_a_reason() {
    for path in sources(Path::new("src")) {
        let text = fs::read_to_string(&path).expect("source is UTF-8");
        let lines = text.split("#[cfg(test)]").next().unwrap_or_default().lines().count();
        assert!(
            lines <= LONGEST_FILE || text.contains("// Long because:"),
            "{}: {lines} lines; split it, or say '// Long because: ...'",
            path.display()
        );
    }
}
