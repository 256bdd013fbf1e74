//! Releases: what makes a dataset a publication, and what stops one.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use graspmill::assets::Description;
use serde_json::Value;
use tree::tree;

mod python;
mod tree;

const JOB: &str = r#"
name = "shelf"
seed = 5
views = { even = 12 }

[[objects]]
built_in = ["can-01", "bowl-01"]

[shards]
samples = 8
"#;

const ABOUT: &str = r#"
title = "A shelf | with <two> things"
version = "1.0.0"
date = "2026-11-22"
description = "Two shapes."
licence = "CC-BY-4.0"
doi = "10.1234/shelf"
keywords = ["shelf"]

[[authors]]
name = "Lovelace, Ada"
orcid = "0000-0002-1825-0097"
affiliation = "Analytical Engines"
"#;

fn graspmill(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_graspmill"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command.args(arguments).output().expect("graspmill starts")
}

/// What it said, after it ended with this code.
fn said(arguments: &[&str], code: i32) -> String {
    let done = graspmill(arguments);
    let text = [done.stdout, done.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert_eq!(done.status.code(), Some(code), "{arguments:?}: {text}");
    text
}

struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a scratch folder"))
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_string_lossy().into_owned()
    }

    fn write(&self, name: &str, content: &str) -> String {
        let path = self.0.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, content).expect("a file");
        self.path(name)
    }

    /// The dataset of a job file's text.
    fn dataset(&self, name: &str, job: &str, threads: &str) -> String {
        let (job, out) = (self.write(&format!("{name}.toml"), job), self.path(name));
        said(&["run", &job, "--out", &out, "--threads", threads, "--progress", "none"], 0);
        out
    }

    fn release(&self, data: &str, name: &str, about: &str) -> String {
        let (about, out) = (self.write("about.toml", about), self.path(name));
        said(&["release", data, "--out", &out, "--about", &about], 0);
        out
    }

    /// What stands beside: nothing of a release that failed may.
    fn entries(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).expect("readable");
        let mut names: Vec<String> =
            entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

fn json(folder: &str, name: &str) -> Value {
    serde_json::from_slice(&fs::read(Path::new(folder).join(name)).expect("readable")).expect("JSON")
}

fn read(folder: &str, name: &str) -> String {
    fs::read_to_string(Path::new(folder).join(name)).expect("text")
}

fn sums(folder: &str) -> bool {
    let mut command = Command::new("sha256sum");
    command.args(["--check", "--quiet", "--strict", "manifest-sha256.txt"]).current_dir(folder);
    command.status().expect("coreutils' sha256sum").success()
}

/// Runs differ in folder, threads and speed; releases of them in nothing.
#[test]
fn a_release_has_the_same_bytes_wherever_it_is_made() {
    let place = Place::new();
    let data = [place.dataset("one", JOB, "1"), place.dataset("other", JOB, "2")];
    let notes = data.each_ref().map(|data| read(data, "notes.json"));
    assert!(notes.iter().all(|notes| notes.contains("seconds")), "runs leave their speed");
    let releases = [place.release(&data[0], "a", ABOUT), place.release(&data[1], "deep/b", ABOUT)];
    let trees = releases.each_ref().map(tree);
    let names = |tree: &BTreeMap<PathBuf, Vec<u8>>| tree.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&trees[0]), names(&trees[1]));
    for (path, content) in &trees[0] {
        assert!(trees[1][path] == *content, "{} differs", path.display());
        let text = String::from_utf8_lossy(content);
        for word in ["seconds", "threads_", env!("CARGO_MANIFEST_DIR"), &place.path("")] {
            let found = content.len() < 100_000 && text.contains(word);
            assert!(!found, "{}: {word}", path.display());
        }
    }
    // Only the staging folder's own leftovers would begin with a point.
    assert!(place.entries().iter().all(|name| !name.starts_with('.')), "{:?}", place.entries());
    assert!(sums(&releases[0]));
}

