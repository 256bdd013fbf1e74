//! Facts that only the authors of a release know: its about file (TOML), as strict as a job file.

use std::{cmp::Reverse, collections::BTreeMap, path::Path};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::rights;
use form::{Checker, FormErrors, decode, did_you_mean, fits_name, schema_of};

/// An about file: facts about a release that cannot be measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct About {
    /// Title of the release.
    #[schemars(length(min = 1), extend("examples" = ["YCB completion, small"]))]
    pub title: String,
    /// Version of the release; any change of its data requires a new version.
    #[schemars(length(min = 1), extend("examples" = ["1.0.0"]))]
    pub version: String,
    /// Day of the release, `YYYY-MM-DD`. The clock is never used.
    #[schemars(extend("examples" = ["2026-11-22"]))]
    pub date: String,
    /// Content and purpose of the dataset, in a few sentences.
    #[schemars(length(min = 1))]
    pub description: String,
    /// Licence of the release, an SPDX expression.
    #[schemars(extend("examples" = ["CC-BY-4.0"]))]
    pub licence: String,
    /// The authors.
    #[schemars(length(min = 1))]
    pub authors: Vec<Author>,
    /// URLs of the release.
    #[schemars(extend("examples" = ["https://example.org/data"]))]
    pub url: Option<String>,
    /// DOI, without a resolver.
    #[schemars(extend("examples" = ["10.1234/abcd"]))]
    pub doi: Option<String>,
    /// Keywords.
    #[serde(default)]
    pub keywords: Vec<String>,
    /// Funding.
    pub funding: Option<String>,
    /// Contact.
    pub contact: Option<String>,
    /// Maintainers of the dataset, how errors are reported and corrected, how long it stays available.
    pub maintenance: Option<String>,
    /// Intended uses.
    #[serde(default)]
    pub intended_uses: Vec<String>,
    /// Uses for which it is not suitable.
    #[serde(default)]
    pub out_of_scope_uses: Vec<String>,
    /// Licences of objects, hands, containers and robots, by name or by pattern (`*` any part, `?` one letter). A pattern applies
    /// only if the dataset knows no licence, or the same one. A name replaces the licence that the dataset knows, and the release
    /// shows both. A name takes precedence over a pattern, and a longer pattern over a shorter one.
    #[serde(default)]
    pub licences: BTreeMap<String, LicenceStatement>,
}

/// An author.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Author {
    /// `Family, Given` for a person; without a comma, the name of an organisation.
    #[schemars(length(min = 1), extend("examples" = ["Lovelace, Ada"]))]
    pub name: String,
    /// ORCID of a person, sixteen digits in four groups.
    #[schemars(extend("examples" = ["0000-0002-1825-0097"]))]
    pub orcid: Option<String>,
    /// Affiliation of a person.
    pub affiliation: Option<String>,
}

impl Author {
    /// Family and given name of a person; `None` for an organisation.
    pub fn person(&self) -> Option<(&str, &str)> {
        self.name.split_once(',').map(|(family, given)| (family.trim(), given.trim()))
    }

    /// The name in natural order.
    pub fn spoken(&self) -> String {
        self.person().map_or_else(|| self.name.clone(), |(family, given)| format!("{given} {family}"))
    }

    /// Checks the keys of the author at `path`.
    fn check(&self, checker: &mut Checker, path: &form::Path) {
        if self.name.trim().is_empty() || self.person().is_some_and(|(a, b)| a.is_empty() || b.is_empty()) {
            checker.invalid(path.key("name"), "`Family, Given`, or an organisation", quoted(&self.name));
        }
        if let Some(orcid) = self.orcid.as_ref().filter(|orcid| !is_orcid(orcid)) {
            let report = checker.invalid(path.key("orcid"), "an ORCID as 0000-0002-1825-0097", quoted(orcid));
            report.help("sixteen digits in four groups, the last one a check digit");
        }
        let is_organisation = self.person().is_none() && !checker.is_wrong(path.key("name"));
        if let Some(affiliation) = self.affiliation.as_ref().filter(|_| is_organisation) {
            let report = checker.invalid(path.key("affiliation"), "no ORCID for an organisation", quoted(affiliation));
            report.help("write a person's name as `Family, Given`");
        }
    }
}

