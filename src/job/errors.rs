//! What is wrong with a job file: typed, placed, and shown like a compiler's message.

use std::{fmt, fmt::Write as _, ops::Range};

use serde::{Serialize, Serializer, ser::SerializeStruct};

/// One mistake.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{place}: {}{problem}{}", prefix(key), suffix(help))]
pub struct JobError {
    /// Where it stands.
    pub place: Place,
    /// The dotted key; empty where there is none.
    pub key: String,
    /// What is wrong.
    pub problem: Problem,
    /// How to mend it, where that is known.
    pub help: Option<String>,
}

fn prefix(key: &str) -> String {
    if key.is_empty() { String::new() } else { format!("{key}: ") }
}

fn suffix(help: &Option<String>) -> String {
    help.as_ref().map(|help| format!("; {help}")).unwrap_or_default()
}

/// A place in a job file, in a `--set` or in a table of meshes.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// The file, or `--set`.
    pub file: String,
    /// Line, from 1; 0 for a file as a whole; which one of the `--set`, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
    /// How many characters it covers on its line, at least 1.
    pub width: u32,
    /// The line itself.
    pub text: String,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => f.write_str(&self.file),
            line => write!(f, "{}:{line}:{}", self.file, self.column),
        }
    }
}

impl Place {
    /// A file as a whole.
    pub fn file(file: &str) -> Self {
        Self { file: file.to_owned(), line: 0, column: 0, width: 0, text: String::new() }
    }

    /// A run of bytes of a text; the borders are moved to the borders of characters.
    pub fn in_text(file: &str, text: &str, range: Range<usize>) -> Self {
        let border = |mut byte: usize| {
            byte = byte.min(text.len());
            while !text.is_char_boundary(byte) {
                byte -= 1;
            }
            byte
        };
        let start = border(range.start);
        let end = border(range.end).max(start);
        let line_start = text[..start].rfind('\n').map_or(0, |newline| newline + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |newline| start + newline);
        Self {
            file: file.to_owned(),
            line: text[..start].matches('\n').count() as u32 + 1,
            column: text[line_start..start].chars().count() as u32 + 1,
            width: (text[start..end.min(line_end).max(start)].chars().count() as u32).max(1),
            text: text[line_start..line_end].trim_end().to_owned(),
        }
    }
}

/// What is wrong, with what was expected and what was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Problem {
    /// The text is no TOML.
    #[error("not TOML: {message}")]
    Syntax {
        /// What the parser says.
        message: String,
    },
    /// A key that no job has here.
    #[error("unknown key `{found}`")]
    UnknownKey {
        /// The key.
        found: String,
        /// The keys that are known here.
        known: Vec<String>,
    },
    /// A value of another type.
    #[error("expected {expected}, found {found}")]
    WrongType {
        /// The type.
        expected: String,
        /// The value.
        found: String,
    },
    /// A name that is none of a list.
    #[error("`{found}` is not one of {}", choices.join(", "))]
    NotAChoice {
        /// The name.
        found: String,
        /// The list.
        choices: Vec<String>,
    },
    /// A number, or a count of elements, that is too small, too large or not finite.
    #[error("expected {expected}, found {found}")]
    OutOfRange {
        /// The range.
        expected: String,
        /// The number.
        found: String,
    },
    /// A key that must be there.
    #[error("missing: expected {expected}")]
    Missing {
        /// What should stand here.
        expected: String,
    },
    /// Two settings that exclude each other.
    #[error("contradicts `{other}`: {because}")]
    Contradiction {
        /// The other key.
        other: String,
        /// Why.
        because: String,
    },
    /// A file, folder, package, shape, mesh or camera that is not there.
    #[error("{what} not found: {detail}")]
    NotFound {
        /// What kind of thing.
        what: String,
        /// Its name and where it was looked for.
        detail: String,
    },
    /// A value of the right type that makes no sense.
    #[error("expected {expected}, found {found}")]
    Senseless {
        /// What would make sense.
        expected: String,
        /// What stands there.
        found: String,
    },
}

