//! The table of statements of descriptions: each is honoured, ignored with a reason, or refused with a remedy.
//!
//! [`ROWS`](mjcf::ROWS) and [`ROWS`](urdf::ROWS) are the only declaration. [`check`] follows them, the page `docs/mjcf.md` is
//! [printed](reference) from them, and tests try every row and compare them with the schema of the linked MuJoCo.

mod mjcf;
mod page;
#[cfg(test)]
mod row_tests;
#[cfg(test)]
mod tests;
mod urdf;

use kernel::description::{DescriptionText, Format, Statement};

pub use page::reference;

use super::error::RefusedStatement;

/// Use that a description is read for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Usage {
    /// The map of a robot: joints, shapes that can collide, and which of them may meet.
    Robot,
    /// A hand that touches and grasps.
    Hand,
    /// A container of scenes: shapes alone.
    Container,
    /// A camera of a scene.
    Camera,
}

impl Usage {
    /// Every use, in the order of [`Row::decisions`].
    pub const ALL: [Self; 4] = [Self::Robot, Self::Hand, Self::Container, Self::Camera];
}

/// Treatment of a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Honoured: it changes what is read, as MuJoCo has it.
    Honoured,
    /// Honoured, and refused under a condition.
    HonouredUnless {
        /// The condition, as a clause.
        when: &'static str,
        /// Remedy: the statement to write instead.
        remedy: &'static str,
    },
    /// Ignored: it changes nothing of what is read.
    Ignored {
        /// Why that is safe.
        reason: &'static str,
    },
    /// Ignored, and refused under a condition.
    IgnoredUnless {
        /// Why that is safe.
        reason: &'static str,
        /// The condition, as a clause.
        when: &'static str,
        /// Remedy: the statement to write instead.
        remedy: &'static str,
    },
    /// Some values change nothing of what is read, all others are refused.
    Only {
        /// The values that are taken; numbers are compared as numbers, one by one.
        values: &'static [&'static str],
        /// Remedy: the statement to write instead.
        remedy: &'static str,
    },
    /// Refused.
    Refused {
        /// Remedy: the statement to write instead.
        remedy: &'static str,
    },
}

/// A row of the table: an element, or some of its attributes.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The element, as `section/element`; `body` stands for all that holds bodies.
    pub element: &'static str,
    /// Attributes of the element, each with a value that makes a difference, or none where it makes none alone; empty: the element with all
    /// attributes that no other row names.
    pub attributes: &'static str,
    /// Attributes without which these make no difference, or for a whole element an example of it.
    pub example: &'static str,
    /// For a robot, a hand, a container and a camera.
    pub decisions: [Decision; 4],
}

impl Row {
    /// Names of the attributes, with their values.
    pub fn values(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let mut rest = self.attributes;
        std::iter::from_fn(move || {
            let (name, after) = rest.trim_start().split_once("=\"")?;
            let (value, after) = after.split_once('"')?;
            rest = after;
            Some((name, value))
        })
    }

    /// Treatment of the statement by a use.
    pub fn decision(&self, usage: Usage) -> Decision {
        let index = Usage::ALL.iter().position(|known| *known == usage).expect("every use is listed");
        self.decisions[index]
    }

    /// Whether it is about an element, or about one of its attributes.
    fn is_about(&self, statement: &Statement, attribute: Option<&str>) -> bool {
        let names_it = match attribute {
            None => self.attributes.is_empty(),
            Some(attribute) => self.attributes.is_empty() || self.values().any(|(name, _)| name == attribute),
        };
        names_it && statement.is_or_defaults(self.element)
    }
}

/// The rows of a format, those of single attributes before those of their elements.
pub fn rows(format: Format) -> &'static [Row] {
    match format {
        Format::Mjcf => mjcf::ROWS,
        Format::Urdf => urdf::ROWS,
    }
}

/// The row about an element, or about one of its attributes.
pub fn row(format: Format, statement: &Statement, attribute: Option<&str>) -> Option<&'static Row> {
    rows(format).iter().find(|row| row.is_about(statement, attribute))
}

/// Refuses the statements of a description that this use does not understand; those whose refusal depends on what MuJoCo makes of
/// them are left to whoever reads that.
///
/// # Errors
/// Every such statement.
pub(super) fn check(text: &DescriptionText, usage: Usage) -> Result<(), Vec<RefusedStatement>> {
    let mut refused = Vec::new();
    for (index, statement) in text.statements.iter().enumerate() {
        if text.format == Format::Urdf && is_in_another_program(text, index) {
            continue;
        }
        refused.extend(refusal(text.format, statement, usage));
    }
    if refused.is_empty() { Ok(()) } else { Err(refused) }
}

/// Why a statement is refused.
fn refusal(format: Format, statement: &Statement, usage: Usage) -> Option<RefusedStatement> {
    let names = statement.attributes.iter().map(|(name, value)| (Some(name.as_str()), value.as_str()));
    for (attribute, value) in std::iter::once((None, "")).chain(names) {
        // `<mujoco>` of a URDF holds statements of MJCF.
        let format = if statement.within == "mujoco" { Format::Mjcf } else { format };
        let Some(row) = row(format, statement, attribute) else {
            // MuJoCo refuses what its schema does not have; of a URDF it drops that in silence.
            if format == Format::Urdf {
                return Some(RefusedStatement::unknown(statement, attribute));
            }
            continue;
        };
        let remedy = match row.decision(usage) {
            Decision::Refused { remedy } => remedy,
            Decision::Only { values, remedy } if attribute.is_some() && !is_one_of(value, values) => remedy,
            _ => continue,
        };
        return Some(RefusedStatement::new(statement, attribute, remedy));
    }
    None
}

/// Condition and remedy of a statement that is refused under a condition.
///
/// # Panics
/// When the table has no such row.
pub(super) fn condition_of(element: &str, attribute: Option<&str>, usage: Usage) -> (&'static str, &'static str) {
    let is_it = |row: &&Row| {
        let names_it = attribute.map_or(row.attributes.is_empty(), |name| row.values().any(|(known, _)| known == name));
        row.element == element && names_it
    };
    let condition = |row: &Row| match row.decision(usage) {
        Decision::HonouredUnless { when, remedy } | Decision::IgnoredUnless { when, remedy, .. } => {
            Some((when, remedy))
        }
        _ => None,
    };
    mjcf::ROWS
        .iter()
        .chain(urdf::ROWS)
        .filter(is_it)
        .find_map(condition)
        .expect("the table has a condition for the statement")
}

/// Whether a value is one of those that are taken.
fn is_one_of(value: &str, values: &[&str]) -> bool {
    let same = |word: &str, known: &str| match (word.parse::<f64>(), known.parse::<f64>()) {
        (Ok(word), Ok(known)) => word == known,
        _ => word == known,
    };
    value.split_ascii_whitespace().all(|word| values.iter().any(|known| same(word, known)))
}

/// Whether an element of a URDF stands in one that is ignored with all that it holds: it speaks to other programs.
fn is_in_another_program(text: &DescriptionText, statement: usize) -> bool {
    let mut next = text.statements[statement].parent;
    while let Some(parent) = next {
        if urdf::HOLDS_ANYTHING.iter().any(|element| text.statements[parent].is(element)) {
            return true;
        }
        next = text.statements[parent].parent;
    }
    false
}
