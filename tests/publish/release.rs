//! Releases: their documents, their checks, and datasets that are refused.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::LazyLock,
};

use graspmill::description::Description;

use crate::support::{
    files::{ROOT, copy_folder, list_names, read_json, read_text, read_tree},
    jobs::{SHORT_SEARCH, barrett_line},
    program::Program,
    workspace::Workspace,
};

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

/// `graspmill release DATA --out OUT --about ABOUT`.
fn release(data: &Path, out: &Path, about: &Path) -> Program {
    Program::on("release", data).option("--out", out).option("--about", about)
}

/// Makes the release `NAME` of a dataset.
fn make_release(workspace: &Workspace, data: &Path, name: &str) -> PathBuf {
    let (about, out) = (workspace.write("about.toml", ABOUT), workspace.path(name));
    release(data, &out, &about).succeed();
    out
}

/// A dataset of [`JOB`], `data`, and a release of it, `release`, made once.
static MADE: LazyLock<Workspace> = LazyLock::new(|| {
    let made = Workspace::kept("release");
    let data = made.make_dataset("data", JOB, &[]);
    make_release(&made, &data, "release");
    made
});

/// Copies the dataset of [`JOB`].
fn copy_data(workspace: &Workspace) -> PathBuf {
    let data = workspace.path("data");
    copy_folder(MADE.path("data"), &data);
    data
}

/// Copies the dataset of [`JOB`] and its release, and an about file.
fn copy_data_and_release(workspace: &Workspace) -> [PathBuf; 2] {
    workspace.write("about.toml", ABOUT);
    let release = workspace.path("release");
    copy_folder(MADE.path("release"), &release);
    [copy_data(workspace), release]
}

fn verify(release: &Path) -> Program {
    Program::on("verify", release)
}

fn has_right_sums(folder: &Path) -> bool {
    let sums = Program::of_system("sha256sum").current_dir(folder);
    sums.args(["--check", "--quiet", "--strict", "manifest-sha256.txt"]).finish().code == Some(0)
}

/// Writes an about file with these licences of objects.
fn write_licences(workspace: &Workspace, lines: &str) -> PathBuf {
    workspace.write("about.toml", format!("{ABOUT}\n[licences]\n{lines}\n"))
}

/// Runs differ in folder, threads and speed; releases of them in nothing.
#[test]
fn a_release_has_the_same_bytes_wherever_it_is_made() {
    let workspace = Workspace::new();
    workspace.write("job.toml", JOB);
    let data = [("one", "1"), ("other", "2")].map(|(name, threads)| {
        workspace.run_job("job", name).option("--threads", threads).succeed();
        workspace.path(name)
    });
    let notes = data.each_ref().map(|data| read_text(data.join("notes.json")));
    assert!(notes.iter().all(|notes| notes.contains("seconds")), "runs leave their speed");
    let releases = [make_release(&workspace, &data[0], "a"), make_release(&workspace, &data[1], "deep/b")];
    let trees = releases.each_ref().map(read_tree);
    let names = |tree: &BTreeMap<PathBuf, Vec<u8>>| tree.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&trees[0]), names(&trees[1]));
    for (path, content) in &trees[0] {
        assert!(trees[1][path] == *content, "{} differs", path.display());
        let text = String::from_utf8_lossy(content);
        for word in ["seconds", "threads_", ROOT, &workspace.folder().display().to_string()] {
            let found = content.len() < 100_000 && text.contains(word);
            assert!(!found, "{}: {word}", path.display());
        }
    }
    // Only the staging folder's own leftovers would begin with a point.
    let names = list_names(workspace.folder());
    assert!(names.iter().all(|name| !name.starts_with('.')), "{names:?}");
    assert!(has_right_sums(&releases[0]));
}

