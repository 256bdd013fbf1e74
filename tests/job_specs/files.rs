//! The job files that travel with the source, their schema and their reference.

use std::{
    fs,
    path::{Path, PathBuf},
};

use graspmill::{
    assets::ScaleRule,
    job::{JobDraft, JobSet, JobText, SetMember, reference, schema},
};
use serde_json::Value;

use super::{
    asset, completion, draft_of,
    python::{self, PYTHON},
    resolve, surroundings,
};

/// The jobs whose robot or hand is no part of what `make test` fetches; `make robots hands` fetches them, for the slow test.
const FETCHED_APART: [&str; 2] = ["jobs/allegro-grasps.toml", "jobs/panda-reachability.toml"];

fn job_files() -> Vec<PathBuf> {
    let files = fs::read_dir("jobs").expect("jobs/ is there").map(|entry| entry.expect("jobs/ is readable").path());
    let mut files: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|ending| ending == "toml")).collect();
    files.retain(|file| !is_set(file));
    files.sort();
    files
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
        assert_eq!(set.jobs[3].grasps.as_deref(), Some("grasps"));
        assert_eq!(set.jobs[3].text.overrides.last().map(String::as_str), Some("render.colour=false"));
        let overridden = |job: &SetMember| job.text.overrides.contains(&"render.colour=false".to_owned());
        assert!(!set.jobs[..3].iter().any(overridden));
        // What the others say is said of the same objects.
        for job in &set.jobs[..3] {
            JobDraft::read(&job.text, &surroundings(".deps")).unwrap_or_else(|errors| panic!("{}", errors.render()));
        }
    }
}

#[test]
fn every_mistake_of_a_set_is_said() {
    let told = |text: &str| {
        let text = JobText { label: "t.toml".into(), folder: "jobs".into(), text: text.into(), overrides: Vec::new() };
        assert!(JobSet::is_one(&text));
        JobSet::read(&text).expect_err("mistakes").render()
    };
    let grasps = "[[jobs]]\nname = \"grasps\"\njob = \"grasps-quick.toml\"\n";
    let patches = |name: &str, grasps: &str| {
        format!("[[jobs]]\nname = \"{name}\"\njob = \"patches-quick.toml\"\ngrasps = \"{grasps}\"\n")
    };
    let head = "product = \"set\"\n";
    let both = told(&format!("{head}{}{grasps}{grasps}", patches("../up", "grasp")));
    for words in ["jobs[0].name", "small letters", "`grasp` among the jobs further up", "a name that no other job has"]
    {
        assert!(both.contains(words), "{words}: {both}");
    }
    assert!(both.contains("3 errors"), "{both}");
    let missing = told(&format!("{head}[[jobs]]\nname = \"a\"\njob = \"nowhere.toml\"\nsets = []\n"));
    assert!(missing.contains("nowhere.toml") && missing.contains("did you mean `set`?"), "{missing}");
    let wrong = told(&format!("{head}{grasps}grasps = \"grasps\"\n"));
    assert!(wrong.contains("a job for grasps takes no grasps"), "{wrong}");
    let nested = told(&format!("{head}[[jobs]]\nname = \"a\"\njob = \"ycb-everything.toml\"\n"));
    assert!(nested.contains("name its jobs here instead"), "{nested}");
    assert!(told(&format!("{head}jobs = []\n")).contains("at least 1"));
}

/// The jobs whose meshes `make test` fetches.
fn jobs_at_hand() -> Vec<PathBuf> {
    let mut files = job_files();
    let all = files.len();
    files.retain(|file| !FETCHED_APART.iter().any(|apart| file == Path::new(apart)));
    assert_eq!(files.len(), all - FETCHED_APART.len(), "{FETCHED_APART:?} are there");
    files
}

fn read(file: &Path, packages: &str) -> JobDraft {
    let text = JobText::open(file, &[]).expect("the job file is readable");
    JobDraft::read(&text, &surroundings(packages)).unwrap_or_else(|errors| {
        panic!("{}\n`make setup` fetches the scans, if it is they that are missing", errors.render())
    })
}

fn sizes(files: &[PathBuf]) -> Vec<(String, usize, u32)> {
    let size = |file: &PathBuf| {
        let draft = read(file, ".deps");
        assert_eq!(draft.notes, Vec::<String>::new(), "{}", file.display());
        let job = resolve(draft);
        assert_eq!(job.name, file.file_stem().expect("a file").to_string_lossy());
        (job.name.clone(), job.subjects(), job.views())
    };
    files.iter().map(size).collect()
}

