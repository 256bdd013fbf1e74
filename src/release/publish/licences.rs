//! `licences.json` and `LICENCES.md`: what the dataset was made of, whose it is, and what of it may be given on.

use std::{collections::BTreeMap, fmt::Write as _};

use serde_json::{Value, json};

use super::{
    Release,
    assets::{Allowed, Asset, Use},
    rights,
};

/// For machines: one row an asset.
pub(super) fn json(release: &Release) -> Value {
    json!({
        "root": release.manifest.root,
        "licence": release.about.licence,
        "assets": release.assets,
    })
}

/// For people.
pub(super) fn markdown(release: &Release) -> String {
    let mut text = format!(
        "# Licences\n\n{} {} stands under **{}**. It was made of the assets below; `licences.json` says the same for \
         programs.\n\n",
        release.about.title, release.about.version, release.about.licence
    );
    text.push_str(
        "| asset | what | from | licence | told by | use | may be shipped |\n|---|---|---|---|---|---|---|\n",
    );
    for asset in release.assets {
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} |",
            cell(&asset.name),
            asset.kind.name(),
            cell(&asset.source),
            asset.licence.as_deref().map_or_else(|| "not known".to_owned(), cell),
            told(asset),
            in_words(asset.used),
            may(asset),
        );
    }
    text.push_str(
        "\nUse: *shape and data* means that the asset's shape stands in `shapes.mcap`; *data* that grids, depth or images were \
         made of it; *facts* that nothing shows its shape.\n",
    );
    let attributions = attributions(release.assets);
    if !attributions.is_empty() {
        text.push_str("\n## To be named\n\n");
        attributions.iter().for_each(|(words, names)| _ = writeln!(text, "- {words} ({names})"));
    }
    let notes = notes(release);
    if !notes.is_empty() {
        text.push_str("\n## To be minded\n\n");
        notes.iter().for_each(|note| _ = writeln!(text, "- {note}"));
    }
    text
}

fn told(asset: &Asset) -> &'static str {
    match asset.licence_told_by {
        super::assets::Told::Dataset => "the dataset",
        super::assets::Told::About => "the authors",
        super::assets::Told::Graspmill => "graspmill",
        super::assets::Told::Nobody => "nobody",
    }
}

fn in_words(used: Use) -> &'static str {
    match used {
        Use::Copied => "shape and data",
        Use::Derived => "data",
        Use::Measured => "facts",
    }
}

fn may(asset: &Asset) -> String {
    let what = match (asset.may_be_shipped, asset.used) {
        (Allowed::Nothing, _) => "nothing",
        (Allowed::Derived, Use::Copied) => "data, not its shape",
        _ => "all of it",
    };
    asset.because.as_ref().map_or_else(|| what.to_owned(), |because| format!("{what}: {}", cell(because)))
}

/// Each wording once, with the names of the assets that ask for it.
pub(super) fn attributions(assets: &[Asset]) -> Vec<(String, String)> {
    let mut named: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for asset in assets {
        if let Some(words) = asset.attribution.as_deref().filter(|words| !words.is_empty()) {
            named.entry(words).or_default().push(&asset.name);
        }
    }
    let row = |(words, names): (&str, Vec<&str>)| (words.to_owned(), super::about::some_of(&names));
    named.into_iter().map(row).collect()
}

/// Each licence once, with how many assets stand under it.
pub(super) fn counts(assets: &[Asset]) -> Vec<(String, usize)> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for asset in assets {
        *counts.entry(asset.licence.as_deref().unwrap_or("not known")).or_default() += 1;
    }
    counts.into_iter().map(|(licence, count)| (licence.to_owned(), count)).collect()
}

/// What a licence asks of whoever uses the release, beyond naming.
fn notes(release: &Release) -> Vec<String> {
    let mut notes = Vec::new();
    for asset in release.assets {
        let Some(licence) = asset.licence.as_deref() else { continue };
        if asset.used == Use::Measured && !rights::is_commercial(licence) {
            notes.push(format!(
                "{} stands under {licence}, which is not known to allow commercial use; nothing of its shape stands here.",
                asset.name
            ));
        }
        if asset.used != Use::Measured && rights::shares_alike(licence) && licence != release.about.licence {
            notes.push(format!(
                "{} stands under {licence}, which asks for the same licence of what is made of it; the release's is {}.",
                asset.name, release.about.licence
            ));
        }
    }
    notes
}

/// Text inside a table of Markdown; no name becomes a tag.
pub(super) fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('<', "&lt;").replace(['\n', '\r'], " ")
}
