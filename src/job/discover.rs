//! From the `[[objects]]` entries to a list of meshes: reads folders and tables, opens no mesh.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs, io,
    path::{Path as FilePath, PathBuf},
};

use super::{
    check::Checker,
    checked::PackageFile,
    decode::did_you_mean,
    document::Path,
    draft::{FoundMesh, Surroundings},
    errors::{JobError, Problem},
    mesh_table,
    packages::{self, MeshPackage, PACKAGES},
    pattern,
    spec::{MeshRow, ObjectsSpec, UnitSpec},
};
use crate::{
    assets::{MeshOrigin, MeshRefusal, MeshSource, ScaleRule, SizeRule},
    ids::{Digest, ObjectId},
};

/// Endings of mesh files, in lower case: those read by the program and those read through the Python package trimesh.
const ENDINGS: [&str; 8] = ["stl", "obj", "ply", "off", "glb", "gltf", "dae", "3mf"];

/// What the entries name.
#[derive(Default)]
pub(super) struct Found {
    pub meshes: Vec<FoundMesh>,
    pub refused: Vec<MeshRefusal>,
    pub notes: Vec<String>,
    pub table_errors: Vec<JobError>,
}

/// One mesh of an entry, before its settings are known.
struct Candidate {
    /// Path below the entry's folder with `/`, or the built-in name.
    relative: String,
    origin: MeshOrigin,
}

impl Candidate {
    fn file(relative: String, path: PathBuf) -> Self {
        Self { relative, origin: MeshOrigin::File(path) }
    }

    fn long_name(&self) -> &str {
        match (&self.origin, self.relative.rsplit_once('.')) {
            (MeshOrigin::File(_), Some((name, ending))) if !ending.contains('/') && !name.is_empty() => name,
            _ => &self.relative,
        }
    }

    fn name(&self) -> &str {
        let long = self.long_name();
        long.rsplit('/').next().unwrap_or(long)
    }
}

/// Lists the meshes of all entries, sorted by name.
pub(super) fn discover(
    checker: &mut Checker<'_>,
    entries: &[ObjectsSpec],
    folder: &FilePath,
    surroundings: &Surroundings<'_>,
) -> Found {
    let mut found = Found::default();
    let mut long_names = Vec::new();
    for (index, entry) in entries.iter().enumerate() {
        let path = Path::of("objects").index(index);
        check_entry(checker, entry, &path);
        let package = entry.package.as_deref().and_then(packages::package);
        let candidates = candidates(checker, entry, &path, folder, surroundings, &mut found.notes);
        let rows = rows(checker, entry, &path, folder, &candidates, &mut found.table_errors);
        let mut kept = filtered(entry, candidates);
        kept.truncate(entry.first.map_or(usize::MAX, |first| first as usize));
        for candidate in kept {
            let row = row_of(&rows, &candidate);
            long_names.push(row.name.clone().unwrap_or_else(|| candidate.long_name().to_owned()));
            found.meshes.push(mesh(entry, package, candidate, row));
        }
    }
    name_apart(&mut found.meshes, &long_names);
    found.meshes.sort_by(|a, b| a.source.name.cmp(&b.source.name));
    if found.meshes.is_empty() && checker.errors.is_empty() && found.table_errors.is_empty() {
        let expected = "at least one mesh".to_owned();
        let problem = Problem::Senseless { expected, found: "none in any entry".to_owned() };
        checker.fail(&Path::of("objects"), problem, found.notes.first().cloned());
    }
    found
}