#[test]
fn a_release_stays_a_dataset_and_its_documents_name_it() {
    let workspace = Workspace::new();
    let [data, out] = copy_data_and_release(&workspace);
    for verb in ["status", "inspect", "digest", "verify"] {
        Program::new(verb).arg(&out).succeed();
    }
    verify(&out).option("--regenerate", "4").succeed();
    let verified = verify(&out).read_json();
    let root = verified["root"].as_str().expect("a root");
    assert_eq!(verified["release_files"].as_u64(), Some(read_tree(&out).len() as u64 - 1));
    for name in ["README.md", "DATASHEET.md", "CITATION.cff", "croissant.json", "provenance.intoto.json"] {
        assert!(read_text(out.join(name)).contains(root), "{name}");
    }
    // Every file of the dataset is included unchanged.
    let (before, after) = (read_tree(&data), read_tree(&out));
    for (path, content) in before.iter().filter(|(path, _)| !path.ends_with("notes.json")) {
        assert!(after.get(path) == Some(content), "{}", path.display());
    }
    let croissant = read_json(out.join("croissant.json"));
    let index = croissant["recordSet"].as_array().expect("record sets").iter().find(|set| set["@id"] == "samples");
    let fields = index.expect("samples")["field"].as_array().expect("fields").len();
    assert_eq!(fields, 11 + 4 + 2, "columns of docs/format.md: all products', completion's, two channels'");
    // Text of the authors breaks neither table nor tag, and leads into no front matter.
    let card = read_text(out.join("README.md"));
    assert!(card.starts_with("---\nlicense: cc-by-4.0\npretty_name: \"A shelf | with <two> things\"\n"), "{card}");
    assert!(card.contains("| samples planned | 24 |") && card.contains("| stored | 24 |"), "{card}");
    let licences = read_json(out.join("licences.json"));
    let rows = licences["assets"].as_array().expect("assets");
    assert!(rows.iter().all(|row| row["licence"] == "CC0-1.0" && row["may_be_shipped"] == "everything"), "{rows:?}");
    assert_eq!(rows[0]["source"], "graspmill, built-in shape bowl-01");
    let subjects = &read_json(out.join("provenance.intoto.json"))["subject"];
    assert_eq!(subjects.as_array().map(Vec::len), Some(1 + 3), "the root and three shards");
    // A folder that is not empty is not changed.
    let said = release(&data, &out, &workspace.path("about.toml")).expect_code(2).stderr;
    assert!(said.contains("is in it"), "{said}");
}

#[test]
fn what_was_changed_is_told() {
    let workspace = Workspace::new();
    let [_, out] = copy_data_and_release(&workspace);
    let other = make_release(&workspace, &workspace.make_dataset("other", JOB, &["seed=6"]), "other-release");
    let whole = read_tree(&out);
    let mend = || {
        for (path, content) in &whole {
            fs::write(out.join(path), content).expect("mended");
        }
    };
    // A document with another word.
    workspace.write("release/DATASHEET.md", workspace.read("release/DATASHEET.md").replace("24", "25"));
    let said = verify(&out).expect_code(4).text();
    assert!(said.contains("DATASHEET.md: its content has changed") && !has_right_sums(&out), "{said}");
    mend();
    // A file too many, then one too few.
    let more = workspace.write("release/shards.zip", "x");
    assert!(verify(&out).expect_code(4).text().contains("does not list this file"));
    fs::remove_file(more).expect("removed");
    fs::remove_file(out.join("LICENCES.md")).expect("removed");
    assert!(verify(&out).expect_code(4).text().contains("LICENCES.md"));
    mend();
    // Documents of another dataset, with sums that are right.
    for name in ["README.md", "croissant.json", "provenance.intoto.json", "licences.json", "CITATION.cff"] {
        fs::copy(other.join(name), out.join(name)).expect("a copy");
        let line = |folder: &Path| {
            let sums = read_text(folder.join("manifest-sha256.txt"));
            sums.lines().find(|line| line.ends_with(&format!("  {name}"))).expect("a line").to_owned()
        };
        let list = read_text(out.join("manifest-sha256.txt")).replace(&line(&out), &line(&other));
        workspace.write("release/manifest-sha256.txt", list);
        assert!(has_right_sums(&out));
        let said = verify(&out).expect_code(4).text();
        assert!(said.contains(name) && said.contains("root"), "{name}: {said}");
        mend();
    }
    verify(&out).succeed();
}

