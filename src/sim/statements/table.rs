//! The rows of all formats, and the one about a statement.

use kernel::description::{Format, Statement};

use super::{
    mjcf,
    row::{Decision, Row, Usage},
    urdf,
};

/// The rows of a format, those of single attributes before those of their elements.
pub fn rows(format: Format) -> &'static [Row] {
    match format {
        Format::Mjcf => mjcf::ROWS,
        Format::Urdf => urdf::ROWS,
    }
}

/// The row for an element, or for one of its attributes.
pub fn row(format: Format, statement: &Statement, attribute: Option<&str>) -> Option<&'static Row> {
    rows(format).iter().find(|row| row.is_about(statement, attribute))
}

/// Condition and remedy of a statement that is refused under a condition.
///
/// # Panics
/// When the table has no such row.
pub(crate) fn condition_of(element: &str, attribute: Option<&str>, usage: Usage) -> (&'static str, &'static str) {
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
