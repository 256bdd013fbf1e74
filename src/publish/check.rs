//! Check of a release: whether it is complete, and whether its documents describe the dataset in the same folder.

use std::{
    collections::{BTreeMap, BTreeSet},
    io,
};

use serde_json::Value;

use super::release::{
    CARD, CITATION, CROISSANT, LICENCES, LeftOutFile, PROVENANCE, RECIPE, Recipe,
    checksums::{CHECKSUMS, digests_of, parsed},
    staging::files_below,
};
use format::dataset::{DatasetError, Manifest, Problem, VerifyReport};
use kernel::files::{Bound, Folder};

const REMEDY: &str = "download the release again, or make it again with `graspmill release`";

/// Largest number of listed problems of single files.
const MOST_PROBLEMS: usize = 1000;

/// Findings of the check of a release.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReleaseCheck {
    /// Files whose SHA-256 was compared.
    pub files: usize,
    /// Files of the dataset that the release leaves out.
    pub left_out: Vec<String>,
    /// Problems.
    pub problems: Vec<Problem>,
}

impl ReleaseCheck {
    /// Adds the problems to the findings about the dataset. A file that the release leaves out becomes a note instead of a
    /// problem.
    pub fn add_to(&self, report: &mut VerifyReport) {
        let known = |problem: &Problem| self.left_out.contains(&problem.file);
        if !self.left_out.is_empty() {
            report.problems.retain(|problem| !known(problem));
            report.notes.push(format!("a recipe: {} files of the dataset are not included", self.left_out.len()));
        }
        report.problems.extend(self.problems.iter().cloned());
    }
}

/// Checks the release in a folder; `None` if the folder is not a release.
///
/// Every file must have the SHA-256 in `manifest-sha256.txt`, the folder must contain no other file, and card, Croissant,
/// citation, licences and provenance must name root and shards of the manifest.
///
/// # Errors
/// When the list or the manifest can't be read, or the operating system refuses to list the folder.
pub fn check_release(folder: &Folder) -> Result<Option<ReleaseCheck>, DatasetError> {
    let path = folder.path_of(CHECKSUMS);
    let bytes = match folder.read(CHECKSUMS, Bound::RELEASE_TEXT) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(DatasetError::Io { action: "reading", path, source }),
    };
    let text = String::from_utf8(bytes).map_err(|error| error.to_string());
    let listed = (text.and_then(|text| parsed(&text).map_err(|error| error.to_string())))
        .map_err(|problem| DatasetError::Invalid { path: path.clone(), problem, remedy: REMEDY })?;
    let manifest = Manifest::read(folder)?;
    let mut problems = check_files(folder, &manifest, &listed)?;
    let recipe = read_recipe(folder, &manifest, &mut problems);
    let left_out: Vec<String> =
        recipe.map(|recipe| recipe.left_out.into_iter().map(|file| file.path).collect()).unwrap_or_default();
    for path in manifest.paths().iter().filter(|path| !listed.contains_key(*path) && !left_out.contains(path)) {
        problems.push(problem(CHECKSUMS, format!("it does not name {path}")));
    }
    check_documents(folder, &manifest, &listed, &mut problems);
    Ok(Some(ReleaseCheck { files: listed.len(), left_out, problems }))
}

fn problem(file: &str, what: String) -> Problem {
    Problem { file: file.to_owned(), shard: None, location: String::new(), what, remedy: REMEDY }
}

/// Compares every file with its digest, and every file of the folder with the list.
fn check_files(
    folder: &Folder,
    manifest: &Manifest,
    listed: &BTreeMap<String, String>,
) -> Result<Vec<Problem>, DatasetError> {
    let (mut problems, mut more) = (Vec::new(), 0);
    let mut push = |found: Problem| if problems.len() < MOST_PROBLEMS { problems.push(found) } else { more += 1 };
    let entries = manifest.entries();
    for (path, saved) in listed {
        // A file that is too large has changed and is not hashed; documents have a bound.
        let most = entries.get(path).map_or(Bound::RELEASE_TEXT.bytes, |entry| entry.bytes);
        match folder.size(path) {
            Ok(size) if size > most => {
                push(problem(
                    path,
                    format!("its content has changed: it has {size} bytes, but at most {most} are expected"),
                ));
                continue;
            }
            _ => {}
        }
        match digests_of(folder, path) {
            Ok(found) if found.sha256 == *saved => {}
            Ok(found) => {
                let (saved, found) = (&saved[..16], &found.sha256[..16]);
                push(problem(
                    path,
                    format!("its content has changed: the listed SHA-256 is {saved}, the calculated one {found}"),
                ));
            }
            Err(error) => push(problem(path, error.to_string())),
        }
    }
    let known: BTreeSet<&str> = listed.keys().map(String::as_str).chain([CHECKSUMS]).collect();
    for path in files_below(folder)?.iter().filter(|path| !known.contains(path.as_str())) {
        push(Problem {
            remedy: "delete it or move it away",
            ..problem(path, format!("{CHECKSUMS} does not list this file"))
        });
    }
    if more > 0 {
        problems.push(problem(CHECKSUMS, format!("and {more} more problems")));
    }
    Ok(problems)
}

