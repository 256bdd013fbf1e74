//! From the `[[objects]]` entries to a list of meshes: reads folders and tables, opens no mesh.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path as FilePath, PathBuf},
};

use super::{
    FoundMesh, JobContext, KnownMass, KnownObject, PackageFile, built_in, mesh_table,
    packages::{self, MeshPackage, PACKAGES},
    paths::{tidy, with_slashes},
    spec::{BodiesSpec, MeshRow, ObjectsSpec},
};
use assets::{FolderError, MeshOrigin, MeshRefusal, MeshSource, ScaleRule, object::MadeOf};
use form::{Checker, FormError, FormProblem, Path, did_you_mean, first_repeated, fits_path};
use kernel::{
    files::{self, Bound},
    ids::{Digest, ObjectId},
    words::Show,
};

/// Meshes that the entries name.
#[derive(Default)]
pub(super) struct Found {
    pub meshes: Vec<FoundMesh>,
    pub refused: Vec<MeshRefusal>,
    pub notes: Vec<String>,
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

    fn built_in(name: String) -> Self {
        Self { relative: name.clone(), origin: MeshOrigin::BuiltIn(name) }
    }

    /// The file's stem, or the built-in name.
    fn name(&self) -> &str {
        let file = self.relative.rsplit('/').next().unwrap_or(&self.relative);
        match (&self.origin, file.rsplit_once('.')) {
            (MeshOrigin::File(_), Some((stem, _))) if !stem.is_empty() => stem,
            _ => file,
        }
    }
}

/// The meshes of an entry: those that rows may speak of, and those that pass.
#[derive(Default)]
struct Candidates {
    all: Vec<String>,
    kept: Vec<Candidate>,
}

impl Candidates {
    fn of(kept: Vec<Candidate>) -> Self {
        let all = kept.iter().flat_map(|mesh| [mesh.name().to_owned(), mesh.relative.clone()]).collect();
        Self { all, kept }
    }

    /// The meshes below a folder.
    fn of_folder(entry: &ObjectsSpec, folder: &FilePath) -> Result<Self, FolderError> {
        let below = |path: &FilePath| with_slashes(path.strip_prefix(folder).unwrap_or(path));
        let paths = assets::list_folder(folder)?.into_iter();
        // Rows may speak of what `exclude` takes out.
        let mut candidates = Self::of(paths.map(|path| Candidate::file(below(&path), path)).collect());
        let any = |patterns: &Vec<String>, path: &str| patterns.iter().any(|wanted| fits_path(wanted, path));
        candidates.kept.retain(|mesh| {
            entry.include.as_ref().is_none_or(|patterns| any(patterns, &mesh.relative))
                && !entry.exclude.as_ref().is_some_and(|patterns| any(patterns, &mesh.relative))
        });
        Ok(candidates)
    }
}

/// Lists the meshes of all entries, sorted by name.
pub(super) fn discover(
    checker: &mut Checker,
    entries: &[ObjectsSpec],
    folder: &FilePath,
    context: &JobContext,
) -> Found {
    let mut found = Found::default();
    let mut long_names = Vec::new();
    for (index, entry) in entries.iter().enumerate() {
        let path = Path::from("objects").index(index);
        check_entry(checker, entry, &path);
        let package = entry.package.as_deref().and_then(packages::package);
        let Candidates { all, mut kept } = candidates(checker, entry, &path, folder, context, &mut found.notes);
        let rows = rows(checker, entry, &path, folder, &all);
        kept.truncate(entry.limit.map_or(usize::MAX, |limit| limit as usize));
        for candidate in kept {
            let row = row_of(&rows, &candidate);
            let long_name = row.name.clone().unwrap_or_else(|| candidate.relative.clone());
            let (found_mesh, has_stray_wall) = mesh(entry, package, candidate, row);
            if has_stray_wall {
                let because = "a mesh of it has a `wall` and no `material`";
                checker.missing(path.key("material"), because);
            }
            for factor in entry.sizes.as_deref().unwrap_or(&[1.0]) {
                long_names.push(sized_name(&long_name, *factor));
                found.meshes.push(sized(found_mesh.clone(), *factor));
            }
        }
    }
    name_apart(&mut found.meshes, &long_names);
    found.meshes.sort_by(|a, b| a.source.name.cmp(&b.source.name));
    if found.meshes.is_empty() && checker.count() == 0 {
        let report = checker.invalid("objects", "at least one mesh", "none in any entry");
        report.help_if(found.notes.first().cloned());
    }
    found
}

