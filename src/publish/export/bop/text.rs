//! Texts of BOP in JSON, and its units.

use serde_json::Value;

/// Millimetres per metre.
pub(super) const MM: f64 = 1e3;

/// Millimetres per step of stored depth; the first value that fits all depths of an image is used.
pub(super) const DEPTH_SCALES: [f64; 2] = [0.1, 1.0];

/// Minimum visible share of the silhouette of a target in the challenge of 2019.
pub(super) const LEAST_SEEN: f64 = 0.1;

/// One line per entry of the outermost table or list.
pub(super) fn pretty(value: &Value) -> String {
    let lines = |lines: Vec<String>| lines.join(",\n");
    match value {
        Value::Object(table) => {
            let line = |(key, value): (&String, &Value)| format!("  \"{key}\": {value}");
            format!("{{\n{}\n}}\n", lines(table.iter().map(line).collect()))
        }
        Value::Array(list) => format!("[\n{}\n]\n", lines(list.iter().map(|value| format!("  {value}")).collect())),
        other => other.to_string(),
    }
}