/// Statement of the authors about an asset's licence: only its name, or more.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum LicenceStatement {
    /// The licence.
    Name(String),
    /// The licence and what goes with it.
    Terms(LicenceTerms),
}

/// A licence with source, credit and permissions.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LicenceTerms {
    /// SPDX expression, or the licence's name.
    #[schemars(length(min = 1))]
    pub licence: String,
    /// Source of the asset.
    pub source: Option<String>,
    /// Attribution and citation.
    pub attribution: Option<String>,
    /// Whether copies of its shape may be shared. By default, the licence decides.
    pub redistribute: Option<bool>,
    /// Whether data made from its shape (grids, depth, images) may be shared. By default, the licence decides.
    pub derived: Option<bool>,
}

impl LicenceStatement {
    /// The statement with every part.
    pub fn terms(&self) -> LicenceTerms {
        match self {
            Self::Name(licence) => LicenceTerms {
                licence: licence.clone(),
                source: None,
                attribution: None,
                redistribute: None,
                derived: None,
            },
            Self::Terms(terms) => terms.clone(),
        }
    }
}

/// The statement of an about file about one asset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Statement<'a> {
    /// The key: a name, or a pattern of names.
    pub pattern: &'a str,
    /// The statement with every part.
    pub terms: LicenceTerms,
}

impl Statement<'_> {
    /// Whether the key is the asset's name instead of a pattern.
    pub fn is_name(&self) -> bool {
        let mut letters = self.pattern.chars();
        while let Some(letter) = letters.next() {
            match letter {
                '*' | '?' => return false,
                // The next character is literal.
                '\\' => _ = letters.next(),
                _ => {}
            }
        }
        true
    }
}

/// Number of literal letters of a pattern.
fn count_letters(pattern: &str) -> usize {
    pattern.chars().filter(|letter| !['*', '?', '\\'].contains(letter)).count()
}

impl About {
    /// Reads an about file; `path` is for messages, `assets` are the names of the dataset's objects, hands and robots.
    ///
    /// # Errors
    /// Every mistake at once, each with its location and remedy.
    pub fn read(path: &Path, text: &str, assets: &[&str]) -> Result<Self, FormErrors> {
        let schema = schema_of::<Self>("about file of a graspmill release");
        let (about, mut checker) = decode::<Self>(&path.display().to_string(), text, &[], &schema, &())?;
        about.check_release(&mut checker);
        for (index, author) in about.authors.iter().enumerate() {
            author.check(&mut checker, &form::Path::from("authors").index(index));
        }
        about.check_licences(&mut checker, assets);
        checker.finish().map(|_| about)
    }

    /// Checks the keys at the top level.
    fn check_release(&self, checker: &mut Checker) {
        for (key, value) in [("title", &self.title), ("version", &self.version), ("description", &self.description)] {
            if value.trim().is_empty() {
                checker.invalid(key, "some text", quoted(value));
            }
        }
        if self.title.contains('\n') {
            checker.invalid("title", "one line", quoted(&self.title));
        }
        if !is_date(&self.date) {
            checker.invalid("date", "a day as YYYY-MM-DD", quoted(&self.date));
        }
        if !rights::is_spdx(&self.licence) {
            let report = checker.invalid("licence", "an SPDX expression", quoted(&self.licence));
            report.help("https://spdx.org/licenses lists them; CC-BY-4.0 is common for data");
        }
        if let Some(url) = self.url.as_ref().filter(|url| !url.starts_with("https://") && !url.starts_with("http://")) {
            checker.invalid("url", "a URL that starts with https://", quoted(url));
        }
        if let Some(doi) = self.doi.as_ref().filter(|doi| !(doi.starts_with("10.") && doi.contains('/'))) {
            checker.invalid("doi", "a DOI as 10.1234/abcd", quoted(doi));
        }
    }

