//! Kills without warning, again and again, at random moments: resumed, a run ends where an undisturbed one does.
//!
//! A binary of its own: kills are spread over the time that the whole run took, so nothing else may run beside it.

#[path = "support/mod.rs"]
mod support;

use std::{
    collections::BTreeMap,
    path::Path,
    time::{Duration, Instant},
};

use graspmill::{format::dataset::DatasetReader, seed::Stream};
use support::{
    files::{digest_dataset, list_names, repository_path},
    jobs::{NO_SPLIT, barrett_line, fetch_table},
    program::Program,
    robots::FETCH,
    workspace::Workspace,
};

/// Jobs of a second or more, by name: pairs, touch, grasps with trials, patches of them, a map of poses.
fn jobs(folder: &Path, size: u32) -> [(&'static str, String); 5] {
    let hand = barrett_line();
    let shapes = "objects = [{ built_in = [\"can-01\", \"bottle-01\", \"mug-01\"] }]\n";
    let pairs = format!(
        "{shapes}views = {{ even = {} }}\n{NO_SPLIT}[channels]\ntsdf = true\n[shards]\nsamples = 16\n",
        60 * size
    );
    let touch = format!(
        "{shapes}views = {{ even = {} }}\n{NO_SPLIT}[touch]\nrandom_rays = true\nexploration = true\napproaches = 2\n\
         {hand}[shards]\nsamples = 2\n",
        2 * size
    );
    let grasps = format!(
        "product = \"grasps\"\n{hand}{shapes}{NO_SPLIT}[grasps]\nseeds = {}\n[annealing]\nsteps = 2000\n\
         [keep]\nspace = \"force\"\n[physics]\nperturbed = 1\n[shards]\nruns = 1\n",
        2 * size
    );
    let patches = format!(
        "product = \"patches\"\n{hand}[grasps]\ndataset = {:?}\n[images]\nfull = true\nheatmaps = true\n\
         [render]\ncolour = false\n[shards]\nsamples = 2\n",
        folder.join("grasps-whole")
    );
    let map = format!(
        "product = \"reachability\"\n{}[poses]\n\
         x = {{ from = 0.4, to = 1.0, step = 0.2 }}\ny = {{ from = -0.2, to = 0.2, step = 0.2 }}\n\
         z = {{ from = 0.4, to = 1.0, step = 0.2 }}\nroll = 2\npitch = 2\nyaw = {}\n[shards]\npositions = 3\n",
        fetch_table(&repository_path(FETCH)),
        2 * size
    );
    [("pairs", pairs), ("touch", touch), ("grasps", grasps), ("patches", patches), ("map", map)]
}

/// Digests of all payloads, or the reason of a reject, by sample.
fn read_fates(out: &Path) -> BTreeMap<String, String> {
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

/// Finished shards in the folder of a dataset, which may not be there yet.
fn count_shards(out: &Path) -> usize {
    let folder = out.join("shards");
    let names = if folder.is_dir() { list_names(folder) } else { Vec::new() };
    names.iter().filter(|name| name.ends_with(".mcap")).count()
}

/// Kills so many times, spread over the jobs.
#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn storm(kills: u32, size: u32, seed: u64) {
    let workspace = Workspace::new();
    let jobs = jobs(workspace.folder(), size);
    let each = kills.div_ceil(jobs.len() as u32);
    let mut stream = Stream::of_job(seed, b"", "kills");
    for (name, text) in jobs {
        workspace.write(format!("{name}.toml"), text);
        let [whole, killed] = ["whole", "killed"].map(|end| format!("{name}-{end}"));
        let began = Instant::now();
        workspace.run_job(name, &whole).succeed();
        let took = began.elapsed().as_secs_f64();
        let (mut at_work, mut shards) = (0, Vec::new());
        for kill in 0..each {
            // Early and late moments alike: work that is done before a kill is not done again.
            let wait = stream.unit() * took * f64::from(each - kill) / f64::from(each) * 0.8;
            at_work += u32::from(workspace.run_job(name, &killed).kill_after(Duration::from_secs_f64(wait)));
            shards.push(count_shards(&workspace.path(&killed)));
        }
        workspace.run_job(name, &killed).succeed();
        let [whole, killed] = [whole, killed].map(|name| workspace.path(name));
        assert_eq!(read_fates(&killed), read_fates(&whole), "{name}: no sample lost, doubled or changed");
        // All files, index, tables and preview among them: no leftover, no second shard, the same root.
        assert_eq!(digest_dataset(&killed), digest_dataset(&whole), "{name}");
        let said = Program::on("verify", &killed).succeed().stdout;
        assert!(!said.contains("note: "), "{name}: {said}");
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