#[test]
fn every_job_file_is_a_job_of_its_size() {
    let expected = [
        ("builtin", 33, 726),
        ("exploration", 78, 12),
        ("fetch-grasps", 78, 20),
        ("fetch-reachability-halfstep", 1, 42_240),
        ("fetch-reachability-meshes", 1, 5280),
        ("fetch-reachability-sphere", 1, 5280),
        ("fetch-reachability", 1, 5280),
        ("fetch-torso-reachability", 1, 5280),
        ("grasps-quick", 3, 4),
        ("half-shapes", 36, 1),
        ("panda-grasps", 78, 20),
        // Of made-up grasps.
        ("patches-quick", 3, 3),
        ("quickstart", 18, 726),
        ("release-608", 608, 726),
        ("sensor-kinect", 32, 500),
        ("thesis", 608, 726),
        ("tx60l-table-reachability", 1, 5054),
        ("ycb-completion", 78, 726),
        ("ycb-grasp-database", 78, 3),
        ("ycb-grasps", 78, 20),
        ("ycb-patches", 3, 3),
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
    assert_eq!(draft_of(&draft).objects.meshes.len(), 6);
    assert_eq!(draft.notes.len(), 1);
    assert!(draft.notes[0].contains("make setup"), "{:?}", draft.notes);
}

fn assert_resolves_and_reads_back(file: &Path) {
    let job = resolve(read(file, ".deps"));
    let text = job.to_toml(Path::new("datasets/x"));
    assert!(!text.contains(".deps"), "{text}");
    let again = JobText { label: "job.toml".into(), folder: "datasets/x".into(), text, overrides: Vec::new() };
    let again = JobDraft::read(&again, &surroundings(".deps")).unwrap_or_else(|errors| panic!("{}", errors.render()));
    assert_eq!(resolve(again), job, "{}", file.display());
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
    let draft = JobDraft::read(&text, &surroundings(".deps")).expect("a job");
    let assets = draft.sources().map(|source| Ok(asset(if source.name == "025_mug" { "other" } else { &source.name })));
    let assets = assets.collect();
    let job = draft.resolve(assets).expect("the other meshes make a job");
    assert_eq!(completion(&job).objects.len(), 17);
    assert_eq!((job.refused().len(), job.refused()[0].reason.as_str()), (1, "changed"));
}

/// Runs `script` with the schema's path and the given files; its standard output.
fn ask_python(script: &str, files: &[PathBuf]) -> String {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let schema_file = folder.path().join("schema.json");
    fs::write(&schema_file, schema().to_string()).expect("the schema is written");
    python::run(PYTHON, |command| command.args(["-c", script]).arg(&schema_file).args(files))
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
    let folder = tempfile::tempdir().expect("a scratch folder");
    let mut files = job_files();
    let fine = files.len();
    let resolved = folder.path().join("resolved.toml");
    let job = resolve(read(Path::new("jobs/sensor-kinect.toml"), ".deps"));
    fs::write(&resolved, job.to_toml(folder.path())).expect("the job is written");
    files.push(resolved);
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
        "[split]\ntest_models = 1.5",
    ];
    let of_objects = wrong.iter().map(|text| format!("objects = [{{ built_in = 3 }}]\n{text}\n"));
    let reachability = fs::read_to_string("jobs/fetch-reachability.toml").expect("the job file is readable");
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
        let file = folder.path().join(format!("{index}.toml"));
        fs::write(&file, &text).expect("a file is written");
        let job = JobText::open(&file, &[]).expect("the file is readable");
        assert!(JobDraft::read(&job, &surroundings(".deps")).is_err(), "{text}");
        files.push(file);
    }
    let counts = ask_python(VALIDATE, &files);
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
    let products = schema()["oneOf"].as_array().expect("one schema a product, and one of sets");
    assert_eq!(products.len(), 5);
    products.iter().for_each(|product| walk(product, "", &mut silent));
    assert_eq!(silent, Vec::<String>::new());
    let text = schema().to_string();
    assert!(!text.contains("\"null\"") && !text.contains("$ref"), "{text}");
}

#[test]
fn the_reference_in_the_docs_is_the_schemas() {
    const MARK: &str = "<!-- From here on printed from the schema. -->\n";
    let file = Path::new("docs/jobs.md");
    let text = fs::read_to_string(file).expect("docs/jobs.md is there");
    let (intro, found) = text.split_once(MARK).expect("docs/jobs.md has its mark");
    let expected = format!("\n{}", reference());
    if found != expected {
        let fresh = tempfile::Builder::new().prefix("jobs-").suffix(".md").tempfile().expect("a scratch file");
        let (_, path) = fresh.keep().expect("the scratch file stays");
        fs::write(&path, format!("{intro}{MARK}{expected}")).expect("the scratch file is written");
        panic!("docs/jobs.md is out of date: copy {} over it", path.display());
    }
}

#[test]
fn folders_lists_and_tables_name_their_meshes() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let root = folder.path();
    for name in ["a/mug.stl", "b/mug.stl", "b/Müll 1.off", "b/odd*[1].ply", "draft/x.stl", "notes.txt", "lone.obj"] {
        let path = root.join("meshes").join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder is made");
        fs::write(path, "").expect("a file is written");
    }
    fs::create_dir_all(root.join("jobs")).expect("a folder is made");
    fs::write(root.join("jobs/t.csv"), "name,group,unit\na/mug.stl,cups,mm\nMüll 1,bins,\n")
        .expect("a table is written");
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
    let read_from = |text: &str, place: &str| {
        let text =
            JobText { label: "t.toml".into(), folder: root.join(place), text: text.into(), overrides: Vec::new() };
        JobDraft::read(&text, &surroundings(".deps"))
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
    assert_eq!(resolve(again), job, "{resolved}");

    // Without names of their own, two meshes of one name are told apart by their folders.
    let draft = read_from("objects = [{ folder = \"../meshes\", include = [\"mug.*\"] }]", "jobs").expect("a job");
    let names: Vec<&str> = draft.sources().map(|source| source.name.as_str()).collect();
    assert_eq!(names, ["a/mug.stl", "b/mug.stl"]);

    fs::write(root.join("jobs/t.csv"), "name,group\nmgu,cups\n").expect("a table is written");
    let wrong =
        "objects = [{ folder = \"../meshes\", table = \"t.csv\", meshes = { lon = { unit = \"mm\", scale = 2 } } }]";
    let errors = read_from(wrong, "jobs").expect_err("two names that no mesh has").render();
    for part in ["did you mean `mug`?", "t.csv:2:1", "did you mean `lone`?"] {
        assert!(errors.contains(part), "{part} is not in\n{errors}");
    }
}