#[test]
fn a_damaged_dataset_is_not_released_and_nothing_is_left() {
    let workspace = Workspace::new();
    let data = copy_data(&workspace);
    let about = workspace.write("about.toml", ABOUT);
    let before = list_names(workspace.folder());
    workspace.write("data/assets.json", workspace.read("data/assets.json").replace("\"bodies\": 1", "\"bodies\": 9"));
    let said = release(&data, &workspace.path("release"), &about).expect_code(4).text();
    assert!(said.contains("assets.json") && said.contains("not intact"), "{said}");
    // A release that failed leaves no file in the folder of the dataset.
    assert_eq!(list_names(workspace.folder()), before);
    fs::remove_file(data.join("manifest.json")).expect("removed");
    let said = release(&data, &workspace.path("release"), &about).expect_code(1).text();
    assert!(said.contains("not finished"), "{said}");
    assert_eq!(list_names(workspace.folder()), before);
}

#[test]
fn mistakes_of_the_about_file_are_all_told_with_their_lines() {
    let workspace = Workspace::new();
    let data = copy_data(&workspace);
    let about = ABOUT.replace("date = \"2026-11-22\"", "date = \"today\"").replace("keywords", "keyword");
    let about = workspace.write("about.toml", about + "\n[licences]\n\"mug-*\" = \"MIT\"\n");
    let said = release(&data, &workspace.path("release"), &about).expect_code(2).text();
    for word in ["about.toml:4", "YYYY-MM-DD", "`keywords`", "mug-*", "can-01", "3 errors in"] {
        assert!(said.contains(word), "'{word}' is not in:\n{said}");
    }
    assert!(!workspace.path("release").exists());
}

/// A box without a known licence.
const BOX: &str = "v 0 0 0\nv 0.1 0 0\nv 0.1 0.08 0\nv 0 0.08 0\nv 0 0 0.06\nv 0.1 0 0.06\nv 0.1 0.08 0.06\nv 0 0.08 0.06\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

#[test]
fn what_has_no_known_licence_is_not_shipped() {
    let workspace = Workspace::new();
    workspace.write("meshes/found.obj", BOX);
    let job = "name = \"found\"\nviews = { even = 4 }\n[[objects]]\nbuilt_in = [\"can-01\"]\n[[objects]]\n\
        folder = \"meshes\"\nunit = \"m\"\n";
    let data = workspace.make_dataset("data", job, &[]);
    let (about, out) = (workspace.write("about.toml", ABOUT), workspace.path("release"));
    let said = release(&data, &out, &about).expect_code(2).text();
    for word in ["object found", "its licence is not known", "[licences]", "--recipe", "about.toml"] {
        assert!(said.contains(word), "'{word}' is not in:\n{said}");
    }
    assert!(!said.contains("can-01") && !out.exists(), "{said}");
    // A recipe holds none of its data, and is checked as far as it goes.
    release(&data, &out, &about).arg("--recipe").succeed();
    let files = read_tree(&out);
    let hidden = |path: &&PathBuf| {
        let name = path.to_string_lossy();
        ["shards", "pictures", "preview", "report"].iter().any(|word| name.starts_with(word))
    };
    assert_eq!(files.keys().find(hidden), None);
    assert_eq!(read_json(out.join("recipe.json"))["root"], read_json(data.join("manifest.json"))["root"]);
    assert!(read_text(out.join("README.md")).contains("This is a recipe"));
    assert!(verify(&out).succeed().text().contains("a recipe: 1 files of the dataset are not included"));
    // It excuses the files that it names, and no other.
    fs::remove_file(out.join("index.parquet")).expect("removed");
    verify(&out).expect_code(4);
    // With its licence it may go out, and there is nothing to leave out.
    let stated = write_licences(&workspace, "\"fou*\" = \"CC-BY-4.0\"");
    let whole = workspace.path("whole");
    let said = release(&data, &whole, &stated).arg("--recipe").expect_code(2).text();
    assert!(said.contains("leave out --recipe"), "{said}");
    release(&data, &whole, &stated).succeed();
    verify(&whole).succeed();
    // Not for sale, but the release would be.
    let unsold = write_licences(&workspace, "found = \"CC-BY-NC-4.0\"");
    let said = release(&data, &workspace.path("sold"), &unsold).expect_code(2).text();
    assert!(
        said.contains("CC-BY-NC-4.0 forbids commercial use, but the release's licence CC-BY-4.0 allows it"),
        "{said}"
    );
}

