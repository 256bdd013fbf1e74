//! Assets of a dataset, and the parts of them that a release may contain: one row per object, hand, container or robot.

use std::{collections::BTreeMap, path::Path, sync::LazyLock};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{
    About, LicenceTerms,
    about::Statement,
    rights::{self, Need},
};
use crate::{
    asset::{AssetKind, AssetUse},
    product::ProductAssets,
    products::pages_of,
};
use format::dataset::{AssetRow, DatasetError, DatasetReader, layout};
use kernel::ids::ObjectId;

/// Part of an asset that a release may contain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Allowed {
    /// Nothing that shows the asset.
    Nothing,
    /// Data made from it, but no copy of its shape.
    Derived,
    /// Everything.
    Everything,
}

/// Source of a licence's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum LicenceSource {
    /// The dataset's asset table.
    Dataset,
    /// The about file.
    About,
    /// `scenes/licences.toml` of this program, by content.
    Graspmill,
    /// No source: the licence is not known.
    Nobody,
}

/// Known licence of an asset without the about file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(super) struct Known {
    /// The licence.
    pub licence: String,
    /// Source of that licence.
    pub licence_source: LicenceSource,
    /// Whom to name, and how to cite it.
    pub attribution: Option<String>,
}

impl Known {
    /// Licence from the asset table, else from this program; `None` if neither knows one.
    fn of(kind: AssetKind, row: &AssetRow) -> Option<Self> {
        let word = |key: &str| row.facts.get(key).and_then(Value::as_str).map(str::to_owned);
        if let Some(licence) = word("licence") {
            return Some(Self { licence, licence_source: LicenceSource::Dataset, attribution: word("citation") });
        }
        let described = described(kind, row)?;
        let attribution = Some(described.attribution.clone());
        Some(Self { licence: described.licence.clone(), licence_source: LicenceSource::Graspmill, attribution })
    }
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
    /// BLAKE3 of the source file, for meshes read from a file.
    pub file_blake3: Option<String>,
    /// Source of the asset.
    pub source: String,
    /// Licence, if known.
    pub licence: Option<String>,
    /// Source of that name.
    pub licence_source: LicenceSource,
    /// Whom to name, and how to cite it.
    pub attribution: Option<String>,
    /// Known licence that the about file replaces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replaces: Option<Known>,
    /// Pattern of the about file that states a different licence but does not replace the known one.
    #[serde(skip)]
    pub passed_over: Option<String>,
    /// Part of it that the dataset contains.
    #[serde(rename = "use")]
    pub used: AssetUse,
    /// Part of it that this release may contain.
    pub may_be_shipped: Allowed,
    /// Reason if not all of it may be shipped.
    pub because: Option<String>,
}

impl Asset {
    /// Whether everything that the dataset contains of it may be shipped.
    pub fn is_free(&self) -> bool {
        match self.used {
            AssetUse::Copied => self.may_be_shipped == Allowed::Everything,
            AssetUse::Derived | AssetUse::Measured => self.may_be_shipped >= Allowed::Derived,
        }
    }

    /// Reason why not all of it may be shipped.
    pub fn because(&self) -> &str {
        self.because.as_deref().unwrap_or("its licence forbids it")
    }
}

/// A robot, hand or container that is part of this program.
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

/// The assets with their licences, sorted by kind and name; `job` is the dataset's.
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

/// A description or container that is part of this program, identified by content.
fn described(kind: AssetKind, row: &AssetRow) -> Option<&'static Described> {
    DESCRIBED.get(&row.object).filter(|_| kind != AssetKind::Object)
}

/// Attribution: a known credit stays, a statement by name adds to it, and a statement by pattern applies only without a known
/// credit.
fn attribution(row: &AssetRow, known: Option<&Known>, terms: Option<&LicenceTerms>, is_name: bool) -> Option<String> {
    let citation = row.facts.get("citation").and_then(Value::as_str);
    let credit = known.map_or(citation, |known| known.attribution.as_deref());
    let stated = terms.and_then(|terms| terms.attribution.as_deref());
    match (credit, stated) {
        (Some(credit), Some(stated)) if is_name && !credit.is_empty() && credit != stated => {
            Some(format!("{credit}; {stated}"))
        }
        (Some(credit), Some(stated)) if is_name && credit.is_empty() => Some(stated.to_owned()),
        (Some(credit), _) => Some(credit.to_owned()),
        (None, stated) => stated.map(str::to_owned),
    }
}

