//! Links inside folders: no verb reads, writes, renames or removes anything through a link of any name.
//!
//! The kernel watches what a link leads to (inotify), so that a test sees that it was opened, and not only that it changed.

use std::{
    collections::BTreeMap,
    fs,
    mem::MaybeUninit,
    os::{fd::OwnedFd, unix::fs::symlink},
    path::{Path, PathBuf},
};

use rustix::fs::inotify;

use crate::support::{
    files::{list_shards, read_tree, repository_path},
    jobs::{ABOUT, NO_SPLIT},
    products::made_products,
    program::{Outcome, Program, print_root},
    workspace::Workspace,
};

/// A folder of a user who has not agreed.
struct Victim {
    folder: PathBuf,
    content: BTreeMap<PathBuf, Vec<u8>>,
    watch: OwnedFd,
}

impl Victim {
    /// Watches a folder with all that is in it.
    fn new(folder: PathBuf) -> Self {
        let flags = inotify::CreateFlags::NONBLOCK | inotify::CreateFlags::CLOEXEC;
        let watch = inotify::init(flags).expect("inotify");
        let content = read_tree(&folder);
        let below = content.keys().flat_map(|file| file.ancestors().skip(1).map(Path::to_owned));
        let mut folders: Vec<PathBuf> = below.collect();
        folders.push(PathBuf::new());
        folders.sort();
        folders.dedup();
        for below in folders {
            let all = inotify::WatchFlags::ACCESS
                | inotify::WatchFlags::ATTRIB
                | inotify::WatchFlags::CREATE
                | inotify::WatchFlags::DELETE
                | inotify::WatchFlags::MODIFY
                | inotify::WatchFlags::MOVE
                | inotify::WatchFlags::OPEN;
            inotify::add_watch(&watch, folder.join(below), all).expect("a watch");
        }
        Self { folder, content, watch }
    }

    /// Whether nothing happened to it since.
    #[track_caller]
    fn assert_untouched(&self, what: &str) {
        let mut buffer = [MaybeUninit::uninit(); 4096];
        let mut events = inotify::Reader::new(&self.watch, &mut buffer);
        let event = events.next().map(|event| format!("{:?} of {:?}", event.events(), event.file_name()));
        assert!(event.is_err(), "{what}: {}: {event:?}", self.folder.display());
    }

    #[track_caller]
    fn assert_unchanged(&self, what: &str) {
        assert!(read_tree(&self.folder) == self.content, "{what}: {} changed", self.folder.display());
    }
}

#[test]
fn a_victim_that_is_opened_is_seen() {
    let workspace = Workspace::new();
    let file = workspace.write("victim/below/file", "text");
    let touches: [&dyn Fn(); 4] = [
        &|| drop(fs::read(&file).expect("a file")),
        &|| fs::write(workspace.path("victim/new"), "").expect("written"),
        &|| assert!(fs::read_dir(workspace.path("victim/below")).expect("a folder").count() < usize::MAX),
        &|| fs::rename(&file, workspace.path("victim/below/other")).expect("renamed"),
    ];
    for (number, touch) in touches.into_iter().enumerate() {
        let victim = Victim::new(workspace.path("victim"));
        victim.assert_untouched("nothing");
        touch();
        let seen = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| victim.assert_untouched("touch")));
        assert!(seen.is_err(), "touch {number}");
    }
}

/// Names inside a dataset's folder; a folder's end with a slash.
const NAMES: [&str; 22] = [
    "run.json",
    "manifest.json",
    "assets.json",
    "splits.json",
    "rejects.jsonl",
    "index.parquet",
    "job.toml",
    "pending.json",
    "notes.json",
    "preview.mcap",
    "report.html",
    "shapes.mcap",
    "field.mcap",
    "types.json",
    "set.json",
    "recipe.json",
    "manifest-sha256.txt",
    "replay/agreement.json",
    "shards/",
    "shards/*",
    "cluster/",
    "replay/",
];

