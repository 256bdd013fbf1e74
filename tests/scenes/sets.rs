//! The report of a set: one picture of one scene as its datasets know it, and links to their own reports alone.

use std::{collections::BTreeSet, fs, path::Path};

use graspmill::{
    files::Folder,
    format::{
        AmodalFacts, Clutter,
        dataset::{DatasetReader, Fate, LedgerRow, SetTable},
    },
};

use crate::support::{
    files::{read_text, repository_path},
    jobs::NO_SPLIT,
    program::Program,
    robots::GRIPPER,
    workspace::Workspace,
};

const NAMES: [&str; 5] = ["scenes", "views", "amodal", "grasps", "picks"];

/// Bins of three shapes, views of them, pairs, grasps, and the grasps among the bodies, by the name of each job.
fn jobs() -> [String; 5] {
    let (hand, shapes) = (repository_path(GRIPPER), "built_in = [\"bottle-01\", \"box-01\", \"can-01\"]");
    let camera =
        "{ shell = { radius = [0.4, 0.6], polar_deg = [0, 50] }, views = 2, width = 320, height = 240, fx = 300.0 }";
    [
        format!(
            "product = \"scenes\"\nseed = 5\nmode = \"bin\"\ncount = 3\ncontainer = {{ inner_size = [0.3, 0.3, 0.06] }}\n\
             scenes = {{ training = 1 }}\n[[objects]]\n{shapes}\n{NO_SPLIT}"
        ),
        format!(
            "product = \"views\"\nseed = 3\n[scenes]\ndataset = \"x\"\n[views]\ncameras = [{camera}]\nmin_pixels = 50\n"
        ),
        "product = \"amodal\"\nseed = 3\n[views]\ndataset = \"x\"\n".to_owned(),
        format!(
            "product = \"grasps\"\nseed = 7\n[hand]\nmodel = {hand:?}\n[[objects]]\n{shapes}\n[grasps]\nseeds = 1\n\
             sampler = \"antipodal\"\n[antipodal]\nbest = 5\n[keep]\ntorsion = 0.002\n{NO_SPLIT}"
        ),
        format!(
            "product = \"picks\"\nseed = 3\n[scenes]\ndataset = \"x\"\n[grasps]\ndataset = \"x\"\n[hand]\nmodel = {hand:?}\n\
             [picks]\ncandidates = 60\ntrials = 2\n"
        ),
    ]
}

/// Writes the jobs and the set of them.
fn write_set(workspace: &Workspace) {
    let mut set = "product = \"set\"\nname = \"small <bins>\"\n".to_owned();
    let inputs = [
        "{}",
        "{ scenes = \"scenes\" }",
        "{ views = \"views\" }",
        "{}",
        "{ scenes = \"scenes\", grasps = \"grasps\" }",
    ];
    for ((name, job), inputs) in NAMES.into_iter().zip(jobs()).zip(inputs) {
        workspace.write(format!("{name}.toml"), job);
        set += &format!("[[jobs]]\nname = \"{name}\"\njob = \"{name}.toml\"\ninputs = {inputs}\n");
    }
    workspace.write("set.toml", set);
}

/// Rows of the stored samples of a dataset.
fn kept(folder: &Path) -> Vec<LedgerRow> {
    let reader = DatasetReader::open(&Folder::at(folder)).expect("a dataset");
    let rows = (0..reader.manifest().shards.len()).flat_map(|shard| reader.ledger(shard).expect("a ledger").rows);
    rows.filter(|row| matches!(row.fate, Fate::Kept(_))).collect()
}

/// The name of the body whose pair a page must show: in the one scene, the body whose visible share is nearest to half.
fn expected_body(set: &Path) -> String {
    let distance = |row: &LedgerRow| {
        let AmodalFacts { visible_share, truncated, .. } = AmodalFacts::from(&row.facts);
        (visible_share - 0.5).abs() + f64::from(truncated)
    };
    let pairs = kept(&set.join("amodal"));
    let nearest = pairs.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("a pair");
    let reader = DatasetReader::open(&Folder::at(set.join("amodal"))).expect("a dataset");
    let object =
        reader.sample(nearest.index).expect("readable").expect("stored").read::<Clutter>().expect("a record").object;
    let row = reader.assets().expect("assets").objects.into_iter().find(|row| row.object == object);
    row.expect("a row").name
}

/// Values of an attribute.
fn values<'a>(page: &'a str, attribute: &str) -> Vec<&'a str> {
    let start = format!(" {attribute}=\"");
    page.split(start.as_str()).skip(1).filter_map(|rest| Some(rest.split_once('"')?.0)).collect()
}

