//! A disk that is full, a limit on the size of files, a folder without write permission: exit code 74, a clear message,
//! and the same command resumes once there is room.
//!
//! For root, a tiny separate tmpfs (in a namespace of mounts that ends with the test's process) is really full. Without
//! root, files may not grow beyond a limit (`ulimit -f`), which is the nearest thing to a full disk that a user has.

use std::{path::Path, process::Command};

use crate::support::{
    jobs::{ABOUT, NO_SPLIT},
    products::{MadeProduct, made_products, small_product},
    program::{Program, print_root},
    workspace::Workspace,
};

/// A workspace with the dataset `whole`, its job `whole.toml`, and an about file.
fn make_whole() -> Workspace {
    let workspace = Workspace::new();
    let job = format!(
        "views = {{ even = 60 }}\nobjects = [{{ built_in = [\"can-01\", \"mug-01\"] }}]\n[channels]\ndepth = \"f32\"\n\
         visibility = true\n[shards]\nsamples = 10\n{NO_SPLIT}"
    );
    workspace.make_dataset("whole", &job, &[]);
    workspace.write("about.toml", ABOUT);
    workspace
}

/// Whether mounts can be made in a namespace of our own; without `unshare` none can.
fn can_mount() -> bool {
    let tried = Command::new("unshare").args(["--mount", "sh", "-c", "mount -t tmpfs -o size=64k tmpfs /mnt"]).output();
    tried.is_ok_and(|tried| tried.status.success())
}

/// Runs a shell script with the program as `$0` and `folder` as `$1`: the exit codes that it printed after `exit `, and its
/// whole output.
fn run_script(script: &str, folder: &Path, mounts: bool) -> (Vec<i32>, String) {
    let shell =
        if mounts { Program::of_system("unshare").args(["--mount", "bash"]) } else { Program::of_system("bash") };
    let text = shell.option("-c", script).arg(env!("CARGO_BIN_EXE_graspmill")).arg(folder).finish().text();
    let codes = text.lines().filter_map(|line| line.strip_prefix("exit ")?.parse().ok()).collect();
    (codes, text)
}

#[test]
fn a_full_disk_ends_every_writing_verb_with_74_and_a_run_goes_on_when_there_is_room() {
    if !can_mount() {
        println!("no tmpfs can be mounted here: only a limit on files simulates a full disk");
        return;
    }
    let workspace = make_whole();
    fill_and_go_on(&workspace, "whole", 200);
    // The other writing verbs, on a disk of one page.
    for verb in [
        "report $1/whole --out $1/disk/report.html",
        "export $1/whole --to npy --out $1/disk/npy",
        "export $1/whole --to binvox --out $1/disk/binvox",
        "export $1/whole --to pcd --out $1/disk/pcd",
        "release $1/whole --about $1/about.toml --out $1/disk/release",
    ] {
        let full = format!("mount -t tmpfs -o size=64k tmpfs $1/disk; $0 {verb}; echo exit $?; ls -A $1/disk");
        let (codes, said) = run_script(&full, workspace.folder(), true);
        println!("{verb}: {said}");
        assert_eq!(codes, [74], "{verb}: {said}");
        let disk = workspace.path("disk").display().to_string();
        assert!(said.contains("No space left on device") && said.contains(&disk), "{verb}: {said}");
        assert!(!said.contains("panicked"), "{verb}: {said}");
        assert!(!said.contains(".tmp\n"), "{verb} leaves a folder behind: {said}");
    }
}