/// Runs every verb on a dataset's folder; what each is called and how it ended.
fn run_verbs(job: &Path, settings: &[String], dataset: &Path, scratch: &Workspace) -> Vec<(String, Outcome)> {
    let about = scratch.write("about.toml", ABOUT);
    let out = |name: &str| scratch.path(format!("out-{name}"));
    let on = |verb: &str| Program::on(verb, dataset);
    let run = || Program::run_job(job, dataset).set(settings);
    let verbs = [
        ("run", run()),
        ("run --task", run().option("--task", "0/2")),
        ("status", on("status")),
        ("merge", on("merge")),
        ("submit", Program::on("submit", job).set(settings).option("--out", dataset).option("--backend", "local")),
        ("submit --retry", Program::new("submit").arg("--retry").option("--out", dataset)),
        ("inspect", on("inspect")),
        ("report", on("report")),
        ("export", on("export").option("--to", "parquet").option("--out", out("export"))),
        ("release", on("release").option("--about", &about).option("--out", out("release"))),
        ("verify", on("verify")),
        ("diff", on("diff").arg(dataset)),
        ("digest", on("digest")),
        ("query", Program::new("query").arg("reach").arg(dataset).option("--pose", "0.6,0.1,0.9,0,0.5,0.2")),
        ("complete", on("complete").option("--method", "hull").option("--out", out("complete"))),
        (
            "evaluate",
            Program::new("evaluate")
                .arg("completion")
                .arg(dataset)
                .option("--method", "hull")
                .option("--split", "training"),
        ),
    ];
    verbs.into_iter().map(|(name, program)| (name.to_owned(), program.finish())).collect()
}

/// Replaces a file or folder by a link to a copy of it, or to another user's file and folder. `None` if the dataset has
/// no shard.
fn link(dataset: &Path, name: &str, victim: &Path) -> Option<PathBuf> {
    let is_folder = name.ends_with('/');
    let path = match name {
        "shards/*" => {
            list_shards(dataset).into_iter().find(|path| path.extension().is_some_and(|end| end == "mcap"))?
        }
        name => dataset.join(name.trim_end_matches('/')),
    };
    fs::create_dir_all(victim).expect("a folder");
    let target = victim.join(path.file_name().expect("a name"));
    fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    if path.exists() {
        fs::rename(&path, &target).expect("moved");
    } else if is_folder {
        fs::create_dir(&target).expect("a folder");
        fs::write(target.join("precious.txt"), "precious").expect("a file");
    } else {
        fs::write(&target, "precious").expect("a file");
    }
    symlink(&target, &path).expect("a link");
    Some(path)
}