fn check_entry(checker: &mut Checker, entry: &ObjectsSpec, path: &Path) {
    let sources = [
        ("folder", entry.folder.is_some()),
        ("list", entry.list.is_some()),
        ("package", entry.package.is_some()),
        ("built_in", entry.built_in.is_some()),
    ];
    let given: Vec<&str> = sources.iter().filter(|(_, given)| *given).map(|(key, _)| *key).collect();
    match given.as_slice() {
        [] => {
            if !sources.iter().any(|(key, _)| checker.is_wrong(path.key(key))) {
                checker.missing(path.key("folder"), "one of folder, list, package, built_in");
            }
        }
        [_] => {}
        [first, others @ ..] => {
            for other in others {
                let because = "each entry has one source; write a second `[[objects]]`";
                checker.contradiction(path.key(other), path.key(first), because);
            }
        }
    }
    let scales = [("unit", entry.unit.is_some()), ("scale", entry.scale.is_some()), ("size", entry.size.is_some())];
    check_scale(checker, path, scales);
    if entry.triangles.is_some() && entry.built_in.is_none() && !given.is_empty() {
        let because = "only built-in shapes can be made finer";
        checker.contradiction(path.key("triangles"), path.key(given[0]), because);
    }
    if entry.built_in.is_some() {
        let files_only = [
            ("include", entry.include.is_some()),
            ("exclude", entry.exclude.is_some()),
            ("sizes", entry.sizes.is_some()),
        ];
        for (key, _) in scales.iter().chain(&files_only).filter(|(_, given)| *given) {
            let because = "built-in shapes are in metres and chosen by name";
            checker.contradiction(path.key(key), path.key("built_in"), because);
        }
    }
    check_licence(checker, entry, path);
    let sizes = entry.sizes.as_deref().unwrap_or_default();
    if let Some(twice) = first_repeated(sizes) {
        checker.invalid(path.key("sizes").index(twice), "each factor once", sizes[twice].to_string());
    }
    if let Some(limits) = entry.limits {
        let rule = entry.size_rule();
        if rule.min > rule.max {
            let key = if limits.max.is_some() { "max" } else { "min" };
            let found = format!("{} m to {} m", rule.min, rule.max);
            checker.invalid(path.key("limits").key(key), "a smallest size below the largest", found);
        }
    }
}

/// Meshes whose licence is known keep it: an entry may state one for those without.
fn check_licence(checker: &mut Checker, entry: &ObjectsSpec, path: &Path) {
    let Some(stated) = &entry.licence else { return };
    let of_package = entry.package.as_deref().and_then(packages::package).and_then(MeshPackage::licence_of_all);
    let known = match of_package {
        Some(licence) => Some(("package", licence.to_owned())),
        None if entry.built_in.is_some() => assets::built_in_source("").licence.map(|licence| ("built_in", licence)),
        None => None,
    };
    let Some((key, known)) = known else { return };
    if *stated != known {
        let because = format!("these meshes have the licence {known}; leave `licence` out");
        checker.contradiction(path.key("licence"), path.key(key), because);
    }
}

fn check_scale(checker: &mut Checker, path: &Path, scales: [(&str, bool); 3]) {
    let mut given = scales.into_iter().filter(|(_, given)| *given).map(|(key, _)| key);
    if let Some(first) = given.next() {
        for other in given {
            checker.contradiction(path.key(other), path.key(first), "each sets the size of the object");
        }
    }
}

