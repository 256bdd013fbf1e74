//! Objects that come nearer to the camera than its sensor measures: warned of before the run, with a remedy that works.

use graspmill::{
    files::Folder,
    format::{
        Depth,
        dataset::{DatasetReader, Selection},
    },
};
use serde_json::Value;

use crate::support::{jobs::NO_SPLIT, workspace::Workspace};

/// Two objects before a Kinect, which measures from half a metre.
const JOB: &str = "seed = 5\nviews = { even = 6 }\nobjects = [{ built_in = [\"can-01\", \"bottle-01\"] }]\n\
                   camera = { preset = \"kinect-v1-640x480\" }\nsensor = { profile = \"kinect-v1\" }\n\
                   [channels]\ndepth = \"f32\"\n";

/// Runs the job with settings; its warnings about nearness.
fn warnings(workspace: &Workspace, out: &str, settings: &[&str]) -> Vec<String> {
    let run = workspace.run_job("job", out).set(settings).arg("--json").succeed().json::<Value>();
    let all: Vec<String> = serde_json::from_value(run["warnings"].clone()).expect("texts");
    all.into_iter().filter(|text| text.contains("nearer to the camera")).collect()
}

/// The number before `unit` that follows `before` in a text.
fn number_after(text: &str, before: &str) -> f64 {
    let rest = text.split_once(before).expect(before).1;
    rest.split_whitespace().next().expect("a number").parse().expect("a number")
}

/// Smallest depth in a dataset [m].
fn smallest_depth(workspace: &Workspace, name: &str) -> f64 {
    let reader = DatasetReader::open(&Folder::at(workspace.path(name))).expect("a dataset");
    let samples = reader.iter(Selection::default()).map(|sample| sample.expect("readable"));
    let depths = samples.map(|sample| sample.find::<Depth>().expect("readable").expect("stored").crop);
    f64::from(depths.flat_map(|crop| crop.depth).filter(|depth| !depth.is_nan()).fold(f32::INFINITY, f32::min))
}

#[test]
fn objects_nearer_than_the_sensor_measures_are_warned_of_and_the_remedy_keeps_them() {
    let workspace = Workspace::new();
    workspace.write("job.toml", format!("{JOB}{NO_SPLIT}"));
    let found = warnings(&workspace, "near", &["distance=0.5"]);
    let [warning] = &found[..] else { panic!("{found:?}") };
    assert!(warning.starts_with("2 of 2 objects can be nearer") && warning.contains("(0.5 m)"), "{warning}");

    // Farther by as much as the warning has: a perfect sensor finds nothing nearer than the Kinect measures.
    let distance = format!("distance={}", 0.5 + number_after(warning, "increase `distance` by "));
    assert_eq!(warnings(&workspace, "far", &[&distance]), [""; 0]);
    assert_eq!(warnings(&workspace, "perfect", &[&distance, "sensor.profile=none"]), [""; 0]);
    assert!(smallest_depth(&workspace, "perfect") >= 0.5);

    // The other sensor.
    let profile = warning.split_once("`sensor.profile = \"").expect("a sensor").1.split('"').next().expect("its name");
    assert_eq!(warnings(&workspace, "other", &["distance=0.5", &format!("sensor.profile={profile}")]), [""; 0]);
}
