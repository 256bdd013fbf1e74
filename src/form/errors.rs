//! Mistakes in a file: typed, located, and shown like compiler messages.

use std::{fmt, fmt::Write as _, sync::Arc};

use serde::{Serialize, Serializer, ser::SerializeStruct};

use super::{
    requirement::{Finding, Requirement},
    source::Location,
};

/// Label of the overrides of a file.
pub(super) const OVERRIDE: &str = "--set";

/// One mistake.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{location}: {}{problem}{}", prefix(key), suffix(help))]
pub struct FormError {
    /// Location of the mistake.
    pub location: Location,
    /// The dotted key; empty if there is none.
    pub key: String,
    /// Kind of the mistake, with its values.
    pub problem: FormProblem,
    /// The remedy, if one is known.
    pub help: Option<String>,
}

fn prefix(key: &str) -> String {
    if key.is_empty() { String::new() } else { format!("{key}: ") }
}

fn suffix(help: &Option<String>) -> String {
    help.as_ref().map(|help| format!("; {help}")).unwrap_or_default()
}

/// Kind of a mistake, with the expected and the found value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FormProblem {
    /// The text is not TOML.
    #[error("not TOML: {message}")]
    Syntax {
        /// Message of the parser.
        message: String,
    },
    /// A key that the table does not define.
    #[error("unknown key `{found}`")]
    UnknownKey {
        /// The key.
        found: String,
        /// The keys that are known here.
        known: Arc<[String]>,
    },
    /// A value of another type.
    #[error("expected {expected}, found {found}")]
    WrongType {
        /// The requirement.
        expected: Requirement,
        /// The value.
        found: Finding,
    },
    /// A word that is not in a list.
    #[error("`{found}` is not one of {}", choices.join(", "))]
    NotAChoice {
        /// The word.
        found: String,
        /// The list.
        choices: Vec<String>,
    },
    /// A number, or a count of elements, that is too small, too large or not finite.
    #[error("expected {expected}, found {found}")]
    OutOfRange {
        /// The requirement, with its range.
        expected: Requirement,
        /// The number or array.
        found: Finding,
    },
    /// A missing required key.
    #[error("missing: expected {expected}")]
    Missing {
        /// The requirement on its value.
        expected: Requirement,
    },
    /// Two settings that exclude each other.
    #[error("contradicts `{other}`: {because}")]
    Contradiction {
        /// The other key.
        other: String,
        /// Reason.
        because: String,
    },
    /// A file or a name that does not exist.
    #[error("{what} not found: {detail}")]
    NotFound {
        /// Kind of the thing.
        what: String,
        /// Name, and where it was searched for.
        detail: String,
    },
    /// A value of the right type that cannot be used.
    #[error("expected {expected}, found {found}")]
    Invalid {
        /// Description of valid values.
        expected: String,
        /// The value in the file.
        found: String,
    },
}

impl FormProblem {
    /// Short stable name for programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Syntax { .. } => "syntax",
            Self::UnknownKey { .. } => "unknown_key",
            Self::WrongType { .. } => "wrong_type",
            Self::NotAChoice { .. } => "not_a_choice",
            Self::OutOfRange { .. } => "out_of_range",
            Self::Missing { .. } => "missing",
            Self::Contradiction { .. } => "contradiction",
            Self::NotFound { .. } => "not_found",
            Self::Invalid { .. } => "invalid",
        }
    }

    /// The expected value as text.
    pub fn expected(&self) -> String {
        match self {
            Self::Syntax { .. } => "a TOML document (https://toml.io/en/v1.1.0)".to_owned(),
            Self::UnknownKey { known: words, .. } => format!("one of {}", words.join(", ")),
            Self::NotAChoice { choices, .. } => format!("one of {}", choices.join(", ")),
            Self::WrongType { expected, .. } | Self::OutOfRange { expected, .. } | Self::Missing { expected } => {
                expected.to_string()
            }
            Self::Invalid { expected, .. } => expected.clone(),
            Self::Contradiction { other, .. } => format!("either this or `{other}`"),
            Self::NotFound { what, .. } => format!("an existing {what}"),
        }
    }

    /// The found value as text.
    pub fn found(&self) -> String {
        match self {
            Self::Syntax { message } => message.clone(),
            Self::UnknownKey { found, .. } | Self::NotAChoice { found, .. } | Self::Invalid { found, .. } => {
                found.clone()
            }
            Self::WrongType { found, .. } | Self::OutOfRange { found, .. } => found.to_string(),
            Self::Missing { .. } => "nothing".to_owned(),
            Self::Contradiction { .. } => "both".to_owned(),
            Self::NotFound { detail, .. } => detail.clone(),
        }
    }
}

