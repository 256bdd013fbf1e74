//! The program as users without a compiler install it: a wheel, and an installation below a prefix.

use std::{ffi::OsStr, fs, path::Path};

use crate::support::{
    files::{list_names, read_text, repository_path},
    program::{Outcome, Program, print_root},
    workspace::Workspace,
};

/// Two built-in shapes, some views of each.
const JOB: &str = "name = \"two\"\nseed = 5\nobjects = [{ built_in = [\"mug-01\", \"box-01\"] }]\nviews = { even = 4 }\n\
                   [split]\nvalidation_objects = 0\ntest_objects = 0\n";
/// Reads the dataset of [`JOB`]: the first sample's cells, which are neither none nor all.
const READ: &str = "import sys, graspmill\ndata = graspmill.Dataset(sys.argv[1], graspmill.CompletionSample)\n\
                    assert len(data) > 0 and 0 < data[0].complete.sum() < data[0].complete.size\nprint(graspmill.__file__)\n";

/// `scripts/package.py VERB`, with the program of this build.
fn package(verb: &str) -> Program {
    let python = Program::peer("deny/bin/python").arg(repository_path("scripts/package.py")).arg(verb);
    python.option("--program", env!("CARGO_BIN_EXE_graspmill"))
}

/// Makes the wheel in `WORKSPACE/dist`; returns its name.
fn make_wheel(workspace: &Workspace) -> String {
    package("wheel").option("--out", workspace.path("dist")).succeed();
    let [name] = list_names(workspace.path("dist")).try_into().expect("one wheel");
    name
}

/// A program and its arguments with no variable of the environment but PATH, which has one folder of its own and the system's.
fn bare(folder: &Path, words: &[&OsStr]) -> Outcome {
    let path = format!("PATH={}:/usr/bin:/bin", folder.display());
    Program::of_system("/usr/bin/env").arg("-i").arg(path).args(words).current_dir("/").succeed()
}

/// Makes, checks and digests the dataset of [`JOB`] with the program in a folder of programs; returns the root digest.
fn use_program(workspace: &Workspace, folder: &Path, name: &str) -> String {
    let (job, out) = (workspace.write("two.toml", JOB), workspace.path(name));
    let graspmill = |words: &[&OsStr]| {
        let words: Vec<&OsStr> = [OsStr::new("graspmill")].into_iter().chain(words.iter().copied()).collect();
        bare(folder, &words).stdout
    };
    let version = graspmill(&["--version".as_ref()]);
    assert_eq!(version.trim(), format!("graspmill {}", env!("CARGO_PKG_VERSION")));
    graspmill(&["run".as_ref(), job.as_ref(), "--out".as_ref(), out.as_ref(), "--quiet".as_ref()]);
    graspmill(&["verify".as_ref(), out.as_ref()]);
    graspmill(&["report".as_ref(), out.as_ref()]);
    assert!(read_text(out.join("report.html")).contains("mug-01"));
    graspmill(&["digest".as_ref(), out.as_ref()]).trim().to_owned()
}

/// The line of `doctor` about libmujoco, by the program in a folder of programs.
fn library_line(folder: &Path) -> String {
    let said = bare(folder, &["graspmill".as_ref(), "doctor".as_ref()]).stdout;
    let line = said.lines().find(|line| line.contains("MuJoCo")).expect("a line about MuJoCo");
    line.to_owned()
}

/// The dataset of [`JOB`] by the checkout's program: its root digest.
fn root_of_checkout(workspace: &Workspace) -> String {
    let job = workspace.write("two.toml", JOB);
    Program::run_job(job, workspace.path("checkout")).succeed();
    print_root(workspace.path("checkout"))
}

fn has_equal_bytes(one: &Path, other: &Path) -> bool {
    fs::read(one).expect("a file") == fs::read(other).expect("a file")
}