#[test]
fn a_release_stays_a_dataset_and_its_documents_name_it() {
    let place = Place::new();
    let data = place.dataset("data", JOB, "2");
    let release = place.release(&data, "release", ABOUT);
    for verb in ["status", "inspect", "digest", "verify"] {
        said(&[verb, &release], 0);
    }
    said(&["verify", &release, "--regenerate", "4"], 0);
    let verified: Value = serde_json::from_str(&said(&["verify", &release, "--json"], 0)).expect("JSON");
    let root = verified["root"].as_str().expect("a root");
    assert_eq!(verified["release_files"].as_u64(), Some(tree(&release).len() as u64 - 1));
    for name in ["README.md", "DATASHEET.md", "CITATION.cff", "croissant.json", "provenance.intoto.json"] {
        assert!(read(&release, name).contains(root), "{name}");
    }
    // Every file of the dataset stands there as it was.
    let (before, after) = (tree(&data), tree(&release));
    for (path, content) in before.iter().filter(|(path, _)| !path.ends_with("notes.json")) {
        assert!(after.get(path) == Some(content), "{}", path.display());
    }
    let croissant = json(&release, "croissant.json");
    let index = croissant["recordSet"].as_array().expect("record sets").iter().find(|set| set["@id"] == "samples");
    let fields = index.expect("samples")["field"].as_array().expect("fields").len();
    assert_eq!(fields, 11 + 4 + 2, "columns of docs/format.md: all products', completion's, two channels'");
    // Text of the authors breaks neither table nor tag, and leads into no front matter.
    let card = read(&release, "README.md");
    assert!(card.starts_with("---\nlicense: cc-by-4.0\npretty_name: \"A shelf | with <two> things\"\n"), "{card}");
    assert!(card.contains("| samples planned | 24 |") && card.contains("| stored | 24 |"), "{card}");
    let licences = json(&release, "licences.json");
    let rows = licences["assets"].as_array().expect("assets");
    assert!(rows.iter().all(|row| row["licence"] == "CC0-1.0" && row["may_be_shipped"] == "everything"), "{rows:?}");
    assert_eq!(rows[0]["source"], "graspmill, built-in shape bowl-01");
    let subjects = &json(&release, "provenance.intoto.json")["subject"];
    assert_eq!(subjects.as_array().map(Vec::len), Some(1 + 3), "the root and three shards");
    // A folder that holds something stays as it is.
    let told = said(&["release", &data, "--out", &release, "--about", &place.path("about.toml")], 2);
    assert!(told.contains("stands in it"), "{told}");
}

#[test]
fn what_was_changed_is_told() {
    let place = Place::new();
    let data = place.dataset("data", JOB, "2");
    let release = place.release(&data, "release", ABOUT);
    let other =
        place.release(&place.dataset("other", &JOB.replace("seed = 5", "seed = 6"), "2"), "other-release", ABOUT);
    let whole = tree(&release);
    let mend =
        || whole.iter().for_each(|(path, content)| fs::write(Path::new(&release).join(path), content).expect("mended"));
    // A document with another word.
    place.write("release/DATASHEET.md", &read(&release, "DATASHEET.md").replace("24", "25"));
    let told = said(&["verify", &release], 4);
    assert!(told.contains("DATASHEET.md: its content has changed") && !sums(&release), "{told}");
    mend();
    // A file too many, then one too few.
    let more = place.write("release/shards.zip", "x");
    assert!(said(&["verify", &release], 4).contains("does not know this file"));
    fs::remove_file(more).expect("removed");
    fs::remove_file(Path::new(&release).join("LICENCES.md")).expect("removed");
    assert!(said(&["verify", &release], 4).contains("LICENCES.md"));
    mend();
    // Documents of another dataset, with sums that are right.
    for name in ["README.md", "croissant.json", "provenance.intoto.json", "licences.json", "CITATION.cff"] {
        place.write(&format!("release/{name}"), &read(&other, name));
        let line = |folder: &str| {
            let sums = read(folder, "manifest-sha256.txt");
            sums.lines().find(|line| line.ends_with(&format!("  {name}"))).expect("a line").to_owned()
        };
        let list = read(&release, "manifest-sha256.txt").replace(&line(&release), &line(&other));
        place.write("release/manifest-sha256.txt", &list);
        assert!(sums(&release));
        let told = said(&["verify", &release], 4);
        assert!(told.contains(name) && told.contains("root"), "{name}: {told}");
        mend();
    }
    said(&["verify", &release], 0);
}

#[test]
fn a_damaged_dataset_is_not_released_and_nothing_is_left() {
    let place = Place::new();
    let data = place.dataset("data", JOB, "2");
    let about = place.write("about.toml", ABOUT);
    let before = place.entries();
    place.write("data/assets.json", &read(&data, "assets.json").replace("\"bodies\": 1", "\"bodies\": 9"));
    let told = said(&["release", &data, "--out", &place.path("release"), "--about", &about], 4);
    assert!(told.contains("assets.json") && told.contains("not intact"), "{told}");
    assert_eq!(place.entries(), before);
    fs::remove_file(Path::new(&data).join("manifest.json")).expect("removed");
    let told = said(&["release", &data, "--out", &place.path("release"), "--about", &about], 1);
    assert!(told.contains("not finished"), "{told}");
    assert_eq!(place.entries(), before);
}