#[test]
fn a_file_that_may_not_grow_ends_every_writing_verb_with_74() {
    let workspace = make_whole();
    // In blocks of 1024 bytes; SIGXFSZ comes with the limit, and is not turned off here.
    let limited =
        "ulimit -f 8; $0 run $1/whole.toml --out $1/data --progress none; echo exit $?; ls -A $1/data/shards | wc -l";
    let (codes, said) = run_script(limited, workspace.folder(), false);
    println!("{said}");
    assert_eq!(codes, [74], "{said}");
    assert!(said.contains("File too large") && said.contains("completion-000"), "{said}");
    for verb in [
        "report $1/whole --out $1/report.html",
        "export $1/whole --to npy --out $1/npy",
        "export $1/whole --to binvox --out $1/binvox",
        "release $1/whole --about $1/about.toml --out $1/release",
    ] {
        let (codes, said) = run_script(&format!("ulimit -f 1; $0 {verb}; echo exit $?"), workspace.folder(), false);
        println!("{verb}: {said}");
        assert_eq!(codes, [74], "{verb}: {said}");
        assert!(said.contains("File too large"), "{verb}: {said}");
    }
    workspace.run_job("whole", "data").succeed();
    assert_eq!(print_root(workspace.path("data")), print_root(workspace.path("whole")));
}

/// Bodies that settle while the disk fills.
#[test]
fn scenes_go_on_when_a_full_disk_has_room_again() {
    if !can_mount() {
        println!("no tmpfs can be mounted here");
        return;
    }
    let workspace = Workspace::new();
    let job = format!(
        "product = \"scenes\"\nmode = \"bin\"\ncount = 2\ncontainer = {{ inner_size = [0.3, 0.3, 0.06] }}\n\
         scenes = {{ training = 6 }}\nobjects = [{{ built_in = [\"can-01\", \"box-01\"] }}]\n[shards]\nscenes = 1\n{NO_SPLIT}"
    );
    workspace.make_dataset("bins", &job, &[]);
    fill_and_go_on(&workspace, "bins", 72);
}

/// Makes the dataset of a job again, on a disk of `size` kB, which has room for some of its shards, not all; then there
/// is room, and the same command resumes to the same dataset.
fn fill_and_go_on(workspace: &Workspace, name: &str, size: u32) {
    let script = format!(
        "mkdir -p $1/disk; mount -t tmpfs -o size={size}k tmpfs $1/disk
        $0 run $1/{name}.toml --out $1/disk/data --progress none; echo exit $?
        echo finished $(ls $1/disk/data/shards | grep -c 'mcap$'); ls -A $1/disk/data/shards | grep -c tmp
        mount -o remount,size=64m $1/disk
        $0 run $1/{name}.toml --out $1/disk/data --progress none; echo exit $?
        cp -r $1/disk/data $1/{name}-resumed"
    );
    let (codes, said) = run_script(&script, workspace.folder(), true);
    assert_eq!(codes, [74, 0], "{said}");
    assert!(said.contains("No space left on device") && said.contains("free some space and run again"), "{said}");
    let finished = said.lines().find_map(|line| line.strip_prefix("finished ")?.parse::<u32>().ok());
    assert!(finished.is_some_and(|finished| finished > 0), "{said}");
    let [resumed, whole] = [workspace.path(format!("{name}-resumed")), workspace.path(name)];
    assert_eq!(print_root(&resumed), print_root(whole), "no other sample for having been interrupted");
    Program::on("verify", resumed).succeed();
}

/// A folder that may not be written, also by root: a read-only mount; without root its permissions.
#[test]
fn a_read_only_folder_ends_every_writing_verb_with_74() {
    let workspace = make_whole();
    workspace.make_folder("disk");
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
        let (codes, said) = run_script(&format!("{begin}; $0 {verb}; echo exit $?"), workspace.folder(), mounts);
        println!("{verb}: {said}");
        assert_eq!(codes, [74], "{verb}: {said}");
        let why = if mounts { "Read-only file system" } else { "Permission denied" };
        assert!(said.contains(why) && said.contains("disk"), "{verb}: {said}");
    }
}