#[test]
#[ignore = "slow: a set of datasets in clutter"]
fn the_page_of_a_set_shows_one_scene_and_leads_to_the_pages_of_its_datasets_alone() {
    let workspace = Workspace::new();
    write_set(&workspace);
    let set = workspace.path("set");
    workspace.run_job("set", "set").succeed();
    let said = Program::on("report", &set).succeed().stdout;
    assert_eq!(said.lines().count(), 6, "{said}");
    assert!(said.lines().last().is_some_and(|line| line.starts_with(&format!("{}/report.html", set.display()))));
    let page = read_text(set.join("report.html"));

    // Each dataset's page is the one that its own report writes, and the only other thing that is linked.
    assert_eq!(values(&page, "href"), NAMES.map(|name| format!("{name}/report.html")));
    assert!(NAMES.iter().all(|name| read_text(set.join(name).join("report.html")).starts_with("<!doctype html>")));
    let written = read_text(set.join("views/report.html"));
    Program::on("report", set.join("views")).succeed();
    assert_eq!(read_text(set.join("views/report.html")), written);
    assert!(values(&page, "src").iter().all(|source| source.starts_with("data:image/png;base64,")));
    for outside in ["http://", "https://", "<script", "url(", "<bins>"] {
        assert!(!page.contains(outside), "the page names {outside}");
    }
    let content = SetTable::read(&Folder::at(&set)).expect("readable").expect("a set").made.expect("a finished set");
    assert!(page.contains("small &lt;bins&gt;") && page.contains(&content.root.hex()));

    // Depth, instances, a pair of two pictures, a pick.
    let object = expected_body(&set);
    let captions: Vec<&str> =
        page.split("<figcaption>").skip(1).filter_map(|rest| Some(rest.split_once('<')?.0)).collect();
    assert_eq!((captions.len(), values(&page, "src").len()), (4, 5), "{captions:?}");
    let parts =
        ["3 bodies in a bin", "instance map", &format!("of the silhouette of {object} is seen"), "held among its"];
    for (caption, part) in captions.iter().zip(parts) {
        assert!(caption.contains(part) && caption.ends_with('.'), "{caption}: {part}");
    }
    let pictures: BTreeSet<&str> = values(&page, "src").into_iter().collect();
    assert!(pictures.len() == 5 && pictures.iter().all(|picture| picture.len() > 2000), "five pictures of something");

    // A cover is the first picture, and changes nothing else; a dataset has none, and only a PNG is one.
    let cover = repository_path("scenes/table.png");
    let with_cover = workspace.path("cover.html");
    let run = |folder: &Path, cover: &Path| {
        Program::on("report", folder).option("--cover", cover).args(["--cover-text", "A <cover>."])
    };
    run(&set, &cover).option("--out", &with_cover).succeed();
    let covered = read_text(&with_cover);
    assert_eq!(values(&covered, "src").len(), 6);
    assert_eq!(values(&covered, "src")[1..], values(&page, "src"));
    assert!(covered.contains("<figcaption>A &lt;cover&gt;.</figcaption>"));
    let said = run(&set.join("views"), &cover).expect_code(2).stderr;
    assert!(said.contains("only the page of a set has a cover"), "{said}");
    let said = run(&set, &repository_path("Makefile")).expect_code(2).stderr;
    assert!(said.contains("--cover") && said.contains("Makefile"), "{said}");

    // Elsewhere the page is the same; written apart it leads nowhere.
    let moved = workspace.path("moved");
    fs::rename(&set, &moved).expect("a move");
    let apart = workspace.path("apart.html");
    let said = Program::on("report", &moved).option("--out", &apart).succeed().stdout;
    assert_eq!(said.lines().count(), 1, "{said}");
    let unlinked =
        NAMES.iter().fold(page, |page, name| page.replace(&format!("<a href=\"{name}/report.html\">{name}</a>"), name));
    assert!(read_text(&apart) == unlinked, "another page");
    assert_unfinished(&moved);
}

/// Without one dataset there is no page of the set; the datasets that are finished have theirs.
fn assert_unfinished(set: &Path) {
    fs::remove_file(set.join("report.html")).expect("a page");
    fs::remove_file(set.join("picks/manifest.json")).expect("a manifest");
    let said = Program::on("report", set).expect_code(1).stderr;
    assert!(said.contains("picks is not finished; `run` the set again to resume"), "{said}");
    assert!(!set.join("report.html").exists());
    Program::on("report", set.join("views")).succeed();
    fs::remove_dir_all(set.join("grasps")).expect("a dataset");
    let said = Program::on("report", set).expect_code(1).stderr;
    assert!(said.contains("grasps, picks are not finished"), "{said}");
}
