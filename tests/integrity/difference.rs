//! `graspmill diff`: what differs between two datasets, and why.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;

use crate::{ROOT, done, graspmill, products, run};

const JOB: &str = "name = \"same\"\nseed = 3\nviews = { even = 5 }\n[[objects]]\nfolder = \"meshes\"\n[grid]\nresolution = 16\n[gate]\nmin_partial_cells = 1\n\
                   [split]\nvalidation_models = 0\ntest_models = 0\n";

/// A folder with two meshes and the dataset `first` of them.
fn place() -> (tempfile::TempDir, PathBuf) {
    let place = tempfile::tempdir().expect("a scratch folder");
    let meshes = place.path().join("meshes");
    fs::create_dir(&meshes).expect("a folder");
    for (name, top) in [("pyramid", ".05 .05 .1"), ("block", ".02 .02 .15")] {
        mesh(place.path(), name, top);
    }
    let first = run(JOB, place.path(), "first");
    (place, first)
}

fn mesh(place: &Path, name: &str, top: &str) {
    let text = format!(
        "OFF\n5 6 0\n0 0 0\n.1 0 0\n.1 .1 0\n0 .1 0\n{top}\n3 0 2 1\n3 0 3 2\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n"
    );
    fs::write(place.join("meshes").join(format!("{name}.off")), text).expect("a mesh");
}

/// Exit code and JSON of `diff`.
fn diff(a: &Path, b: &Path) -> (i32, Value) {
    let output = graspmill(&["diff", "--json"]).arg(a).arg(b).output().expect("graspmill starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let found = serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {said}"));
    (output.status.code().unwrap_or(-1), found)
}

fn keys(found: &Value) -> Vec<&str> {
    found["settings"].as_array().into_iter().flatten().filter_map(|setting| setting["key"].as_str()).collect()
}

fn reasons(found: &Value) -> Vec<&str> {
    found["reasons"].as_array().into_iter().flatten().filter_map(|reason| reason["what"].as_str()).collect()
}

#[test]
fn the_same_job_is_equal_and_other_shards_are_packaging_alone() {
    let (place, first) = place();
    let again = run(JOB, place.path(), "again");
    let (exit, found) = diff(&first, &again);
    assert_eq!((exit, &found["equal"], &found["both"]["same"]), (0, &true.into(), &10.into()), "{found}");
    assert!(reasons(&found).is_empty() && keys(&found).is_empty(), "{found}");
    assert_eq!(found["packaging"].as_array().map(Vec::len), Some(0), "{found}");
    let cut = run(&format!("{JOB}[shards]\nsamples = 3\n"), place.path(), "cut");
    let (exit, found) = diff(&first, &cut);
    assert_eq!((exit, &found["equal"]), (0, &true.into()), "{found}");
    let packaging = found["packaging"].to_string();
    assert!(packaging.contains("1 shards") && packaging.contains("4 shards of at most 3 samples"), "{packaging}");
    assert_eq!(keys(&found), ["shards.samples"], "the settings are said, though no sample follows from them");
    let said = done(graspmill(&["diff"]).arg(&first).arg(&cut));
    assert!(String::from_utf8_lossy(&said.stdout).contains("equal in content, root "));
}

#[test]
fn another_seed_changes_samples_and_says_so() {
    let (place, first) = place();
    let other = run(
        &JOB.replace("seed = 3", "seed = 4").replace("[grid]", "[sensor]\nprofile = \"kinect-v1\"\n[grid]"),
        place.path(),
        "sensor",
    );
    let seed = run(&JOB.replace("[grid]", "[sensor]\nprofile = \"kinect-v1\"\n[grid]"), place.path(), "seed");
    let (exit, found) = diff(&seed, &other);
    assert_eq!(exit, 4, "{found}");
    assert_eq!(found["both"]["changed"], 10, "{found}");
    assert_eq!(found["channels"]["/completion/pair"]["changed"], 10, "{found}");
    assert_eq!(keys(&found), ["seed"], "{found}");
    assert_eq!(reasons(&found), ["job", "class"], "{found}");
    // One setting: the sensor's profile brings its numbers along.
    let (exit, found) = diff(&first, &seed);
    assert_eq!(exit, 4, "{found}");
    assert!(keys(&found).iter().all(|key| key.starts_with("sensor")) && !keys(&found).is_empty(), "{found}");
}

