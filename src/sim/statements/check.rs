//! Statements that a use does not understand.

use kernel::description::{DescriptionText, Format, Statement};

use super::{
    row::{Decision, Usage},
    table::row,
    urdf,
};
use crate::error::RefusedStatement;

/// Refuses the statements of a description that this use does not understand; those whose refusal depends on MuJoCo's
/// result are left to their readers.
///
/// # Errors
/// Every such statement.
pub(crate) fn check(text: &DescriptionText, usage: Usage) -> Result<(), Vec<RefusedStatement>> {
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
            // MuJoCo refuses statements that its schema lacks; in a URDF it drops them silently.
            if format == Format::Urdf {
                return Some(RefusedStatement::unknown(statement, attribute));
            }
            continue;
        };
        let remedy = match row.decision(usage) {
            Decision::Refused { remedy } => remedy,
            Decision::Only { values, remedy } if attribute.is_some() && !is_one_of(value, values) => remedy,
            Decision::IgnoredUnless { remedy, .. }
                if attribute == Some("content_type") && !is_ending(value, statement) =>
            {
                remedy
            }
            _ => continue,
        };
        return Some(RefusedStatement::new(statement, attribute, remedy));
    }
    None
}

/// Whether a value is one of the accepted ones.
fn is_one_of(value: &str, values: &[&str]) -> bool {
    let same = |word: &str, known: &str| match (word.parse::<f64>(), known.parse::<f64>()) {
        (Ok(word), Ok(known)) => word == known,
        _ => word == known,
    };
    value.split_ascii_whitespace().all(|word| values.iter().any(|known| same(word, known)))
}

/// Whether a content type such as `model/stl` is that of the ending of the statement's file.
fn is_ending(content_type: &str, statement: &Statement) -> bool {
    let ending = statement.get("file").and_then(|file| file.rsplit_once('.')).map(|(_, ending)| ending);
    let format = content_type.strip_prefix("model/");
    ending.zip(format).is_some_and(|(ending, format)| ending.eq_ignore_ascii_case(format))
}

/// Whether an element of a URDF is inside one that is ignored with all its content: it addresses other programs.
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