fn check_entry(checker: &mut Checker<'_>, entry: &ObjectsSpec, path: &Path) {
    let sources = [
        ("folder", entry.folder.is_some()),
        ("list", entry.list.is_some()),
        ("package", entry.package.is_some()),
        ("built_in", entry.built_in.is_some()),
    ];
    let given: Vec<&str> = sources.iter().filter(|(_, given)| *given).map(|(key, _)| *key).collect();
    match given.as_slice() {
        [] => {
            let wrong = |key: &str| checker.wrong.iter().any(|wrong| path.key(key).holds(wrong));
            if !sources.iter().any(|(key, _)| wrong(key)) {
                let expected = "one of folder, list, package, built_in".to_owned();
                checker.fail(&path.key("folder"), Problem::Missing { expected }, None);
            }
        }
        [_] => {}
        [first, others @ ..] => {
            for other in others {
                let because = "one entry is one source; write a second `[[objects]]`".to_owned();
                checker.fail(
                    &path.key(other),
                    Problem::Contradiction { other: path.key(first).to_string(), because },
                    None,
                );
            }
        }
    }
    let scales = [("unit", entry.unit.is_some()), ("scale", entry.scale.is_some()), ("size", entry.size.is_some())];
    check_scale(checker, path, scales);
    if entry.built_in.is_some() {
        let files_only = [("include", entry.include.is_some()), ("table", entry.table.is_some())];
        for (key, _) in scales.iter().chain(&files_only).filter(|(_, given)| *given) {
            let because = "built-in shapes are in metres and chosen by name".to_owned();
            let other = path.key("built_in").to_string();
            checker.fail(&path.key(key), Problem::Contradiction { other, because }, None);
        }
    }
    if let Some(limits) = entry.limits {
        let rule = size_rule(entry);
        if rule.min > rule.max {
            let key = if limits.max.is_some() { "max" } else { "min" };
            let problem = Problem::Senseless {
                expected: "a least size below the greatest".to_owned(),
                found: format!("{} m to {} m", rule.min, rule.max),
            };
            checker.fail(&path.key("limits").key(key), problem, None);
        }
    }
}

fn check_scale(checker: &mut Checker<'_>, path: &Path, scales: [(&str, bool); 3]) {
    let mut given = scales.into_iter().filter(|(_, given)| *given).map(|(key, _)| key);
    if let Some(first) = given.next() {
        for other in given {
            let because = "each says how large the object is".to_owned();
            checker.fail(
                &path.key(other),
                Problem::Contradiction { other: path.key(first).to_string(), because },
                None,
            );
        }
    }
}

fn size_rule(entry: &ObjectsSpec) -> SizeRule {
    let default = SizeRule::default();
    let limits = entry.limits;
    SizeRule {
        min: limits.and_then(|limits| limits.min).unwrap_or(default.min),
        max: limits.and_then(|limits| limits.max).unwrap_or(default.max),
    }
}

fn candidates(
    checker: &mut Checker<'_>,
    entry: &ObjectsSpec,
    path: &Path,
    folder: &FilePath,
    surroundings: &Surroundings<'_>,
    notes: &mut Vec<String>,
) -> Vec<Candidate> {
    let mut absent = |checker: &mut Checker<'_>, path: &Path, what: &str, detail: String, help: Option<String>| {
        if entry.optional == Some(true) {
            let help = help.map(|help| format!("; {help}")).unwrap_or_default();
            notes.push(format!("{what} not found: {detail}: done without it{help}"));
        } else {
            checker.fail(path, Problem::NotFound { what: what.to_owned(), detail }, help);
        }
    };
    if let Some(wanted) = &entry.folder {
        let place = tidy(&folder.join(wanted));
        return list_folder(&place).unwrap_or_else(|error| {
            absent(checker, &path.key("folder"), "folder", format!("{} ({error})", place.display()), None);
            Vec::new()
        });
    }
    if let Some(list) = &entry.list {
        let mut candidates = Vec::new();
        for (index, file) in list.iter().enumerate() {
            let place = tidy(&folder.join(file));
            if place.is_file() {
                candidates.push(Candidate::file(with_slashes(file), place));
            } else {
                absent(checker, &path.key("list").index(index), "mesh file", place.display().to_string(), None);
            }
        }
        return candidates;
    }
    if let Some(name) = &entry.package {
        let Some(package) = packages::package(name) else {
            let choices: Vec<String> = PACKAGES.iter().map(|package| package.name.to_owned()).collect();
            let help = did_you_mean(name, PACKAGES.iter().map(|package| package.name));
            checker.fail(&path.key("package"), Problem::NotAChoice { found: name.clone(), choices }, help);
            return Vec::new();
        };
        let place = surroundings.packages.join(package.folder);
        return match list_folder(&place) {
            Ok(candidates) if !candidates.is_empty() => candidates,
            other => {
                let why = other.err().map_or("no mesh in it".to_owned(), |error| error.to_string());
                let detail = format!("{name}, looked for in {} ({why})", place.display());
                absent(checker, &path.key("package"), "package", detail, Some(package.remedy.to_owned()));
                Vec::new()
            }
        };
    }
    built_in(checker, entry, path, &surroundings.built_in)
}