    /// Checks that each licence has a name and matches an asset; reports the first pattern that matches none.
    fn check_licences(&self, checker: &mut Checker, assets: &[&str]) {
        for (pattern, statement) in &self.licences {
            let path = form::Path::from("licences").key(pattern);
            if statement.terms().licence.trim().is_empty() {
                checker.invalid(&path, "the name of a licence", quoted(""));
            }
            if !assets.iter().any(|name| fits_name(pattern, name)) {
                let detail = format!("`{pattern}` matches none of {}", some_of(assets));
                let help = did_you_mean(pattern, assets.iter().copied());
                checker.not_found(&path, "asset", detail).help_if(help);
                break;
            }
        }
    }

    /// The statement about the asset of this name: that of the name, else that of the pattern with the most letters, and of equal
    /// patterns the first.
    pub(super) fn statement_of(&self, name: &str) -> Option<Statement<'_>> {
        let fitting = self.licences.iter().filter(|(pattern, _)| fits_name(pattern, name));
        let statements = fitting.map(|(pattern, stated)| Statement { pattern, terms: stated.terms() });
        statements.min_by_key(|statement| Reverse((statement.is_name(), count_letters(statement.pattern))))
    }

    /// All authors, with names in natural order.
    pub fn spoken_authors(&self) -> String {
        self.authors.iter().map(Author::spoken).collect::<Vec<_>>().join(", ")
    }
}

fn quoted(text: &str) -> String {
    format!("\"{text}\"")
}

/// The first few names, and the number of further ones.
pub(super) fn some_of(names: &[&str]) -> String {
    const SHOWN: usize = 8;
    let shown = names[..names.len().min(SHOWN)].join(", ");
    match names.len().checked_sub(SHOWN) {
        Some(more) if more > 0 => format!("{shown} and {more} more"),
        _ => shown,
    }
}

/// Whether a text is a day of the Gregorian calendar.
fn is_date(text: &str) -> bool {
    let shape = text.len() == 10
        && text.bytes().enumerate().all(|(index, byte)| match index {
            4 | 7 => byte == b'-',
            _ => byte.is_ascii_digit(),
        });
    if !shape {
        return false;
    }
    let number = |range: std::ops::Range<usize>| text[range].parse::<u32>().unwrap_or(0);
    let (year, month, day) = (number(0..4), number(5..7), number(8..10));
    let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let days = match month {
        2 => 28 + u32::from(leap),
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => 0,
    };
    (1..=days).contains(&day)
}

