//! `licences.json` and the rows of `LICENCES.md`: assets of the dataset, their licences, and the parts that may be shared.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::{Value, json};

use super::{
    assets::{Allowed, Asset, Known, LicenceSource},
    material::Release,
    rights,
};
use crate::asset::AssetUse;

/// JSON with one row per asset.
pub(super) fn json(release: &Release) -> Value {
    json!({
        "root": release.manifest.root,
        "licence": release.about.licence,
        "assets": release.assets,
    })
}

/// The row of an asset.
#[derive(Serialize)]
pub(super) struct LicenceRow {
    name: String,
    kind: &'static str,
    source: String,
    licence: String,
    licence_source: &'static str,
    /// Known licence that the authors replace, with its source.
    replaces: Option<String>,
    r#use: &'static str,
    /// Part of it that may be shipped.
    may: &'static str,
    /// Reason if not all of it may be shipped.
    because: Option<String>,
}

impl LicenceRow {
    pub fn of(asset: &Asset) -> Self {
        Self {
            name: asset.name.clone(),
            kind: asset.kind.name(),
            source: asset.source.clone(),
            licence: asset.licence.clone().unwrap_or_else(|| "not known".to_owned()),
            licence_source: source_name(asset.licence_source),
            replaces: asset.replaces.as_ref().map(replaced_in_words),
            r#use: in_words(asset.used),
            may: may(asset),
            because: asset.because.clone(),
        }
    }
}

/// Text about a known licence.
pub(super) fn replaced_in_words(known: &Known) -> String {
    format!("{} ({})", known.licence, source_name(known.licence_source))
}

/// Text about the source of a licence.
pub(super) fn source_name(source: LicenceSource) -> &'static str {
    match source {
        LicenceSource::Dataset => "the dataset",
        LicenceSource::About => "the authors",
        LicenceSource::Graspmill => "graspmill",
        LicenceSource::Nobody => "nobody",
    }
}

fn in_words(used: AssetUse) -> &'static str {
    match used {
        AssetUse::Copied => "shape and data",
        AssetUse::Derived => "data",
        AssetUse::Measured => "facts",
    }
}

fn may(asset: &Asset) -> &'static str {
    match (asset.may_be_shipped, asset.used) {
        (Allowed::Nothing, _) => "nothing",
        (Allowed::Derived, AssetUse::Copied) => "data, not its shape",
        _ => "all of it",
    }
}

/// An attribution with the names of its assets.
#[derive(Serialize)]
pub(super) struct AttributionView {
    words: String,
    names: String,
}

/// Each attribution once, with the names of its assets.
pub(super) fn attributions(assets: &[Asset]) -> Vec<AttributionView> {
    let mut named: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for asset in assets {
        if let Some(words) = asset.attribution.as_deref().filter(|words| !words.is_empty()) {
            named.entry(words).or_default().push(&asset.name);
        }
    }
    let view = |(words, names): (&str, Vec<&str>)| AttributionView {
        words: words.to_owned(),
        names: super::about::some_of(&names),
    };
    named.into_iter().map(view).collect()
}

/// A licence with its number of assets.
#[derive(Serialize)]
pub(super) struct CountView {
    licence: String,
    count: usize,
}

/// Each licence once, with its number of assets.
pub(super) fn counts(assets: &[Asset]) -> Vec<CountView> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for asset in assets {
        *counts.entry(asset.licence.as_deref().unwrap_or("not known")).or_default() += 1;
    }
    counts.into_iter().map(|(licence, count)| CountView { licence: licence.to_owned(), count }).collect()
}

/// A licence with conditions beyond attribution.
#[derive(Serialize)]
pub(super) struct NoteView {
    name: String,
    licence: String,
    /// Whether it requires the same licence for derived data; otherwise it is not known to allow commercial use.
    shares_alike: bool,
}

/// Licences with conditions beyond attribution.
pub(super) fn notes(release: &Release) -> Vec<NoteView> {
    let mut notes = Vec::new();
    for asset in release.assets {
        let Some(licence) = asset.licence.as_deref() else { continue };
        let note = |shares_alike| NoteView { name: asset.name.clone(), licence: licence.to_owned(), shares_alike };
        if asset.used == AssetUse::Measured && !rights::is_commercial(licence) {
            notes.push(note(false));
        }
        if asset.used != AssetUse::Measured && rights::shares_alike(licence) && licence != release.about.licence {
            notes.push(note(true));
        }
    }
    notes
}
