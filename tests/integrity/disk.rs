//! A disk that is full, a limit on the size of files, a folder that may not be written: exit code 74, a clear word, and the
//! same command goes on once there is room.
//!
//! As root a tiny tmpfs of its own (in a namespace of mounts that ends with the test's process) is really full. Without root
//! files may not grow beyond a limit (`ulimit -f`), which is the nearest thing to a full disk that a user has.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use crate::{ABOUT, ROOT, done, graspmill, run};

const JOB: &str = "views = { even = 60 }\nobjects = [{ built_in = [\"can-01\", \"mug-01\"] }]\n[channels]\ndepth = \"f32\"\nvisibility = true\n\
                   [shards]\nsamples = 10\n[split]\nvalidation_models = 0\ntest_models = 0\n";

/// Whether mounts can be made in a namespace of our own.
fn can_mount() -> bool {
    let tried = Command::new("unshare").args(["--mount", "sh", "-c", "mount -t tmpfs -o size=64k tmpfs /mnt"]).output();
    tried.is_ok_and(|tried| tried.status.success())
}

/// Runs a shell script with the program as `$0` and `place` as `$1`.
fn script(script: &str, place: &Path, mounts: bool) -> Output {
    let mut command = if mounts { Command::new("unshare") } else { Command::new("bash") };
    if mounts {
        command.args(["--mount", "bash"]);
    }
    command.current_dir(ROOT).args(["-c", script]).arg(env!("CARGO_BIN_EXE_graspmill")).arg(place);
    command.output().expect("bash starts")
}

/// The exit code that a script printed after `exit `, and all that was said.
fn exits(output: &Output) -> (Vec<i32>, String) {
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    let codes = text.lines().filter_map(|line| line.strip_prefix("exit ")?.parse().ok()).collect();
    (codes, text)
}

#[test]
fn a_full_disk_ends_every_writing_verb_with_74_and_a_run_goes_on_when_there_is_room() {
    if !can_mount() {
        println!("no tmpfs can be mounted here: the limit on files alone stands for a full disk");
        return;
    }
    let place = tempfile::tempdir().expect("a scratch folder");
    let whole = run(JOB, place.path(), "whole");
    fs::write(place.path().join("about.toml"), ABOUT).expect("an about file");
    // 200 kB hold some shards, not all; then there is room, and the same command goes on.
    let resumed = "mkdir -p $1/disk; mount -t tmpfs -o size=200k tmpfs $1/disk
        $0 run $1/whole.toml --out $1/disk/data --progress none; echo exit $?
        ls $1/disk/data/shards | grep -c 'mcap$'; ls -A $1/disk/data/shards | grep -c tmp
        mount -o remount,size=64m $1/disk
        $0 run $1/whole.toml --out $1/disk/data --progress none; echo exit $?
        cp -r $1/disk/data $1/resumed";
    let (codes, said) = exits(&script(resumed, place.path(), true));
    println!("{said}");
    assert_eq!(codes, [74, 0], "{said}");
    assert!(said.contains("No space left on device") && said.contains("make room and run again"), "{said}");
    let digest = |folder: &Path| done(graspmill(&["digest"]).arg(folder)).stdout;
    assert_eq!(digest(&place.path().join("resumed")), digest(&whole), "no other sample for having been interrupted");
    done(graspmill(&["verify"]).arg(place.path().join("resumed")));
    // The other writing verbs, on a disk of one page.
    for verb in [
        "report $1/whole --out $1/disk/report.html",
        "export $1/whole --to npy --out $1/disk/npy",
        "export $1/whole --to binvox --out $1/disk/binvox",
        "export $1/whole --to pcd --out $1/disk/pcd",
        "release $1/whole --about $1/about.toml --out $1/disk/release",
    ] {
        let full = format!("mount -t tmpfs -o size=64k tmpfs $1/disk; $0 {verb}; echo exit $?; ls -A $1/disk");
        let (codes, said) = exits(&script(&full, place.path(), true));
        println!("{verb}: {said}");
        assert_eq!(codes, [74], "{verb}: {said}");
        assert!(
            said.contains("No space left on device") && said.contains(&format!("{}/disk", place.path().display())),
            "{verb}: {said}"
        );
        assert!(!said.contains("panicked"), "{verb}: {said}");
        assert!(!said.contains(".tmp\n"), "{verb} leaves a folder behind: {said}");
    }
}

#[test]
fn a_file_that_may_not_grow_ends_every_writing_verb_with_74() {
    let place = tempfile::tempdir().expect("a scratch folder");
    let whole = run(JOB, place.path(), "whole");
    fs::write(place.path().join("about.toml"), ABOUT).expect("an about file");
    // In blocks of 1024 bytes; SIGXFSZ comes with the limit, and is not turned off here.
    let limited =
        "ulimit -f 8; $0 run $1/whole.toml --out $1/data --progress none; echo exit $?; ls -A $1/data/shards | wc -l";
    let (codes, said) = exits(&script(limited, place.path(), false));
    println!("{said}");
    assert_eq!(codes, [74], "{said}");
    assert!(said.contains("File too large") && said.contains("completion-000"), "{said}");
    for verb in [
        "report $1/whole --out $1/report.html",
        "export $1/whole --to npy --out $1/npy",
        "export $1/whole --to binvox --out $1/binvox --unpacked",
        "release $1/whole --about $1/about.toml --out $1/release",
    ] {
        let (codes, said) = exits(&script(&format!("ulimit -f 1; $0 {verb}; echo exit $?"), place.path(), false));
        println!("{verb}: {said}");
        assert_eq!(codes, [74], "{verb}: {said}");
        assert!(said.contains("File too large"), "{verb}: {said}");
    }
    done(
        graspmill(&["run", "--progress", "none"])
            .arg(place.path().join("whole.toml"))
            .arg("--out")
            .arg(place.path().join("data")),
    );
    let digest = |folder: &Path| done(graspmill(&["digest"]).arg(folder)).stdout;
    assert_eq!(digest(&place.path().join("data")), digest(&whole));
}

/// A folder that may not be written, also by root: a read-only mount; without root its permissions.
#[test]
fn a_read_only_folder_ends_every_writing_verb_with_74() {
    let place = tempfile::tempdir().expect("a scratch folder");
    run(JOB, place.path(), "whole");
    fs::write(place.path().join("about.toml"), ABOUT).expect("an about file");
    fs::create_dir(place.path().join("disk")).expect("a folder");
    let mounts = can_mount();
    let begin = match mounts {
        true => "mount -t tmpfs -o ro,size=64k tmpfs $1/disk",
        false => "chmod a-w $1/disk",
    };
    for verb in [
        "run $1/whole.toml --out $1/disk/data --progress none",
        "report $1/whole --out $1/disk/report.html",
        "export $1/whole --to npy --out $1/disk/npy",
        "release $1/whole --about $1/about.toml --out $1/disk/release",
    ] {
        let (codes, said) = exits(&script(&format!("{begin}; $0 {verb}; echo exit $?"), place.path(), mounts));
        println!("{verb}: {said}");
        assert_eq!(codes, [74], "{verb}: {said}");
        let why = if mounts { "Read-only file system" } else { "Permission denied" };
        assert!(said.contains(why) && said.contains("disk"), "{verb}: {said}");
    }
}
