//! How to cite a release: `CITATION.cff` and a BibTeX entry.

use std::fmt::Write as _;

use super::{Release, rights};

/// `CITATION.cff`, version 1.2.0 of the format. JSON strings are YAML strings.
pub(super) fn cff(release: &Release) -> String {
    let about = release.about;
    let mut text = String::from("cff-version: 1.2.0\ntype: dataset\n");
    let mut line = |key: &str, value: &str| _ = writeln!(text, "{key}: {}", quoted(value));
    line("message", "If you use this dataset, please cite it, and the assets that LICENCES.md asks to be cited.");
    line("title", &about.title);
    line("version", &about.version);
    line("date-released", &about.date);
    line("abstract", about.description.trim());
    if let Some(url) = &about.url {
        line("url", url);
    }
    if let Some(doi) = &about.doi {
        line("doi", doi);
    }
    let licences = rights::names(&about.licence);
    if let ([licence], true) = (licences.as_slice(), rights::is_choice(&about.licence)) {
        line("license", licence);
    } else if rights::is_choice(&about.licence) {
        text.push_str("license:\n");
        licences.iter().for_each(|licence| _ = writeln!(text, "  - {}", quoted(licence)));
    }
    if !about.keywords.is_empty() {
        text.push_str("keywords:\n");
        about.keywords.iter().for_each(|word| _ = writeln!(text, "  - {}", quoted(word)));
    }
    text.push_str("authors:\n");
    for author in &about.authors {
        match author.person() {
            Some((family, given)) => {
                let _ = writeln!(text, "  - family-names: {}\n    given-names: {}", quoted(family), quoted(given));
            }
            None => _ = writeln!(text, "  - name: {}", quoted(&author.name)),
        }
        if let Some(orcid) = &author.orcid {
            let _ = writeln!(text, "    orcid: {}", quoted(&format!("https://orcid.org/{orcid}")));
        }
        if let Some(affiliation) = &author.affiliation {
            let _ = writeln!(text, "    affiliation: {}", quoted(affiliation));
        }
    }
    let root = quoted(&format!("graspmill-root:{}", release.manifest.root));
    let _ = writeln!(
        text,
        "identifiers:\n  - type: other\n    value: {root}\n    description: \"Root digest of the data\""
    );
    text
}

/// A BibTeX entry.
pub(super) fn bibtex(release: &Release) -> String {
    let about = release.about;
    let year = &about.date[..4];
    let key: String = about.title.chars().filter(char::is_ascii_alphanumeric).take(24).collect();
    let authors: Vec<String> = (about.authors.iter())
        .map(|author| match author.person() {
            Some(_) => plain(&author.name),
            None => format!("{{{}}}", plain(&author.name)),
        })
        .collect();
    let mut text = format!("@misc{{{key}{year},\n");
    let mut field = |name: &str, value: &str| _ = writeln!(text, "  {name} = {{{value}}},");
    field("title", &plain(&about.title));
    field("author", &authors.join(" and "));
    field("year", year);
    field("version", &plain(&about.version));
    if let Some(doi) = &about.doi {
        field("doi", doi);
    }
    if let Some(url) = &about.url {
        field("url", url);
    }
    field("note", &format!("Dataset, root digest {}", release.manifest.root));
    text.push('}');
    text
}

/// Text without what BibTeX gives a meaning to.
fn plain(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '{' | '}' | '\\' => {}
            '&' | '%' | '$' | '#' | '_' => out.extend(['\\', character]),
            other => out.push(other),
        }
    }
    out
}

/// A string as JSON and YAML write it.
pub(super) fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
