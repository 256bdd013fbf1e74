//! Names of others on a terminal: no control character, no line end and no mark of direction in one reaches it.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;

use crate::support::{
    files::{copy_folder, repository_path},
    jobs::NO_SPLIT,
    program::{Outcome, Program},
    workspace::Workspace,
};

/// A name that colours, sets a window's title, begins a line, and turns the direction of writing.
const NAME: &str = "a\u{1b}[31mred\u{1b}]0;owned\u{7}\nroot 0000\r\u{202e}b\u{2066}c\u{9b}d\u{200f}";

/// Whether a text acts on a terminal.
fn acts(text: &str) -> bool {
    let is_mark =
        |letter: char| matches!(letter, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    text.chars().any(|letter| letter.is_control() && letter != '\n' && letter != '\t' || is_mark(letter))
}

#[track_caller]
fn assert_harmless(outcome: &Outcome, what: &str) {
    assert!(!acts(&outcome.text()), "{what}: {:?}", outcome.text());
    let begins_a_line = outcome.text().lines().any(|line| line.starts_with("root 0000"));
    assert!(!begins_a_line, "{what}: {}", outcome.text());
}

#[test]
fn names_of_others_are_shown_with_escapes() {
    let workspace = Workspace::new();
    let meshes = workspace.make_folder("meshes");
    fs::copy(repository_path("meshes/bottle.stl"), meshes.join(format!("{NAME}.stl"))).expect("a mesh");
    fs::write(meshes.join(format!("{NAME}-wrong.stl")), "solid x").expect("a mesh");
    let job = workspace.write(
        "job.toml",
        format!("views = {{ even = 3 }}\nobjects = [{{ folder = \"meshes\" }}]\n[shards]\nsamples = 1\n{NO_SPLIT}"),
    );
    let outcome = Program::new("meshes").arg("check").arg(&meshes).finish();
    assert_harmless(&outcome, "meshes check");
    assert!(outcome.stdout.contains("c\\u{9b}d\\u{200f}"), "{}", outcome.stdout);
    assert_harmless(&Program::on("estimate", &job).finish(), "estimate");

    // In JSON the name is what it was.
    let json = Program::new("meshes").arg("check").arg(&meshes).arg("--json").finish();
    assert!(!acts(&json.stdout), "{}", json.stdout);
    let found: Value = json.json();
    assert!(found.to_string().contains("owned"), "{found}");
    let files: Vec<String> =
        found["meshes"].as_array().expect("rows").iter().map(|row| row["file"].to_string()).collect();
    let expected = Value::from(meshes.join(format!("{NAME}.stl")).display().to_string()).to_string();
    assert!(files.contains(&expected), "{files:?}");

    // A dataset with such a name, in a folder with one, and its log.
    let data = workspace.path(format!("data {NAME}"));
    let log = workspace.path("log");
    for run in [Program::run_job(&job, &data).option("--log", &log), Program::run_job(&job, &data)] {
        assert_harmless(&run.finish(), "run");
    }
    assert!(!acts(&fs::read_to_string(&log).expect("a log")));
    for verb in ["inspect", "report", "status", "verify", "digest"] {
        assert_harmless(&Program::on(verb, &data).finish(), verb);
    }
    let exported = Program::on("export", &data).option("--to", "npy").option("--out", workspace.path("npy")).finish();
    assert_harmless(&exported, "export");

    // Errors about files with such names.
    for (what, program) in [
        ("no such job", Program::on("run", workspace.path(NAME)).option("--out", workspace.path("x"))),
        ("no such dataset", Program::on("verify", workspace.path(NAME))),
        ("a strange folder", Program::run_job(&job, strange(&workspace))),
        ("an argument", Program::new(NAME)),
        ("an option", Program::on("export", &data).option("--to", NAME).option("--out", workspace.path("y"))),
    ] {
        let outcome = program.finish();
        assert_harmless(&outcome, what);
        assert_ne!(outcome.code, Some(0), "{what}");
    }
    let shards = data.join("shards");
    fs::write(shards.join(NAME), "?").expect("a file");
    for verb in ["status", "verify"] {
        let outcome = Program::on(verb, &data).finish();
        assert_harmless(&outcome, verb);
        assert!(outcome.text().contains("owned"), "{}", outcome.text());
    }
}

/// A folder that holds a file of that name and no dataset.
fn strange(workspace: &Workspace) -> PathBuf {
    let folder = workspace.make_folder("strange");
    fs::write(folder.join(NAME), "").expect("a file");
    folder
}

/// A manifest and an asset table with such values, behind digests that fit.
#[test]
fn texts_of_strangers_manifests_are_shown_with_escapes() {
    let workspace = Workspace::new();
    let job = format!("views = {{ even = 2 }}\nobjects = [{{ built_in = [\"can-01\"] }}]\n{NO_SPLIT}");
    let dataset = workspace.make_dataset("data", &job, &[]);
    let evil = workspace.path("evil");
    copy_folder(&dataset, &evil);
    edit(&evil.join("assets.json"), |table| table["objects"][0]["name"] = NAME.into());
    edit(&evil.join("manifest.json"), |manifest| {
        manifest["warnings"] = vec![NAME; 300].into();
        manifest["generator"] = NAME.into();
        manifest.as_object_mut().expect("a table").remove("seal");
    });
    for verb in ["inspect", "verify", "report", "status", "digest"] {
        assert_harmless(&Program::on(verb, &evil).finish(), verb);
    }
    let inspected = Program::on("inspect", &evil).finish().text();
    assert!(inspected.contains("and 250 more remarks"), "{inspected}");
}

/// Changes a JSON file.
fn edit(path: &Path, change: impl FnOnce(&mut Value)) {
    let mut value: Value = serde_json::from_slice(&fs::read(path).expect("a file")).expect("JSON");
    change(&mut value);
    fs::write(path, serde_json::to_string_pretty(&value).expect("JSON") + "\n").expect("written");
}
