//! Markup made by the program, as opposed to text, which is escaped.

use minijinja::Value;
use serde::Serialize;

/// Markup made by the program, such as a chart; templates insert it without escaping.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Markup(pub String);

impl Serialize for Markup {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Value::from_safe_string(self.0.clone()).serialize(serializer)
    }
}
