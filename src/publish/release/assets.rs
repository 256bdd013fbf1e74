//! Assets that a dataset was made of, and the parts of them that a release may hold: one row per object, hand, container or robot.

use std::{collections::BTreeMap, path::Path, sync::LazyLock};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{
    About,
    rights::{self, Need},
};
use crate::{
    asset::{AssetKind, AssetUse},
    product::ProductAssets,
    products::pages_of,
};
use format::dataset::{AssetRow, DatasetError, DatasetReader, layout};
use kernel::ids::ObjectId;

/// Part of an asset that may stand in a release.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Allowed {
    /// Nothing that shows it.
    Nothing,
    /// Data made of it, but no copy of its shape.
    Derived,
    /// Everything.
    Everything,
}

/// Source of the name of a licence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum LicenceSource {
    /// The dataset's asset table.
    Dataset,
    /// The about file.
    About,
    /// `scenes/licences.toml` of this program, by content.
    Graspmill,
    /// Nobody.
    Nobody,
}

/// One asset of a release.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Asset {
    /// Name in the job.
    pub name: String,
    /// Kind of the asset.
    pub kind: AssetKind,
    /// Digest of the content, as graspmill counts it: of the prepared mesh, or of the description with all that it
    /// names.
    pub content: ObjectId,
    /// BLAKE3 of the source file, of a mesh out of a file.
    pub file_blake3: Option<String>,
    /// Where it is from.
    pub source: String,
    /// Licence, where known.
    pub licence: Option<String>,
    /// Source of that name.
    pub licence_source: LicenceSource,
    /// Whom to name, and how to cite it.
    pub attribution: Option<String>,
    /// Part of it that stands in the dataset.
    #[serde(rename = "use")]
    pub used: AssetUse,
    /// Part of it that may stand in this release.
    pub may_be_shipped: Allowed,
    /// Why not all of it.
    pub because: Option<String>,
}

impl Asset {
    /// Whether what the dataset holds of it may be shipped whole.
    pub fn is_free(&self) -> bool {
        match self.used {
            AssetUse::Copied => self.may_be_shipped == Allowed::Everything,
            AssetUse::Derived | AssetUse::Measured => self.may_be_shipped >= Allowed::Derived,
        }
    }

    /// Why not all of it may be shipped.
    pub fn because(&self) -> &str {
        self.because.as_deref().unwrap_or("its licence forbids it")
    }
}

/// A robot, hand or container that comes with this program.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Described {
    scene: String,
    content: ObjectId,
    licence: String,
    attribution: String,
}

/// `scenes/licences.toml`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Licences {
    descriptions: Vec<Described>,
    containers: Vec<Described>,
}

static DESCRIBED: LazyLock<BTreeMap<ObjectId, Described>> = LazyLock::new(|| {
    let table: Licences =
        toml::from_str(include_str!("licences.toml")).expect("scenes/licences.toml (a test reads it)");
    table.descriptions.into_iter().chain(table.containers).map(|row| (row.content, row)).collect()
});

/// Names and kinds of a dataset's assets: objects, or its robot, then hands and containers.
pub(super) fn rows(reader: &DatasetReader) -> Result<Vec<(AssetKind, AssetRow)>, DatasetError> {
    let table = reader.assets()?;
    let kind = pages_of(reader.manifest().product).assets.subjects;
    let objects = table.objects.into_iter().map(|row| (kind, row));
    let hands = table.hands.into_iter().map(|row| (AssetKind::Hand, row));
    let containers = table.containers.into_iter().map(|row| (AssetKind::Container, row));
    Ok(objects.chain(hands).chain(containers).collect())
}

/// The assets with what is known of their licences, sorted by kind and name; `job` is the dataset's.
pub(super) fn assets(
    reader: &DatasetReader,
    rows: &[(AssetKind, AssetRow)],
    job: &toml::Table,
    about: &About,
) -> Vec<Asset> {
    let sources = Sources::of(job);
    let product = &pages_of(reader.manifest().product).assets;
    let mut assets: Vec<Asset> = rows.iter().map(|(kind, row)| asset(product, *kind, row, &sources, about)).collect();
    assets.sort_by(|a, b| (a.kind, &a.name, a.content).cmp(&(b.kind, &b.name, b.content)));
    assets
}