fn built_in(checker: &mut Checker<'_>, entry: &ObjectsSpec, path: &Path, names: &[String]) -> Vec<Candidate> {
    let patterns = entry.built_in.as_deref().unwrap_or_default();
    for (index, wanted) in patterns.iter().enumerate() {
        if !names.iter().any(|name| pattern::name(wanted, name)) {
            let help = did_you_mean(wanted, names.iter().map(String::as_str));
            let help = help.or_else(|| Some(format!("the built-in set holds {} shapes: {}", names.len(), few(names))));
            let problem = Problem::NotFound { what: "built-in shape".to_owned(), detail: format!("`{wanted}`") };
            checker.fail(&path.key("built_in").index(index), problem, help);
        }
    }
    let wanted = |name: &&String| patterns.iter().any(|wanted| pattern::name(wanted, name));
    let shape = |name: &String| Candidate { relative: name.clone(), origin: MeshOrigin::BuiltIn(name.clone()) };
    names.iter().filter(wanted).map(shape).collect()
}

/// The first names of a list, for messages.
fn few(names: &[String]) -> String {
    let shown: Vec<&str> = names.iter().take(8).map(String::as_str).collect();
    let more = if names.len() > shown.len() { ", ..." } else { "" };
    format!("{}{more}", shown.join(", "))
}

/// All mesh files below a folder, by path; links to folders are not followed, so no circle can trap it.
fn list_folder(folder: &FilePath) -> io::Result<Vec<Candidate>> {
    fn walk(folder: &FilePath, below: &str, found: &mut Vec<Candidate>) -> io::Result<()> {
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
            if name.starts_with('.') {
                continue;
            }
            let relative = if below.is_empty() { name } else { format!("{below}/{name}") };
            let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
            if entry.file_type()?.is_dir() {
                walk(&path, &relative, found)?;
            } else if ending.is_some_and(|ending| ENDINGS.contains(&ending.as_str())) && path.is_file() {
                found.push(Candidate::file(relative, path));
            }
        }
        Ok(())
    }
    let mut found = Vec::new();
    walk(folder, "", &mut found)?;
    found.sort_by(|a, b| a.relative.cmp(&b.relative));
    Ok(found)
}

/// Without `a/..`, so that messages and resolved jobs show the shortest path.
pub(super) fn tidy(path: &FilePath) -> PathBuf {
    use std::path::Component;
    let mut tidy = PathBuf::new();
    for part in path.components() {
        match (part, tidy.components().next_back()) {
            (Component::CurDir, _) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => {
                tidy.pop();
            }
            _ => tidy.push(part),
        }
    }
    if tidy.as_os_str().is_empty() { PathBuf::from(".") } else { tidy }
}

pub(super) fn with_slashes(path: &FilePath) -> String {
    let parts: Vec<String> = path.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
    parts.join("/")
}

/// Whether an entry's `include` and `exclude` let a mesh pass.
fn filtered(entry: &ObjectsSpec, candidates: Vec<Candidate>) -> Vec<Candidate> {
    let any = |patterns: &Vec<String>, path: &str| patterns.iter().any(|wanted| pattern::matches(wanted, path));
    let passes = |candidate: &Candidate| {
        entry.include.as_ref().is_none_or(|patterns| any(patterns, &candidate.relative))
            && !entry.exclude.as_ref().is_some_and(|patterns| any(patterns, &candidate.relative))
    };
    candidates.into_iter().filter(passes).collect()
}