impl FormError {
    /// Renders several lines: the message, the location, the source line with the mistake underlined, and the remedy.
    pub fn render(&self) -> String {
        let Self { location, key, problem, help } = self;
        let mut text = format!("error: {}{problem}\n", prefix(key));
        let gutter = location.line.to_string().len();
        let _ = writeln!(text, "{:gutter$}--> {location}", "");
        let _ = writeln!(text, "{:gutter$} |", "");
        let _ = writeln!(text, "{} | {}", location.line, location.text.replace('\t', " "));
        let spot = " ".repeat(location.lead as usize) + &"^".repeat(location.width as usize);
        let _ = write!(text, "{:gutter$} | {spot}", "");
        if let FormProblem::UnknownKey { .. } = problem {
            let _ = write!(text, " expected {}", problem.expected());
        }
        text.push('\n');
        if let Some(help) = help {
            let _ = writeln!(text, "{:gutter$} = help: {help}", "");
        }
        text
    }
}

impl Serialize for FormError {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut fields = serializer.serialize_struct("FormError", 9)?;
        fields.serialize_field("file", &self.location.file)?;
        fields.serialize_field("line", &self.location.line)?;
        fields.serialize_field("column", &self.location.column)?;
        fields.serialize_field("key", &self.key)?;
        fields.serialize_field("problem", self.problem.code())?;
        fields.serialize_field("message", &self.problem.to_string())?;
        fields.serialize_field("expected", &self.problem.expected())?;
        fields.serialize_field("found", &self.problem.found())?;
        fields.serialize_field("help", &self.help)?;
        fields.end()
    }
}

/// Mistakes in the order found. The first [`Mistakes::MOST`] are kept and the others only counted, so that a file with a million
/// wrong lines needs neither memory nor pages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mistakes {
    list: Vec<FormError>,
    more: usize,
}

impl Mistakes {
    /// Maximum number of kept mistakes.
    pub const MOST: usize = 1000;

    /// Adds a mistake; returns it if it is kept.
    pub fn push(&mut self, error: FormError) -> Option<&mut FormError> {
        if self.list.len() == Self::MOST {
            self.more += 1;
            return None;
        }
        self.list.push(error);
        self.list.last_mut()
    }

    /// Adds the mistakes of another file.
    pub fn append(&mut self, other: Self) {
        self.more += other.more;
        for error in other.list {
            self.push(error);
        }
    }

    /// Number of mistakes, kept or not.
    pub fn count(&self) -> usize {
        self.list.len() + self.more
    }

    /// Whether there are no mistakes.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The kept mistakes.
    pub fn iter(&self) -> impl Iterator<Item = &FormError> {
        self.list.iter()
    }
}

/// All mistakes of a file, in the order of the file; never empty.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct FormErrors {
    list: Vec<FormError>,
    /// Number of further mistakes.
    #[serde(skip)]
    more: usize,
    /// Name of the file, including the files that it names.
    #[serde(skip)]
    name: String,
}

impl FormErrors {
    /// The mistakes in the order of the file, then of the overrides.
    pub(super) fn new(name: &str, mistakes: Mistakes) -> Self {
        let Mistakes { mut list, more } = mistakes;
        list.sort_by(|a, b| {
            let order =
                |error: &FormError| (error.location.file == OVERRIDE, error.location.line, error.location.column);
            order(a).cmp(&order(b)).then_with(|| a.key.cmp(&b.key))
        });
        Self { list, more, name: name.to_owned() }
    }

    /// The mistakes: the first [`Mistakes::MOST`].
    pub fn list(&self) -> &[FormError] {
        &self.list
    }

    /// Number of mistakes.
    pub fn count(&self) -> usize {
        self.list.len() + self.more
    }

    /// Renders all mistakes like a compiler, followed by their number.
    pub fn render(&self) -> String {
        let mut text: String = self.list.iter().map(|error| error.render() + "\n").collect();
        if self.more > 0 {
            let _ = writeln!(text, "and {} more", self.more);
        }
        let plural = if self.count() == 1 { "error" } else { "errors" };
        let _ = writeln!(text, "{} {plural} in {}", self.count(), self.name);
        text
    }
}

impl fmt::Display for FormErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, error) in self.list.iter().enumerate() {
            write!(f, "{}{error}", if index > 0 { "\n" } else { "" })?;
        }
        if self.more > 0 {
            write!(f, "\nand {} more", self.more)?;
        }
        Ok(())
    }
}

impl std::error::Error for FormErrors {}