#[test]
fn mistakes_of_the_about_file_are_all_told_with_their_lines() {
    let place = Place::new();
    let data = place.dataset("data", JOB, "2");
    let about = ABOUT.replace("date = \"2026-11-22\"", "date = \"today\"").replace("keywords", "keyword");
    let about = place.write("about.toml", &(about + "\n[licences]\n\"mug-*\" = \"MIT\"\n"));
    let told = said(&["release", &data, "--out", &place.path("release"), "--about", &about], 2);
    for word in ["about.toml:4", "YYYY-MM-DD", "`keywords`", "mug-*", "can-01", "3 errors in"] {
        assert!(told.contains(word), "'{word}' is not in:\n{told}");
    }
    assert!(!Path::new(&place.path("release")).exists());
}

/// A box of which nobody says whose it is.
const BOX: &str = "v 0 0 0\nv 0.1 0 0\nv 0.1 0.08 0\nv 0 0.08 0\nv 0 0 0.06\nv 0.1 0 0.06\nv 0.1 0.08 0.06\nv 0 0.08 0.06\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

#[test]
fn what_has_no_known_licence_is_not_shipped() {
    let place = Place::new();
    place.write("meshes/found.obj", BOX);
    let job = "name = \"found\"\nviews = { even = 4 }\n[[objects]]\nbuilt_in = [\"can-01\"]\n[[objects]]\n\
        folder = \"meshes\"\nunit = \"m\"\n";
    let data = place.dataset("data", job, "2");
    let about = place.write("about.toml", ABOUT);
    let out = place.path("release");
    let told = said(&["release", &data, "--out", &out, "--about", &about], 2);
    for word in ["object found", "its licence is not known", "[licences]", "--recipe", "about.toml"] {
        assert!(told.contains(word), "'{word}' is not in:\n{told}");
    }
    assert!(!told.contains("can-01") && !Path::new(&out).exists(), "{told}");
    // A recipe holds none of its data, and is checked as far as it goes.
    said(&["release", &data, "--out", &out, "--about", &about, "--recipe"], 0);
    let files = tree(&out);
    let hidden = |path: &&PathBuf| {
        let name = path.to_string_lossy();
        ["shards", "pictures", "preview", "report"].iter().any(|word| name.starts_with(word))
    };
    assert_eq!(files.keys().find(hidden), None);
    assert_eq!(json(&out, "recipe.json")["root"], json(&data, "manifest.json")["root"]);
    assert!(read(&out, "README.md").contains("This is a recipe"));
    assert!(said(&["verify", &out], 0).contains("a recipe: 1 files of the dataset are left out"));
    // What it excuses is what it names alone.
    fs::remove_file(Path::new(&out).join("index.parquet")).expect("removed");
    said(&["verify", &out], 4);
    // With its licence it may go out, and there is nothing to leave out.
    let stated = place.write("about.toml", &format!("{ABOUT}\n[licences]\n\"fou*\" = \"CC-BY-4.0\"\n"));
    let whole = place.path("whole");
    assert!(
        said(&["release", &data, "--out", &whole, "--about", &stated, "--recipe"], 2).contains("leave --recipe away")
    );
    said(&["release", &data, "--out", &whole, "--about", &stated], 0);
    said(&["verify", &whole], 0);
    // Not for sale, but the release would be.
    let unsold = place.write("about.toml", &format!("{ABOUT}\n[licences]\nfound = \"CC-BY-NC-4.0\"\n"));
    let told = said(&["release", &data, "--out", &place.path("sold"), "--about", &unsold], 2);
    assert!(told.contains("CC-BY-NC-4.0 forbids commercial use, the release's licence CC-BY-4.0 allows it"), "{told}");
}