/// A pattern fills gaps: objects with a known licence, credit and source keep them. A name replaces a licence, keeps
/// the credit, and the release shows both licences.
#[test]
fn a_pattern_of_licences_replaces_nothing_that_is_known() {
    let workspace = Workspace::new();
    workspace.write("scan/scan.obj", BOX);
    workspace.write("found/found.obj", BOX.replace("0.08", "0.09"));
    let job = "name = \"shapes\"\nviews = { even = 4 }\n[[objects]]\nbuilt_in = [\"can-01\"]\n[[objects]]\nfolder = \"scan\"\n\
               unit = \"m\"\nlicence = \"CC-BY-4.0\"\ncitation = \"Doe et al. 2020\"\n[[objects]]\nfolder = \"found\"\nunit = \"m\"\n";
    let data = workspace.make_dataset("data", job, &[]);
    let make = |name: &str, lines: &str| {
        let out = workspace.path(name);
        let said = release(&data, &out, &write_licences(&workspace, lines)).succeed().text();
        let found = read_json(out.join("licences.json"));
        let rows = found["assets"].as_array().expect("rows").iter();
        let rows: BTreeMap<String, serde_json::Value> =
            rows.map(|row| (row["name"].as_str().expect("a name").to_owned(), row.clone())).collect();
        (said, rows, read_text(out.join("LICENCES.md")))
    };
    let all = "\"*\" = { licence = \"MIT\", attribution = \"Somebody else\", source = \"a drawer\" }";
    let (said, rows, _) = make("all", all);
    assert!(
        said.contains("\"*\" applies only to assets without a known licence") && said.contains("scan (CC-BY-4.0)"),
        "{said}"
    );
    let stated = |name: &str| ["licence", "licence_source", "attribution"].map(|key| rows[name][key].clone());
    assert_eq!(stated("scan"), ["CC-BY-4.0", "dataset", "Doe et al. 2020"]);
    assert_eq!(rows["scan"]["source"], "file scan.obj");
    assert_eq!(stated("found"), ["MIT", "about", "Somebody else"]);
    assert_eq!(rows["found"]["source"], "a drawer");
    assert_eq!(stated("can-01")[..2], ["CC0-1.0", "dataset"]);
    assert!(rows.values().all(|row| row["replaces"].is_null()), "{rows:?}");
    // By its name.
    let (said, rows, page) =
        make("named", &format!("{all}\nscan = {{ licence = \"CC0-1.0\", attribution = \"A. Buyer\" }}"));
    let told = "the about file states CC0-1.0 for scan, instead of CC-BY-4.0 (the dataset); LICENCES.md shows both";
    assert!(said.contains(told), "{said}");
    assert_eq!(rows["scan"]["licence"], "CC0-1.0");
    assert_eq!(rows["scan"]["replaces"]["licence"], "CC-BY-4.0");
    assert_eq!(rows["scan"]["attribution"], "Doe et al. 2020; A. Buyer");
    let row = page.lines().find(|line| line.starts_with("| scan ")).expect("a row");
    assert!(row.contains("CC0-1.0") && row.contains("CC-BY-4.0"), "{row}");
}

