//! A release: a dataset's folder with the documents for its publication, for people and for programs.
//!
//! A release is also a dataset. It adds a card, a datasheet, licences, metadata (Croissant), citation, provenance, pictures, and
//! a list of digests of all files (docs/releases.md). Two releases of one dataset with one about file have the same bytes and do
//! not depend on time or machine.

mod about;
mod assets;
pub(super) mod checksums;
mod croissant;
mod documents;
mod error;
mod licences;
mod material;
mod pictures;
mod provenance;
mod recipe;
mod rights;
pub(super) mod staging;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde::Serialize;
use serde_json::Value;

pub use about::{About, Author, LicenceStatement, LicenceTerms};
pub use error::ReleaseError;
pub(super) use recipe::{LeftOutFile, Recipe};

use self::{
    assets::{Asset, LeftOut},
    checksums::{CHECKSUMS, FileDigests, digests_of},
    documents::Documents,
    material::Release,
    staging::Staging,
};
use super::{
    inspection::job_table,
    notes::RunNotes,
    numbers::Numbers,
    product::{ProductAssets, Survey},
    products::pages_of,
    report::report,
};
use format::dataset::{DatasetError, DatasetReader, FileEntry, Manifest, VerifyLevel, VerifyOptions, layout, verify};
use kernel::{
    files::{self, Bound, Folder},
    ids::Digest,
};
use tables::ParquetIndex;

/// The card.
pub(super) const CARD: &str = "README.md";
/// Metadata for programs.
pub(super) const CROISSANT: &str = "croissant.json";
/// The citation.
pub(super) const CITATION: &str = "CITATION.cff";
/// All inputs.
pub(super) const PROVENANCE: &str = "provenance.intoto.json";
/// Machine-readable licences.
pub(super) const LICENCES: &str = "licences.json";
/// The recipe: files left out, and how to make them again.
pub(super) const RECIPE: &str = "recipe.json";
const ABOUT: &str = "about.toml";
const DATASHEET: &str = "DATASHEET.md";
const LICENCES_TEXT: &str = "LICENCES.md";

/// Options of a release.
#[derive(Clone, Copy, Debug)]
pub struct ReleaseOptions<'a> {
    /// The finished dataset.
    pub folder: &'a Folder,
    /// The release's folder: new or empty.
    pub out: &'a Path,
    /// The about file.
    pub about: &'a Path,
    /// Leave out files that may not be shipped, and describe how to make them again.
    pub recipe: bool,
    /// Threads for the check of the dataset, at least 1.
    pub threads: usize,
}

/// A finished release.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Published {
    /// The folder.
    pub folder: PathBuf,
    /// Root digest of the dataset.
    pub root: Digest,
    /// Files.
    pub files: usize,
    /// Total size of the files [bytes].
    pub bytes: u64,
    /// Files of the dataset left out.
    pub left_out: Vec<String>,
    /// Notes for the publisher.
    pub notes: Vec<String>,
}

/// Makes a release of a finished dataset.
///
/// The whole dataset is checked first. The folder is filled under a temporary name and renamed at the end.
///
/// # Errors
/// When the dataset is not finished or not intact, the about file has mistakes, the folder is not empty, an asset may
/// not be shipped (without `recipe`), or a file can't be read or written.
pub fn make_release(options: &ReleaseOptions) -> Result<Published, ReleaseError> {
    let reader = DatasetReader::open(options.folder)?;
    let rows = assets::rows(&reader)?;
    let names: Vec<&str> = rows.iter().map(|(_, row)| row.name.as_str()).collect();
    let about_text = files::read_text(options.about, Bound::ABOUT)
        .map_err(|source| ReleaseError::NoAbout { path: options.about.to_owned(), source })?;
    let about = About::read(options.about, &about_text, &names).map_err(ReleaseError::About)?;
    let job = job_table(&reader)?;
    let assets = assets::assets(&reader, &rows, &job, &about);
    let left_out = shipped(options, &assets)?;
    let staging = Staging::begin(options.out)?;
    check_dataset(options)?;
    for path in reader.manifest().paths() {
        staging.copy(options.folder, &path)?;
    }
    staging.write(ABOUT, about_text.as_bytes())?;
    let notes = RunNotes::read(options.folder)?;
    if !notes.leaks.is_empty() {
        // Speed differs from run to run and is not part of a release.
        RunNotes { speed: None, ..notes }.write(staging.folder())?;
    }
    let drawn = draw(options.folder, &staging, left_out)?;
    let left_out = leave_out(&staging, reader.manifest(), left_out)?;
    let data = hash_all(&staging)?;
    check_copies(reader.manifest(), &data, options.folder)?;
    let release = Release {
        about: &about,
        manifest: reader.manifest(),
        assets: &assets,
        numbers: &drawn.numbers,
        files: &data,
        left_out: &left_out,
        pictures: &drawn.pictures,
        outside: outside(&job),
    };
    write_documents(&staging, &release)?;
    let notes = notes_of(&release);
    let mut files = data.clone();
    for path in staging.files()?.into_iter().filter(|path| !release.files.contains_key(path)) {
        let digests = digests_of(staging.folder(), &path)?;
        files.insert(path, digests);
    }
    staging.write(CHECKSUMS, checksums::list(&files).as_bytes())?;
    let bytes = files.values().map(|file| file.bytes).sum();
    Ok(Published {
        folder: staging.publish()?,
        root: reader.manifest().root,
        files: files.len() + 1,
        bytes,
        left_out: left_out.into_iter().map(|file| file.path).collect(),
        notes,
    })
}