/// Makes a dataset again on a disk that is full at a share of its size, or, without mounts, under a limit of its
/// largest file; then there is room, and the same command resumes to the same root. Returns whether the disk was full
/// at all.
#[track_caller]
fn fill_at(made: &MadeProduct, share: f64, mounts: bool) -> bool {
    let workspace = Workspace::new();
    let sizes = sizes_of(&made.dataset);
    // Of a page each, as a file system counts them.
    let whole: u64 = sizes.iter().map(|size| size.div_ceil(4096) * 4).sum();
    let largest = sizes.iter().max().copied().unwrap_or(0) / 1024;
    let run = made.shell_words("$1/disk/data");
    let script = if mounts {
        let size = ((whole as f64 * share) as u64).max(16);
        format!(
            "mkdir -p $1/disk; mount -t tmpfs -o size={size}k tmpfs $1/disk; {run}; echo exit $?
            mount -o remount,size=256m $1/disk; {run}; echo exit $?; cp -r $1/disk/data $1/resumed"
        )
    } else {
        let size = ((largest as f64 * share) as u64).max(1);
        format!(
            "mkdir -p $1/disk; (ulimit -f {size}; {run}; echo exit $?); {run}; echo exit $?; cp -r $1/disk/data $1/resumed"
        )
    };
    let (codes, said) = run_script(&script, workspace.folder(), mounts);
    let what = format!("{} at {share}: {said}", made.product);
    let [first, second] = codes[..] else { panic!("{what}") };
    assert!([0, 3].contains(&second), "{what}");
    assert_eq!(print_root(workspace.path("resumed")), made.root, "{what}");
    if [0, 3].contains(&first) {
        return false;
    }
    assert_eq!(first, 74, "{what}");
    assert!(said.contains("No space left on device") || said.contains("File too large"), "{what}");
    assert!(!said.contains("panicked"), "{what}");
    true
}

/// Sizes of the files of a dataset [bytes].
fn sizes_of(dataset: &Path) -> Vec<u64> {
    crate::support::files::read_tree(dataset).values().map(|content| content.len() as u64).collect()
}

#[test]
fn a_full_disk_ends_a_run_with_74() {
    assert!(fill_at(&small_product("completion"), 0.5, can_mount()), "the disk was full");
}

#[test]
#[ignore = "slow: makes a dataset of each product"]
fn a_full_disk_ends_a_run_of_every_product_with_74() {
    let mounts = can_mount();
    for made in made_products() {
        let was_full = [0.3, 0.8].map(|share| fill_at(made, share, mounts));
        assert!(was_full[0], "{}: {was_full:?}", made.product);
    }
}

#[test]
#[ignore = "ten levels of every product, by a full disk and by a limit: half an hour of two cores"]
fn a_full_disk_ends_a_run_of_every_product_with_74_at_every_level() {
    for mounts in [true, false].into_iter().filter(|mounts| !mounts || can_mount()) {
        for made in made_products() {
            let full = (1..=10).filter(|level| fill_at(made, f64::from(*level) / 10.5, mounts)).count();
            println!("{:14} mounts {mounts}: 10 tried, {full} met the end of the disk", made.product);
            assert!(full > 3, "{}: {full}", made.product);
        }
    }
}

/// Every form of every product's export on a disk of one page, and the verbs that write for pictures.
#[test]
#[ignore = "slow: makes a dataset of each product"]
fn exports_of_every_product_end_with_74_on_a_full_disk() {
    let workspace = Workspace::new();
    let mut tried = 0;
    for (number, made) in made_products().iter().enumerate() {
        for format in graspmill::export::FORMATS
            .iter()
            .filter(|format| format.forms.iter().any(|form| form.product.name == made.product))
        {
            let out = workspace.path(format!("{number}-{}", format.name));
            let script = format!(
                "ulimit -f 0; $0 export {} --to {} --out {}; echo exit $?; ls -d {0}* | grep -c tmp",
                made.dataset.display(),
                format.name,
                out.display()
            );
            let (codes, said) = run_script(&script, workspace.folder(), false);
            // A format of picks or grasps may have nothing to write for such a small dataset: that is reported before
            // anything is written.
            assert!(matches!(codes[..], [74] | [2]), "{} of {}: {said}", format.name, made.product);
            assert!(!said.contains("panicked"), "{} of {}: {said}", format.name, made.product);
            tried += usize::from(codes == [74]);
        }
    }
    assert!(tried > 10, "{tried}");
}
