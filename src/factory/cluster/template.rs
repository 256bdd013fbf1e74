//! Templates of scripts and manifests, and how a value is quoted on its way into each.

use std::sync::LazyLock;

use minijinja::{
    AutoEscape, Environment, Error, ErrorKind, Output, State, UndefinedBehavior, Value,
    syntax::SyntaxConfig,
    value::{Serde, ValueKind},
};
use serde::Serialize;

macro_rules! files {
    ($($name:literal),* $(,)?) => { [$(($name, include_str!(concat!("templates/", $name)))),*] };
}

/// Every template: its name in `jobs/cluster/`, and its text.
const TEMPLATES: [(&str, &str); 5] =
    files!["kubernetes.yaml", "local.sh", "parallel.sh", "slurm-merge.sh", "slurm-tasks.sh"];

static ENVIRONMENT: LazyLock<Environment<'static>> = LazyLock::new(environment);

/// Fills a template: the end of its name decides whether texts become words of a shell or strings of YAML.
///
/// # Panics
/// When the template names a value that is not there, or a text holds NUL: templates are part of the program, whose tests fill
/// each, and control characters are refused before.
pub(super) fn fill(name: &str, view: &impl Serialize) -> String {
    let filled = ENVIRONMENT.get_template(name).and_then(|template| template.render(Value::from(Serde(view))));
    filled.unwrap_or_else(|error| panic!("the template {name}: {error}"))
}

/// Text that is no single word or string, and enters a script as it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Verbatim(pub String);

impl Serialize for Verbatim {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Value::from_safe_string(self.0.clone()).serialize(serializer)
    }
}

fn environment() -> Environment<'static> {
    let mut environment = Environment::empty();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_auto_escape_callback(|name| {
        name.rsplit_once('.').map_or(AutoEscape::None, |(_, end)| AutoEscape::Custom(end.to_owned().into()))
    });
    environment.set_formatter(write);
    // Kubernetes replaces `$(NAME)` in arguments, Slurm `%j` in the names of logs; doubling escapes both.
    environment.add_filter("argument", |text: &str| text.replace('$', "$$"));
    environment.add_filter("log_name", |text: &str| text.replace('%', "%%"));
    let syntax = SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).keep_trailing_newline(true).build();
    environment.set_syntax(syntax.expect("the usual marks of a template"));
    for (name, text) in TEMPLATES {
        environment.add_template(name, text).unwrap_or_else(|error| panic!("the template {name}: {error}"));
    }
    environment
}

/// Writes a value: a whole number as it is, a text as a word of a shell or as a string of YAML.
fn write(out: &mut Output, state: &mut State, value: &Value) -> Result<(), Error> {
    let wrong = |message: String| Error::new(ErrorKind::InvalidOperation, message);
    let text = match value.kind() {
        ValueKind::String => value.as_str().unwrap_or_default(),
        ValueKind::Number if value.is_integer() => return Ok(out.write_str(&value.to_string())?),
        kind => return Err(wrong(format!("{kind} is neither text nor a whole number"))),
    };
    if value.is_safe() {
        return Ok(out.write_str(text)?);
    }
    match state.auto_escape() {
        AutoEscape::Custom(end) if end == "sh" => {
            let word = shlex::try_quote(text).map_err(|error| wrong(error.to_string()))?;
            Ok(out.write_str(&word)?)
        }
        // A string of JSON is one of YAML.
        AutoEscape::Custom(end) if end == "yaml" => Ok(out.write_str(&serde_json::Value::from(text).to_string())?),
        other => Err(wrong(format!("there is no quoting rule for {other:?}"))),
    }
}

/// A name that engines take: small letters, digits and hyphens, at most 40 (Kubernetes adds to it).
pub(super) fn plain_name(text: &str) -> Verbatim {
    let letter = |letter: char| if letter.is_ascii_alphanumeric() { letter.to_ascii_lowercase() } else { '-' };
    let name: String = text.chars().map(letter).take(40).collect();
    let name = name.trim_matches('-');
    Verbatim(if name.is_empty() { "graspmill".to_owned() } else { name.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_plain() {
        assert_eq!(plain_name("My job (2)").0, "my-job--2");
        assert_eq!(plain_name("...").0, "graspmill");
    }
}