/// Tries names of a dataset, finished or not, with every verb: how often a verb was run.
fn try_names(
    product: &str,
    job: &Path,
    settings: &[String],
    dataset: &Path,
    names: impl IntoIterator<Item = (&'static str, bool)>,
) -> usize {
    let mut tried = 0;
    for (name, is_finished) in names {
        let workspace = Workspace::new();
        let data = workspace.path("data");
        crate::support::files::copy_folder(dataset, &data);
        if !is_finished {
            // As a run that was killed leaves it: a shard is missing, and the tables are.
            for table in ["manifest.json", "assets.json", "index.parquet", "rejects.jsonl"] {
                _ = fs::remove_file(data.join(table));
            }
            _ = list_shards(&data).pop().map(fs::remove_file);
        }
        let Some(path) = link(&data, name, &workspace.path("victim")) else { continue };
        let victim = Victim::new(workspace.path("victim"));
        for (verb, outcome) in run_verbs(job, settings, &data, &workspace) {
            let what =
                format!("{product}, {name}, finished: {is_finished}, {verb}: {:?} {}", outcome.code, outcome.text());
            victim.assert_untouched(&what);
            assert!(outcome.code.is_some_and(|code| [0, 1, 2, 3, 4].contains(&code)), "{what}");
            assert!(!outcome.text().contains("panicked"), "{what}");
            tried += 1;
        }
        victim.assert_unchanged(&format!("{product}, {name}, finished: {is_finished}"));
        // Links that nothing replaced still lead there.
        assert!(!path.is_symlink() || path.exists());
    }
    tried
}

#[test]
fn no_verb_reaches_through_a_link_in_a_dataset() {
    let workspace = Workspace::new();
    let job = format!(
        "views = {{ even = 4 }}\nobjects = [{{ built_in = [\"can-01\"] }}]\n[grid]\nresolution = 12\n[gate]\n\
         min_partial_cells = 1\n[channels]\ndepth = \"u16\"\n[shards]\nsamples = 2\n{NO_SPLIT}"
    );
    let dataset = workspace.make_dataset("whole", &job, &[]);
    let names = [("report.html", true), ("shards/", false), ("cluster/", true), ("manifest.json", true)];
    let tried = try_names("completion", &workspace.path("whole.toml"), &[], &dataset, names);
    println!("{tried} tried");
}

#[test]
#[ignore = "every name of every product with every verb: an hour of two cores"]
fn no_verb_reaches_through_a_link_in_a_dataset_of_any_product() {
    for made in made_products() {
        let names = NAMES.into_iter().flat_map(|name| [(name, true), (name, false)]);
        let tried = try_names(made.product, &made.job, &made.settings, &made.dataset, names);
        println!("{:14} {tried} tried", made.product);
    }
}

/// The two cases that began this, and where a user names a link.
#[test]
fn a_link_is_replaced_itself_where_a_file_is_written_and_refused_where_a_folder_is() {
    let workspace = Workspace::new();
    let job = format!("views = {{ even = 2 }}\nobjects = [{{ built_in = [\"can-01\"] }}]\n{NO_SPLIT}");
    let dataset = workspace.make_dataset("data", &job, &[]);
    let root = print_root(&dataset);
    let precious = workspace.write("victim/precious.txt", "precious");
    // Without --out the link itself is replaced; with it, its target is written, since the user named it.
    symlink(&precious, dataset.join("report.html")).expect("a link");
    let victim = Victim::new(workspace.path("victim"));
    Program::on("report", &dataset).succeed();
    victim.assert_untouched("report");
    assert!(!dataset.join("report.html").is_symlink());
    let page = workspace.write("page.html", "old");
    symlink(&page, workspace.path("link.html")).expect("a link");
    Program::on("report", &dataset).option("--out", workspace.path("link.html")).succeed();
    assert!(workspace.path("link.html").is_symlink() && fs::metadata(&page).expect("a page").len() > 1000);

    // An output folder whose `shards` is a link: nothing behind it is renamed.
    let out = workspace.make_folder("out");
    symlink(workspace.path("victim"), out.join("shards")).expect("a link");
    let said = workspace.run_job("data", "out").expect_code(2).stderr;
    assert!(said.contains("shards is a symbolic link") && said.contains("cp -rL"), "{said}");
    victim.assert_untouched("run");
    // A folder of strange files by that name is no dataset, and keeps them.
    fs::remove_file(out.join("shards")).expect("removed");
    workspace.write("out/shards/passwd", "precious");
    let said = workspace.run_job("data", "out").expect_code(2).stderr;
    assert!(said.contains("'passwd' is in it"), "{said}");
    assert_eq!(fs::read_dir(out.join("shards")).expect("a folder").count(), 1);

    // A folder that the user names may be reached by links, also below one.
    fs::create_dir_all(workspace.path("disk/place")).expect("a folder");
    symlink(workspace.path("disk"), workspace.path("home")).expect("a link");
    workspace.make_folder("disk/other");
    symlink(workspace.path("disk/other"), workspace.path("named")).expect("a link");
    for out in ["home/place/new", "named"] {
        workspace.run_job("data", out).succeed();
        for verb in ["verify", "inspect", "report", "status"] {
            Program::on(verb, workspace.path(out)).succeed();
        }
        assert_eq!(print_root(workspace.path(out)), root);
    }
    assert!(workspace.path("disk/place/new/report.html").is_file());
}

/// Each remedy that a message names works when it is followed: `cp -rL`.
#[test]
fn a_copy_in_the_place_of_a_link_is_taken() {
    let workspace = Workspace::new();
    let job = format!("views = {{ even = 2 }}\nobjects = [{{ built_in = [\"can-01\"] }}]\n{NO_SPLIT}");
    let dataset = workspace.make_dataset("data", &job, &[]);
    for name in ["shards/", "manifest.json"] {
        let path = link(&dataset, name, &workspace.path(format!("victim-{}", name.len()))).expect("a link");
        let said = Program::on("verify", &dataset).expect_code(4).text();
        assert!(said.contains("symbolic link") && said.contains("cp -rL"), "{name}: {said}");
        let copy = workspace.path("copy");
        Program::of_system("cp").arg("-rL").arg(&path).arg(&copy).succeed();
        fs::remove_file(&path).expect("the link");
        fs::rename(copy, &path).expect("the copy");
        Program::on("verify", &dataset).succeed();
    }
}

/// A set whose dataset is a link: refused by every verb, also where it leads to that very dataset.
#[test]
fn datasets_of_a_set_are_no_links() {
    let workspace = Workspace::new();
    let job = format!("views = {{ even = 2 }}\nobjects = [{{ built_in = [\"can-01\"] }}]\n{NO_SPLIT}");
    workspace.write("one.toml", job);
    workspace.write(
        "both.toml",
        "product = \"set\"\nname = \"both\"\n[[jobs]]\nname = \"a\"\njob = \"one.toml\"\n[[jobs]]\nname = \"b\"\njob = \"one.toml\"\n\
         set = [\"seed=2\"]\n",
    );
    workspace.run_job("both", "both").succeed();
    let both = workspace.path("both");
    let root = print_root(&both);
    for name in ["b/", "set.json", "report.html"] {
        let path = link(&both, name, &workspace.path(format!("victim-{}", name.len()))).expect("a link");
        let victim = Victim::new(workspace.path(format!("victim-{}", name.len())));
        for verb in ["status", "report", "verify", "digest", "run"] {
            let program = match verb {
                "run" => workspace.run_job("both", "both"),
                verb => Program::on(verb, &both),
            };
            let outcome = program.finish();
            let what = format!("{name} {verb}: {:?} {}", outcome.code, outcome.text());
            victim.assert_untouched(&what);
            // The root of a finished set is in its table; a page is replaced.
            let is_free = name == "report.html" || (verb, name) == ("digest", "b/");
            let is_refused = outcome.text().contains("is a symbolic link") && matches!(outcome.code, Some(2 | 4));
            assert_eq!(is_refused, !is_free, "{what}");
        }
        victim.assert_unchanged(name);
        // The remedy of the message.
        if path.is_symlink() {
            Program::of_system("cp").arg("-rL").arg(&path).arg(workspace.path("copy")).succeed();
            fs::remove_file(&path).expect("the link");
            fs::rename(workspace.path("copy"), &path).expect("the copy");
        }
        Program::on("verify", &both).succeed();
        assert_eq!(print_root(&both), root);
    }
    // A dataset that is named itself may be reached by a link.
    symlink(both.join("a"), workspace.path("named")).expect("a link");
    Program::on("verify", workspace.path("named")).succeed();
}

/// A release and pictures of a hand: files of the folders that verbs make and check.
#[test]
fn releases_and_pictures_follow_no_link() {
    let workspace = Workspace::new();
    let job = format!("views = {{ even = 2 }}\nobjects = [{{ built_in = [\"can-01\"] }}]\n{NO_SPLIT}");
    let dataset = workspace.make_dataset("data", &job, &[]);
    let about = workspace.write("about.toml", ABOUT);
    let release = workspace.path("release");
    Program::on("release", &dataset).option("--about", &about).option("--out", &release).succeed();
    for name in ["README.md", "pictures/", "manifest-sha256.txt", "croissant.json", "shards/"] {
        let copy = workspace.path("copy");
        crate::support::files::copy_folder(&release, &copy);
        let place = workspace.path(format!("victim-{}", name.trim_end_matches('/')));
        link(&copy, name, &place).expect("a link");
        let victim = Victim::new(place);
        let outcome = Program::on("verify", &copy).finish();
        let what = format!("{name}: {:?} {}", outcome.code, outcome.text());
        victim.assert_untouched(&what);
        assert!(outcome.code == Some(4) && outcome.text().contains("is a symbolic link"), "{what}");
        fs::remove_dir_all(copy).expect("removed");
    }

    let (pictures, precious) = (workspace.make_folder("pictures"), workspace.write("victim/precious", "precious"));
    symlink(&precious, pictures.join("opened.png")).expect("a link");
    let victim = Victim::new(workspace.path("victim"));
    let hand = repository_path("scenes/parallel_gripper.xml");
    Program::new("hand").arg("check").arg(hand).option("--picture", &pictures).succeed();
    victim.assert_untouched("hand check");
    symlink(&precious, pictures.join("graspmill.1")).expect("a link");
    Program::new("man").option("--out", &pictures).succeed();
    victim.assert_untouched("man");
    assert!(!pictures.join("opened.png").is_symlink() && !pictures.join("graspmill.1").is_symlink());
}
