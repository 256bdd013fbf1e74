//! Files of three gigabytes that hold nothing: refused by their size or their head, with both numbers, for next to no memory.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use crate::support::{
    files::{copy_folder, list_shards, repository_path},
    jobs::{ABOUT, NO_SPLIT},
    program::{Outcome, Program},
    workspace::Workspace,
};

/// Size of each file [bytes]; it takes no block of the disk.
const SIZE: u64 = 3 << 30;
/// Address space of the program [kB]: none of these files fits.
const MEMORY: u32 = 2_500_000;
/// A start under load, and no more.
const AT_ONCE: Duration = Duration::from_secs(20);

/// Gives a file that size, with this beginning.
fn swell(path: &Path, head: &[u8]) -> PathBuf {
    fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    fs::write(path, head).expect("a file");
    File::options().write(true).open(path).and_then(|file| file.set_len(SIZE)).expect("a size");
    path.to_owned()
}

/// Runs graspmill with little memory.
fn run(arguments: &[&str]) -> Outcome {
    let limited = format!("ulimit -v {MEMORY}; exec \"$0\" \"$@\"");
    let program = Program::of_system("bash").option("-c", limited).arg(env!("CARGO_BIN_EXE_graspmill"));
    let began = Instant::now();
    let outcome = program.args(arguments).finish();
    assert!(began.elapsed() < AT_ONCE, "{arguments:?}: {:?}", began.elapsed());
    outcome
}

#[track_caller]
fn assert_refused(outcome: &Outcome, file: &str, codes: &[i32], words: &[&str]) {
    let said = outcome.text();
    assert!(outcome.code.is_some_and(|code| codes.contains(&code)), "{file}: {:?} {said}", outcome.code);
    assert!(said.contains(file.rsplit('/').next().unwrap_or(file)), "{file}: {said}");
    assert!(words.iter().any(|word| said.contains(word)), "{file}: {said}");
    assert!(!said.contains("panicked") && said.len() < 20_000, "{file}: {said}");
}

