//! The command line as a contract: verbs, exit codes, what is printed where, and that nothing is lost.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

const JOB: &str = r#"
name = "cli"
seed = 5
views = { even = 12 }

[[objects]]
built_in = ["can-01", "bowl-01"]

[shards]
samples = 8
"#;

fn graspmill(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_graspmill")).args(arguments).output().expect("graspmill starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("text")
}

fn exit(output: &Output) -> i32 {
    output.status.code().expect("an exit code")
}

struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_string_lossy().into_owned()
    }

    fn write(&self, name: &str, content: &str) -> String {
        fs::write(self.0.path().join(name), content).expect("a file");
        self.path(name)
    }

    /// A finished dataset.
    fn dataset(&self) -> String {
        let (job, out) = (self.write("job.toml", JOB), self.path("data"));
        let done = graspmill(&["run", &job, "--out", &out, "--progress", "none"]);
        assert_eq!(exit(&done), 0, "{}", text(&done.stderr));
        out
    }
}

fn first_shard(data: &str) -> PathBuf {
    let mut shards: Vec<_> = fs::read_dir(Path::new(data).join("shards"))
        .expect("shards")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    shards.sort();
    shards.remove(0)
}

#[test]
fn a_dataset_goes_through_every_verb() {
    let place = Place::new();
    let data = place.dataset();
    let json = |arguments: &[&str]| -> serde_json::Value {
        let done = graspmill(arguments);
        assert_eq!(exit(&done), 0, "{arguments:?}: {}", text(&done.stderr));
        serde_json::from_slice(&done.stdout).expect("JSON on stdout")
    };
    let status = json(&["status", &data, "--json"]);
    assert_eq!((status["state"].as_str(), status["shards_done"].as_u64()), (Some("complete"), Some(3)));
    let verified = json(&["verify", &data, "--json"]);
    assert_eq!(verified["intact"], true);
    json(&["inspect", &data, "--json"]);
    let digest = text(&graspmill(&["digest", &data]).stdout);
    assert_eq!(digest.trim(), verified["root"].as_str().expect("a root"));
    let report = graspmill(&["report", &data]);
    assert_eq!(exit(&report), 0, "{}", text(&report.stderr));
    assert!(fs::read_to_string(format!("{data}/report.html")).expect("a report").starts_with("<!"));
    assert_eq!(json(&["verify", &data, "--json"])["intact"], true, "the report is no foreign file");
    for format in ["npy", "binvox", "pcd"] {
        let done = graspmill(&["export", &data, "--to", format, "--out", &place.path(format), "--limit", "3"]);
        assert_eq!(exit(&done), 0, "{format}: {}", text(&done.stderr));
    }
    let estimate = json(&["estimate", &place.path("job.toml"), "--json"]);
    assert_eq!(estimate["samples"], 24);
    json(&["doctor", "--json"]);
    assert!(json(&["schema"])["oneOf"][0]["properties"]["objects"].is_object());
}

#[test]
fn a_second_run_does_nothing_and_says_so() {
    let place = Place::new();
    let data = place.dataset();
    let again = graspmill(&["run", &place.path("job.toml"), "--out", &data]);
    assert_eq!(exit(&again), 0);
    assert!(text(&again.stdout).contains("nothing to do"), "{}", text(&again.stdout));
}

#[test]
fn wrong_arguments_and_jobs_mean_two() {
    let place = Place::new();
    assert_eq!(exit(&graspmill(&["fly"])), 2);
    assert_eq!(exit(&graspmill(&["run", "nowhere.toml", "--out", &place.path("x")])), 2);
    let job = place.write("bad.toml", "sede = 1\n[grid]\nresolution = 400\n[[objects]]\nbuilt_in = [\"cann-01\"]\n");
    let done = graspmill(&["run", &job, "--out", &place.path("x")]);
    assert_eq!(exit(&done), 2);
    let said = text(&done.stderr);
    for word in ["bad.toml:1", "seed", "resolution", "can-01", "3 errors"] {
        assert!(said.contains(word), "'{word}' is not in:\n{said}");
    }
    assert!(!Path::new(&place.path("x")).exists(), "nothing is begun for a bad job");
}