/// Files that must be left out; an error if this contradicts the options.
fn shipped(options: &ReleaseOptions, assets: &[Asset]) -> Result<LeftOut, ReleaseError> {
    let left_out = LeftOut::of(assets);
    match (left_out, options.recipe) {
        (LeftOut::Nothing, true) => Err(ReleaseError::NothingToLeaveOut { folder: options.folder.path().to_owned() }),
        (LeftOut::Nothing, false) | (_, true) => Ok(left_out),
        (_, false) => {
            let line = |asset: &Asset| {
                format!("  {} {} ({}): {}", asset.kind.name(), asset.name, asset.source, asset.because())
            };
            let lines = assets.iter().filter(|asset| !asset.is_free()).map(line).collect();
            Err(ReleaseError::MayNotShip { assets: lines, about: options.about.to_owned() })
        }
    }
}

/// Checks the whole dataset.
fn check_dataset(options: &ReleaseOptions) -> Result<(), ReleaseError> {
    let level = VerifyLevel::Full;
    // The rules of the job are checked by the run and by `verify`, not here.
    let verification = VerifyOptions { level, rules: &[], index: Some(&ParquetIndex), threads: options.threads };
    let found = verify(options.folder, verification, |_| {})?;
    match found.problems.first() {
        None => Ok(()),
        Some(first) => Err(ReleaseError::NotIntact {
            folder: options.folder.path().to_owned(),
            problems: found.problems.len(),
            first: first.to_string(),
        }),
    }
}

/// Pictures and numbers.
struct Drawn {
    numbers: Numbers,
    pictures: Vec<(String, String)>,
}

/// Preview, report and pictures, as far as they may be shown; numbers always.
fn draw(folder: &Folder, staging: &Staging, left_out: LeftOut) -> Result<Drawn, ReleaseError> {
    let reader = DatasetReader::open(staging.folder())?;
    let pages = pages_of(reader.manifest().product);
    let mut numbers = Numbers::of(&reader, (pages.headline)(&reader)?, pages.assets.subjects)?;
    if left_out == LeftOut::Samples {
        return Ok(Drawn { numbers, pictures: Vec::new() });
    }
    let survey: Box<dyn Survey> = (pages.survey)(&reader)?;
    let drawn = pictures::pictures(&reader, &*survey)?;
    for shown in &drawn {
        staging.write(&shown.path, &shown.picture.to_png())?;
    }
    preview(folder, &reader, staging)?;
    report(staging.folder(), Some(&staging.folder().path_of(layout::REPORT)))?;
    survey.add_numbers(&mut numbers);
    Ok(Drawn { numbers, pictures: drawn.into_iter().map(|shown| (shown.path, shown.caption)).collect() })
}

/// The preview of the run if it shows more than the dataset stores; else a preview of the stored data.
fn preview(folder: &Folder, reader: &DatasetReader, staging: &Staging) -> Result<(), ReleaseError> {
    let pages = pages_of(reader.manifest().product);
    if pages.preview_shows_more && folder.contains(layout::PREVIEW) {
        staging.copy(folder, layout::PREVIEW)?;
    } else {
        (pages.write_preview)(reader, None)?;
    }
    Ok(())
}

/// Removes files that may not be shipped; returns the removed files of the dataset.
fn leave_out(staging: &Staging, manifest: &Manifest, left_out: LeftOut) -> Result<Vec<LeftOutFile>, DatasetError> {
    let (mut files, mut entries) = (Vec::new(), manifest.entries());
    let product: &ProductAssets = &pages_of(manifest.product).assets;
    for path in staging.files()?.into_iter().filter(|path| left_out.holds(path, product)) {
        staging.remove(&path)?;
        if let Some(FileEntry { digest: blake3, bytes }) = entries.remove(&path) {
            files.push(LeftOutFile { path, blake3, bytes });
        }
    }
    Ok(files)
}

fn hash_all(staging: &Staging) -> Result<BTreeMap<String, FileDigests>, DatasetError> {
    let of = |path: String| digests_of(staging.folder(), &path).map(|digests| (path, digests));
    staging.files()?.into_iter().map(of).collect()
}

/// Checks that the copied files are the checked ones: the dataset may have changed meanwhile.
fn check_copies(
    manifest: &Manifest,
    files: &BTreeMap<String, FileDigests>,
    folder: &Folder,
) -> Result<(), DatasetError> {
    for (path, FileEntry { digest: saved, .. }) in manifest.entries() {
        if let Some(file) = files.get(&path).filter(|file| file.blake3 != saved) {
            return Err(DatasetError::Changed {
                path: folder.path_of(path),
                saved,
                calculated: file.blake3,
                remedy: "do not change the dataset while it is released",
            });
        }
    }
    Ok(())
}

