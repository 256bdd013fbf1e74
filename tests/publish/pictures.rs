//! The pictures of README.md: drawn from `jobs/pictures.toml`, the same bytes on every machine.

use std::{fs, path::Path};

use graspmill::{
    files::Folder,
    ids::ItemId,
    publish::{
        draw_panels,
        picture::{Panel, Picture},
    },
};

use crate::support::{
    files::{list_names, read_text, repository_path},
    program::Program,
    workspace::Workspace,
};

/// Side of a panel [px]: about twice its size on a page, so that it stays crisp on fine screens.
const SIDE: u32 = 300;
/// Gap between panels [px].
const GAP: u32 = 24;
/// Bytes of a picture, at most.
const MAX_BYTES: usize = 400_000;
/// Folder of the pictures in the repository.
const PICTURES: &str = "docs/pictures";

/// Panels of a sample: dataset in the set, object, item, and the captions that are taken.
struct Choice(&'static str, &'static str, u32, &'static [&'static str]);

const OVERVIEW: [Choice; 3] = [
    Choice("pairs", "025_mug", 4, &["depth image", "what it saw", "whole object", "touch from behind"]),
    Choice("grasps", "025_mug", 0, &["a grasp"]),
    Choice("map", "", 0, &["reachable poses"]),
];

const SAW: &[&str] = &["what it saw"];
const WHOLE: &[&str] = &["whole object"];
/// Objects of the gallery, each with its view.
const OBJECTS: [(&str, u32); 5] =
    [("006_mustard_bottle", 4), ("025_mug", 4), ("035_power_drill", 4), ("037_scissors", 4), ("072-a_toy_airplane", 4)];

const GRASPS: [Choice; 4] = [
    Choice("grasps", "006_mustard_bottle", 0, &["a grasp"]),
    Choice("grasps", "025_mug", 0, &["a grasp"]),
    Choice("gripper", "025_mug", 0, &["a grasp"]),
    Choice("gripper", "037_scissors", 0, &["a grasp"]),
];

fn draw(set: &Path, Choice(dataset, object, item, captions): &Choice, side: u32) -> Vec<Panel> {
    let panels = draw_panels(&Folder::at(set.join(dataset)), object, ItemId(*item), side).expect("an intact dataset");
    let panels = panels.unwrap_or_else(|| panic!("{dataset} stores no item {item} of {object}"));
    let found = panels.into_iter().filter(|panel| captions.contains(&panel.caption.as_str()));
    let found: Vec<Panel> = found.collect();
    assert_eq!(found.len(), captions.len(), "{dataset}, {object}: {captions:?}");
    found
}

/// The pictures by their files' names.
fn draw_pictures(set: &Path) -> [(&'static str, Picture); 3] {
    let overview: Vec<Panel> = OVERVIEW.iter().flat_map(|choice| draw(set, choice, SIDE)).collect();
    // Two rows without captions: what the camera saw, and the whole object below.
    let row = |captions| {
        let panels =
            OBJECTS.iter().flat_map(|(object, item)| draw(set, &Choice("pairs", object, *item, captions), SIDE));
        Picture::row(&panels.map(|panel| panel.picture).collect::<Vec<_>>(), GAP)
    };
    let objects = Picture::column(&[row(SAW), row(WHOLE)], GAP);
    let grasps = GRASPS.iter().flat_map(|choice| draw(set, choice, SIDE)).map(|panel| panel.picture);
    let grasps = Picture::row(&grasps.collect::<Vec<_>>(), GAP);
    [("overview.png", Panel::row(&overview, GAP)), ("objects.png", objects), ("grasps.png", grasps)]
}

/// `make pictures` sets GRASPMILL_WRITE_PICTURES to the folder of the set, and writes; a test compares.
#[test]
#[ignore = "slow: make test-all"]
fn pictures_of_the_readme_come_out_again() {
    let workspace = Workspace::new();
    let given = std::env::var_os("GRASPMILL_WRITE_PICTURES");
    let set = given.as_ref().map_or_else(|| workspace.path("pictures"), repository_path);
    if given.is_none() {
        Program::run_job("jobs/pictures.toml", &set).succeed();
    }
    let folder = repository_path(PICTURES);
    let mut names = Vec::new();
    for (name, picture) in draw_pictures(&set) {
        let png = picture.with_few_colours().to_png();
        println!("{name}: {} bytes", png.len());
        if given.is_some() {
            fs::create_dir_all(&folder).expect("a folder");
            fs::write(folder.join(name), &png).expect("a picture");
        }
        let kept = fs::read(folder.join(name)).unwrap_or_default();
        assert!(kept == png, "{PICTURES}/{name} is another picture now: run `make pictures`, and look at it");
        assert!(png.len() <= MAX_BYTES, "{name}: {} bytes", png.len());
        let shown = format!("({PICTURES}/{name})");
        assert!(read_text(repository_path("README.md")).contains(&shown), "README.md does not show {name}");
        names.push(name.to_owned());
    }
    names.sort();
    assert_eq!(list_names(&folder), names, "every picture is drawn here");
}