fn asset(product: &ProductAssets, kind: AssetKind, row: &AssetRow, sources: &Sources, about: &About) -> Asset {
    let word = |key: &str| row.facts.get(key).and_then(Value::as_str).map(str::to_owned);
    let known = DESCRIBED.get(&row.object).filter(|_| kind != AssetKind::Object);
    let stated = about.licence_of(&row.name);
    let (licence, licence_source) = match (&stated, word("licence"), known) {
        (Some(terms), _, _) => (Some(terms.licence.clone()), LicenceSource::About),
        (None, Some(licence), _) => (Some(licence), LicenceSource::Dataset),
        (None, None, Some(known)) => (Some(known.licence.clone()), LicenceSource::Graspmill),
        (None, None, None) => (None, LicenceSource::Nobody),
    };
    let attribution = (stated.as_ref().and_then(|terms| terms.attribution.clone()))
        .or_else(|| word("citation"))
        .or_else(|| known.map(|known| known.attribution.clone()));
    let source = (stated.as_ref().and_then(|terms| terms.source.clone()))
        .or_else(|| known.map(|known| format!("graspmill, {}", known.scene)))
        .unwrap_or_else(|| sources.of_asset(kind, row));
    let used = match kind {
        AssetKind::Object => product.objects,
        AssetKind::Hand | AssetKind::Robot => product.descriptions,
        // Every record of a scene has its triangles.
        AssetKind::Container => AssetUse::Copied,
    };
    let (may_be_shipped, because) = match &licence {
        None => (Allowed::Nothing, Some("its licence is not known".to_owned())),
        Some(_) if used == AssetUse::Measured => (Allowed::Derived, None),
        Some(licence) => {
            let said = stated.as_ref().map_or([None; 2], |terms| [terms.redistribute, terms.derived]);
            allowed(licence, said, &about.licence)
        }
    };
    Asset {
        name: row.name.clone(),
        kind,
        content: row.object,
        file_blake3: word("file"),
        source,
        licence,
        licence_source,
        attribution,
        used,
        may_be_shipped,
        because,
    }
}

/// Part of an asset that its licence lets a release hold, and why not all; `said` are the words of the authors on copies and
/// on derived data.
fn allowed(licence: &str, [copies, derived]: [Option<bool>; 2], of_release: &str) -> (Allowed, Option<String>) {
    let commercial = rights::is_commercial(of_release);
    let of = |derived| rights::allows(licence, Need { derived, commercial });
    // `None`: it may.
    let forbidden = |derived: bool, said: Option<bool>, key: &str| match (said, of(derived)) {
        (Some(true), _) | (None, Some(true)) => None,
        (Some(false), _) => Some(format!("the about file forbids it (`{key} = false`)")),
        (None, None) => {
            Some(format!("{licence} is no licence whose terms are known; say `{key} = true` or `false` with it"))
        }
        (None, Some(false)) => {
            let unsold = commercial && rights::allows(licence, Need { derived, commercial: false }) == Some(true);
            Some(match unsold {
                true => format!("{licence} forbids commercial use, the release's licence {of_release} allows it"),
                false => format!("{licence} forbids it"),
            })
        }
    };
    match (forbidden(true, derived, "derived"), forbidden(false, copies, "redistribute")) {
        (Some(why), _) => (Allowed::Nothing, Some(format!("data made of its shape: {why}"))),
        (None, Some(why)) => (Allowed::Derived, Some(format!("copies of its shape: {why}"))),
        (None, None) => (Allowed::Everything, None),
    }
}

/// Where objects are from, as the resolved job says.
struct Sources(BTreeMap<String, String>);