#[test]
#[ignore = "slow: packs and installs the program; needs setuptools, which make test-all installs"]
fn a_wheel_installs_into_an_empty_environment() {
    let workspace = Workspace::new();
    let wheel = make_wheel(&workspace);
    assert!(wheel.contains("-py3-none-manylinux_2_") && wheel.ends_with("_x86_64.whl"), "{wheel}");
    let (wheel, root) = (workspace.path("dist").join(wheel), root_of_checkout(&workspace));
    println!("{}: {} bytes", wheel.display(), fs::metadata(&wheel).expect("the wheel").len());

    // An empty environment, which sees NumPy and zstandard of the tests' own.
    let venv = workspace.path("venv");
    Program::python().args(["-m", "venv"]).arg(&venv).succeed();
    let pip = |words: &[&OsStr]| {
        let offline = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-index", "--no-deps"];
        Program::of_system(venv.join("bin/python")).args(offline).args(words).succeed();
    };
    let purelib = "import sysconfig; print(sysconfig.get_path('purelib'))";
    let others = Program::python_lines(purelib).succeed().stdout;
    let own = Program::of_system(venv.join("bin/python")).option("-c", purelib).succeed().stdout;
    let own = Path::new(own.trim());
    fs::write(own.join("tests.pth"), others).expect("written");
    pip(&[wheel.as_ref()]);

    let programs = venv.join("bin");
    assert_eq!(use_program(&workspace, &programs, "venv-data"), root);
    let line = library_line(&programs);
    assert!(line.contains("the pinned build") && line.contains("graspmill/_lib/libmujoco.so"), "{line}");
    let data = workspace.path("venv-data");
    let read = bare(&programs, &["python".as_ref(), "-c".as_ref(), READ.as_ref(), data.as_ref()]).stdout;
    assert!(Path::new(read.trim()).starts_with(own), "{read}");
    // Python finds the program without PATH.
    let find = "from graspmill import segmenting; print(segmenting._installed_program())";
    let python = venv.join("bin/python");
    let found = bare(workspace.folder(), &[python.as_ref(), "-c".as_ref(), find.as_ref()]).stdout;
    assert_eq!(Path::new(found.trim()), own.join("graspmill/_bin/graspmill"));

    bare(&programs, &["python".as_ref(), "-m".as_ref(), "graspmill.fetch".as_ref(), "--help".as_ref()]);

    // Its parts: libmujoco as it was, completions, manual pages, licences.
    let [library] = list_names(own.join("graspmill/_lib")).try_into().expect("one library");
    assert!(has_equal_bytes(
        &own.join("graspmill/_lib").join(&library),
        &repository_path(".deps/mujoco").join(&library)
    ));
    for path in [
        "share/bash-completion/completions/graspmill",
        "share/zsh/site-functions/_graspmill",
        "share/man/man1/graspmill-run.1",
    ] {
        assert!(venv.join(path).is_file(), "{path}");
    }
    let licences = own.join(format!("graspmill-{}.dist-info/licenses", env!("CARGO_PKG_VERSION")));
    let names = list_names(&licences);
    for name in
        ["LICENSE-APACHE", "LICENSE-MIT", "LICENSE-MUJOCO", "LICENSES-CRATES.md", "LICENSES-MUJOCO-THIRD-PARTY.md"]
    {
        assert!(names.iter().any(|found| found == name), "{name}: {names:?}");
    }
    let crates = read_text(licences.join("LICENSES-CRATES.md"));
    assert!(crates.contains("| nalgebra | ") && crates.contains("| mujoco-rs | ") && !crates.contains("| proptest | "));

    // A folder of its own, without an environment.
    let target = workspace.path("target-folder");
    pip(&["--target".as_ref(), target.as_ref(), wheel.as_ref()]);
    assert_eq!(use_program(&workspace, &target.join("bin"), "target-data"), root);
    let line = library_line(&target.join("bin"));
    assert!(line.contains("target-folder/graspmill/_lib/libmujoco.so"), "{line}");
}

#[test]
#[ignore = "slow: packs and installs the program; needs setuptools, which make test-all installs"]
fn a_wheel_is_the_same_bytes_again_and_promises_no_older_system() {
    let workspace = Workspace::new();
    let name = make_wheel(&workspace);
    let first = workspace.path("dist").join(&name);
    package("wheel").option("--out", workspace.path("again")).succeed();
    assert!(has_equal_bytes(&first, &workspace.path("again").join(&name)));
    let low = package("wheel").option("--out", workspace.path("low")).option("--tag", "manylinux_2_17_x86_64");
    let said = low.expect_code(1).stderr;
    assert!(said.contains("too low") && said.contains("glibc 2."), "{said}");
    assert!(!workspace.path("low").exists());
}

#[test]
#[ignore = "slow: packs and installs the program; needs setuptools, which make test-all installs"]
fn an_installation_below_a_prefix_runs() {
    let workspace = Workspace::new();
    let destination = workspace.path("staged");
    package("install").option("--prefix", "/opt/mill").option("--destdir", &destination).succeed();
    // Moved as a packager does.
    let prefix = workspace.path("prefix");
    fs::rename(destination.join("opt/mill"), &prefix).expect("moved");
    assert_eq!(use_program(&workspace, &prefix.join("bin"), "prefix-data"), root_of_checkout(&workspace));
    let line = library_line(&prefix.join("bin"));
    assert!(line.contains("the pinned build") && line.contains("lib/graspmill/libmujoco.so"), "{line}");
    for path in [
        "share/man/man1/graspmill.1",
        "share/doc/graspmill/LICENSE-MUJOCO",
        "share/fish/vendor_completions.d/graspmill.fish",
    ] {
        assert!(prefix.join(path).is_file(), "{path}");
    }
    let relative = package("install").option("--prefix", "opt").expect_code(2).stderr;
    assert!(relative.contains("give an absolute path"), "{relative}");
}
