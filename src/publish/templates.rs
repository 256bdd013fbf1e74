//! Templates of pages and documents, and how a value is escaped on its way into each kind of file.
//!
//! A template places values; numbers come to it as text. The end of a template's name says what it writes, and every value is
//! escaped for that: no filter lets text through as it is but `authored`, for Markdown of a release's own authors.

use std::sync::LazyLock;

use minijinja::{
    AutoEscape, Environment, Error, ErrorKind, Output, State, UndefinedBehavior, Value,
    syntax::SyntaxConfig,
    value::{Serde, ValueKind},
};
use serde::Serialize;

use super::{escape, products::PRODUCTS};

macro_rules! files {
    ($($name:literal),* $(,)?) => { [$(($name, include_str!(concat!("templates/", $name)))),*] };
}

/// Templates that all products share: their paths below `templates/`, and their texts.
const SHARED: [(&str, &str); 9] = files![
    "macros.html",
    "page.css",
    "page.html",
    "release/CITATION.cff",
    "release/DATASHEET.md",
    "release/LICENCES.md",
    "release/README.md",
    "release/citation.bib",
    "release/front_matter.yaml",
];

static ENVIRONMENT: LazyLock<Environment<'static>> = LazyLock::new(|| environment(templates()));

/// Every template: its name and its text.
fn templates() -> impl Iterator<Item = (&'static str, &'static str)> {
    SHARED.into_iter().chain(PRODUCTS.iter().flat_map(|pages| pages.templates.iter().copied()))
}

/// Fills a template.
///
/// # Panics
/// When the template names a value that is not there: templates are part of the program, and a test fills each branch of each.
pub(super) fn render(name: &str, view: &impl Serialize) -> String {
    fill(&ENVIRONMENT, name, view).unwrap_or_else(|error| panic!("the template {name}: {error}"))
}

fn fill(environment: &Environment, name: &str, view: &impl Serialize) -> Result<String, Error> {
    environment.get_template(name)?.render(Value::from(Serde(view)))
}

/// Markup that the program made, such as a chart: it enters a template as it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Markup(pub String);

impl Serialize for Markup {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Value::from_safe_string(self.0.clone()).serialize(serializer)
    }
}

fn environment(templates: impl IntoIterator<Item = (&'static str, &'static str)>) -> Environment<'static> {
    let mut environment = Environment::empty();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_auto_escape_callback(|name| {
        name.rsplit_once('.').map_or(AutoEscape::None, |(_, end)| AutoEscape::Custom(end.to_owned().into()))
    });
    environment.set_formatter(write);
    let safe = |escaped: fn(&str) -> String| move |text: &str| Value::from_safe_string(escaped(text));
    environment.add_filter("address", safe(escape::address));
    environment.add_filter("code", safe(escape::code));
    environment.add_filter("prose", safe(escape::prose));
    environment.add_filter("quoted", safe(escape::quoted));
    environment.add_filter("authored", safe(|text| text.trim().to_owned()));
    environment.add_filter("bar", safe(|text| text.trim().replace('\n', "\n> ")));
    let syntax = SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).keep_trailing_newline(true).build();
    environment.set_syntax(syntax.expect("the usual marks of a template"));
    for (name, text) in templates {
        environment.add_template(name, text).unwrap_or_else(|error| panic!("the template {name}: {error}"));
    }
    environment
}

/// Writes a value as the kind of file asks, which the end of the template's name says.
fn write(out: &mut Output, state: &mut State, value: &Value) -> Result<(), Error> {
    let text = match value.kind() {
        ValueKind::String => value.as_str().unwrap_or_default().to_owned(),
        ValueKind::Number if value.is_integer() => value.to_string(),
        kind => {
            return Err(Error::new(ErrorKind::InvalidOperation, format!("{kind} is neither text nor a whole number")));
        }
    };
    if value.is_safe() {
        return Ok(out.write_str(&text)?);
    }
    let AutoEscape::Custom(end) = state.auto_escape() else {
        return Err(Error::new(ErrorKind::InvalidOperation, "a template whose values are not escaped"));
    };
    let escaped = match &**end {
        "html" => escape::html(&text),
        "md" => escape::markdown(&text),
        "cff" | "yaml" => escape::quoted(&text),
        "bib" => escape::bibtex(&text),
        end => return Err(Error::new(ErrorKind::InvalidOperation, format!("nothing says how to escape for .{end}"))),
    };
    Ok(out.write_str(&escaped)?)
}

/// All templates with a mark at the beginning of each branch, and the marks.
#[cfg(test)]
pub(super) fn marked() -> (Environment<'static>, Vec<String>) {
    let mut marks = Vec::new();
    let marked = |(name, text): (&'static str, &str)| {
        let pieces = text.split_inclusive("%}").map(|piece| {
            let tag = piece.rsplit_once("{%").map_or("", |(_, tag)| tag).trim_start_matches('-').trim_start();
            if !["if ", "elif ", "else", "for "].iter().any(|word| tag.starts_with(word)) {
                return piece.to_owned();
            }
            marks.push(format!("\u{e000}{name} {}\u{e001}", marks.len()));
            format!("{piece}{}", marks[marks.len() - 1])
        });
        let text: &'static str = Box::leak(pieces.collect::<String>().into_boxed_str());
        (name, text)
    };
    let templates: Vec<(&str, &str)> = templates().map(marked).collect();
    (environment(templates), marks)
}

/// Fills a template of any environment.
#[cfg(test)]
pub(super) fn fill_of(environment: &Environment, name: &str, view: &Value) -> String {
    let filled = environment.get_template(name).and_then(|template| template.render(view.clone()));
    filled.unwrap_or_else(|error| panic!("the template {name}: {error}"))
}
