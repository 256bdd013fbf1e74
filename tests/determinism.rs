//! The same job gives the same bytes: whatever the threads, vector instructions, folder, shards, other objects, or kills.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    thread,
    time::Duration,
};

const JOB: &str = r#"
name = "determinism"
seed = 11
views = { even = 40 }
distance = { min = 0.6, max = 1.2 }

[[objects]]
built_in = ["can-01", "bottle-01", "bowl-01", "half-cube-sphere"]

[sensor]
profile = "kinect-v1"

[channels]
depth = "f32"

[touch]
random_rays = true

[shards]
samples = 32
"#;

fn graspmill() -> Command {
    Command::new(env!("CARGO_BIN_EXE_graspmill"))
}

struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a temporary folder") }
    }

    fn job(&self, text: &str) -> PathBuf {
        let path = self.folder.path().join("job.toml");
        fs::write(&path, text).expect("a job file");
        path
    }

    fn out(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

fn run(job: &Path, out: &Path, more: &[&str], simd: Option<&str>) {
    let mut command = graspmill();
    command.arg("run").arg(job).arg("--out").arg(out).args(["--progress", "none"]).args(more);
    if let Some(level) = simd {
        command.env("GRASPMILL_SIMD", level);
    }
    let done = command.output().expect("graspmill starts");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
}

fn root(out: &Path) -> String {
    let done = graspmill().arg("digest").arg(out).output().expect("graspmill starts");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).expect("text").trim().to_owned()
}

/// Shard files by name: the name holds the content's digest.
fn shards(out: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(out.join("shards"))
        .expect("shards")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Digests of every payload, by sample id and channel, read from the shards' ledgers.
fn payloads(out: &Path) -> BTreeMap<(String, String), String> {
    let reader = graspmill::dataset::DatasetReader::open(out).expect("a dataset");
    let mut all = BTreeMap::new();
    for shard in 0..reader.manifest().shards.len() {
        let ledger = reader.ledger(shard).expect("a ledger");
        for row in &ledger.rows {
            match &row.fate {
                graspmill::dataset::Fate::Kept(digests) => {
                    for (channel, digest) in ledger.channels.iter().zip(digests) {
                        all.insert((row.sample.to_string(), channel.name().to_owned()), digest.hex());
                    }
                }
                graspmill::dataset::Fate::Rejected { reason, .. } => {
                    all.insert((row.sample.to_string(), "rejected".to_owned()), reason.clone());
                }
            }
        }
    }
    all
}

#[test]
fn threads_levels_and_folders_change_no_byte() {
    let place = Place::new();
    let job = place.job(JOB);
    let first = place.out("first");
    run(&job, &first, &["--threads", "1"], None);
    let others =
        [("two", "2", None), ("elsewhere", "1", None), ("scalar", "1", Some("scalar")), ("avx2", "2", Some("avx2"))];
    for (name, threads, simd) in others {
        if simd.is_some_and(|level| graspmill::geom::SimdLevel::detect() < level.parse().expect("a level")) {
            println!("{name}: this machine does not have it");
            continue;
        }
        let out = place.out(name);
        run(&job, &out, &["--threads", threads], simd);
        assert_eq!(root(&out), root(&first), "{name}");
        assert_eq!(shards(&out), shards(&first), "{name}");
        let manifest = |out: &Path| fs::read_to_string(out.join("manifest.json")).expect("a manifest");
        assert_eq!(manifest(&out), manifest(&first), "{name}");
    }
}

#[test]
fn shard_size_channels_and_other_objects_change_no_sample() {
    let place = Place::new();
    let job = place.job(JOB);
    let first = place.out("first");
    run(&job, &first, &[], None);
    let before = payloads(&first);
    let changes: [&[&str]; 3] = [
        &["--set", "shards.samples=57"],
        &["--set", "channels.cloud=true"],
        &["--set", r#"objects=[{built_in=["box-01","can-01","bottle-01","bowl-01","half-cube-sphere"]}]"#],
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let out = place.out(&format!("change-{number}"));
        run(&job, &out, change, None);
        let after = payloads(&out);
        for (key, digest) in &before {
            assert_eq!(after.get(key), Some(digest), "{change:?} changed {key:?}");
        }
    }
    let other_size = place.out("change-0");
    let reader = |out: &Path| graspmill::dataset::DatasetReader::open(out).expect("a dataset");
    let (a, b) = (reader(&first), reader(&other_size));
    assert_eq!(a.manifest().root, b.manifest().root, "the root digest knows no shards");
}

#[test]
fn a_killed_run_resumes_to_the_same_root() {
    let place = Place::new();
    let job = place.job(&JOB.replace("even = 40", "even = 400"));
    let first = place.out("first");
    run(&job, &first, &["--threads", "2"], None);
    let out = place.out("killed");
    for kill in 0..6 {
        let mut child = graspmill()
            .arg("run")
            .arg(&job)
            .arg("--out")
            .arg(&out)
            .args(["--progress", "none"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("graspmill starts");
        thread::sleep(Duration::from_millis(40 + 70 * kill));
        // On Unix this is SIGKILL: nothing is cleaned up.
        child.kill().expect("a kill");
        child.wait().expect("an end");
    }
    run(&job, &out, &[], None);
    assert_eq!(root(&out), root(&first));
    assert_eq!(shards(&out), shards(&first), "no leftover, no duplicate");
    let again = graspmill().arg("run").arg(&job).arg("--out").arg(&out).output().expect("graspmill starts");
    assert!(String::from_utf8_lossy(&again.stdout).contains("nothing to do"));
}

#[test]
fn samples_are_made_again_from_the_manifest_alone() {
    let place = Place::new();
    let job = place.job(JOB);
    let out = place.out("data");
    run(&job, &out, &[], None);
    fs::remove_file(&job).expect("the job file is not needed any more");
    let done = graspmill()
        .args(["verify", "--regenerate", "25", "--seed", "3", "--json"])
        .arg(&out)
        .output()
        .expect("graspmill starts");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let found: serde_json::Value = serde_json::from_slice(&done.stdout).expect("JSON");
    assert_eq!(found["regenerated"]["samples"], 25);
    assert_eq!(found["regenerated"]["differences"].as_array().map(Vec::len), Some(0));
}