/// Grasps carry the meshes themselves: these alone are left out where data made of them may be shipped.
#[cfg(feature = "sim")]
#[test]
fn a_recipe_of_grasps_leaves_out_the_shapes_alone() {
    let place = Place::new();
    let root = env!("CARGO_MANIFEST_DIR");
    let job = format!(
        "product = \"grasps\"\nname = \"held\"\nseed = 1\n[hand]\nscene = \"{root}/scenes/barrett_bh8_280.xml\"\n\
         [grasps]\nseeds = 2\n[annealing]\nsteps = 1500\n[keep]\nspace = \"force\"\n[[objects]]\nbuilt_in = [\"box-01\"]\n"
    );
    let data = place.dataset("data", &job, "2");
    let terms = "\"box-*\" = { licence = \"for our lab\", redistribute = false, derived = true }";
    let about = place.write("about.toml", &format!("{ABOUT}\n[licences]\n{terms}\n"));
    let out = place.path("release");
    let told = said(&["release", &data, "--out", &out, "--about", &about], 2);
    assert!(told.contains("copies of its shape") && !told.contains("hand"), "the hand is graspmill's own: {told}");
    said(&["release", &data, "--out", &out, "--about", &about, "--recipe"], 0);
    let files = tree(&out);
    let left = [Path::new("shapes.mcap"), Path::new("preview.mcap")];
    assert!(left.iter().all(|path| !files.contains_key(*path)), "{:?}", files.keys());
    assert!(files.contains_key(Path::new("pictures/1.png")) && files.contains_key(Path::new("report.html")));
    assert!(said(&["verify", &out], 0).contains("1 of 1 shards intact"));
    let free = place.release(&data, "free", ABOUT);
    assert!(tree(&free).contains_key(Path::new("shapes.mcap")));
    let licences = json(&free, "licences.json");
    assert_eq!(licences["assets"][1]["kind"], "hand");
    assert_eq!(licences["assets"][1]["licence_told_by"], "graspmill");
}

/// The table knows the descriptions as they are; those whose files have to be fetched, where they are there.
#[test]
fn licences_of_our_scenes_are_of_their_content() {
    let table: toml::Table = fs::read_to_string("scenes/licences.toml").expect("a table").parse().expect("TOML");
    let rows = table["descriptions"].as_array().expect("rows");
    let mut known = 0;
    for row in rows {
        let scene = Path::new(row["scene"].as_str().expect("a scene"));
        let hand = scene.with_extension("toml").exists();
        let found = if hand { Description::of_hand(scene) } else { Description::read(scene) };
        match found {
            Ok(found) => {
                assert_eq!(row["content"].as_str(), Some(found.digest.hex().as_str()), "{}", scene.display());
                known += 1;
            }
            Err(error) => {
                assert!(error.path.to_string_lossy().contains(".deps"), "{error}: not a file that is fetched");
            }
        }
    }
    assert!(known >= 6, "{known} of {}", rows.len());
}

/// The small release is made again and compared with the documents that are kept of it.
#[test]
fn the_small_release_comes_out_again() {
    let place = Place::new();
    let data = place.path("data");
    said(&["run", "jobs/ycb-small.toml", "--out", &data, "--progress", "none"], 0);
    let out = place.path("release");
    said(&["release", &data, "--out", &out, "--about", "datasets/ycb-small/about.toml"], 0);
    let (kept, made) = (tree("datasets/ycb-small"), tree(&out));
    for name in ["README.md", "manifest.json", "manifest-sha256.txt", "croissant.json", "about.toml"] {
        assert!(kept.contains_key(Path::new(name)), "{name} is kept");
    }
    for (path, content) in &kept {
        let same = made.get(path) == Some(content);
        assert!(same, "{} is not what is kept; `make release-small` writes it anew", path.display());
    }
}

/// What reads such documents for others: mlcroissant, cffconvert, Rerun; on a release of each product.
#[cfg(feature = "sim")]
#[test]
#[ignore = "slow: make test-slow"]
fn others_read_releases_of_every_product() {
    let place = Place::new();
    let about = place.write("about.toml", ABOUT);
    let grasps = place.path("grasps");
    let chosen = format!("grasps.dataset={grasps}");
    let jobs: [(&str, &[&str]); 4] = [
        ("builtin", &["views={ even = 12 }"]),
        ("grasps-quick", &["annealing.steps=1500", "keep.space=force"]),
        ("patches-quick", &[&chosen, "render.colour=false"]),
        ("fetch-reachability", &[]),
    ];
    for (job, settings) in jobs {
        let product = job.split('-').next().expect("a name");
        let (file, data) = (format!("jobs/{job}.toml"), place.path(product));
        let settings = settings.iter().flat_map(|setting| ["--set", setting]);
        let arguments: Vec<&str> =
            ["run", &file, "--out", &data, "--progress", "none"].into_iter().chain(settings).collect();
        said(&arguments, 0);
        let out = place.path(&format!("{product}-release"));
        said(&["release", &data, "--out", &out, "--about", &about], 0);
        assert!(sums(&out), "{product}");
        let told = python::run("peers/bin/python", |command| command.arg("tests/peers/release.py").arg(&out));
        let rows: u64 = told.trim().parse().expect("a count of records");
        assert_eq!(Some(rows), json(&out, "manifest.json")["counts"]["samples"].as_u64(), "{product}");
    }
}
