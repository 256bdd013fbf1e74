//! Killed without warning, again and again, at random moments: resumed, a run ends where an undisturbed one does.
#![cfg(feature = "sim")]

mod tree;

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use graspmill::{dataset::DatasetReader, ids::Digest, seed::Stream};
use tree::tree;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// One job of the storm: name, text, whether its dataset is what a later job takes.
type Job = (&'static str, String);

/// Jobs of a second or more: pairs, touch, grasps with trials, patches of them, a map of poses.
fn jobs(place: &Path, size: u32) -> Vec<Job> {
    let hand = Path::new(ROOT).join("scenes/barrett_bh8_280.xml");
    let fetch = Path::new(ROOT).join("scenes/fetch.xml");
    let joints =
        ["shoulder_pan", "shoulder_lift", "upperarm_roll", "elbow_flex", "forearm_roll", "wrist_flex", "wrist_roll"];
    let joints = joints.map(|joint| format!("{joint}_joint"));
    let split = "[split]\nvalidation_models = 0\ntest_models = 0\n";
    let shapes = "objects = [{ built_in = [\"can-01\", \"bottle-01\", \"mug-01\"] }]\n";
    let pairs = format!("{shapes}views = {{ even = {} }}\n{split}[channels]\ntsdf = true\n", 60 * size);
    let touch = format!(
        "{shapes}views = {{ even = {} }}\n{split}[touch]\nrandom_rays = true\nexploration = true\napproaches = 2\n\
         hand = {{ scene = {hand:?} }}\n[shards]\nsamples = 2\n",
        2 * size
    );
    let grasps = format!(
        "product = \"grasps\"\nhand = {{ scene = {hand:?} }}\n{shapes}{split}[grasps]\nseeds = {}\n[annealing]\nsteps = 2000\n\
         [keep]\nspace = \"force\"\n[physics]\nperturbed = 1\n[shards]\nruns = 1\n",
        2 * size
    );
    let patches = format!(
        "product = \"patches\"\nhand = {{ scene = {hand:?} }}\n[grasps]\ndataset = {:?}\n[images]\nfull = true\nheatmaps = true\n\
         [render]\ncolour = false\n[shards]\nsamples = 2\n",
        place.join("grasps-whole")
    );
    let map = format!(
        "product = \"reachability\"\n[robot]\nscene = {fetch:?}\njoints = {joints:?}\ntarget = \"wrist_roll_link\"\n[poses]\n\
         x = {{ from = 0.4, to = 1.0, step = 0.2 }}\ny = {{ from = -0.2, to = 0.2, step = 0.2 }}\n\
         z = {{ from = 0.4, to = 1.0, step = 0.2 }}\nroll = 2\npitch = 2\nyaw = {}\n[shards]\npositions = 3\n",
        2 * size
    );
    let pairs = format!("{pairs}[shards]\nsamples = 16\n");
    vec![("pairs", pairs), ("touch", touch), ("grasps", grasps), ("patches", patches), ("map", map)]
}

fn command(job: &Path, out: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_graspmill"));
    command.arg("run").arg(job).arg("--out").arg(out).args(["--progress", "none"]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// Digests of all payloads, or the reason of a reject, by sample.
fn samples(out: &Path) -> BTreeMap<String, String> {
    let reader = DatasetReader::open(out).expect("a dataset");
    let mut found = BTreeMap::new();
    for shard in 0..reader.manifest().shards.len() {
        for row in reader.ledger(shard).expect("a ledger").rows {
            let before = found.insert(row.sample.to_string(), format!("{:?}", row.fate));
            assert!(before.is_none(), "{} stands twice", row.sample);
        }
    }
    found
}

/// Digests of all files below a folder but the run's notes, which say how fast it was.
fn files(folder: &Path) -> BTreeMap<PathBuf, Digest> {
    let mut files = tree(folder);
    files.remove(Path::new("notes.json"));
    files.into_iter().map(|(path, content)| (path, Digest::of(&content))).collect()
}

/// Kills so many times, spread over the jobs.
#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn storm(kills: u32, size: u32, seed: u64) {
    let place = tempfile::tempdir().expect("a scratch folder");
    let jobs = jobs(place.path(), size);
    let each = kills.div_ceil(jobs.len() as u32);
    let mut stream = Stream::of_job(seed, b"", "kills");
    for (name, text) in jobs {
        let job = place.path().join(format!("{name}.toml"));
        fs::write(&job, text).expect("a job");
        let (whole, out) = (place.path().join(format!("{name}-whole")), place.path().join(format!("{name}-killed")));
        let began = Instant::now();
        assert!(command(&job, &whole).status().expect("graspmill starts").success(), "{name}");
        let took = began.elapsed().as_secs_f64();
        let (mut at_work, mut shards) = (0, Vec::new());
        for kill in 0..each {
            let mut child = command(&job, &out).spawn().expect("graspmill starts");
            // Early and late moments alike: what is done before a kill is not done again.
            let wait = stream.unit() * took * f64::from(each - kill) / f64::from(each) * 0.8;
            thread::sleep(Duration::from_secs_f64(wait));
            at_work += u32::from(child.try_wait().expect("a state").is_none());
            // On Unix this is SIGKILL: nothing is cleaned up.
            child.kill().expect("a kill");
            child.wait().expect("an end");
            shards.push(fs::read_dir(out.join("shards")).map_or(0, |entries| {
                entries
                    .filter(|entry| {
                        entry.as_ref().is_ok_and(|entry| entry.path().extension().is_some_and(|end| end == "mcap"))
                    })
                    .count()
            }));
        }
        assert!(command(&job, &out).status().expect("graspmill starts").success(), "{name}: resumed");
        assert_eq!(samples(&out), samples(&whole), "{name}: no sample lost, doubled or changed");
        // All files, index, tables and preview among them: no leftover, no second shard, the same root.
        assert_eq!(files(&out), files(&whole), "{name}");
        let mut verify = Command::new(env!("CARGO_BIN_EXE_graspmill"));
        let done = verify.arg("verify").arg(&out).output().expect("graspmill starts");
        let said = String::from_utf8_lossy(&done.stdout);
        assert!(done.status.success() && !said.contains("note: "), "{name}: {said}");
        println!(
            "{name:8} {each:3} kills, {at_work:3} of them at work, whole run {took:.1} s, shards after each kill {shards:?}"
        );
        assert!(at_work > 0, "{name}: no kill met the program at work");
    }
}

#[test]
fn a_few_kills_lose_double_and_change_nothing() {
    storm(10, 1, 1);
}

#[test]
#[ignore = "minutes: `make test-slow`"]
fn fifty_kills_lose_double_and_change_nothing() {
    storm(50, 4, 2);
}