/// Reads the recipe, if it belongs to this dataset.
fn read_recipe(folder: &Folder, manifest: &Manifest, problems: &mut Vec<Problem>) -> Option<Recipe> {
    let text = folder.read(RECIPE, Bound::RELEASE_TEXT).ok()?;
    let recipe: Recipe = match serde_json::from_slice(&text) {
        Ok(recipe) => recipe,
        Err(error) => {
            problems.push(problem(RECIPE, error.to_string()));
            return None;
        }
    };
    if (recipe.root, recipe.job) != (manifest.root, manifest.job) {
        problems.push(problem(RECIPE, other_root(&recipe.root.hex(), manifest)));
        return None;
    }
    // A recipe may leave out only files that the dataset has with that content.
    let known = manifest.entries();
    let is_known = |file: &LeftOutFile| known.get(&file.path).is_some_and(|entry| entry.digest == file.blake3);
    for file in recipe.left_out.iter().filter(|file| !is_known(file)) {
        problems.push(problem(RECIPE, format!("{} is not a file of the manifest with that digest", file.path)));
    }
    Some(recipe)
}

fn other_root(found: &str, manifest: &Manifest) -> String {
    format!("its root is {found}, that of the manifest {}", manifest.root)
}

/// Compares each document with root and shards of the manifest.
fn check_documents(
    folder: &Folder,
    manifest: &Manifest,
    listed: &BTreeMap<String, String>,
    problems: &mut Vec<Problem>,
) {
    let root = manifest.root.hex();
    for path in [CARD, CITATION, LICENCES, CROISSANT, PROVENANCE] {
        match folder.read_text(path, Bound::RELEASE_TEXT) {
            Ok(text) if text.contains(&root) => {}
            Ok(_) => problems.push(problem(path, format!("it does not name the manifest's root {root}"))),
            Err(error) => problems.push(problem(path, error.to_string())),
        }
    }
    let json =
        |path: &str| -> Option<Value> { serde_json::from_slice(&folder.read(path, Bound::RELEASE_TEXT).ok()?).ok() };
    let mut compare = |path: &str, name: &str, sha256: Option<&str>| {
        if sha256 != listed.get(name).map(String::as_str) {
            problems.push(problem(path, format!("its SHA-256 of {name} differs from {CHECKSUMS}")));
        }
    };
    if let Some(croissant) = json(CROISSANT) {
        for file in rows(&croissant["distribution"]).filter(|row| row["@type"] == "cr:FileObject") {
            compare(CROISSANT, file["contentUrl"].as_str().unwrap_or_default(), file["sha256"].as_str());
        }
    }
    if let Some(provenance) = json(PROVENANCE) {
        let subjects: BTreeMap<&str, &Value> =
            (rows(&provenance["subject"])).filter_map(|row| Some((row["name"].as_str()?, &row["digest"]))).collect();
        for shard in &manifest.shards {
            let name = shard.path();
            let digest = subjects.get(name.as_str()).copied().unwrap_or(&Value::Null);
            compare(PROVENANCE, &name, digest["sha256"].as_str());
            if digest["blake3"].as_str() != Some(&shard.digest.hex()) {
                compare(PROVENANCE, &name, Some("another BLAKE3"));
            }
        }
        let whole = subjects.get("dataset").copied().unwrap_or(&Value::Null);
        let job = &provenance["predicate"]["buildDefinition"]["externalParameters"]["job"]["digest"]["graspmillJob"];
        if whole["graspmillRoot"].as_str() != Some(&root) || job.as_str() != Some(&manifest.job.0.hex()) {
            problems.push(problem(PROVENANCE, format!("its subject or its job does not belong to root {root}")));
        }
    }
}

fn rows(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}
