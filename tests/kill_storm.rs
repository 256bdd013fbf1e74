//! Kills without warning and requests to stop, again and again, at random moments: resumed, a run ends where an undisturbed
//! one does, and a release is there whole or not at all.
//!
//! A separate binary: moments are spread over the time that the whole run took, so nothing else may run at the same
//! time.

#[path = "support/mod.rs"]
mod support;

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    thread,
    time::{Duration, Instant},
};

use graspmill::{files::Folder, format::dataset::DatasetReader, seed::Stream};
use support::{
    files::{digest_dataset, list_names, repository_path},
    jobs::{ABOUT, NO_SPLIT, barrett_line, fetch_table},
    program::{Program, Running},
    robots::{FETCH, GRIPPER},
    workspace::Workspace,
};

/// Jobs of a second or more, by name: pairs, touch, grasps without and with trials, patches of these, a map of poses, and
/// scenes with their views, pairs in clutter, and trials among neighbours.
fn jobs(folder: &Path, size: u32) -> [(&'static str, String); 11] {
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
    let grasps = |physics: &str| {
        format!(
            "product = \"grasps\"\n{hand}{shapes}{NO_SPLIT}[grasps]\nseeds = {}\n[annealing]\nsteps = 2000\n\
             [keep]\nspace = \"force\"\n{physics}[shards]\nruns = 1\n",
            2 * size
        )
    };
    let patches = format!(
        "product = \"patches\"\n{hand}[grasps]\ndataset = {:?}\n[images]\nfull = true\nheatmaps = true\n\
         [render]\ncolour = false\n[shards]\nsamples = 2\n",
        folder.join("trials-whole")
    );
    let map = format!(
        "product = \"reachability\"\n{}[poses]\n\
         x = {{ from = 0.4, to = 1.0, step = 0.2 }}\ny = {{ from = -0.2, to = 0.2, step = 0.2 }}\n\
         z = {{ from = 0.4, to = 1.0, step = 0.2 }}\nroll = 2\npitch = 2\nyaw = {}\n[shards]\npositions = 3\n",
        fetch_table(&repository_path(FETCH)),
        2 * size
    );
    let [annealing, trials] = ["", "[physics]\nperturbed_runs = 1\n"].map(grasps);
    let [scenes, views, amodal, sampled, picks] = clutter(folder, size);
    [
        ("pairs", pairs),
        ("touch", touch),
        ("annealing", annealing),
        ("trials", trials),
        ("patches", patches),
        ("map", map),
        ("scenes", scenes),
        ("views", views),
        ("amodal", amodal),
        ("sampled", sampled),
        ("picks", picks),
    ]
}

/// The jobs of [`clutter`].
const OF_CLUTTER: [&str; 5] = ["scenes", "views", "amodal", "sampled", "picks"];

/// Scenes, their views, pairs in clutter, sampled grasps, and these grasps among the bodies.
fn clutter(folder: &Path, size: u32) -> [String; 5] {
    let of = |name: &str| folder.join(format!("{name}-whole"));
    let shapes = "[[objects]]\nbuilt_in = [\"can-01\", \"bottle-01\", \"box-01\"]\n";
    let hand = repository_path(GRIPPER);
    [
        format!(
            "product = \"scenes\"\nmode = \"bin\"\ncount = 3\ncontainer = {{ inner_size = [0.3, 0.3, 0.06] }}\n\
             scenes = {{ training = {} }}\n{shapes}{NO_SPLIT}[shards]\nscenes = 1\n",
            6 * size
        ),
        format!(
            "product = \"views\"\nsensor = {{ profile = \"kinect-v1\" }}\n[scenes]\ndataset = {:?}\n[views]\n\
             cameras = [{{ shell = {{ radius = [0.4, 0.6], polar_deg = [0, 50] }}, views = 4, width = 640, height = 480, fx = 570.0 }}]\n\
             min_pixels = 50\n[shards]\nsamples = 2\n",
            of("scenes")
        ),
        format!("product = \"amodal\"\n[views]\ndataset = {:?}\n[shards]\nsamples = 8\n", of("views")),
        format!(
            "product = \"grasps\"\n[hand]\nmodel = {hand:?}\n{shapes}[grasps]\nseeds = {}\nsampler = \"antipodal\"\n[antipodal]\n\
             best = 5\n[keep]\ntorsion = 0.002\n{NO_SPLIT}[shards]\nruns = 1\n",
            2 * size
        ),
        format!(
            "product = \"picks\"\n[scenes]\ndataset = {:?}\n[grasps]\ndataset = {:?}\n[hand]\nmodel = {hand:?}\n[picks]\n\
             candidates = 60\ntrials = 2\n[shards]\nsamples = 1\n",
            of("scenes"),
            of("sampled")
        ),
    ]
}

/// Digests of all payloads, or the reason of a reject, by sample.
fn read_fates(out: &Path) -> BTreeMap<String, String> {
    let reader = DatasetReader::open(&Folder::at(out)).expect("a dataset");
    let mut found = BTreeMap::new();
    for shard in 0..reader.manifest().shards.len() {
        for row in reader.ledger(shard).expect("a ledger").rows {
            let before = found.insert(row.sample.to_string(), format!("{:?}", row.fate));
            assert!(before.is_none(), "{} is listed twice", row.sample);
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

/// Ways to disturb a program, by the names of the signals, and the ends that they may lead to, unless the program is
/// faster: `None` where the signal itself ended it. TERM and USR1 request a stop, which it cannot handle before it has
/// started.
const DISTURBANCES: [(&str, &[Option<i32>]); 5] = [
    ("KILL", &[None]),
    ("TERM", &[None, Some(75)]),
    ("HUP", &[None]),
    ("USR1", &[None, Some(75)]),
    // Paused for a moment, then killed a moment later.
    ("STOP", &[None]),
];
/// Pause of a program that is stopped.
const PAUSE: Duration = Duration::from_millis(50);

/// Disturbs a program that was started `wait` ago or longer; whether it was still at work.
fn disturb(mut running: Running, (signal, ends): (&str, &[Option<i32>]), wait: Duration, label: &str) -> bool {
    thread::sleep(wait);
    let at_work = running.is_at_work();
    running.signal(signal);
    if signal == "STOP" {
        thread::sleep(PAUSE);
        running.signal("CONT");
        thread::sleep(PAUSE);
        running.signal("KILL");
    }
    let code = running.wait();
    assert!(code == Some(0) || ends.contains(&code), "{label}: {signal} after {wait:?} ended with {code:?}");
    at_work
}

/// Figures of the disturbances of one job.
struct Tally<'s> {
    label: &'static str,
    stream: &'s mut Stream,
    /// Time that it takes undisturbed [s].
    took: f64,
    tried: u32,
    /// Disturbances that met the program at work.
    at_work: u32,
    /// Number of disturbances by signal.
    by_signal: BTreeMap<&'static str, u32>,
    /// Number of complete results in spite of them.
    finished: u32,
}

impl<'s> Tally<'s> {
    fn new(label: &'static str, took: f64, stream: &'s mut Stream) -> Self {
        Self { label, stream, took, tried: 0, at_work: 0, by_signal: BTreeMap::new(), finished: 0 }
    }

    /// Disturbs a program at a random moment.
    fn disturb(&mut self, program: Program) {
        let way = DISTURBANCES[self.stream.below(DISTURBANCES.len() as u64) as usize];
        let wait = Duration::from_secs_f64(self.stream.unit() * self.took * 0.8);
        let at_work = disturb(program.start_running(), way, wait, self.label);
        self.tried += 1;
        self.at_work += u32::from(at_work);
        if at_work {
            *self.by_signal.entry(way.0).or_default() += 1;
        }
        assert!(self.tried < 100 + 20 * self.at_work, "{}: signals do not meet the program at work", self.label);
    }

    #[expect(clippy::print_stdout, reason = "the figures that the test checks")]
    fn print(&self) {
        let Self { label, took, tried, at_work, by_signal, finished, .. } = self;
        println!(
            "kills of {label:10} tried {at_work:3} passed {at_work:3}, {} more came too late, {finished} times whole, run {took:.1} s, \
             {by_signal:?}",
            tried - at_work
        );
    }
}

/// Runs a job again and again to a disturbance, until `count` disturbances met it at work; each time that it is
/// finished, it is the dataset of an undisturbed run.
fn storm_job(workspace: &Workspace, name: &'static str, text: &str, count: u32, stream: &mut Stream) {
    workspace.write(format!("{name}.toml"), text);
    let [whole, killed] = ["whole", "killed"].map(|end| format!("{name}-{end}"));
    let began = Instant::now();
    workspace.run_job(name, &whole).succeed();
    let mut tally = Tally::new(name, began.elapsed().as_secs_f64(), stream);
    let (whole, folder) = (workspace.path(whole), workspace.path(&killed));
    let (fates, digests) = (read_fates(&whole), digest_dataset(&whole));
    let mut shards = 0;
    while tally.at_work < count || folder.exists() {
        if tally.at_work < count {
            tally.disturb(workspace.run_job(name, &killed));
        }
        let found = count_shards(&folder);
        assert!(found >= shards, "{name}: of {shards} finished shards {found} are left");
        shards = found;
        if tally.at_work == count || folder.join("manifest.json").exists() {
            workspace.run_job(name, &killed).succeed();
            assert_eq!(read_fates(&folder), fates, "{name}: no sample lost, doubled or changed");
            // All files, index, tables and preview among them: no leftover, no second shard, the same root.
            assert_eq!(digest_dataset(&folder), digests, "{name}");
            let said = Program::on("verify", &folder).succeed().stdout;
            assert!(!said.contains("note: "), "{name}: {said}");
            fs::remove_dir_all(&folder).expect("a folder");
            (shards, tally.finished) = (0, tally.finished + 1);
        }
    }
    tally.print();
}

/// Disturbs `release` until `count` disturbances met it at work: an entry with its name is the whole release, and no
/// leftover remains at the end.
fn storm_release(workspace: &Workspace, count: u32, stream: &mut Stream) {
    let about = workspace.write("about.toml", ABOUT);
    let release = |name: &str| {
        let program = Program::on("release", workspace.path("pairs-whole"));
        program.option("--out", workspace.path(name)).option("--about", &about)
    };
    let began = Instant::now();
    release("release-whole").succeed();
    let mut tally = Tally::new("release", began.elapsed().as_secs_f64(), stream);
    let whole = digest_dataset(workspace.path("release-whole"));
    let out = workspace.path("release");
    while tally.at_work < count {
        tally.disturb(release("release"));
        if out.is_dir() && !list_names(&out).is_empty() {
            assert_eq!(digest_dataset(&out), whole, "a release that has its name is whole");
            fs::remove_dir_all(&out).expect("a folder");
            tally.finished += 1;
        }
    }
    release("release").succeed();
    assert_eq!(digest_dataset(&out), whole, "release");
    let left: Vec<String> =
        list_names(workspace.folder()).into_iter().filter(|name| name.starts_with(".release.")).collect();
    assert_eq!(left, [""; 0], "what was killed leaves nothing behind");
    Program::on("verify", &out).succeed();
    tally.print();
}

/// Disturbs each of the chosen jobs, and a release of pairs if they are among them, `count` times each.
fn storm(chosen: impl Fn(&str) -> bool, count: u32, size: u32, seed: u64) {
    let workspace = Workspace::new();
    let mut stream = Stream::of_job(seed, b"", "kills");
    for (name, text) in jobs(workspace.folder(), size) {
        if chosen(name) {
            storm_job(&workspace, name, &text, count, &mut stream);
        }
    }
    if chosen("pairs") {
        storm_release(&workspace, count, &mut stream);
    }
}

/// One job of each kind of work: exact samples, trials, a map by position, bodies that settle.
#[test]
fn a_few_kills_lose_double_and_change_nothing() {
    storm(|name| ["pairs", "trials", "map", "scenes"].contains(&name), 1, 1, 1);
}

#[test]
#[ignore = "minutes: `make test-all`"]
fn a_hundred_kills_of_each_product_of_objects_lose_double_and_change_nothing() {
    storm(|name| !OF_CLUTTER.contains(&name), 100, 1, 2);
}

#[test]
#[ignore = "minutes: `make test-all`"]
fn fifty_kills_of_each_product_of_clutter_lose_double_and_change_nothing() {
    storm(|name| OF_CLUTTER.contains(&name), 50, 1, 3);
}
