//! Files that are no regular files: refused at once, before anything waits for them.

use std::{
    fs,
    os::unix::fs::symlink,
    path::Path,
    process::Command,
    time::{Duration, Instant},
};

use crate::support::{
    files::{list_shards, repository_path},
    jobs::{NO_SPLIT, small_job},
    program::Program,
    small_dataset::SmallDataset,
    workspace::Workspace,
};

/// A verb that waits for one of these files would wait for ever. The time of a start under load is far below.
const AT_ONCE: Duration = Duration::from_secs(10);

/// Kinds of entries in place of a regular file.
const KINDS: [&str; 4] = ["a FIFO", "a link to a FIFO", "a device", "a folder"];

/// Reads all that the Python package reads of a dataset.
const READ: &str = "\
import sys, graspmill
try:
    data = graspmill.Dataset(sys.argv[1])
    print(len(list(data)), data.folder.objects(), data.folder.splits())
except graspmill.DatasetError as error:
    sys.exit(str(error))
";

/// Puts something of a kind in the place of a file.
fn replace(path: &Path, kind: &str) {
    _ = fs::remove_file(path);
    _ = fs::remove_dir(path);
    let make_fifo = |fifo: &Path| assert!(Command::new("mkfifo").arg(fifo).status().expect("mkfifo").success());
    match kind {
        "a FIFO" => make_fifo(path),
        "a link to a FIFO" => {
            let fifo = path.with_extension("fifo");
            _ = fs::remove_file(&fifo);
            make_fifo(&fifo);
            symlink(fifo, path).expect("a link");
        }
        "a device" => symlink("/dev/zero", path).expect("a link"),
        "a folder" => fs::create_dir(path).expect("a folder"),
        other => unreachable!("{other}"),
    }
}

/// Runs a program that must end at once and fail; returns its message.
#[track_caller]
fn refused(program: Program, name: &str) -> String {
    let began = Instant::now();
    let outcome = program.fail();
    assert!(began.elapsed() < AT_ONCE, "{name}: {:?}", began.elapsed());
    outcome.text()
}

#[test]
fn files_of_a_dataset_that_are_no_files_are_refused() {
    let workspace = Workspace::new();
    let data = workspace.path("data");
    SmallDataset { resolution: 9, views: 3, ..SmallDataset::default() }.finish(&data);
    let shards = list_shards(&data);
    let shard = shards[0].strip_prefix(&data).expect("below the dataset");
    // The verbs that need a file, and the file.
    let needs: [(&str, &[&str]); 6] = [
        ("manifest.json", &["verify", "inspect", "report"]),
        ("run.json", &["verify"]),
        ("assets.json", &["verify", "inspect", "report"]),
        ("splits.json", &["verify"]),
        ("rejects.jsonl", &["verify"]),
        (shard.to_str().expect("UTF-8"), &["verify", "inspect", "report"]),
    ];
    let mut tried = 0;
    for (file, verbs) in needs {
        let path = data.join(file);
        let content = fs::read(&path).expect("a file of the dataset");
        for kind in KINDS {
            replace(&path, kind);
            for verb in verbs {
                let said = refused(Program::on(verb, &data), &format!("{verb} of {file}, {kind}"));
                // Sizes are compared before files are opened: readers of shards report that first.
                let is_named = ["not a regular file", "is a symbolic link", "the manifest lists"];
                let is_named = is_named.iter().any(|words| said.contains(words));
                assert!(is_named, "{verb} of {file}, {kind}: {said}");
                tried += 1;
            }
            if ["manifest.json", "assets.json", "splits.json"].contains(&file) || file.starts_with("shards") {
                let python = Program::python_lines(READ).arg(&data).env("PYTHONPATH", repository_path("python"));
                let said = refused(python, &format!("Python's reader of {file}, {kind}"));
                let is_named = said.contains("not a regular file") || said.contains("it is a symbolic link");
                assert!(is_named, "{file}, {kind}: {said}");
                tried += 1;
            }
        }
        _ = fs::remove_file(&path);
        _ = fs::remove_dir(&path);
        _ = fs::remove_file(path.with_extension("fifo"));
        fs::write(&path, content).expect("a file");
    }
    Program::on("verify", &data).succeed();
    println!("{tried} refused");
}