#[test]
fn one_mesh_that_changed_is_named_and_the_other_samples_are_the_same() {
    let (place, first) = place();
    mesh(place.path(), "pyramid", ".05 .05 .12");
    let other = run(JOB, place.path(), "other");
    let (exit, found) = diff(&first, &other);
    assert_eq!(exit, 4, "{found}");
    assert_eq!(
        (&found["both"]["same"], &found["vanished"], &found["appeared"]),
        (&5.into(), &5.into(), &5.into()),
        "{found}"
    );
    let objects = found["objects"].as_object().expect("objects");
    assert_eq!(objects.keys().collect::<Vec<_>>(), ["pyramid"], "{found}");
    assert_eq!(objects["pyramid"]["samples"], 10, "{found}");
    assert!(reasons(&found).contains(&"assets"), "{found}");
    let said = graspmill(&["diff"]).arg(&first).arg(&other).output().expect("graspmill starts");
    let text = String::from_utf8_lossy(&said.stdout).into_owned();
    assert!(text.contains("pyramid: other content") && text.contains("they DIFFER"), "{text}");
}

#[test]
fn one_more_channel_leaves_the_others_the_same() {
    let (place, first) = place();
    let more = run(&format!("{JOB}[channels]\ncloud = true\n"), place.path(), "more");
    let (exit, found) = diff(&first, &more);
    assert_eq!(exit, 4, "{found}");
    assert_eq!(found["both"]["same"], 10, "{found}");
    assert_eq!(found["channels"]["/completion/cloud"]["only_b"], 10, "{found}");
    assert_eq!(found["channels"]["/completion/pair"]["same"], 10, "{found}");
    assert_eq!(keys(&found), ["channels.cloud"], "{found}");
    assert_eq!(found["objects"].as_object().map(serde_json::Map::len), Some(0), "{found}");
}

/// The manifest as another program would have written it: without a seal, which is no fault.
fn fake(folder: &Path, change: impl Fn(&mut Value)) {
    let path = folder.join("manifest.json");
    let mut manifest: Value = serde_json::from_slice(&fs::read(&path).expect("a manifest")).expect("JSON");
    manifest.as_object_mut().expect("an object").remove("seal");
    change(&mut manifest);
    fs::write(&path, manifest.to_string()).expect("written");
}

#[test]
fn another_version_and_platform_are_reasons() {
    let place = tempfile::tempdir().expect("a scratch folder");
    let jobs = products::jobs(Path::new(ROOT), place.path());
    let (_, grasps) = jobs.iter().find(|(name, _)| *name == "grasps").expect("a job");
    let (a, b) = (run(grasps, place.path(), "a"), run(grasps, place.path(), "b"));
    assert_eq!(diff(&a, &b).0, 0);
    fake(&b, |manifest| {
        manifest["generator"] = "graspmill 9.9.9".into();
        manifest["platform"]["libc"] = "another 1.0".into();
    });
    let (exit, found) = diff(&a, &b);
    assert_eq!(exit, 0, "the samples are the same: {found}");
    assert_eq!(reasons(&found), ["program", "platform"], "{found}");
    assert_eq!(found["reasons"][0]["b"], "graspmill 9.9.9");
}

#[test]
fn other_products_and_folders_that_are_no_dataset() {
    let (place, first) = place();
    let output = graspmill(&["diff"]).arg(&first).arg(place.path()).output().expect("graspmill starts");
    assert!(!output.status.success() && output.stdout.is_empty());
    let jobs = products::jobs(Path::new(ROOT), place.path());
    let (_, map) = jobs.iter().find(|(name, _)| *name == "reachability").expect("a job");
    let map = run(map, place.path(), "map");
    let (exit, found) = diff(&first, &map);
    assert_eq!((exit, &found["vanished"]), (4, &10.into()), "{found}");
    assert_eq!(found["appeared"], found["samples"][1], "{found}");
}