/// Whether a text is an ORCID: four groups of four digits, the last one the check digit of ISO 7064, MOD 11-2.
fn is_orcid(text: &str) -> bool {
    let groups: Vec<&str> = text.split('-').collect();
    if groups.len() != 4 || groups.iter().any(|group| group.len() != 4) {
        return false;
    }
    let Some((last, digits)) = text
        .bytes()
        .filter(|byte| *byte != b'-')
        .collect::<Vec<u8>>()
        .split_last()
        .map(|(last, digits)| (*last, digits.to_vec()))
    else {
        return false;
    };
    if !digits.iter().all(u8::is_ascii_digit) {
        return false;
    }
    let sum = digits.iter().fold(0, |sum, digit| (sum + u32::from(digit - b'0')) * 2 % 11);
    let check = (12 - sum) % 11;
    last == if check == 10 { b'X' } else { b'0' + check as u8 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"
title = "Mugs"
version = "1.0.0"
date = "2026-11-22"
description = "Some mugs."
licence = "CC-BY-4.0"
keywords = ["mugs"]

[[authors]]
name = "Lovelace, Ada"
orcid = "0000-0002-1825-0097"
affiliation = "Analytical Engines"

[[authors]]
name = "The Makers"

[licences]
"mug-*" = "CC0-1.0"
bowl = { licence = "proprietary", redistribute = false, derived = true }
"#;

    fn read(text: &str) -> Result<About, FormErrors> {
        About::read(Path::new("about.toml"), text, &["bowl", "mug-01", "mug-02"])
    }

    #[test]
    fn a_good_file_is_read() {
        let about = read(GOOD).expect("no mistakes");
        assert_eq!(about.spoken_authors(), "Ada Lovelace, The Makers");
        let terms_of = |name| about.statement_of(name).map(|statement| statement.terms);
        assert_eq!(terms_of("mug-02").map(|terms| terms.licence).as_deref(), Some("CC0-1.0"));
        assert_eq!(terms_of("bowl").and_then(|terms| terms.derived), Some(true));
        assert_eq!(terms_of("cup"), None);
    }

    #[test]
    fn names_count_before_patterns_and_long_patterns_before_short_ones() {
        let patterns =
            ["\"*\" = \"MIT\"", "\"mug-*\" = \"ISC\"", "mug-01 = \"Zlib\"", "\"*-02\" = \"0BSD\""].join("\n");
        let (head, _) = GOOD.split_once("[licences]").expect("the section");
        let about = read(&format!("{head}[licences]\n{patterns}\n")).expect("no mistakes");
        let found = ["bowl", "mug-01", "mug-02"].map(|name| {
            let statement = about.statement_of(name).expect("a statement");
            (statement.terms.licence.clone(), statement.is_name())
        });
        let expected = [("MIT", false), ("Zlib", true), ("ISC", false)];
        assert_eq!(found, expected.map(|(licence, is_name)| (licence.to_owned(), is_name)));
        let statement = |pattern| Statement { pattern, terms: LicenceStatement::Name("MIT".to_owned()).terms() };
        assert!(statement("a\\*").is_name() && !statement("a?").is_name());
    }

    #[test]
    fn every_mistake_is_told_at_its_place() {
        for (from, to, line, words) in [
            ("keywords", "keyword", 7, "did you mean `keywords`?"),
            ("2026-11-22", "2026-02-29", 4, "YYYY-MM-DD"),
            ("licence = \"CC-BY-4.0\"", "licence = \"free\"", 6, "SPDX"),
            ("0097", "0098", 11, "ORCID"),
            ("\"mug-*\"", "\"mugs-*\"", 18, "matches none of bowl, mug-01, mug-02"),
            ("\"mug-*\" = \"CC0-1.0\"", "\"mug-*\" = 3", 18, "expected a string, or a table"),
            ("redistribute", "redistributes", 19, "redistribute"),
            ("name = \"The Makers\"", "name = \"The Makers\"\naffiliation = \"here\"", 16, "Family, Given"),
        ] {
            let text = GOOD.replace(from, to);
            assert_ne!(text, GOOD);
            let errors = read(&text).expect_err(to);
            let rendered = errors.render();
            assert!(rendered.contains(words), "{rendered}");
            assert_eq!(errors.list()[0].location.line, line, "{rendered}");
        }
        let errors = read(&GOOD.replace("title = \"Mugs\"\n", "")).expect_err("a missing key");
        assert!(errors.to_string().contains("title"), "{errors}");
    }

    #[test]
    fn days_and_check_digits() {
        for (day, good) in [
            ("2024-02-29", true),
            ("2100-02-29", false),
            ("2026-04-31", false),
            ("2026-13-01", false),
            ("2026-1-01", false),
            ("2026/01/01", false),
        ] {
            assert_eq!(is_date(day), good, "{day}");
        }
        // The two examples of ORCID's own documentation, and one digit off.
        for (orcid, good) in
            [("0000-0002-1825-0097", true), ("0000-0002-1694-233X", true), ("0000-0002-1825-0079", false), ("", false)]
        {
            assert_eq!(is_orcid(orcid), good, "{orcid}");
        }
    }
}