impl Sources {
    fn of(job: &toml::Table) -> Self {
        let mut sources = BTreeMap::new();
        for entry in job.get("objects").and_then(toml::Value::as_array).into_iter().flatten() {
            let meshes = entry.get("meshes").and_then(toml::Value::as_table);
            for (file, mesh) in meshes.into_iter().flatten() {
                let Some(content) = mesh.get("object").and_then(toml::Value::as_str) else { continue };
                let name = file.rsplit('/').next().unwrap_or(file);
                let source = match entry.get("package").and_then(toml::Value::as_str) {
                    Some(package) => format!("package {package}, {file}"),
                    None if entry.get("built_in").is_some() => format!("graspmill, built-in shape {file}"),
                    None => format!("file {name}"),
                };
                sources.insert(content.to_owned(), source);
            }
        }
        Self(sources)
    }

    fn of_asset(&self, kind: AssetKind, row: &AssetRow) -> String {
        let of_job = self.0.get(&row.object.0.hex()).cloned();
        of_job.unwrap_or_else(|| match (kind, row.facts.get("file")) {
            (AssetKind::Object, Some(Value::Null)) => format!("graspmill, built-in shape {}", row.name),
            (AssetKind::Object | AssetKind::Container, _) => "a mesh file".to_owned(),
            _ => "a description (MJCF or URDF)".to_owned(),
        })
    }
}

/// Files that a release must leave out: whole ones, by their paths, or all that show an asset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LeftOut {
    /// None.
    Nothing,
    /// Copies of shapes.
    Copies,
    /// Everything that holds data of the samples.
    Samples,
}

impl LeftOut {
    /// The files that a release of these assets leaves out.
    pub fn of(assets: &[Asset]) -> Self {
        // Copies of a container stand in the samples themselves.
        let hidden = |asset: &Asset| match asset.kind {
            AssetKind::Container => !asset.is_free(),
            AssetKind::Object | AssetKind::Hand | AssetKind::Robot => asset.may_be_shipped == Allowed::Nothing,
        };
        if assets.iter().any(hidden) {
            Self::Samples
        } else if assets.iter().all(Asset::is_free) {
            Self::Nothing
        } else {
            Self::Copies
        }
    }

    /// Whether a file of a dataset's folder is left out.
    pub fn holds(self, path: &str, product: &ProductAssets) -> bool {
        let copies = path == layout::PREVIEW || product.shape_files.contains(&path);
        let data = product.data_files.contains(&path) || Path::new(path).starts_with(layout::SHARDS);
        match self {
            Self::Nothing => false,
            Self::Copies => copies,
            Self::Samples => copies || data,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn licences_decide_what_may_be_shipped() {
        let free = "CC-BY-4.0";
        let own = "CC-BY-NC-4.0";
        for (licence, said, release, expected, words) in [
            ("CC-BY-4.0", [None, None], free, Allowed::Everything, ""),
            ("CC-BY-NC-4.0", [None, None], free, Allowed::Nothing, "forbids commercial use"),
            ("CC-BY-NC-4.0", [None, None], own, Allowed::Everything, ""),
            ("CC-BY-ND-4.0", [None, None], free, Allowed::Nothing, "CC-BY-ND-4.0 forbids it"),
            ("CC-BY-ND-4.0", [None, Some(true)], free, Allowed::Everything, ""),
            ("proprietary", [None, None], free, Allowed::Nothing, "`derived = true`"),
            ("proprietary", [None, Some(true)], free, Allowed::Derived, "`redistribute = true`"),
            ("proprietary", [Some(false), Some(true)], free, Allowed::Derived, "forbids it"),
            ("proprietary", [Some(true), Some(true)], free, Allowed::Everything, ""),
            (
                "CC-BY-4.0",
                [Some(false), None],
                free,
                Allowed::Derived,
                "copies of its shape: the about file forbids it",
            ),
        ] {
            let (found, because) = allowed(licence, said, release);
            assert_eq!(found, expected, "{licence} {said:?} in {release}: {because:?}");
            assert!(because.unwrap_or_default().contains(words), "{licence}: {words}");
        }
    }
}