impl Problem {
    /// A short stable name, for machines.
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
            Self::Senseless { .. } => "senseless",
        }
    }

    /// What was expected.
    pub fn expected(&self) -> String {
        match self {
            Self::Syntax { .. } => "a TOML document (https://toml.io/en/v1.1.0)".to_owned(),
            Self::UnknownKey { known, .. } => format!("one of {}", known.join(", ")),
            Self::NotAChoice { choices, .. } => format!("one of {}", choices.join(", ")),
            Self::WrongType { expected, .. }
            | Self::OutOfRange { expected, .. }
            | Self::Missing { expected }
            | Self::Senseless { expected, .. } => expected.clone(),
            Self::Contradiction { other, .. } => format!("either this or `{other}`"),
            Self::NotFound { what, .. } => format!("a {what} that is there"),
        }
    }

    /// What was found.
    pub fn found(&self) -> String {
        match self {
            Self::Syntax { message } => message.clone(),
            Self::UnknownKey { found, .. }
            | Self::NotAChoice { found, .. }
            | Self::WrongType { found, .. }
            | Self::OutOfRange { found, .. }
            | Self::Senseless { found, .. } => found.clone(),
            Self::Missing { .. } => "nothing".to_owned(),
            Self::Contradiction { .. } => "both".to_owned(),
            Self::NotFound { detail, .. } => detail.clone(),
        }
    }
}

impl JobError {
    /// A mistake at a place.
    pub fn at(place: Place, key: impl Into<String>, problem: Problem) -> Self {
        Self { place, key: key.into(), problem, help: None }
    }

    /// The same with a remedy.
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Several lines: the message, the place, the source line with the spot underlined, the remedy.
    pub fn render(&self) -> String {
        let Self { place, key, problem, help } = self;
        let mut text = format!("error: {}{problem}\n", prefix(key));
        let gutter = place.line.to_string().len();
        let _ = writeln!(text, "{:gutter$}--> {place}", "");
        if place.line > 0 {
            let spot = " ".repeat(place.column as usize - 1) + &"^".repeat(place.width as usize);
            let _ = writeln!(text, "{:gutter$} |", "");
            let _ = writeln!(text, "{} | {}", place.line, place.text.replace('\t', " "));
            let _ = write!(text, "{:gutter$} | {spot}", "");
            if let Problem::UnknownKey { .. } = problem {
                let _ = write!(text, " expected {}", problem.expected());
            }
            text.push('\n');
        }
        if let Some(help) = help {
            let _ = writeln!(text, "{:gutter$} = help: {help}", "");
        }
        text
    }
}

impl Serialize for JobError {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut fields = serializer.serialize_struct("JobError", 9)?;
        fields.serialize_field("file", &self.place.file)?;
        fields.serialize_field("line", &self.place.line)?;
        fields.serialize_field("column", &self.place.column)?;
        fields.serialize_field("key", &self.key)?;
        fields.serialize_field("problem", self.problem.code())?;
        fields.serialize_field("message", &self.problem.to_string())?;
        fields.serialize_field("expected", &self.problem.expected())?;
        fields.serialize_field("found", &self.problem.found())?;
        fields.serialize_field("help", &self.help)?;
        fields.end()
    }
}

/// All mistakes of a job, in the order of the file; never empty.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct JobErrors(Vec<JobError>);

impl JobErrors {
    /// `Err` with the mistakes, `Ok` when there is none.
    pub(super) fn check(errors: Vec<JobError>) -> Result<(), Self> {
        if errors.is_empty() { Ok(()) } else { Err(Self::of(errors)) }
    }

    /// The mistakes in the order of the file, then of the overrides.
    pub(super) fn of(mut errors: Vec<JobError>) -> Self {
        errors.sort_by(|a, b| {
            let order = |error: &JobError| (error.place.file == "--set", error.place.line, error.place.column);
            order(a).cmp(&order(b)).then_with(|| a.key.cmp(&b.key))
        });
        Self(errors)
    }

    /// The mistakes.
    pub fn list(&self) -> &[JobError] {
        &self.0
    }

    /// All mistakes as a compiler shows them, and how many.
    pub fn render(&self) -> String {
        self.render_of("the job")
    }

    /// The same of a file that is no job: `what` names it.
    pub fn render_of(&self, what: &str) -> String {
        let mut text: String = self.0.iter().map(|error| error.render() + "\n").collect();
        let plural = if self.0.len() == 1 { "error" } else { "errors" };
        let _ = writeln!(text, "{} {plural} in {what}", self.0.len());
        text
    }
}

impl fmt::Display for JobErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, error) in self.0.iter().enumerate() {
            write!(f, "{}{error}", if place > 0 { "\n" } else { "" })?;
        }
        Ok(())
    }
}

impl std::error::Error for JobErrors {}