#[test]
fn the_folder_of_another_job_is_left_alone() {
    let place = Place::new();
    let data = place.dataset();
    let before = text(&graspmill(&["digest", &data]).stdout);
    let done = graspmill(&["run", &place.path("job.toml"), "--out", &data, "--set", "seed=6", "--progress", "none"]);
    assert_eq!(exit(&done), 2, "{}", text(&done.stderr));
    assert!(text(&done.stderr).contains("another --out"), "{}", text(&done.stderr));
    let full = place.path("full");
    fs::create_dir(&full).expect("a folder");
    fs::write(format!("{full}/thesis.tex"), "my only copy").expect("a file");
    let done = graspmill(&["run", &place.path("job.toml"), "--out", &full, "--progress", "none"]);
    assert_eq!(exit(&done), 2, "{}", text(&done.stderr));
    assert_eq!(fs::read_to_string(format!("{full}/thesis.tex")).expect("still there"), "my only copy");
    assert_eq!(text(&graspmill(&["digest", &data]).stdout), before);
}

#[test]
fn one_flipped_byte_is_found_and_mended_by_running_again() {
    let place = Place::new();
    let data = place.dataset();
    let root = text(&graspmill(&["digest", &data]).stdout);
    let shard = first_shard(&data);
    let mut bytes = fs::read(&shard).expect("a shard");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x40;
    fs::write(&shard, &bytes).expect("a damaged shard");
    let found = graspmill(&["verify", &data]);
    assert_eq!(exit(&found), 4);
    let said = text(&found.stdout);
    assert!(said.contains("completion-00000") && said.contains("2 of 3 shards intact"), "{said}");
    let mended = graspmill(&["run", &place.path("job.toml"), "--out", &data, "--progress", "none"]);
    assert_eq!(exit(&mended), 0, "{}", text(&mended.stderr));
    assert_eq!(exit(&graspmill(&["verify", &data])), 0);
    assert_eq!(text(&graspmill(&["digest", &data]).stdout), root);
}

#[test]
fn a_truncated_shard_is_found() {
    let place = Place::new();
    let data = place.dataset();
    let shard = first_shard(&data);
    let bytes = fs::read(&shard).expect("a shard");
    fs::write(&shard, &bytes[..bytes.len() * 6 / 10]).expect("a truncated shard");
    assert_eq!(exit(&graspmill(&["verify", &data])), 4);
    let status = graspmill(&["status", &data]);
    assert!(text(&status.stdout).contains("unfinished"), "{}", text(&status.stdout));
}

#[test]
fn refused_meshes_mean_three_and_the_others_are_made() {
    let place = Place::new();
    let meshes = place.0.path().join("meshes with spaces ü");
    fs::create_dir(&meshes).expect("a folder");
    fs::write(meshes.join("empty.stl"), "").expect("a file");
    fs::write(
        meshes.join("tetra.off"),
        "OFF\n4 4 6\n0 0 0\n0.1 0 0\n0 0.1 0\n0 0 0.1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n",
    )
    .expect("a file");
    let job = place.write(
        "folder.toml",
        "seed = 1\nviews = { even = 6 }\n[gate]\nmin_partial_cells = 20\n[[objects]]\nfolder = \"meshes with spaces ü\"\n",
    );
    let done = graspmill(&["run", &job, "--out", &place.path("data"), "--progress", "none"]);
    assert_eq!(exit(&done), 3, "{}", text(&done.stderr));
    let said = text(&done.stdout);
    assert!(said.contains("empty.stl") && said.contains("6 samples of 1 objects"), "{said}");
}

#[test]
fn results_go_to_stdout_and_talk_to_stderr() {
    let place = Place::new();
    let job = place.write("job.toml", JOB);
    let done = graspmill(&["run", &job, "--out", &place.path("data"), "--progress", "json", "--json"]);
    assert_eq!(exit(&done), 0);
    let summary: serde_json::Value = serde_json::from_slice(&done.stdout).expect("one JSON value on stdout");
    assert_eq!(summary["kept"].as_u64().zip(summary["rejected"].as_u64()).map(|(a, b)| a + b), Some(24));
    for line in text(&done.stderr).lines() {
        let event: serde_json::Value = serde_json::from_str(line).expect("one JSON object a line on stderr");
        assert!(event["event"].is_string(), "{line}");
    }
}

#[test]
fn shells_and_manuals_know_every_verb() {
    let place = Place::new();
    for shell in ["bash", "zsh", "fish"] {
        let done = graspmill(&["completions", shell]);
        let script = text(&done.stdout);
        assert!(exit(&done) == 0 && ["submit", "--task", "verify"].iter().all(|word| script.contains(word)), "{shell}");
    }
    let pages = place.path("man1");
    assert_eq!(exit(&graspmill(&["man", "--out", &pages])), 0);
    for page in ["graspmill.1", "graspmill-run.1", "graspmill-query-reach.1"] {
        let page = fs::read_to_string(Path::new(&pages).join(page)).expect("a page");
        assert!(page.contains(".TH") && page.contains(".SH"), "{page}");
    }
}
