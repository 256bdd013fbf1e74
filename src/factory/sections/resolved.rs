//! Objects and other parts of a checked job as keys of a job file, and as keys of its digests.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde::Serialize;

use super::{
    JobObject, JobObjects, KnownMass, KnownObject,
    paths::{relative_to, with_slashes},
    spec::{BodiesSpec, BuiltInSpec, LimitsSpec, MaterialSpec, MeshRow, ObjectsSpec, SplitSpec},
};
use assets::{MeshOrigin, ScaleRule};
use form::literal_pattern;
use kernel::ids::Digest;

/// Keys of a part of a job, from the type that also reads them.
///
/// # Panics
/// When it does not become a table.
pub fn keys_of(spec: &impl Serialize) -> toml::Table {
    toml::Table::try_from(spec).expect("keys of a job are plain data in a table")
}

/// The section `shards` of a job file: samples per shard, under the product's own word for them.
pub fn shards_section(word: &str, shard_samples: u32) -> (String, toml::Value) {
    ("shards".to_owned(), toml::Table::from_iter([(word.to_owned(), shard_samples.into())]).into())
}

/// Keys that the digest of a job covers in addition to those of its samples, where the subjects come from another
/// dataset: their splits, and their names by content. The root of that dataset depends on neither.
pub fn subjects_section(splits: &impl Serialize, names: impl Iterator<Item = (Digest, String)>) -> toml::Table {
    let splits = toml::Value::try_from(splits).expect("splits are plain data");
    let names: toml::Table = names.map(|(content, name)| (content.hex(), name.into())).collect();
    toml::Table::from_iter([("splits".to_owned(), splits), ("names".to_owned(), names.into())])
}

impl JobObjects {
    /// Keys of a job file about the objects: `split` and `[[objects]]`, pinned by content.
    pub fn resolved(&self, folder: &Path) -> toml::Table {
        let objects = self.specs(folder).into_iter().map(|entry| keys_of(&entry).into());
        toml::Table::from_iter([
            ("split".to_owned(), keys_of(&self.split.spec()).into()),
            ("objects".to_owned(), toml::Value::Array(objects.collect())),
        ])
    }

