//! Templates of pages and documents, and the escaping of values for each kind of file.
//!
//! A template inserts values; numbers are passed as text. The extension of a template's name determines the file format, and
//! every value is escaped for it. Only the filter `authored` inserts text unescaped, for Markdown by a release's authors.

use std::sync::OnceLock;

use minijinja::{
    AutoEscape, Environment, Error, ErrorKind, Output, State, UndefinedBehavior, Value,
    syntax::SyntaxConfig,
    value::{Serde, ValueKind},
};
use serde::Serialize;

use super::escape;

/// A template: its name and its text.
pub(super) type Template = (&'static str, &'static str);

/// Templates that all pages share.
pub(super) const SHARED: [Template; 3] = [
    ("macros.html", include_str!("templates/macros.html")),
    ("page.css", include_str!("templates/page.css")),
    ("page.html", include_str!("templates/page.html")),
];

/// Templates of one kind of page or document, together with [`SHARED`].
pub(super) struct PageTemplates {
    /// Templates of this kind only; the page is the first.
    pub own: &'static [Template],
    environment: OnceLock<Environment<'static>>,
}

impl PageTemplates {
    /// Combines the shared templates with these.
    pub const fn new(own: &'static [Template]) -> Self {
        Self { own, environment: OnceLock::new() }
    }

    /// Fills the template of this name.
    ///
    /// # Panics
    /// When the template uses a missing value: templates are part of the program, and a test renders every branch.
    pub fn render(&self, name: &str, view: &impl Serialize) -> String {
        self.fill(name, page_values(view))
    }

    /// Fills the template of the page.
    ///
    /// # Panics
    /// When the template names a value that is not there.
    pub fn render_page(&self, values: &Value) -> String {
        self.fill(self.own[0].0, values.clone())
    }

    fn fill(&self, name: &str, values: Value) -> String {
        let environment = self.environment.get_or_init(|| environment(SHARED.iter().chain(self.own).copied()));
        let filled = environment.get_template(name).and_then(|template| template.render(values));
        filled.unwrap_or_else(|error| panic!("the template {name}: {error}"))
    }
}

/// Values of a page for its template.
pub(super) fn page_values(view: &impl Serialize) -> Value {
    Value::from(Serde(view))
}

/// Template engine: strict about missing values, with the escaping filters.
pub(super) fn environment(templates: impl IntoIterator<Item = Template>) -> Environment<'static> {
    let mut environment = Environment::empty();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_auto_escape_callback(|name| {
        name.rsplit_once('.').map_or(AutoEscape::None, |(_, end)| AutoEscape::Custom(end.to_owned().into()))
    });
    environment.set_formatter(write);
    let safe = |escaped: fn(&str) -> String| move |text: &str| Value::from_safe_string(escaped(text));
    // A page without samples to show has no strip.
    environment.add_test("defined", |value: &Value| !value.is_undefined());
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

/// Writes a value, escaped for the file format that the template's extension determines.
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
        return Err(Error::new(ErrorKind::InvalidOperation, "a template without escaping"));
    };
    let escaped = match &**end {
        "html" => escape::html(&text),
        "md" => escape::markdown(&text),
        "cff" | "yaml" => escape::quoted(&text),
        "bib" => escape::bibtex(&text),
        end => return Err(Error::new(ErrorKind::InvalidOperation, format!("no escaping is defined for .{end}"))),
    };
    Ok(out.write_str(&escaped)?)
}
