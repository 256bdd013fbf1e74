//! Jobs for patches: defaults of both profiles, mistakes with their places, and what names them.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use graspmill::{
    assets::Description,
    dataset::{NumberClass, ProductTables, Split},
    geom::Pose,
    ids::{Digest, ObjectId, Product},
    job::{
        ChosenGrasp, FoundGrasps, GraspedObject, Job, JobDraft, JobErrors, JobText, ObjectSide, PatchJob, PatchLabel,
        Surroundings, TypeChoice,
    },
    plan::Plan,
    run::dataset_header,
};

use super::surroundings;

const BARRETT: &str = "../scenes/barrett_bh8_280.xml";

fn text(more: &str) -> String {
    format!("product = \"patches\"\n[hand]\nscene = \"{BARRETT}\"\n[grasps]\ndataset = \"../datasets/made-up\"\n{more}")
}

fn hand() -> ObjectId {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/barrett_bh8_280.xml");
    ObjectId(Description::of_hand(&scene).expect("the Barrett hand").digest)
}

/// Grasps of three objects, the second without any of the chosen types.
pub fn found(types: u32) -> FoundGrasps {
    let grasp = |(run, rank, kind): (u32, u32, u32)| ChosenGrasp {
        run,
        rank,
        kind,
        object_from_approach: Pose::identity(),
        object_from_base: Pose::identity(),
        joints: vec![0.0; 8],
        energy: 1.0,
        epsilon: 0.1,
    };
    let object = |byte: u8, side, grasps: &[(u32, u32, u32)]| GraspedObject {
        id: ObjectId(Digest([byte; 32])),
        name: format!("object {byte}"),
        asset: serde_json::json!({ "object": ObjectId(Digest([byte; 32])), "name": format!("object {byte}") }),
        side,
        holdout_runs: BTreeSet::from([4]),
        subset: None,
        grasps: grasps.iter().copied().map(grasp).collect(),
    };
    FoundGrasps {
        root: Digest([7; 32]),
        hand: hand(),
        space: "wrench".to_owned(),
        types: TypeChoice::new(BTreeMap::from([(12, 3), (40, 2), (99, 1)]), 1, types),
        objects: vec![
            object(1, ObjectSide::Training, &[(0, 1, 12), (4, 0, 40), (4, 2, 12)]),
            object(2, ObjectSide::Test, &[]),
            object(3, ObjectSide::Validation, &[(1, 0, 12), (4, 0, 40)]),
        ],
        training_subsets: Vec::new(),
    }
}

fn read_with(
    text: String,
    overrides: &[&str],
    grasps: &dyn Fn(&Path, u32) -> Result<FoundGrasps, String>,
) -> Result<JobDraft, JobErrors> {
    let overrides = overrides.iter().map(|text| (*text).to_owned()).collect();
    let job = JobText { label: "test.toml".to_owned(), folder: PathBuf::from("jobs"), text, overrides };
    JobDraft::read(&job, &Surroundings { grasps, ..surroundings("no/such/folder") })
}

fn job(overrides: &[&str]) -> Job {
    let read = read_with(text(""), overrides, &|_, types| Ok(found(types)));
    read.and_then(|draft| draft.resolve(Vec::new())).unwrap_or_else(|errors| panic!("{}", errors.render()))
}

fn work(job: &Job) -> &PatchJob {
    job.patches().expect("a job for patches")
}

fn mistakes(overrides: &[&str]) -> String {
    read_with(text(""), overrides, &|_, types| Ok(found(types))).expect_err("a mistake").render()
}

#[test]
fn the_smallest_job_has_the_standard_defaults_and_the_thesis_its_own() {
    let standard = job(&["grasps.types=2"]);
    assert_eq!((standard.product(), standard.subjects(), standard.views()), (Product::Patches, 3, 3));
    assert_eq!((standard.views_of(1), standard.shard_samples), (0, 200));
    let settings = &work(&standard).settings;
    assert_eq!((settings.side, settings.label, settings.distance), (72, PatchLabel::Epsilon, 2.0));
    assert_eq!((settings.camera.width, settings.camera.height, settings.camera.near), (640, 480, 0.1));
    // The camera of the completion jobs.
    assert!((settings.camera.fx - 554.382_712_8).abs() < 1e-6 && settings.camera.fx == settings.camera.fy);
    assert_eq!(settings.tips, ["distal_1_outer", "distal_2_outer", "distal_3_outer"]);
    assert!(settings.colour.is_some_and(|colour| !colour.randomise));
    assert_eq!(work(&standard).grasps.types.chosen, [12, 40]);
    let plan = Plan::new(&standard);
    assert_eq!((plan.samples, plan.shards.len(), plan.units().count()), (5, 1, 2));
    let thesis = job(&["profile=thesis"]);
    assert_eq!(work(&thesis).settings.label, PatchLabel::Energy);
    // Without quirks the points are where the images show them.
    assert_eq!((settings.point_focal_length, settings.image, settings.heatmap_angle), (None, false, None));
    assert_eq!(work(&thesis).settings.point_focal_length, Some(589.366_454));
    assert_eq!(work(&job(&["images.heatmaps=true"])).settings.heatmap_angle, Some(0.349));
}

