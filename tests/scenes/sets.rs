//! The report of a set: one picture of one scene as its datasets know it, and links to their own reports alone.

use std::{collections::BTreeMap, fs, path::Path};

use graspmill::{
    format::{
        AmodalFacts, PickFacts,
        dataset::{DatasetReader, Fate, LedgerRow, SetTable},
    },
    ids::ObjectId,
    publish::draw_set,
};

use crate::support::{
    files::{copy_folder, read_text, repository_path},
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
            "product = \"scenes\"\nseed = 5\nmode = \"bin\"\ncount = 3\ncontainer = {{ inner = [0.3, 0.3, 0.06] }}\n\
             scenes = {{ training = 2 }}\n[[objects]]\n{shapes}\n{NO_SPLIT}"
        ),
        format!(
            "product = \"views\"\nseed = 3\n[scenes]\ndataset = \"x\"\n[views]\ncameras = [{camera}]\nmin_pixels = 50\n"
        ),
        "product = \"amodal\"\nseed = 3\n[views]\ndataset = \"x\"\n".to_owned(),
        format!(
            "product = \"grasps\"\nseed = 7\n[hand]\nscene = {hand:?}\n[[objects]]\n{shapes}\n[grasps]\nseeds = 2\n\
             sampler = \"antipodal\"\n[antipodal]\nbest = 5\n[keep]\ntorsion = 0.002\n{NO_SPLIT}"
        ),
        format!(
            "product = \"picks\"\nseed = 3\n[scenes]\ndataset = \"x\"\n[grasps]\ndataset = \"x\"\n[hand]\nscene = {hand:?}\n\
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
    let reader = DatasetReader::open(folder).expect("a dataset");
    let rows = (0..reader.manifest().shards.len()).flat_map(|shard| reader.ledger(shard).expect("a ledger").rows);
    rows.filter(|row| matches!(row.fate, Fate::Kept(_))).collect()
}

/// The scene that a page has to show, and the name of the body whose pair it has to show.
fn expected(set: &Path) -> (ObjectId, String) {
    let held: Vec<ObjectId> = (kept(&set.join("picks")).iter())
        .filter(|row| PickFacts::from(&row.facts).trials.held() > 0)
        .map(|row| row.sample.subject)
        .collect();
    let pairs = kept(&set.join("amodal"));
    let views = kept(&set.join("views"));
    let scene = views
        .iter()
        .map(|row| row.sample.subject)
        .find(|scene| held.contains(scene) && pairs.iter().any(|pair| pair.sample.subject == *scene));
    let scene = scene.expect("a scene with all");
    let distance = |row: &LedgerRow| {
        let AmodalFacts { visible_share, truncated, .. } = AmodalFacts::from(&row.facts);
        (visible_share - 0.5).abs() + f64::from(truncated)
    };
    let of_scene = pairs.iter().filter(|row| row.sample.subject == scene);
    let nearest = of_scene.min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("a pair");
    let reader = DatasetReader::open(&set.join("amodal")).expect("a dataset");
    let object = reader.sample(nearest.index).expect("readable").expect("stored").clutter().expect("a record").object;
    let names: BTreeMap<ObjectId, String> =
        reader.assets().expect("assets").objects.into_iter().map(|row| (row.object, row.name)).collect();
    (scene, names[&object].clone())
}

/// Values of an attribute.
fn values<'a>(page: &'a str, attribute: &str) -> Vec<&'a str> {
    let start = format!(" {attribute}=\"");
    page.split(start.as_str()).skip(1).filter_map(|rest| Some(rest.split_once('"')?.0)).collect()
}

#[test]
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
    for name in NAMES {
        let written = read_text(set.join(name).join("report.html"));
        Program::on("report", set.join(name)).succeed();
        assert_eq!(read_text(set.join(name).join("report.html")), written, "{name}");
    }
    assert!(values(&page, "src").iter().all(|source| source.starts_with("data:image/png;base64,")));
    for outside in ["http://", "https://", "<script", "url(", "<bins>"] {
        assert!(!page.contains(outside), "the page names {outside}");
    }
    let content = SetTable::read(&set).expect("readable").expect("a set").made.expect("a finished set");
    assert!(page.contains("small &lt;bins&gt;") && page.contains(&content.root.hex()));

    // Depth, instances, a pair of two pictures, a pick.
    let (_, object) = expected(&set);
    let captions: Vec<&str> =
        page.split("<figcaption>").skip(1).filter_map(|rest| Some(rest.split_once('<')?.0)).collect();
    assert_eq!((captions.len(), values(&page, "src").len()), (4, 5), "{captions:?}");
    let parts =
        ["3 bodies in a bin", "instance map", &format!("of the silhouette of {object} is seen"), "held among its"];
    for (caption, part) in captions.iter().zip(parts) {
        assert!(caption.contains(part) && caption.ends_with('.'), "{caption}: {part}");
    }
    let table = SetTable::read(&set).expect("readable").expect("a set");
    let pictures = draw_set(&set, &table).expect("pictures");
    assert_eq!(pictures.len(), 5);
    for picture in pictures {
        let ink = picture.pixels.iter().filter(|pixel| pixel[3] == 255).count();
        assert!(ink > picture.pixels.len() / 20, "a picture of {ink} pixels");
    }

    // A copy elsewhere has the same page; written apart it leads nowhere.
    let copy = workspace.path("copy");
    copy_folder(&set, &copy);
    fs::remove_file(copy.join("report.html")).expect("a page");
    Program::on("report", &copy).succeed();
    assert_eq!(read_text(copy.join("report.html")), page);
    let apart = workspace.path("apart.html");
    Program::on("report", &copy).option("--out", &apart).succeed();
    assert!(values(&read_text(&apart), "href").is_empty());
    assert_unfinished(&copy);
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