fn candidates(
    checker: &mut Checker,
    entry: &ObjectsSpec,
    path: &Path,
    folder: &FilePath,
    context: &JobContext,
    notes: &mut Vec<String>,
) -> Candidates {
    let mut absent = |checker: &mut Checker, path: &Path, what: &str, detail: String, help: Option<String>| {
        if entry.optional == Some(true) {
            let help = help.map(|help| format!("; {help}")).unwrap_or_default();
            notes.push(format!("{what} not found: {detail}: done without it{help}"));
        } else {
            checker.not_found(path, what, detail).help_if(help);
        }
        Candidates::default()
    };
    if let Some(wanted) = &entry.folder {
        let target = tidy(&folder.join(wanted));
        return Candidates::of_folder(entry, &target)
            .unwrap_or_else(|error| absent(checker, &path.key("folder"), "folder", error.to_string(), None));
    }
    if let Some(list) = &entry.list {
        let mut found = Vec::new();
        for (index, file) in list.iter().enumerate() {
            let target = tidy(&folder.join(file));
            if files::is_file(&target) {
                found.push(Candidate::file(with_slashes(file), target));
            } else {
                absent(checker, &path.key("list").index(index), "mesh file", target.display().to_string(), None);
            }
        }
        return Candidates::of(found);
    }
    if let Some(name) = &entry.package {
        let Some(package) = packages::package(name) else {
            let choices: Vec<String> = PACKAGES.iter().map(|package| package.name.to_owned()).collect();
            let help = did_you_mean(name, PACKAGES.iter().map(|package| package.name));
            checker.fail(path.key("package"), FormProblem::NotAChoice { found: name.clone(), choices }).help_if(help);
            return Candidates::default();
        };
        let target = context.packages.join(package.folder);
        return match Candidates::of_folder(entry, &target) {
            Ok(candidates) if !candidates.all.is_empty() => candidates,
            other => {
                let why = other.err().map_or("no mesh in it".to_owned(), |error| error.error.to_string());
                let detail = format!("{name}, expected in {} ({why})", target.shown());
                absent(checker, &path.key("package"), "package", detail, Some(package.remedy.to_owned()))
            }
        };
    }
    let shapes = built_in::shapes(checker, entry, path, &context.built_in);
    Candidates::of(shapes.into_iter().map(Candidate::built_in).collect())
}

/// The rows of the table and of `meshes`, the latter on top; each must name a mesh of the entry.
fn rows(
    checker: &mut Checker,
    entry: &ObjectsSpec,
    path: &Path,
    folder: &FilePath,
    names: &[String],
) -> BTreeMap<String, MeshRow> {
    let mut rows = BTreeMap::new();
    let known: BTreeSet<&str> = names.iter().map(String::as_str).collect();
    if let Some(table) = &entry.table {
        let target = tidy(&folder.join(table));
        match files::read_text(&target, Bound::CSV) {
            Ok(text) => {
                let (read, errors) = mesh_table::read(&target.display().to_string(), &text);
                checker.add_errors(errors);
                for (name, (row, location)) in read {
                    // A list can use a few meshes of a table with many.
                    if entry.list.is_none() && !known.is_empty() && !known.contains(name.as_str()) {
                        let problem = not_in_entry(&name);
                        let help = did_you_mean(&name, known.iter().copied());
                        checker.add_error(FormError { location, key: "name".to_owned(), problem, help });
                    }
                    rows.insert(name, row);
                }
            }
            Err(error) => {
                let detail = format!("{} ({error})", target.shown());
                checker.not_found(path.key("table"), "table", detail);
            }
        }
    }
    for (name, row) in entry.meshes.iter().flatten() {
        let path = path.key("meshes").key(name);
        if !known.is_empty() && !known.contains(name.as_str()) {
            let help = did_you_mean(name, known.iter().copied());
            checker.fail(&path, not_in_entry(name)).help_if(help);
        }
        let scales = [("unit", row.unit.is_some()), ("scale", row.scale.is_some()), ("size", row.size.is_some())];
        check_scale(checker, &path, scales);
        let below: MeshRow = rows.remove(name).unwrap_or_default();
        rows.insert(name.clone(), joined(row.clone(), below));
    }
    rows
}