#[test]
fn inputs_above_their_bounds_are_refused_unread() {
    let workspace = Workspace::new();
    let at = |name: &str| workspace.path(name).display().to_string();
    let out = at("out");
    let size = SIZE.to_string();
    let head = |name: &str, head: &[u8]| swell(&workspace.path(name), head).display().to_string();
    let words =
        [size.as_str(), "head", "format", "NPY", "PNG", "syntax", "no PLY", "does not start", "zero", "meaning"];

    // Files that a command names.
    let npy = {
        let text = "{'descr': '<f4', 'fortran_order': False, 'shape': (480, 640), }";
        [b"\x93NUMPY\x01\x00", &(text.len() as u16).to_le_bytes()[..], text.as_bytes()].concat()
    };
    let png =
        [&b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"[..], &640_u32.to_be_bytes(), &480_u32.to_be_bytes(), &[16, 0, 0, 0, 0]]
            .concat();
    let pcd = b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 640\nHEIGHT 480\nDATA binary\n";
    let ply = b"ply\nformat ascii 1.0\nobj_info num_cols 640\nobj_info num_rows 480\nelement vertex 307200\nproperty float x\n\
                property float y\nproperty float z\nend_header\n";
    for name in ["job.toml", "set.toml"] {
        let file = head(name, if name == "set.toml" { b"product = \"set\"\n" } else { b"" });
        for verb in ["estimate", "run"] {
            let arguments: &[&str] = if verb == "run" { &[verb, &file, "--out", &out] } else { &[verb, &file] };
            assert_refused(&run(arguments), &file, &[2], &words);
        }
    }
    for (name, begin) in [
        ("a.npy", &b""[..]),
        ("b.npy", &npy),
        ("a.png", b""),
        ("b.png", &png),
        ("a.pcd", b""),
        ("b.pcd", pcd),
        ("a.ply", b""),
        ("b.ply", ply),
    ] {
        let file = head(name, begin);
        assert_refused(
            &run(&["segment", &file, "--intrinsics", "300,300,320,240", "--out", &out]),
            &file,
            &[2],
            &words,
        );
    }
    for (name, begin) in
        [("m.stl", &b""[..]), ("m.obj", b"v 0 0 0\n"), ("m.ply", b"ply\n"), ("m.off", b"OFF\n"), ("other.glb", b"glTF")]
    {
        let file = head(name, begin);
        assert_refused(&run(&["meshes", "check", &file]), &file, &[3], &words);
    }
    let depth = repository_path("tests/fixtures").display().to_string();
    assert!(Path::new(&depth).is_dir());
    for name in ["camera.json", "camera.yaml"] {
        let file = head(name, b"");
        let small = workspace.write("depth.npy", &npy).display().to_string();
        assert_refused(&run(&["segment", &small, "--intrinsics", &file, "--out", &out]), &file, &[2], &words);
    }
    for ending in ["xml", "toml"] {
        let hand = workspace.path("hand");
        fs::create_dir_all(&hand).expect("a folder");
        fs::copy(repository_path("scenes/parallel_gripper.xml"), hand.join("g.xml")).expect("a copy");
        fs::copy(repository_path("scenes/parallel_gripper.toml"), hand.join("g.toml")).expect("a copy");
        let file = head(&format!("hand/g.{ending}"), b"");
        assert_refused(&run(&["hand", "check", &at("hand/g.xml")]), &file, &[2], &words);
    }
    let model = workspace.path("model");
    copy_folder(repository_path("tests/models/thicken"), &model);
    for name in ["card.md", "model.json"] {
        let kept = fs::read(model.join(name)).expect("a file");
        let file = head(&format!("model/{name}"), b"");
        assert_refused(&run(&["model", "check", &at("model")]), &file, &[2], &["bytes", "cannot be read"]);
        fs::write(model.join(name), kept).expect("a file");
    }
}

#[test]
fn files_of_jobs_above_their_bounds_are_refused_unread() {
    let workspace = Workspace::new();
    let out = workspace.path("out").display().to_string();
    let cup = repository_path("meshes/bottle.stl").display().to_string();
    let size = SIZE.to_string();
    let jobs = [
        ("table.csv", format!("[[objects]]\nlist = [{cup:?}]\ntable = \"table.csv\"\n{NO_SPLIT}")),
        (
            "poses.csv",
            format!(
                "product = \"scenes\"\n[[objects]]\nbuilt_in = [\"can-01\"]\n[import]\ncsv = \"poses.csv\"\n{NO_SPLIT}"
            ),
        ),
        (
            "bop/scene_gt.json",
            format!(
                "product = \"scenes\"\n[[objects]]\nbuilt_in = [\"can-01\"]\n[import]\nbop = [\"bop\"]\n{NO_SPLIT}"
            ),
        ),
    ];
    for (name, text) in jobs {
        workspace.write("bop/scene_camera.json", "{}");
        let file = swell(&workspace.path(name), b"").display().to_string();
        let job = workspace.write("names.toml", text).display().to_string();
        assert_refused(&run(&["run", &job, "--out", &out]), &file, &[2], &[&size]);
    }
}

#[test]
fn files_of_datasets_above_their_bounds_are_refused_unread() {
    let workspace = Workspace::new();
    let job = format!("views = {{ even = 2 }}\nobjects = [{{ built_in = [\"can-01\"] }}]\n{NO_SPLIT}");
    let dataset = workspace.make_dataset("data", &job, &[]);
    let about = workspace.write("about.toml", ABOUT);
    let release = workspace.path("release");
    Program::on("release", &dataset).option("--about", &about).option("--out", &release).succeed();
    let out = workspace.path("out").display().to_string();
    let shard = list_shards(&dataset)[0].strip_prefix(&dataset).expect("inside").display().to_string();
    let size = SIZE.to_string();
    let cases: [(&Path, &str, &[&str], &[i32]); 14] = [
        (&dataset, "run.json", &["verify", "status"], &[2, 4]),
        (&dataset, "manifest.json", &["verify", "inspect", "report", "digest"], &[2, 4]),
        (&dataset, "assets.json", &["verify", "inspect"], &[2, 4]),
        (&dataset, "splits.json", &["verify", "inspect"], &[2, 4]),
        (&dataset, "rejects.jsonl", &["verify"], &[4]),
        (&dataset, "job.toml", &["report"], &[2]),
        (&dataset, "notes.json", &["report", "inspect"], &[2]),
        (&dataset, "set.json", &["status", "report", "digest"], &[2]),
        (&dataset, &shard, &["inspect", "report"], &[1]),
        (&release, "README.md", &["verify"], &[4]),
        (&release, "manifest-sha256.txt", &["verify"], &[4]),
        (&release, "croissant.json", &["verify"], &[4]),
        (&release, "licences.json", &["verify"], &[4]),
        (&release, "provenance.intoto.json", &["verify"], &[4]),
    ];
    for (of, name, verbs, codes) in cases {
        let copy = workspace.path("copy");
        copy_folder(of, &copy);
        swell(&copy.join(name), b"");
        for verb in verbs {
            let outcome = run(&[verb, &copy.display().to_string()]);
            assert_refused(&outcome, name, codes, &[&size, "line of rejects.jsonl"]);
        }
        fs::remove_dir_all(copy).expect("removed");
    }
    let big = swell(&workspace.path("big.toml"), b"").display().to_string();
    let outcome = run(&["release", &dataset.display().to_string(), "--about", &big, "--out", &out]);
    assert_refused(&outcome, &big, &[2], &[&size]);
    fs::create_dir_all(dataset.join("cluster")).expect("a folder");
    swell(&dataset.join("cluster/submit.json"), b"");
    let outcome = run(&["submit", "--retry", "--out", &dataset.display().to_string()]);
    assert_refused(&outcome, "submit.json", &[2], &[&size]);
}

/// A scene of two million bodies where twenty are allowed: one mistake, not two million.
#[test]
fn a_scene_of_two_million_bodies_is_one_mistake() {
    let workspace = Workspace::new();
    let job = format!(
        "product = \"scenes\"\n[[objects]]\nbuilt_in = [\"can-01\", \"mug-01\"]\n[import]\ncsv = \"poses.csv\"\n{NO_SPLIT}"
    );
    let job = workspace.write("job.toml", job).display().to_string();
    let rows = "k,can-01,0.1,0.2,0.06,0,0,0,1\n".repeat(2_000_000);
    workspace.write("poses.csv", format!("scene,object,x,y,z,qx,qy,qz,qw\n{rows}"));
    let outcome = run(&["run", &job, "--out", &workspace.path("out").display().to_string()]);
    assert_refused(&outcome, "poses.csv", &[2], &["1 to 20 bodies in scene `k`"]);
    // Rows that are all wrong are counted, and a thousand are shown.
    workspace.write("poses.csv", format!("scene,object,x,y,z,qx,qy,qz,qw\n{}", "k,can-01,x\n".repeat(300_000)));
    let outcome = run(&["run", &job, "--out", &workspace.path("out").display().to_string()]);
    let said = outcome.text();
    assert!(
        outcome.code == Some(2) && said.contains("300000 errors in") && said.contains("\nand 299000 more\n"),
        "{}",
        said.len()
    );
}