/// Grasps contain the meshes themselves: only these are left out where derived data may be shipped.
#[test]
fn a_recipe_of_grasps_leaves_out_the_shapes_alone() {
    let workspace = Workspace::new();
    let job = format!(
        "product = \"grasps\"\nname = \"held\"\nseed = 1\n{}[grasps]\nseeds = 2\n[[objects]]\nbuilt_in = [\"box-01\"]\n",
        barrett_line()
    );
    let data = workspace.make_dataset("data", &job, &SHORT_SEARCH);
    // A name replaces what is known of the built-in shape; a pattern fills gaps, and the hand has none.
    let terms = "\"box-01\" = { licence = \"for our lab\", redistribute = false, derived = true }\n\"*\" = \"MIT\"";
    let (about, out) = (write_licences(&workspace, terms), workspace.path("release"));
    let said = release(&data, &out, &about).expect_code(2).text();
    assert!(said.contains("copies of its shape") && !said.contains("hand"), "the hand is graspmill's own: {said}");
    let said = release(&data, &out, &about).arg("--recipe").succeed().text();
    assert!(
        said.contains("\"*\" applies only to assets without a known licence") && said.contains("barrett_bh8_280"),
        "{said}"
    );
    let hand = &read_json(out.join("licences.json"))["assets"][1];
    assert!(hand["licence_source"] == "graspmill" && hand["licence"] != "MIT", "{hand}");
    let files = read_tree(&out);
    let left = [Path::new("shapes.mcap"), Path::new("preview.mcap")];
    assert!(left.iter().all(|path| !files.contains_key(*path)), "{:?}", files.keys());
    assert!(files.contains_key(Path::new("pictures/1.png")) && files.contains_key(Path::new("report.html")));
    assert!(verify(&out).succeed().text().contains("1 of 1 shard intact"));
    let free = make_release(&workspace, &data, "free");
    assert!(free.join("shapes.mcap").is_file());
    let licences = read_json(free.join("licences.json"));
    assert_eq!(licences["assets"][1]["kind"], "hand");
    assert_eq!(licences["assets"][1]["licence_source"], "graspmill");
}

/// The table has the descriptions unchanged; those whose files must be fetched, if they are installed.
#[test]
fn licences_of_our_scenes_are_of_their_content() {
    let table: toml::Table = read_text("scenes/licences.toml").parse().expect("TOML");
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
                assert!(error.to_string().contains(".deps"), "{error}: not a file that is fetched");
            }
        }
    }
    assert!(known >= 6, "{known} of {}", rows.len());
}

/// The small release is made again and compared with the documents that are kept of it.
#[test]
fn the_small_release_comes_out_again() {
    let workspace = Workspace::new();
    let [data, out] = ["data", "release"].map(|name| workspace.path(name));
    Program::run_job("jobs/ycb-small.toml", &data).succeed();
    release(&data, &out, Path::new("datasets/ycb-small/about.toml")).succeed();
    let (kept, made) = (read_tree("datasets/ycb-small"), read_tree(&out));
    for name in ["README.md", "manifest.json", "manifest-sha256.txt", "croissant.json", "about.toml"] {
        assert!(kept.contains_key(Path::new(name)), "{name} is kept");
    }
    for (path, content) in &kept {
        let same = made.get(path) == Some(content);
        assert!(same, "{} is not what is kept; `make release-small` writes it again", path.display());
    }
}

/// Readers that others use: mlcroissant, cffconvert, Rerun; on a release of each product.
#[test]
#[ignore = "slow: make test-all"]
fn others_read_releases_of_every_product() {
    let workspace = Workspace::new();
    let chosen = format!("grasps.dataset={}", workspace.path("grasps").display());
    let jobs: [(&str, &[&str]); 4] = [
        ("builtin", &["views={ even = 12 }"]),
        ("grasps-quick", &SHORT_SEARCH),
        ("patches-quick", &[&chosen, "render.colour=false"]),
        ("fetch-reachability", &[]),
    ];
    for (job, settings) in jobs {
        let product = job.split('-').next().expect("a name");
        let data = workspace.path(product);
        Program::run_job(format!("jobs/{job}.toml"), &data).set(settings).succeed();
        let out = make_release(&workspace, &data, &format!("{product}-release"));
        assert!(has_right_sums(&out), "{product}");
        let peer = Program::peer("peers/bin/python").arg("tests/peers/release.py").arg(&out);
        let rows: u64 = peer.succeed().json();
        assert_eq!(Some(rows), read_json(out.join("manifest.json"))["counts"]["samples"].as_u64(), "{product}");
    }
}