#[test]
fn the_tables_are_those_of_the_grasps() {
    let job = job(&["grasps.types=2", "render.colour=false"]);
    let header = dataset_header(&job, None, Path::new("nowhere"));
    assert_eq!((header.class, header.channel_classes.len(), header.platform.len()), (NumberClass::Exact, 0, 0));
    assert_eq!((header.assets.len(), header.hands.len()), (3, 1));
    let ProductTables::Patches { splits, types } = header.tables else { panic!("tables of patches") };
    assert_eq!((types.grasps(), types.covered(), types.without), (7, 5, 1));
    // Runs that were held out are patches that are.
    assert_eq!(splits.objects.iter().map(|row| row.holdout_views.clone()).collect::<Vec<_>>()[0], [1, 2]);
    assert_eq!(splits.objects[2].models, Split::ValidationModels);
}

#[test]
fn what_names_a_job_is_what_its_samples_depend_on() {
    let first = job(&[]);
    for same in [vec!["shards.samples=7"], vec!["name=another"], vec!["grasps.dataset=../elsewhere"]] {
        assert_eq!(job(&same).digest(), first.digest(), "{same:?}");
    }
    for other in [
        "seed=3",
        "grasps.types=2",
        "patches.side=64",
        "patches.label=energy",
        "render.colour=false",
        "images.full=true",
        "images.heatmaps=true",
        "camera.point_focal_length=589.0",
    ] {
        assert_ne!(job(&[other]).digest(), first.digest(), "{other}");
    }
    let elsewhere = |change: fn(&mut FoundGrasps)| {
        let read = read_with(text(""), &[], &|_, types| {
            let mut found = found(types);
            change(&mut found);
            Ok(found)
        });
        read.and_then(|draft| draft.resolve(Vec::new())).expect("a job").digest()
    };
    assert_ne!(elsewhere(|found| found.root = Digest([8; 32])), first.digest());
    assert_ne!(elsewhere(|found| found.objects[0].side = ObjectSide::Test), first.digest());
    // The resolved job reads back as itself, its grasps pinned.
    let resolved = first.to_toml(Path::new("jobs"));
    assert!(resolved.contains("dataset = \"../datasets/made-up\"") && resolved.contains(&Digest([7; 32]).hex()));
    let again = read_with(resolved, &[], &|_, types| Ok(found(types))).and_then(|draft| draft.resolve(Vec::new()));
    assert_eq!(again.unwrap_or_else(|errors| panic!("{}", errors.render())).digest(), first.digest());
}

#[test]
fn mistakes_are_told_with_their_places() {
    let (pinned, other) = (Digest([7; 32]).hex(), Digest([1; 32]).hex());
    assert_eq!(job(&[&format!("grasps.root=\"{pinned}\"")]).digest(), job(&[]).digest());
    for (overrides, key, words) in [
        (&[format!("grasps.root=\"{other}\"")][..], "grasps.root", "grasps of root 0101"),
        (&["patches.tips=[\"a\", \"b\", \"a\"]".to_owned()], "patches.tips", "twice"),
        (&["patches.side=500".to_owned()], "patches.side", "480 px"),
        (&["camera.near=3.0".to_owned()], "camera.near", "nothing would be seen"),
        (&["render.colour=false".to_owned(), "render.randomise=true".to_owned()], "render.randomise", "lights"),
        (&["patches.tip=3".to_owned()], "patches.tip", "did you mean `tips`"),
        (&["objects=[]".to_owned()], "objects", "unknown key"),
    ] {
        let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
        let told = mistakes(&overrides);
        assert!(told.contains(key) && told.contains(words), "{told}");
    }
    let bare = read_with("product = \"patches\"\n".to_owned(), &[], &|_, types| Ok(found(types)));
    let told = bare.expect_err("grasps and hand are missing").render();
    assert!(told.contains("dataset") && told.contains("hand"), "{told}");
    let refused = read_with(text(""), &[], &|folder, _| Err(format!("{} is not finished", folder.display())));
    let told = refused.expect_err("no dataset").render();
    assert!(told.contains("grasps.dataset") && told.contains("made-up is not finished"), "{told}");
    let none = read_with(text(""), &[], &|_, _| Ok(FoundGrasps { types: TypeChoice::default(), ..found(2) }));
    assert!(none.expect_err("no type").render().contains("kept grasp that has a type"));
    let stranger =
        read_with(text(""), &[], &|_, types| Ok(FoundGrasps { hand: ObjectId(Digest([1; 32])), ..found(types) }));
    assert!(stranger.expect_err("another hand").render().contains("hand of the grasps"));
}