    /// The objects as `[[objects]]`: one entry per package, one for files, one for built-in shapes; several where size limits
    /// differ, or where a file is an object in several sizes. Files are named relative to `folder`.
    fn specs(&self, folder: &Path) -> Vec<ObjectsSpec> {
        let mut entries: BTreeMap<(Origin<'_>, [u64; 2], usize), Vec<&JobObject>> = BTreeMap::new();
        let mut times: BTreeMap<(Origin<'_>, String), usize> = BTreeMap::new();
        for object in &self.list {
            let limits = [object.source.size.min.to_bits(), object.source.size.max.to_bits()];
            let origin = Origin::of(object);
            let times = times.entry((origin, file_of(object, folder))).or_default();
            entries.entry((origin, limits, *times)).or_default().push(object);
            *times += 1;
        }
        entries.into_iter().map(|((origin, ..), objects)| entry(origin, &objects, folder)).collect()
    }

    /// The objects by name, content and group, with the rules of their split: everything that decides who trains and who tests.
    pub fn subject_keys(&self) -> toml::Table {
        let object = |object: &JobObject| {
            let group = object.source.group.as_deref().unwrap_or_default();
            let mut parts = vec![object.source.name.clone(), object.id().0.hex(), group.to_owned()];
            // What an object weighs is a part of the job where samples depend on it.
            match &object.known {
                _ if !self.with_masses => {}
                KnownObject { mass: Some(KnownMass { kilograms, source }), .. } => {
                    parts.extend([kilograms.to_string(), source.clone()]);
                }
                KnownObject { made_of: Some(made_of), .. } => parts.push(made_of.in_words()),
                _ => {}
            }
            parts
        };
        let objects: Vec<Vec<String>> = self.list.iter().map(object).collect();
        let mut keys = toml::Table::new();
        // Words about the split, which decide nothing, stay out.
        let split = SplitSpec { twins_intended: None, ..self.split.spec() };
        keys.insert("split".to_owned(), keys_of(&split).into());
        keys.insert("objects".to_owned(), objects.into());
        keys
    }
}

/// Source of an object's mesh.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Origin<'a> {
    BuiltIn,
    Files,
    Package(&'a str),
}

impl<'a> Origin<'a> {
    fn of(object: &'a JobObject) -> Self {
        match (&object.package, &object.source.origin) {
            (Some(file), _) => Self::Package(&file.package),
            (None, MeshOrigin::File(_)) => Self::Files,
            (None, MeshOrigin::BuiltIn(_)) => Self::BuiltIn,
        }
    }
}

/// One `[[objects]]` entry for objects of one origin with the same size limits.
fn entry(origin: Origin<'_>, objects: &[&JobObject], folder: &Path) -> ObjectsSpec {
    let files: Vec<String> = objects.iter().map(|object| file_of(object, folder)).collect();
    let limits = objects.first().map(|object| object.source.size).unwrap_or_default();
    let mut spec = ObjectsSpec {
        limits: Some(LimitsSpec { min: Some(limits.min), max: Some(limits.max) }),
        meshes: Some(files.iter().cloned().zip(objects.iter().map(|object| row(object))).collect()),
        ..ObjectsSpec::default()
    };
    match origin {
        Origin::Package(package) => {
            spec.package = Some(package.to_owned());
            // A leading `./` keeps a bare name from fitting files in folders below.
            spec.include = Some(files.iter().map(|file| format!("./{}", literal_pattern(file))).collect());
        }
        Origin::Files => spec.list = Some(files.into_iter().map(PathBuf::from).collect()),
        Origin::BuiltIn => spec.built_in = Some(BuiltInSpec::Names(files)),
    }
    spec
}

/// All data of a job about one mesh.
fn row(object: &JobObject) -> MeshRow {
    let source = &object.source;
    let (scale, size) = match (&source.origin, source.scale) {
        (MeshOrigin::BuiltIn(_), _) => (None, None),
        (_, ScaleRule::MetresPerUnit(scale)) => (Some(scale), None),
        (_, ScaleRule::LongestSide(size)) => (None, Some(size)),
    };
    let KnownObject { mass, made_of, category, joins_parts } = &object.known;
    MeshRow {
        name: Some(source.name.clone()),
        unit: None,
        scale,
        size,
        group: source.group.clone(),
        licence: source.licence.clone(),
        citation: source.citation.clone(),
        category: category.clone(),
        mass: mass.as_ref().map(|mass| mass.kilograms),
        mass_source: mass.as_ref().map(|mass| mass.source.clone()).filter(|source| !source.is_empty()),
        material: made_of.map(|made_of| MaterialSpec(made_of.material)),
        wall: made_of.and_then(|made_of| made_of.wall),
        bodies: joins_parts.then_some(BodiesSpec::Join),
        object: Some(object.id().0.hex()),
    }
}

/// Name of an object's file in its entry.
fn file_of(object: &JobObject, folder: &Path) -> String {
    match (&object.package, &object.source.origin) {
        (Some(file), _) => file.file.clone(),
        (None, MeshOrigin::File(path)) => with_slashes(&relative_to(path, folder)),
        (None, MeshOrigin::BuiltIn(name)) => name.clone(),
    }
}

/// A table without some of its keys, given as dotted paths; those that it does not have are passed over.
pub fn without(mut table: toml::Table, paths: &[&str]) -> toml::Table {
    for path in paths {
        let (sections, key) = path.rsplit_once('.').map_or((None, *path), |(sections, key)| (Some(sections), key));
        let mut section = Some(&mut table);
        for name in sections.into_iter().flat_map(|sections| sections.split('.')) {
            section = section.and_then(|table| table.get_mut(name)).and_then(toml::Value::as_table_mut);
        }
        section.and_then(|table| table.remove(key));
    }
    table
}