fn write_documents(staging: &Staging, release: &Release) -> Result<(), DatasetError> {
    let manifest = release.manifest;
    if !release.left_out.is_empty() {
        let recipe = Recipe {
            root: manifest.root,
            job: manifest.job,
            generator: manifest.generator.clone(),
            left_out: release.left_out.to_vec(),
        };
        staging.write(RECIPE, pretty(&serde_json::to_value(&recipe).expect("plain data")).as_bytes())?;
    }
    let documents = Documents::of(release);
    staging.write(LICENCES, pretty(&licences::json(release)).as_bytes())?;
    staging.write(LICENCES_TEXT, documents.licences().as_bytes())?;
    staging.write(CITATION, documents.citation().as_bytes())?;
    staging.write(CROISSANT, pretty(&croissant::croissant(release, &documents.bibtex())).as_bytes())?;
    staging.write(PROVENANCE, pretty(&provenance::provenance(release)).as_bytes())?;
    staging.write(DATASHEET, documents.datasheet().as_bytes())?;
    staging.write(CARD, documents.card().as_bytes())
}

/// JSON with sorted keys and a line end.
fn pretty(value: &Value) -> String {
    serde_json::to_string_pretty(value).expect("documents are plain data with text keys") + "\n"
}

/// Notes for the publisher before the release is published.
fn notes_of(release: &Release) -> Vec<String> {
    let mut notes = Vec::new();
    for (key, (path, more)) in &release.outside {
        let more = and_more(*more);
        notes.push(format!(
            "job.toml contains {key} = \"{path}\"{more}, a path on the machine where the data was made; the card describes what to do elsewhere"
        ));
    }
    notes.extend(licence_notes(release.assets));
    let about = release.about;
    let said = [
        ("url", about.url.is_some() || about.doi.is_some()),
        ("contact", about.contact.is_some()),
        ("maintenance", about.maintenance.is_some()),
        ("intended_uses", !about.intended_uses.is_empty()),
        ("out_of_scope_uses", !about.out_of_scope_uses.is_empty()),
    ];
    let unsaid: Vec<&str> = said.iter().filter(|(_, said)| !said).map(|(key, _)| *key).collect();
    if !unsaid.is_empty() {
        notes.push(format!("the about file does not state {}; the datasheet marks this", unsaid.join(", ")));
    }
    notes
}

/// Licences that the about file replaces, and patterns that do not apply to all matching assets.
fn licence_notes(assets: &[Asset]) -> Vec<String> {
    let mut notes = Vec::new();
    let mut kept: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for asset in assets {
        let licence = asset.licence.as_deref().unwrap_or_default();
        if let Some(known) = &asset.replaces {
            let (name, known) = (&asset.name, licences::replaced_in_words(known));
            notes.push(format!(
                "the about file states {licence} for {name}, instead of {known}; LICENCES.md shows both"
            ));
        }
        if let Some(pattern) = &asset.passed_over {
            kept.entry(pattern).or_default().push(format!("{} ({licence})", asset.name));
        }
    }
    for (pattern, assets) in kept {
        let names: Vec<&str> = assets.iter().map(String::as_str).collect();
        let names = about::some_of(&names);
        notes.push(format!(
            "[licences] \"{pattern}\" applies only to assets without a known licence; these keep their known licence: {names}; use an asset's name to replace its licence"
        ));
    }
    notes
}

/// Text about further items.
fn and_more(count: usize) -> String {
    if count > 0 { format!(" and {count} more") } else { String::new() }
}

/// Keys of a resolved job with paths outside its folder, and these paths.
fn outside(job: &toml::Table) -> BTreeMap<String, (String, usize)> {
    type Found = BTreeMap<String, (String, usize)>;
    fn walk_table(table: &toml::Table, key: &str, found: &mut Found) {
        for (name, value) in table.iter().filter(|(name, _)| *name != "meshes") {
            walk(value, &if key.is_empty() { name.clone() } else { format!("{key}.{name}") }, found);
        }
    }
    fn walk(value: &toml::Value, key: &str, found: &mut Found) {
        match value {
            toml::Value::Table(table) => walk_table(table, key, found),
            toml::Value::Array(array) => array.iter().for_each(|value| walk(value, key, found)),
            toml::Value::String(text) => {
                let last = key.rsplit('.').next().unwrap_or(key);
                if ["model", "scene", "dataset", "list", "folder"].contains(&last) {
                    found.entry(key.to_owned()).and_modify(|(_, more)| *more += 1).or_insert_with(|| (text.clone(), 0));
                }
            }
            _ => {}
        }
    }
    let mut found = Found::new();
    walk_table(job, "", &mut found);
    found
}

#[cfg(test)]
mod examples;
#[cfg(test)]
pub(super) use self::{documents::TEMPLATES as DOCUMENT_TEMPLATES, examples::Example};
