//! Views of each object, rotated by a separate rotation per object and otherwise unchanged.

use std::collections::BTreeMap;

use graspmill::{
    files::Folder,
    format::{
        VoxelPair,
        dataset::{DatasetReader, Selection},
    },
    geom::super_fibonacci,
};
use nalgebra::Matrix3;

use super::determinism::digest_payloads;
use crate::support::{program::Program, workspace::Workspace};

const JOB: &str = "name = \"sides\"\nseed = 5\nviews = { even = 12, per_object = true }\ndistance = { min = 0.6, max = 1.2 }\n\
    objects = [{ built_in = [\"can-01\", \"bowl-01\", \"box-01\"] }]\n[channels]\nvisibility = true\n";

/// By object and item, the rotation of each kept pair.
fn rotations(workspace: &Workspace, out: &str) -> BTreeMap<(String, u32), Matrix3<f64>> {
    let reader = DatasetReader::open(&Folder::at(workspace.path(out))).expect("a dataset");
    let samples = reader.iter(Selection::default()).map(|sample| sample.expect("a sample"));
    samples
        .map(|sample| {
            let pair = sample.read::<VoxelPair>().expect("a pair");
            let id = &pair.sample;
            ((id.subject.0.hex(), id.item.0), *pair.world_from_object.rotation().matrix())
        })
        .collect()
}

#[test]
fn every_object_has_a_rotation_of_its_own_before_the_same_views() {
    let workspace = Workspace::new();
    workspace.write("job.toml", JOB);
    workspace.run_job("job", "own").succeed();
    workspace.run_job("job", "other_seed").set(["seed=6"]).succeed();
    workspace.run_job("job", "same").set(["views.per_object=false"]).succeed();
    let [own, other_seed, same] = ["own", "other_seed", "same"].map(|out| rotations(&workspace, out));

    let mut rotations_of: BTreeMap<&str, Vec<Matrix3<f64>>> = BTreeMap::new();
    for ((object, item), rotation) in &own {
        let view = super_fibonacci(*item, 12).into_inner();
        assert!(same.get(&(object.clone(), *item)).is_none_or(|found| *found == view));
        rotations_of.entry(object).or_default().push(view.transpose() * rotation);
    }
    assert_eq!(rotations_of.len(), 3);
    let apart = |a: &Matrix3<f64>, b: &Matrix3<f64>| (a - b).abs().max();
    for each in rotations_of.values() {
        assert!(
            each.len() >= 8 && each.iter().all(|other| apart(other, &each[0]) < 1e-12),
            "one rotation for all views"
        );
        assert!(apart(&each[0], &Matrix3::identity()) > 0.1);
    }
    let firsts: Vec<_> = rotations_of.values().map(|each| each[0]).collect();
    assert!(apart(&firsts[0], &firsts[1]) > 0.1 && apart(&firsts[1], &firsts[2]) > 0.1);
    let both = own.iter().filter_map(|(key, rotation)| Some(apart(rotation, other_seed.get(key)?)));
    assert!(both.fold(f64::MAX, f64::min) > 0.01, "it depends on the seed");
}

#[test]
fn other_objects_change_no_rotation_and_pairs_are_made_again() {
    let workspace = Workspace::new();
    workspace.write("job.toml", JOB);
    workspace.run_job("job", "first").args(["--threads", "1"]).succeed();
    workspace.run_job("job", "more").set([r#"objects=[{built_in=["mug-01","can-01","bowl-01","box-01"]}]"#]).succeed();
    let (before, after) = (digest_payloads(&workspace.path("first")), digest_payloads(&workspace.path("more")));
    assert!(!before.is_empty());
    for (key, digest) in &before {
        assert_eq!(after.get(key), Some(digest), "{key:?}");
    }
    let verify = Program::new("verify").args(["--regenerate", "12", "--seed", "3"]).arg(workspace.path("first"));
    assert_eq!(verify.read_json()["regenerated"]["differences"].as_array().map(Vec::len), Some(0));
}
