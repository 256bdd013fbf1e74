//! Sets: several datasets of the same objects in one folder, made by one command.
#![cfg(feature = "sim")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use graspmill::dataset::{DatasetReader, Manifest, Selection, SetTable};

fn graspmill(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_graspmill"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command.args(arguments).output().expect("graspmill starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The quick set with short searches.
fn run(out: &Path, more: &[&str]) -> Output {
    let short = ["--set", "grasps:annealing.steps=1500", "--set", "grasps:keep.space=force", "--progress", "none"];
    let out = out.to_string_lossy();
    graspmill(&[&["run", "jobs/everything-quick.toml", "--out", &out], &short[..], more].concat())
}

fn made(out: &Path, more: &[&str]) -> SetTable {
    let done = run(out, more);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    SetTable::read(out).expect("readable").expect("a set")
}

#[test]
fn one_command_makes_datasets_that_share_their_objects() {
    let place = tempfile::tempdir().expect("a scratch folder");
    let out = place.path().join("all");
    let table = made(&out, &[]);
    let content = table.made.clone().expect("a finished set");
    let names: Vec<&str> = table.jobs.iter().map(|job| job.name.as_str()).collect();
    assert_eq!(names, ["completion", "touch", "grasps", "patches"]);
    assert_eq!(
        content.objects.iter().map(|object| object.name.as_str()).collect::<Vec<_>>(),
        ["bottle-01", "box-01", "mug-01"]
    );
    assert!(content.differing.is_empty());
    // The ids are those of the samples themselves.
    for name in names {
        let reader = DatasetReader::open(&out.join(name)).expect("a dataset");
        assert_eq!(content.roots[name], reader.manifest().root);
        for object in &content.objects {
            let kept = reader.indices(Selection::default()).filter_map(|index| reader.id(index));
            let kept = kept.filter(|id| id.subject == object.object).count() as u64;
            assert_eq!(object.samples[name], kept, "{name}: {}", object.name);
        }
    }
    // Patches take their grasps from the dataset beside them, by a path that moves with the folder.
    let job = fs::read_to_string(out.join("patches/job.toml")).expect("a job");
    assert!(job.contains("dataset = \"../grasps\"") && !job.contains("grasps.dataset"), "{job}");
    let moved = place.path().join("moved");
    fs::rename(&out, &moved).expect("a move");
    let folder = moved.to_string_lossy();
    let verified = graspmill(&["verify", &folder, "--regenerate", "2"]);
    assert_eq!(verified.status.code(), Some(0), "{}{}", text(&verified.stdout), text(&verified.stderr));
    assert_eq!(text(&verified.stdout).matches("is intact").count(), 4);
    assert_eq!(text(&graspmill(&["digest", &folder]).stdout).trim(), content.root.hex());
    // Each dataset is the one that its job alone makes.
    let alone = place.path().join("alone");
    let job =
        ["run", "jobs/grasps-quick.toml", "--out", &alone.to_string_lossy(), "--progress", "none"].map(str::to_owned);
    let job: Vec<&str> = job.iter().map(String::as_str).collect();
    let done = graspmill(&[&job[..], &["--set", "annealing.steps=1500", "--set", "keep.space=force"]].concat());
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert_eq!(Manifest::read(&alone).expect("a dataset").root, content.roots["grasps"]);
    resumed(&moved, &table);
    damaged(&moved);
}

/// What is lost is made again, what is there is kept, and nothing is said to be whole before it is.
fn resumed(out: &Path, whole: &SetTable) {
    let folder = out.to_string_lossy();
    fs::remove_dir_all(out.join("patches")).expect("a lost dataset");
    fs::remove_file(out.join("touch/manifest.json")).expect("a lost file");
    fs::remove_file(out.join("set.json")).expect("a lost file");
    assert_eq!(made(out, &[]), *whole);
    fs::remove_dir_all(out.join("patches")).expect("a lost dataset");
    let status = text(&graspmill(&["status", &folder]).stdout);
    assert_eq!((status.matches(": complete").count(), status.matches(": not begun").count()), (3, 1), "{status}");
    assert_eq!(made(out, &["--json"]), *whole);
    let status: serde_json::Value =
        serde_json::from_slice(&graspmill(&["status", &folder, "--json"]).stdout).expect("JSON");
    assert_eq!(status["datasets"]["patches"]["state"], "complete");
    assert_eq!(status["made"]["root"].as_str(), whole.made.as_ref().map(|made| made.root.hex()).as_deref());
}

/// A flipped byte anywhere, or other datasets under this name, mean 4; another set is refused.
fn damaged(out: &Path) {
    let folder = out.to_string_lossy();
    let told = run(out, &["--set", "seed=9"]);
    assert_eq!(told.status.code(), Some(2), "{}", text(&told.stderr));
    let other = out.with_file_name("other.toml");
    let job = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("jobs/grasps-quick.toml");
    fs::write(&other, format!("product = \"set\"\n[[jobs]]\nname = \"grasps\"\njob = \"{}\"\n", job.display()))
        .expect("a set");
    let told = graspmill(&["run", &other.to_string_lossy(), "--out", &folder]);
    assert_eq!(told.status.code(), Some(2));
    assert!(text(&told.stderr).contains("this is grasps (grasps)"), "{}", text(&told.stderr));
    let told = graspmill(&["inspect", &folder]);
    assert!(text(&told.stderr).contains("give one of completion, touch, grasps, patches"), "{}", text(&told.stderr));
    let set = fs::read_to_string(out.join("set.json")).expect("a set");
    let lie = set.replacen("\"bottle-01\"", "\"bottle-02\"", 1);
    fs::write(out.join("set.json"), &lie).expect("a lie");
    let told = graspmill(&["verify", &folder]);
    assert_eq!(told.status.code(), Some(4));
    assert!(text(&told.stderr).contains("its seal says"), "{}", text(&told.stderr));
    let (unsealed, _) = lie.split_once(",\n  \"seal\"").expect("a seal");
    fs::write(out.join("set.json"), format!("{unsealed}\n}}\n")).expect("a lie");
    let told = graspmill(&["verify", &folder]);
    assert_eq!(told.status.code(), Some(4));
    assert!(text(&told.stdout).contains("set.json does not say"), "{}", text(&told.stdout));
}

#[test]
fn one_name_for_two_objects_is_said() {
    let place = tempfile::tempdir().expect("a scratch folder");
    let job = |name: &str, side: f64| {
        let folder = place.path().join(name);
        fs::create_dir(&folder).expect("a folder");
        let corners = format!("0 0 0\n{side} 0 0\n0 {side} 0\n0 0 {side}\n");
        let mesh = format!("OFF\n4 4 6\n{corners}3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
        fs::write(folder.join("tetra.off"), mesh).expect("a mesh");
        let text = format!("views = {{ even = 4 }}\n[gate]\nmin_partial_cells = 1\n[[objects]]\nfolder = \"{name}\"\n");
        fs::write(place.path().join(format!("{name}.toml")), text).expect("a job");
        format!("[[jobs]]\nname = \"{name}\"\njob = \"{name}.toml\"\n")
    };
    let set = format!("product = \"set\"\n{}{}", job("small", 0.1), job("large", 0.15));
    fs::write(place.path().join("set.toml"), set).expect("a set");
    let (file, out) = (place.path().join("set.toml"), place.path().join("out"));
    let done = graspmill(&["run", &file.to_string_lossy(), "--out", &out.to_string_lossy(), "--progress", "none"]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    assert!(text(&done.stdout).contains("`tetra` is not the same object"), "{}", text(&done.stdout));
    let content = SetTable::read(&out).expect("readable").and_then(|table| table.made).expect("a finished set");
    assert_eq!((content.objects.len(), content.differing.len()), (2, 1));
    // Only `run` takes a set.
    let told = graspmill(&["estimate", &file.to_string_lossy()]);
    assert_eq!(told.status.code(), Some(2));
    assert!(text(&told.stderr).contains("only `run` takes sets"), "{}", text(&told.stderr));
}
