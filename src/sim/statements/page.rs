//! The table of statements as a page of the documentation.

use std::fmt::Write;

use kernel::description::{BOUNDS, ElementBound, Format, MAX_BYTES, MAX_DEPTH, MAX_ELEMENTS, MAX_FILES_DEEP, Rule};

use super::{
    row::{Decision, Row, Usage},
    table::rows,
};

/// The table of statements and that of bounds, in Markdown.
pub fn reference() -> String {
    let mut out = String::new();
    for (title, format) in [("MJCF", Format::Mjcf), ("URDF", Format::Urdf)] {
        write_statements(&mut out, title, rows(format)).expect("a string takes all text");
    }
    write_bounds(&mut out).expect("a string takes all text");
    out
}

fn write_statements(out: &mut String, title: &str, rows: &[Row]) -> std::fmt::Result {
    writeln!(
        out,
        "\n## {title}\n\n| statement | robot | hand | container | camera |\n| --- | --- | --- | --- | --- |"
    )?;
    for row in rows {
        let decisions = Usage::ALL.map(|usage| words(row.decision(usage)));
        writeln!(out, "| {} | {} |", statement(row), decisions.join(" | "))?;
    }
    Ok(())
}

/// Element and attributes of a row.
fn statement(row: &Row) -> String {
    let element = match row.element.split_once('/').unwrap_or(("", row.element)) {
        ("", element) => format!("`<{element}>`"),
        ("*", element) => format!("`<{element}>` anywhere"),
        (section, "*") => format!("others in `<{section}>`"),
        (section, element) => format!("`<{element}>` in `<{section}>`"),
    };
    let names: Vec<String> = row.values().map(|(name, _)| format!("`{name}`")).collect();
    if names.is_empty() { element } else { format!("{element}: {}", names.join(", ")) }
}

fn words(decision: Decision) -> String {
    match decision {
        Decision::Honoured => "honoured".to_owned(),
        Decision::HonouredUnless { when, remedy } => format!("honoured; refused when {when}: {remedy}"),
        Decision::Ignored { reason } => format!("ignored: {reason}"),
        Decision::IgnoredUnless { reason, when, remedy } => {
            format!("ignored: {reason}; refused when {when}: {remedy}")
        }
        Decision::Only { values, remedy } => format!("refused but for `{}`: {remedy}", values.join("`, `")),
        Decision::Refused { remedy } => format!("refused: {remedy}"),
    }
    .replace('<', "&lt;")
    .replace('|', "\\|")
}

fn write_bounds(out: &mut String) -> std::fmt::Result {
    writeln!(out, "\n## Bounds\n\n| what | bound |\n| --- | --- |")?;
    writeln!(out, "| elements, with all copies | {MAX_ELEMENTS} |")?;
    writeln!(out, "| elements within each other | {MAX_DEPTH} |")?;
    writeln!(out, "| files that include or attach each other in a row | {MAX_FILES_DEEP} |")?;
    writeln!(out, "| memory that the sizes below need, together | {} MiB |", MAX_BYTES / (1024.0 * 1024.0))?;
    for ElementBound { element, rule } in BOUNDS {
        let row = Row { element, attributes: "", example: "", decisions: [Decision::Honoured; 4] };
        let of = statement(&row);
        match rule {
            Rule::Count { most } => writeln!(out, "| number of {of} | {most} |")?,
            Rule::Value { attribute, range: [least, most] } if least.is_finite() => {
                writeln!(out, "| `{attribute}` of {of} | {least} to {most} |")?;
            }
            Rule::Value { attribute, range: [_, most] } => writeln!(out, "| `{attribute}` of {of} | {most} |")?,
            Rule::Copies { attribute, most } => writeln!(out, "| copies by `{attribute}` of {of} | {most} |")?,
            Rule::Numbers { attribute, most } => writeln!(out, "| numbers in `{attribute}` of {of} | {most} |")?,
            Rule::Memory { attributes, unit } => {
                writeln!(
                    out,
                    "| memory for {unit} bytes x `{}` of {of} | part of the sum |",
                    attributes.join("` x `")
                )?;
            }
        }
    }
    Ok(())
}
