//! `graspmill diff`: differences of two datasets, and their reasons.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::{Map, Value};

use crate::support::{
    files::read_json,
    jobs::{NO_SPLIT, copy_small_dataset},
    meshes::pyramid_off,
    program::Program,
    workspace::Workspace,
};

/// The job of all datasets here, with these tables on top.
fn job(tables: &str) -> String {
    format!(
        "name = \"same\"\nseed = 3\nviews = {{ even = 5 }}\n[[objects]]\nfolder = \"meshes\"\n[grid]\nresolution = 16\n\
         [gate]\nmin_partial_cells = 1\n{NO_SPLIT}{tables}"
    )
}

/// A folder with two meshes, and the dataset `first` of them.
fn make_first() -> (Workspace, PathBuf) {
    let workspace = Workspace::new();
    workspace.write("meshes/pyramid.off", pyramid_off([0.05, 0.05, 0.1]));
    workspace.write("meshes/block.off", pyramid_off([0.02, 0.02, 0.15]));
    let first = workspace.make_dataset("first", &job(""), &[]);
    (workspace, first)
}

fn diff(a: &Path, b: &Path) -> Program {
    Program::new("diff").args([a, b])
}

/// Exit code and JSON of `diff`.
fn read_diff(a: &Path, b: &Path) -> (i32, Value) {
    let outcome = diff(a, b).arg("--json").finish();
    (outcome.code.unwrap_or(-1), outcome.json())
}

fn keys(found: &Value) -> Vec<&str> {
    found["settings"].as_array().into_iter().flatten().filter_map(|setting| setting["key"].as_str()).collect()
}

fn reasons(found: &Value) -> Vec<&str> {
    found["reasons"].as_array().into_iter().flatten().filter_map(|reason| reason["what"].as_str()).collect()
}

#[test]
fn the_same_job_is_equal_and_other_shards_are_packaging_alone() {
    let (workspace, first) = make_first();
    let again = workspace.make_dataset("again", &job(""), &[]);
    let (exit, found) = read_diff(&first, &again);
    assert_eq!((exit, &found["equal"], &found["both"]["same"]), (0, &true.into(), &10.into()), "{found}");
    assert!(reasons(&found).is_empty() && keys(&found).is_empty(), "{found}");
    assert_eq!(found["packaging"].as_array().map(Vec::len), Some(0), "{found}");
    let cut = workspace.make_dataset("cut", &job("[shards]\nsamples = 3\n"), &[]);
    let (exit, found) = read_diff(&first, &cut);
    assert_eq!((exit, &found["equal"]), (0, &true.into()), "{found}");
    let packaging = found["packaging"].to_string();
    assert!(packaging.contains("1 shards") && packaging.contains("4 shards of at most 3 samples"), "{packaging}");
    assert_eq!(keys(&found), ["shards.samples"], "the settings are listed, though no sample follows from them");
    assert!(diff(&first, &cut).succeed().stdout.contains("equal in content, root "));
}

#[test]
fn another_seed_changes_samples_and_says_so() {
    let (workspace, first) = make_first();
    let sensor = job("[sensor]\nprofile = \"kinect-v1\"\n");
    let other = workspace.make_dataset("seed", &sensor.replace("seed = 3", "seed = 4"), &[]);
    let sensor = workspace.make_dataset("sensor", &sensor, &[]);
    let (exit, found) = read_diff(&sensor, &other);
    assert_eq!(exit, 4, "{found}");
    assert_eq!(found["both"]["changed"], 10, "{found}");
    assert_eq!(found["channels"]["/completion/pair"]["changed"], 10, "{found}");
    assert_eq!(keys(&found), ["seed"], "{found}");
    assert_eq!(reasons(&found), ["job", "class"], "{found}");
    // One setting: the sensor's profile brings its numbers along.
    let (exit, found) = read_diff(&first, &sensor);
    assert_eq!(exit, 4, "{found}");
    assert!(keys(&found).iter().all(|key| key.starts_with("sensor")) && !keys(&found).is_empty(), "{found}");
}

#[test]
fn one_mesh_that_changed_is_named_and_the_other_samples_are_the_same() {
    let (workspace, first) = make_first();
    workspace.write("meshes/pyramid.off", pyramid_off([0.05, 0.05, 0.12]));
    let other = workspace.make_dataset("other", &job(""), &[]);
    let (exit, found) = read_diff(&first, &other);
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
    let text = diff(&first, &other).finish().stdout;
    assert!(text.contains("pyramid: other content") && text.contains("they DIFFER"), "{text}");
}

#[test]
fn one_more_channel_leaves_the_others_the_same() {
    let (workspace, first) = make_first();
    let more = workspace.make_dataset("more", &job("[channels]\ncloud = true\n"), &[]);
    let (exit, found) = read_diff(&first, &more);
    assert_eq!(exit, 4, "{found}");
    assert_eq!(found["both"]["same"], 10, "{found}");
    assert_eq!(found["channels"]["/completion/cloud"]["only_b"], 10, "{found}");
    assert_eq!(found["channels"]["/completion/pair"]["same"], 10, "{found}");
    assert_eq!(keys(&found), ["channels.cloud"], "{found}");
    assert_eq!(found["objects"].as_object().map(Map::len), Some(0), "{found}");
}

/// Changes the manifest as another program would have written it: without a seal, which is no fault.
fn fake_manifest(folder: &Path, change: impl Fn(&mut Value)) {
    let path = folder.join("manifest.json");
    let mut manifest = read_json(&path);
    manifest.as_object_mut().expect("an object").remove("seal");
    change(&mut manifest);
    fs::write(&path, manifest.to_string()).expect("written");
}

#[test]
fn another_version_and_platform_are_reasons() {
    let workspace = Workspace::new();
    let [a, b] = ["a", "b"].map(|name| copy_small_dataset("grasps", &workspace.path(name)));
    assert_eq!(read_diff(&a, &b).0, 0);
    fake_manifest(&b, |manifest| {
        manifest["generator"] = "graspmill 9.9.9".into();
        manifest["platform"]["libc"] = "another 1.0".into();
    });
    let (exit, found) = read_diff(&a, &b);
    assert_eq!(exit, 0, "the samples are the same: {found}");
    assert_eq!(reasons(&found), ["program", "platform"], "{found}");
    assert_eq!(found["reasons"][0]["b"], "graspmill 9.9.9");
}

#[test]
fn other_products_and_folders_that_are_no_dataset() {
    let (workspace, first) = make_first();
    assert!(diff(&first, workspace.folder()).fail().stdout.is_empty());
    let map = copy_small_dataset("reachability", &workspace.path("map"));
    let (exit, found) = read_diff(&first, &map);
    assert_eq!((exit, &found["vanished"]), (4, &10.into()), "{found}");
    assert_eq!(found["appeared"], found["samples"][1], "{found}");
}
