//! Reads the arrangements that a job names: every mistake is reported with file, line and remedy.

use std::{collections::BTreeMap, path::Path as FilePath};

use super::{
    Import, ImportedBody, SourceFrame,
    bop::{self, BopFolder, ImageChoice},
    found::{FoundBody, FoundScene},
    spec::{ImportSpec, ImportedSceneSpec},
    table,
};
use crate::products::listed_pose::check_pose;
use form::{Checker, Mistakes, Path};
use kernel::{
    files::{self, Bound},
    words::{Show, Split},
};

/// Key that lists scenes in the job itself.
const LISTED: &str = "import.scenes";

/// The arrangements; `None` when something is wrong, which is reported. `names` are the objects of the job,
/// `is_contained` is true with a container.
pub(in super::super) fn read(
    checker: &mut Checker,
    spec: &ImportSpec,
    folder: &FilePath,
    names: &[&str],
    is_contained: bool,
) -> Option<Import> {
    let given = [("bop", spec.bop.is_some()), ("csv", spec.csv.is_some()), ("scenes", spec.scenes.is_some())];
    let given: Vec<&str> = given.into_iter().filter_map(|(key, is_given)| is_given.then_some(key)).collect();
    let [source] = given[..] else {
        let found = if given.is_empty() { "none of them".to_owned() } else { given.join(" and ") };
        checker.invalid("import", "one of `bop`, `csv` and `scenes`", found);
        return None;
    };
    for key in ["images", "every_image", "objects"] {
        let path = Path::from("import").key(key);
        if source != "bop" && checker.has(&path) {
            checker.contradiction(path, format!("import.{source}"), "it applies to folders of BOP");
        }
    }
    let before = checker.count();
    let frame = if is_contained { frame_of_container(checker, spec) } else { frame_of_table(checker, spec) };
    let (key, found) = match (&spec.bop, &spec.csv, &spec.scenes) {
        (Some(folders), ..) => (bop::KEY, of_folders(checker, spec, folders, folder)),
        (_, Some(file), _) => (table::KEY, of_table(checker, &folder.join(file))),
        (.., scenes) => (LISTED, listed(checker, scenes.as_deref().unwrap_or_default())),
    };
    let mut errors = Mistakes::default();
    found.iter().for_each(|scene| scene.check(key, names, &mut errors));
    checker.add_errors(errors);
    if checker.count() > before {
        return None;
    }
    Some(Import {
        scenes: found.into_iter().map(FoundScene::into_scene).collect(),
        split: spec.split.map_or(Split::Training, Split::from),
        frame,
    })
}

/// The world of scenes on a table.
fn frame_of_table(checker: &mut Checker, spec: &ImportSpec) -> SourceFrame {
    let up = spec.up.unwrap_or(SourceFrame::UP);
    let length = up.iter().map(|part| part * part).sum::<f64>().sqrt();
    if !(length > 0.0 && length.is_finite()) {
        checker.invalid("import.up", "a direction", format!("{up:?}"));
    }
    if spec.container_pose.is_some() {
        let report = checker.invalid("import.container_pose", "`[container]` in the job", "no container");
        report.help("describe the container, for example [container] inner = [0.4, 0.3, 0.2], or remove the pose");
    }
    SourceFrame::Table { up, height: spec.table_height }
}

/// The world of scenes in a container.
fn frame_of_container(checker: &mut Checker, spec: &ImportSpec) -> SourceFrame {
    for (key, is_given) in [("import.up", spec.up.is_some()), ("import.table_height", spec.table_height.is_some())] {
        if is_given {
            checker.contradiction(
                key,
                "container",
                "`import.container_pose` gives the pose of the container, including its up direction",
            );
        }
    }
    let pose = spec.container_pose.unwrap_or(SourceFrame::SAME);
    if let Err(problem) = check_pose(&pose) {
        checker.invalid("import.container_pose", "a pose", problem);
    }
    SourceFrame::Container { pose }
}

/// Scenes of folders of BOP.
fn of_folders(
    checker: &mut Checker,
    spec: &ImportSpec,
    folders: &[std::path::PathBuf],
    folder: &FilePath,
) -> Vec<FoundScene> {
    if let Some(images) = spec.every_image.filter(|every| *every).and(spec.images.as_ref()) {
        let other = format!("import.images = {images:?}");
        checker.contradiction("import.every_image", other, "either every image is a scene or only the listed ones");
    }
    let images = match &spec.images {
        Some(numbers) => ImageChoice::Numbers(numbers),
        None if spec.every_image == Some(true) => ImageChoice::All,
        None => ImageChoice::First,
    };
    let mut objects: BTreeMap<u32, String> = BTreeMap::new();
    for (id, name) in spec.objects.iter().flatten() {
        if let Ok(number) = id.parse() {
            objects.insert(number, name.clone());
        } else {
            checker.invalid(Path::from("import.objects").key(id), "a number, the `obj_id`", id.clone());
        }
    }
    let mut scenes = Vec::new();
    for (index, name) in folders.iter().enumerate() {
        let files = bop::FILES.map(|file| folder.join(name).join(file));
        let mut text = |file: &FilePath| {
            let read = files::read_text(file, Bound::BOP);
            let problem = read.as_ref().err().map(|error| format!("{}: {error}", file.shown()));
            if let Some(problem) = problem {
                let report = checker.not_found(Path::from(bop::KEY).index(index), "file of BOP", problem);
                report.help(
                    "name folders of single scenes, such as test/000048, with scene_gt.json and scene_camera.json",
                );
            }
            read.ok()
        };
        let (Some(poses), Some(camera)) = (text(&files[0]), text(&files[1])) else { continue };
        let labels = files.each_ref().map(|file| file.display().to_string());
        let name = name.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let labels = [labels[0].as_str(), labels[1].as_str()];
        let read = BopFolder { name: &name, labels, texts: [&poses, &camera] };
        let (found, errors) = read.scenes(&images, &objects, spec.up.is_some() || spec.container_pose.is_some());
        checker.add_errors(errors);
        scenes.extend(found);
    }
    scenes
}

/// Scenes of a CSV file.
fn of_table(checker: &mut Checker, file: &FilePath) -> Vec<FoundScene> {
    match files::read_text(file, Bound::CSV) {
        Ok(text) => {
            let (scenes, errors) = table::scenes_of_table(&file.display().to_string(), &text);
            checker.add_errors(errors);
            scenes
        }
        Err(error) => {
            let report = checker.not_found(table::KEY, "file of poses", format!("{}: {error}", file.shown()));
            report.help("paths are relative to the job file");
            Vec::new()
        }
    }
}

/// Scenes that the job itself lists.
fn listed(checker: &mut Checker, specs: &[ImportedSceneSpec]) -> Vec<FoundScene> {
    let mut scenes = Vec::new();
    for (index, spec) in specs.iter().enumerate() {
        let path = Path::from(LISTED).index(index);
        let mut bodies = Vec::new();
        for (number, body) in spec.bodies.iter().enumerate() {
            let path = path.key("bodies").index(number);
            if let Err(problem) = check_pose(&body.pose) {
                checker.invalid(path.key("pose"), "a pose", problem);
            }
            let location = checker.document().location_of(path.key("object"));
            let body = ImportedBody { object: body.object.clone(), pose: body.pose };
            bodies.push(FoundBody { body, obj_id: None, location });
        }
        let location = checker.document().location_of(&path);
        scenes.push(FoundScene { source: spec.source.clone(), bodies, location });
    }
    scenes
}