fn not_in_entry(name: &str) -> FormProblem {
    FormProblem::NotFound { what: "mesh".to_owned(), detail: format!("`{name}` in this entry") }
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
        mass_source: if above.mass.is_some() { above.mass_source } else { above.mass_source.or(below.mass_source) },
        mass: above.mass.or(below.mass),
        category: above.category.or(below.category),
        // The walls are those of the material that is named with them.
        wall: if above.material.is_some() { above.wall } else { above.wall.or(below.wall) },
        material: above.material.or(below.material),
        bodies: above.bodies.or(below.bodies),
        object: above.object.or(below.object),
    }
}

fn row_of(rows: &BTreeMap<String, MeshRow>, candidate: &Candidate) -> MeshRow {
    let names = [candidate.relative.as_str(), candidate.name()];
    names.into_iter().find_map(|name| rows.get(name)).cloned().unwrap_or_default()
}

/// A mesh of an entry, with its row; also whether it has a wall of nothing.
fn mesh(entry: &ObjectsSpec, package: Option<&MeshPackage>, candidate: Candidate, row: MeshRow) -> (FoundMesh, bool) {
    let made = match &candidate.origin {
        MeshOrigin::BuiltIn(name) => Some(assets::built_in_source(name)),
        MeshOrigin::File(_) => None,
    };
    let known = MeshRow {
        group: made.as_ref().and_then(|made| made.group.clone()),
        licence: package.map(|package| package.licence.to_owned()).or_else(|| made.and_then(|made| made.licence)),
        citation: package.map(|package| package.citation.to_owned()),
        ..MeshRow::default()
    };
    let of_entry = MeshRow {
        unit: entry.unit,
        scale: entry.scale,
        size: entry.size,
        group: entry.group.clone(),
        licence: entry.licence.clone(),
        citation: entry.citation.clone(),
        category: entry.category.clone(),
        material: entry.material,
        wall: entry.wall,
        bodies: entry.bodies,
        ..MeshRow::default()
    };
    let row = joined(row, joined(of_entry, known));
    let scale = match (row.size, row.scale, row.unit) {
        (Some(size), ..) => ScaleRule::LongestSide(size),
        (_, Some(scale), _) => ScaleRule::MetresPerUnit(scale),
        (.., Some(unit)) => ScaleRule::MetresPerUnit(unit.0.metres),
        _ => ScaleRule::MetresPerUnit(package.map_or(1.0, |package| package.metres_per_unit)),
    };
    let known = KnownObject {
        mass: row.mass.map(|kilograms| KnownMass { kilograms, source: row.mass_source.unwrap_or_default() }),
        made_of: row.material.map(|material| MadeOf { material: material.0, wall: row.wall }),
        category: row.category,
        joins_parts: row.bodies == Some(BodiesSpec::Join),
    };
    let has_stray_wall = row.wall.is_some() && known.made_of.is_none();
    let found = FoundMesh {
        source: MeshSource {
            name: row.name.unwrap_or_else(|| candidate.name().to_owned()),
            origin: candidate.origin.clone(),
            scale,
            size: entry.size_rule(),
            licence: row.licence,
            citation: row.citation,
            group: row.group,
        },
        known,
        package: package.map(|package| PackageFile { package: package.name.to_owned(), file: candidate.relative }),
        pinned: row.object.as_deref().and_then(Digest::from_hex).map(ObjectId),
    };
    (found, has_stray_wall)
}

/// A mesh in another size.
fn sized(mut mesh: FoundMesh, factor: f64) -> FoundMesh {
    mesh.source.name = sized_name(&mesh.source.name, factor);
    mesh.source.scale = match mesh.source.scale {
        ScaleRule::MetresPerUnit(metres) => ScaleRule::MetresPerUnit(metres * factor),
        ScaleRule::LongestSide(side) => ScaleRule::LongestSide(side * factor),
    };
    let KnownObject { mass, made_of, .. } = &mut mesh.known;
    if let Some(mass) = mass {
        mass.kilograms *= factor * factor * factor;
    }
    if let Some(wall) = made_of.as_mut().and_then(|made_of| made_of.wall.as_mut()) {
        *wall *= factor;
    }
    mesh
}

/// Name of a mesh in another size.
fn sized_name(name: &str, factor: f64) -> String {
    if factor == 1.0 { name.to_owned() } else { format!("{name}-x{factor}") }
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
