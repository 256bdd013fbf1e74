//! What is wrong with a hand's table: typed, placed, with a remedy.

use std::{fmt, path::PathBuf};

/// Everything that is wrong with a table.
#[derive(Clone, Debug, PartialEq)]
pub struct HandTableError {
    /// The table.
    pub file: PathBuf,
    /// Its mistakes, one at least, in the table's order.
    pub faults: Vec<HandTableFault>,
}

/// One mistake and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct HandTableFault {
    /// Line, from 1; 0 for the table as a whole.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong.
    pub problem: HandProblem,
}

impl std::error::Error for HandTableError {}

impl fmt::Display for HandTableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, HandTableFault { line, column, problem }) in self.faults.iter().enumerate() {
            if place > 0 {
                writeln!(f)?;
            }
            write!(f, "{}", self.file.display())?;
            if *line > 0 {
                write!(f, ":{line}:{column}")?;
            }
            write!(f, ": {problem}")?;
        }
        Ok(())
    }
}

/// What is wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HandProblem {
    /// The file can't be read.
    #[error("{message}; a hand is an MJCF file and a table of the same name that ends in .toml (docs/hands.md)")]
    Unreadable {
        /// The system's words.
        message: String,
    },
    /// Not TOML, or a value of another type.
    #[error("{message}")]
    Syntax {
        /// The parser's words.
        message: String,
    },
    /// A key that no table has here.
    #[error("unknown key `{found}`; {}the keys here are {}", did_you_mean(found, known), known.join(", "))]
    UnknownKey {
        /// The key.
        found: String,
        /// The keys that are known here.
        known: Vec<String>,
    },
    /// Nothing in the description has the name.
    #[error("no {kind} is named {found:?}; {}the hand has {}", did_you_mean(found, present), list(present))]
    NoSuch {
        /// A joint, site, body or contact.
        kind: &'static str,
        /// The name.
        found: String,
        /// The names that there are.
        present: Vec<String>,
    },
    /// A joint is driven that follows another.
    #[error("joint {joint:?} follows {follows:?} by <equality><joint>; drive that one")]
    Follows {
        /// The joint.
        joint: String,
        /// The joint that it follows.
        follows: String,
    },
    /// A name or joint stands twice.
    #[error("{kind} {name:?} stands twice")]
    Twice {
        /// A driven joint, or a contact.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// Nothing moves a joint.
    #[error(
        "joint {joint:?} is neither driven nor does it follow a driven one; give it a [[driven]], or couple it by <equality><joint> in the MJCF"
    )]
    NotMoved {
        /// The joint.
        joint: String,
    },
    /// A driven joint has no range.
    #[error("joint {joint:?} turns without end; give it range=\"LOW HIGH\" in the MJCF")]
    NoRange {
        /// The joint.
        joint: String,
    },
    /// A value is outside its range.
    #[error(
        "{key} = {value}, but joint {joint:?}, with what follows it, goes from {low} to {high} (radians or metres)"
    )]
    Outside {
        /// The key.
        key: &'static str,
        /// The value.
        value: f64,
        /// The driven joint.
        joint: String,
        /// Its lowest value.
        low: f64,
        /// Its highest value.
        high: f64,
    },
    /// A number has to be above 0.
    #[error("{key} = {value}; it has to be a number above 0")]
    NotPositive {
        /// The key.
        key: &'static str,
        /// The value.
        value: f64,
    },
    /// A number has to be there, and not 0.
    #[error("{key} = {value}; it has to be finite and not 0")]
    NotANumber {
        /// The key.
        key: &'static str,
        /// The value.
        value: f64,
    },
    /// A list has another length than the driven joints.
    #[error("{found} values; there are {expected} driven joints: {}", list(driven))]
    Length {
        /// Count of driven joints.
        expected: usize,
        /// Count of values.
        found: usize,
        /// Names of the driven joints.
        driven: Vec<String>,
    },
    /// A clutch's joint does not follow.
    #[error("joint {joint:?} does not follow {driven:?}; those that do: {}", list(followers))]
    NotAFollower {
        /// The joint.
        joint: String,
        /// The driven joint.
        driven: String,
        /// Those that follow.
        followers: Vec<String>,
    },
    /// A clutch on a joint that does not close the hand.
    #[error("a breakaway needs `closed`: which way the hand closes")]
    NeedsClosed,
    /// A frame is given in neither way, or in both.
    #[error("give {one}, or {other}")]
    Form {
        /// The keys of one way.
        one: &'static str,
        /// The keys of the other.
        other: &'static str,
    },
    /// A direction without length, or two that are parallel.
    #[error("{key} gives no direction: {value:?}")]
    NoDirection {
        /// The key.
        key: &'static str,
        /// The value.
        value: [f64; 3],
    },
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none with a name".into() } else { names.join(", ") }
}

/// The name that is nearest, when one is near.
fn did_you_mean(found: &str, known: &[String]) -> String {
    let wanted = found.to_lowercase();
    let distance = |name: &String| strsim::damerau_levenshtein(&wanted, &name.to_lowercase());
    match known.iter().map(|name| (distance(name), name)).min() {
        Some((distance, name)) if distance <= (wanted.chars().count() / 3).max(1) => {
            format!("did you mean {name:?}? ")
        }
        _ => String::new(),
    }
}