/// The rows of the table and of `meshes`, the latter on top; each must name a mesh of the entry.
fn rows(
    checker: &mut Checker<'_>,
    entry: &ObjectsSpec,
    path: &Path,
    folder: &FilePath,
    candidates: &[Candidate],
    table_errors: &mut Vec<JobError>,
) -> BTreeMap<String, MeshRow> {
    let mut rows = BTreeMap::new();
    let known: BTreeSet<&str> =
        candidates.iter().flat_map(|mesh| [mesh.name(), mesh.long_name(), &mesh.relative]).collect();
    if let Some(table) = &entry.table {
        let place = tidy(&folder.join(table));
        match fs::read_to_string(&place) {
            Ok(text) => {
                let (read, errors) = mesh_table::read(&place.display().to_string(), &text);
                table_errors.extend(errors);
                rows = read;
            }
            Err(error) => {
                let detail = format!("{} ({error})", place.display());
                checker.fail(&path.key("table"), Problem::NotFound { what: "table".to_owned(), detail }, None);
            }
        }
    }
    for (name, row) in entry.meshes.iter().flatten() {
        let path = path.key("meshes").key(name);
        if !candidates.is_empty() && !known.contains(name.as_str()) {
            let help = did_you_mean(name, known.iter().copied());
            let problem = Problem::NotFound { what: "mesh".to_owned(), detail: format!("`{name}` in this entry") };
            checker.fail(&path, problem, help);
        }
        let scales = [("unit", row.unit.is_some()), ("scale", row.scale.is_some()), ("size", row.size.is_some())];
        check_scale(checker, &path, scales);
        let below: MeshRow = rows.remove(name).unwrap_or_default();
        rows.insert(name.clone(), joined(row.clone(), below));
    }
    rows
}

fn joined(above: MeshRow, below: MeshRow) -> MeshRow {
    let has_scale = above.unit.is_some() || above.scale.is_some() || above.size.is_some();
    let scales = if has_scale { above.clone() } else { below.clone() };
    MeshRow {
        name: above.name.or(below.name),
        unit: scales.unit,
        scale: scales.scale,
        size: scales.size,
        group: above.group.or(below.group),
        licence: above.licence.or(below.licence),
        citation: above.citation.or(below.citation),
        object: above.object.or(below.object),
    }
}

fn row_of(rows: &BTreeMap<String, MeshRow>, candidate: &Candidate) -> MeshRow {
    let names = [candidate.relative.as_str(), candidate.long_name(), candidate.name()];
    names.into_iter().find_map(|name| rows.get(name)).cloned().unwrap_or_default()
}

fn mesh(entry: &ObjectsSpec, package: Option<&MeshPackage>, candidate: Candidate, row: MeshRow) -> FoundMesh {
    let of_entry = MeshRow {
        name: None,
        unit: entry.unit,
        scale: entry.scale,
        size: entry.size,
        group: entry.group.clone(),
        licence: entry.licence.clone().or_else(|| package.map(|package| package.licence.to_owned())),
        citation: entry.citation.clone().or_else(|| package.map(|package| package.citation.to_owned())),
        object: None,
    };
    let row = joined(row, of_entry);
    let scale = match (row.size, row.scale, row.unit) {
        (Some(size), ..) => ScaleRule::LongestSide(size),
        (_, Some(scale), _) => ScaleRule::MetresPerUnit(scale),
        (.., Some(unit)) => ScaleRule::MetresPerUnit(UnitSpec::metres(unit)),
        _ => ScaleRule::MetresPerUnit(package.map_or(1.0, |package| package.metres_per_unit)),
    };
    FoundMesh {
        source: MeshSource {
            name: row.name.unwrap_or_else(|| candidate.name().to_owned()),
            origin: candidate.origin.clone(),
            scale,
            size: size_rule(entry),
            licence: row.licence,
            citation: row.citation,
            group: row.group,
        },
        package: package.map(|package| PackageFile { package: package.name.to_owned(), file: candidate.relative }),
        pinned: row.object.as_deref().and_then(Digest::from_hex).map(ObjectId),
    }
}

/// Gives meshes of the same name different ones: their paths below the folder, then a number.
fn name_apart(meshes: &mut [FoundMesh], long_names: &[String]) {
    let mut count: BTreeMap<String, usize> = BTreeMap::new();
    meshes.iter().for_each(|mesh| *count.entry(mesh.source.name.clone()).or_default() += 1);
    for (mesh, long_name) in meshes.iter_mut().zip(long_names) {
        if count[&mesh.source.name] > 1 {
            mesh.source.name.clone_from(long_name);
        }
    }
    let mut taken = BTreeSet::new();
    for mesh in meshes {
        let name = mesh.source.name.clone();
        let mut number = 2;
        while !taken.insert(mesh.source.name.clone()) {
            mesh.source.name = format!("{name}@{number}");
            number += 1;
        }
    }
}
