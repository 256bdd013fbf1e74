//! One job gives one set of bytes for all threads, vector instructions, folders, shards, other objects and kills.

use std::{collections::BTreeMap, fs, path::Path, time::Duration};

use graspmill::{
    files::Folder,
    format::dataset::{DatasetReader, Fate},
    geom::SimdLevel,
};

use crate::support::{
    files::{list_names, read_text},
    program::{Program, print_root},
    workspace::Workspace,
};

const JOB: &str = r#"
name = "determinism"
seed = 11
views = { even = 16 }
distance = { min = 0.6, max = 1.2 }

[[objects]]
built_in = ["can-01", "bottle-01", "bowl-01", "half-cube-sphere"]

[sensor]
profile = "kinect-v1"

[occlusion]

[channels]
depth = "f32"

[touch]
random_rays = true

[shards]
samples = 13
"#;

fn write_job(text: &str) -> Workspace {
    let workspace = Workspace::new();
    workspace.write("job.toml", text);
    workspace
}

/// Shard files by name: the name holds the content's digest.
fn shards(out: &Path) -> Vec<String> {
    list_names(out.join("shards"))
}

/// Digests of every payload, by sample id and channel, read from the shards' ledgers.
pub fn digest_payloads(out: &Path) -> BTreeMap<(String, String), String> {
    let reader = DatasetReader::open(&Folder::at(out)).expect("a dataset");
    let mut all = BTreeMap::new();
    for shard in 0..reader.manifest().shards.len() {
        let ledger = reader.ledger(shard).expect("a ledger");
        for row in &ledger.rows {
            match &row.fate {
                Fate::Kept(digests) => {
                    for (channel, digest) in ledger.channels.iter().zip(digests) {
                        all.insert((row.sample.to_string(), channel.name().to_owned()), digest.hex());
                    }
                }
                Fate::Rejected { reason, .. } => {
                    all.insert((row.sample.to_string(), "rejected".to_owned()), reason.clone());
                }
            }
        }
    }
    all
}

#[test]
fn threads_levels_and_folders_change_no_byte() {
    let workspace = write_job(JOB);
    let first = workspace.path("first");
    workspace.run_job("job", "first").args(["--threads", "1"]).succeed();
    let others =
        [("two", "2", None), ("elsewhere", "1", None), ("scalar", "1", Some("scalar")), ("avx2", "2", Some("avx2"))];
    for (name, threads, simd) in others {
        if simd.is_some_and(|level| SimdLevel::detect() < level.parse().expect("a level")) {
            println!("{name}: this machine does not have it");
            continue;
        }
        let run = workspace.run_job("job", name).args(["--threads", threads]);
        simd.into_iter().fold(run, |run, level| run.env("GRASPMILL_SIMD", level)).succeed();
        let out = workspace.path(name);
        assert_eq!(print_root(&out), print_root(&first), "{name}");
        assert_eq!(shards(&out), shards(&first), "{name}");
        let manifest = |out: &Path| read_text(out.join("manifest.json"));
        assert_eq!(manifest(&out), manifest(&first), "{name}");
    }
}

#[test]
fn shard_size_channels_and_other_objects_change_no_sample() {
    let workspace = write_job(JOB);
    let first = workspace.path("first");
    workspace.run_job("job", "first").succeed();
    let before = digest_payloads(&first);
    let changes = [
        "shards.samples=23",
        "channels.cloud=true",
        r#"objects=[{built_in=["box-01","can-01","bottle-01","bowl-01","half-cube-sphere"]}]"#,
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let out = format!("change-{number}");
        workspace.run_job("job", &out).set([change]).succeed();
        let after = digest_payloads(&workspace.path(&out));
        for (key, digest) in &before {
            assert_eq!(after.get(key), Some(digest), "{change} changed {key:?}");
        }
    }
    let other_size = workspace.path("change-0");
    let reader = |out: &Path| DatasetReader::open(&Folder::at(out)).expect("a dataset");
    let (a, b) = (reader(&first), reader(&other_size));
    assert_eq!(a.manifest().root, b.manifest().root, "the root digest does not depend on shards");
}

#[test]
#[ignore = "slow: kills at several moments"]
fn a_killed_run_resumes_to_the_same_root() {
    let workspace = write_job(&JOB.replace("even = 16", "even = 400"));
    let [first, out] = ["first", "killed"].map(|name| workspace.path(name));
    workspace.run_job("job", "first").args(["--threads", "2"]).succeed();
    for kill in 0..6 {
        workspace.run_job("job", "killed").kill_after(Duration::from_millis(40 + 70 * kill));
    }
    workspace.run_job("job", "killed").succeed();
    assert_eq!(print_root(&out), print_root(&first));
    assert_eq!(shards(&out), shards(&first), "no leftover, no duplicate");
    assert!(workspace.run_job("job", "killed").succeed().stdout.contains("nothing to do"));
}

#[test]
fn samples_are_made_again_from_the_manifest_alone() {
    let workspace = write_job(JOB);
    workspace.run_job("job", "data").succeed();
    fs::remove_file(workspace.path("job.toml")).expect("the job file is not needed any more");
    let verify = Program::new("verify").args(["--regenerate", "25", "--seed", "3"]);
    let found = verify.arg(workspace.path("data")).read_json();
    assert_eq!(found["regenerated"]["samples"], 25);
    assert_eq!(found["regenerated"]["differences"].as_array().map(Vec::len), Some(0));
}
