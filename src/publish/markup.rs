//! Markup that the program made, beside text that is escaped on its way into a file.

use minijinja::Value;
use serde::Serialize;

/// Markup that the program made, such as a chart: it enters a template as it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Markup(pub String);

impl Serialize for Markup {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Value::from_safe_string(self.0.clone()).serialize(serializer)
    }
}