fn asset(product: &ProductAssets, kind: AssetKind, row: &AssetRow, sources: &Sources, about: &About) -> Asset {
    let word = |key: &str| row.facts.get(key).and_then(Value::as_str).map(str::to_owned);
    let (known, statement) = (Known::of(kind, row), about.statement_of(&row.name));
    let contradicts = match (&known, &statement) {
        (Some(known), Some(statement)) => known.licence != statement.terms.licence,
        _ => false,
    };
    // A pattern does not apply to an asset with a different known licence.
    let (statement, passed_over) = match statement {
        Some(statement) if contradicts && !statement.is_name() => (None, Some(statement.pattern.to_owned())),
        statement => (statement, None),
    };
    let is_name = statement.as_ref().is_some_and(Statement::is_name);
    let terms = statement.map(|statement| statement.terms);
    let attribution = attribution(row, known.as_ref(), terms.as_ref(), is_name);
    // The known licence applies unless the about file replaces it by name.
    let (known, replaces) = if contradicts && terms.is_some() { (None, known) } else { (known, None) };
    let (licence, licence_source) = match (&known, &terms) {
        (Some(known), _) => (Some(known.licence.clone()), known.licence_source),
        (None, Some(terms)) => (Some(terms.licence.clone()), LicenceSource::About),
        (None, None) => (None, LicenceSource::Nobody),
    };
    let known_origin = described(kind, row).map(|described| format!("graspmill, {}", described.scene));
    let source = (terms.as_ref().filter(|_| is_name || licence_source == LicenceSource::About))
        .and_then(|terms| terms.source.clone())
        .or(known_origin)
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
            let said = terms.as_ref().map_or([None; 2], |terms| [terms.redistribute, terms.derived]);
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
        replaces,
        passed_over,
        used,
        may_be_shipped,
        because,
    }
}

/// Part of an asset that its licence allows in a release, and the reason if not all; `said` is the authors' statement about
/// copies and derived data.
fn allowed(licence: &str, [copies, derived]: [Option<bool>; 2], of_release: &str) -> (Allowed, Option<String>) {
    let commercial = rights::is_commercial(of_release);
    let of = |derived| rights::allows(licence, Need { derived, commercial });
    // `None` if it is allowed.
    let forbidden = |derived: bool, said: Option<bool>, key: &str| match (said, of(derived)) {
        (Some(true), _) | (None, Some(true)) => None,
        (Some(false), _) => Some(format!("the about file forbids it (`{key} = false`)")),
        (None, None) => Some(format!("the terms of {licence} are not known; state `{key} = true` or `false` with it")),
        (None, Some(false)) => {
            let unsold = commercial && rights::allows(licence, Need { derived, commercial: false }) == Some(true);
            Some(match unsold {
                true => format!("{licence} forbids commercial use, but the release's licence {of_release} allows it"),
                false => format!("{licence} forbids it"),
            })
        }
    };
    match (forbidden(true, derived, "derived"), forbidden(false, copies, "redistribute")) {
        (Some(why), _) => (Allowed::Nothing, Some(format!("data made from its shape: {why}"))),
        (None, Some(why)) => (Allowed::Derived, Some(format!("copies of its shape: {why}"))),
        (None, None) => (Allowed::Everything, None),
    }
}

/// Sources of the objects, from the resolved job.
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

/// Files that a release must leave out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LeftOut {
    /// None.
    Nothing,
    /// Copies of shapes.
    Copies,
    /// Everything that contains data of the samples.
    Samples,
}

impl LeftOut {
    /// Files that a release of these assets leaves out.
    pub fn of(assets: &[Asset]) -> Self {
        // The samples contain copies of a container.
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
