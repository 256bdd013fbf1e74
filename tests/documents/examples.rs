//! The programs in `examples/` run as their heads describe, and what they print is so.

use std::{collections::BTreeMap, path::Path, time::SystemTime};

use crate::support::{
    files::{list_names, read_text, repository_path, stem},
    program::Program,
    workspace::Workspace,
};

/// The examples by name.
fn examples() -> Vec<String> {
    let names = list_names(repository_path("examples")).into_iter().filter(|name| name.ends_with(".rs"));
    names.map(|name| stem(Path::new(&name))).collect()
}

/// Time of a file's last change; `None` where there is no file.
fn modified(path: &Path) -> Option<SystemTime> {
    path.metadata().and_then(|facts| facts.modified()).ok()
}

/// Runs an example from the repository's root, with its temporary files in a workspace; its output.
fn run(example: &str, workspace: &Workspace) -> String {
    let program = Path::new(env!("CARGO_BIN_EXE_graspmill")).with_file_name("examples").join(example);
    let source = repository_path("examples").join(example).with_extension("rs");
    assert!(
        modified(&program) >= modified(&source),
        "{} is older than its source: run `cargo build --release --locked --examples`",
        program.display()
    );
    Program::of_system(program).env("TMPDIR", workspace.folder()).succeed().stdout
}

/// The line that begins with a text, without it.
fn line_after<'a>(output: &'a str, start: &str) -> &'a str {
    let found = output.lines().find_map(|line| line.trim_start().strip_prefix(start));
    found.unwrap_or_else(|| panic!("no line begins with `{start}`:\n{output}"))
}

/// The numbers in a text.
fn numbers(text: &str) -> Vec<f64> {
    let words = text.split(|letter: char| !(letter.is_ascii_digit() || letter == '.' || letter == '-'));
    words.filter_map(|word| word.trim_end_matches('.').parse().ok()).collect()
}

#[test]
fn every_example_has_its_command_and_a_test() {
    let tested = read_text(repository_path("tests/documents/examples.rs"));
    for example in examples() {
        let text = read_text(repository_path("examples").join(&example).with_extension("rs"));
        let head: String = text.lines().take_while(|line| line.starts_with("//!")).collect();
        assert!(
            head.contains(&format!("cargo run --release --example {example}")),
            "{example}: its head has no command"
        );
        assert!(tested.contains(&format!("run(\"{example}\"")), "{example}: no test here runs it");
    }
}

#[test]
fn a_dataset_is_read() {
    let output = run("read", &Workspace::new());
    // Four objects, 6 views of each; rejected ones are counted nowhere.
    let kept = numbers(output.lines().next().unwrap_or_default().split(": ").nth(1).unwrap_or_default())[0];
    let splits =
        ["training: ", "holdout: ", "validation: ", "test: "].map(|split| numbers(line_after(&output, split))[0]);
    assert_eq!(splits.iter().sum::<f64>(), kept, "{output}");
    assert!(kept <= 24.0 && splits.iter().all(|count| *count <= 12.0) && splits[3] > 0.0, "{output}");
    let pairs: Vec<Vec<f64>> = output.lines().filter_map(|line| Some(numbers(line.split_once("saw ")?.1))).collect();
    assert_eq!(pairs.len() as f64, splits[0].min(5.0), "{output}");
    assert!(pairs.iter().all(|pair| pair[0] > 0.0 && pair[0] < pair[1]), "{output}");
}

#[test]
fn a_job_is_run_from_code() {
    let output = run("make", &Workspace::new());
    let made = numbers(line_after(&output, "16 samples in "))[0];
    assert_eq!(output.lines().filter(|line| line.contains(".mcap: ")).count() as f64, made, "{output}");
    assert!(output.contains("intact: true; 4 samples made again, 0 differ"), "{output}");
}

#[test]
fn a_map_and_a_depth_image_are_used() {
    let output = run("runtime", &Workspace::new());
    // A ranking begins with the pose deepest inside.
    let distances: Vec<f64> =
        output.lines().filter_map(|line| Some(numbers(line.split_once(": distance ")?.1)[0])).collect();
    assert!(distances[..3].is_sorted() && distances[0] < 0.0, "{output}");
    // An obstacle takes poses away, and adds none.
    let table = numbers(line_after(&output, "pose 1 with a table: "));
    assert!(table[0] > table[1], "{output}");
    // The image shows five objects: docs/completing.md.
    let volumes: Vec<f64> =
        output.lines().filter_map(|line| Some(numbers(line.split_once(" triangles, ")?.1)[0])).collect();
    assert!(output.contains("5 objects on the table") && volumes.len() == 5, "{output}");
    assert!(volumes.iter().all(|litres| (0.05..5.0).contains(litres)), "{output}");
}

#[test]
fn a_report_and_an_export_are_written() {
    let workspace = Workspace::new();
    let output = run("publish", &workspace);
    let folder = workspace.path("graspmill-example-published");
    let page = read_text(folder.join("report.html"));
    assert!(
        page.contains("three-shapes")
            && page.len() as f64 == numbers(line_after(&output, &format!("{}/report.html: ", folder.display())))[0]
    );
    let script = "import sys, numpy; print(len(numpy.load(sys.argv[1])))";
    let rows = Program::python_lines(script).arg(folder.join("npy/complete.npy")).succeed().stdout;
    let count = numbers(line_after(&output, &format!("{}/npy: ", folder.display())))[0];
    assert!(count > 0.0 && rows.trim() == count.to_string(), "{rows} of {output}");
}

#[test]
fn meshes_are_checked() {
    let output = run("check_meshes", &Workspace::new());
    let report = Program::on("meshes", "check").arg("meshes").read_json();
    let counts: BTreeMap<String, f64> = serde_json::from_value(report["counts"].clone()).expect("counts");
    let printed = numbers(output.lines().last().unwrap_or_default());
    assert_eq!(printed, ["total", "fine", "repaired", "refused"].map(|name| counts[name]), "{output}");
    assert_eq!(output.matches("triangles, ").count() as f64, counts["total"] - counts["refused"], "{output}");
}