#[test]
fn descriptions_that_are_no_files_are_refused_and_so_are_their_meshes() {
    let workspace = Workspace::new();
    let scene = "<mujoco><asset><mesh name=\"part\" file=\"part.stl\"/></asset><worldbody><body><joint name=\"j\"/>\
                 <geom type=\"mesh\" mesh=\"part\"/><site name=\"s\"/></body></worldbody></mujoco>";
    let with_mesh = workspace.write("robot.xml", scene);
    let alone = workspace.path("alone.xml");
    for kind in KINDS {
        replace(&workspace.path("part.stl"), kind);
        replace(&alone, kind);
        for file in [&with_mesh, &alone] {
            for verb in ["hand", "robot"] {
                let program = Program::new(verb).arg("check").arg(file);
                let program = if verb == "robot" { program.args(["--joints", "j", "--target", "s"]) } else { program };
                let said = refused(program, &format!("{verb} check, {kind}"));
                assert!(said.contains("not a regular file"), "{verb} check, {kind}: {said}");
            }
        }
    }
}

#[test]
fn outputs_never_replace_what_is_no_file() {
    let workspace = Workspace::new();
    let data = workspace.path("data");
    SmallDataset { resolution: 9, views: 3, ..SmallDataset::default() }.finish(&data);
    for kind in ["a FIFO", "a folder"] {
        let out = workspace.path("out");
        replace(&out, kind);
        let said = refused(Program::on("report", &data).option("--out", &out), kind);
        assert!(said.contains("not a regular file"), "{kind}: {said}");
        assert!(!fs::metadata(&out).expect("still there").is_file(), "{kind}: it was replaced");
        _ = fs::remove_file(&out);
        _ = fs::remove_dir(&out);
    }
    // A link stays one, and what it leads to is written.
    fs::write(workspace.path("page.html"), "old").expect("a file");
    symlink(workspace.path("page.html"), workspace.path("link.html")).expect("a link");
    Program::on("report", &data).option("--out", workspace.path("link.html")).succeed();
    assert!(fs::symlink_metadata(workspace.path("link.html")).expect("a link").is_symlink());
    assert!(fs::metadata(workspace.path("page.html")).expect("a page").len() > 1000);
}

#[test]
fn a_result_that_cannot_be_written_is_no_success() {
    let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has one");
    let output = Command::new(env!("CARGO_BIN_EXE_graspmill")).arg("schema").stdout(full).output().expect("a program");
    assert_eq!(output.status.code(), Some(74));
    assert!(String::from_utf8_lossy(&output.stderr).contains("cannot write the output"));
}

#[test]
fn inputs_that_are_no_files_are_refused() {
    let workspace = Workspace::new();
    let job = workspace.write(
        "job.toml",
        format!("product = \"completion\"\n[[objects]]\nlist = [\"mesh.stl\", \"box.stl\"]\nunit = \"m\"\n{NO_SPLIT}"),
    );
    fs::copy(repository_path("meshes/bottle.stl"), workspace.path("box.stl")).expect("a mesh of the repository");
    let mesh = workspace.path("mesh.stl");
    for kind in KINDS {
        replace(&mesh, kind);
        let began = Instant::now();
        let said = Program::on("estimate", &job).finish().text();
        assert!(began.elapsed() < AT_ONCE && said.contains("mesh.stl"), "a mesh, {kind}: {said}");
        let said = refused(Program::new("meshes").arg("check").arg(&mesh), &format!("a mesh, {kind}"));
        assert!(said.contains("regular file") || said.contains("folder"), "a mesh, {kind}: {said}");

        let file = workspace.path("other.toml");
        replace(&file, kind);
        for verb in ["estimate", "run"] {
            let program = Program::on(verb, &file);
            let program = if verb == "run" { program.option("--out", workspace.path("out")) } else { program };
            let said = refused(program, &format!("{verb} of a job file, {kind}"));
            assert!(said.contains("not a regular file"), "{verb} of a job file, {kind}: {said}");
        }
    }
}

#[test]
fn a_leftover_that_is_no_file_is_not_waited_for() {
    let workspace = Workspace::new();
    let job = workspace.write("job.toml", small_job("completion"));
    let data = workspace.path("data");
    Program::run_job(&job, &data).option("--task", "0/2").succeed();
    let leftover = data.join("shards/.completion-00001-of-00002.1-1-0.tmp");
    for kind in KINDS {
        replace(&leftover, kind);
        let began = Instant::now();
        for program in [Program::on("status", &data), Program::run_job(&job, &data), Program::on("merge", &data)] {
            program.succeed();
        }
        assert!(began.elapsed() < 4 * AT_ONCE, "{kind}: {:?}", began.elapsed());
        _ = fs::remove_file(data.join("manifest.json"));
    }
}
