//! Statements of a camera out of JSON.

use std::fmt;

use serde::{
    Deserialize, Deserializer,
    de::{Error, MapAccess, SeqAccess, Visitor},
};

use super::{
    problem::CameraProblem,
    statement::{Statement, Value},
};

/// The statements of a text.
pub(super) fn parse(text: &str) -> Result<Statement, CameraProblem> {
    serde_json::from_str(text).map_err(|error| {
        let place = format!("line {}, column {}", error.line(), error.column());
        // The library ends its message with the position.
        let message = error.to_string();
        let found = message.split(" at line ").next().unwrap_or_default();
        CameraProblem::content(place, found, "write it as JSON, each key once")
    })
}

impl<'de> Deserialize<'de> for Statement {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AnyValue)
    }
}

struct AnyValue;

impl<'de> Visitor<'de> for AnyValue {
    type Value = Statement;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a camera")
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Statement, E> {
        Ok(Statement::scalar(0, value.to_string()))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Statement, E> {
        Ok(Statement::scalar(0, value.to_string()))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Statement, E> {
        Ok(Statement::scalar(0, value.to_string()))
    }

    /// The shortest decimal that gives the same number back.
    fn visit_f64<E: Error>(self, value: f64) -> Result<Statement, E> {
        Ok(Statement::scalar(0, value.to_string()))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Statement, E> {
        Ok(Statement::scalar(0, value))
    }

    fn visit_unit<E: Error>(self) -> Result<Statement, E> {
        Ok(Statement::scalar(0, ""))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Statement, A::Error> {
        let mut list = Vec::new();
        while let Some(item) = items.next_element()? {
            list.push(item);
        }
        Ok(Statement { line: 0, value: Value::List(list) })
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Statement, A::Error> {
        let mut keys: Vec<(String, Statement)> = Vec::new();
        let mut known = std::collections::BTreeSet::new();
        while let Some((key, value)) = entries.next_entry::<String, Statement>()? {
            if !known.insert(key.clone()) {
                return Err(A::Error::custom(format!("the key `{key}` is there twice")));
            }
            keys.push((key, value));
        }
        Ok(Statement { line: 0, value: Value::Map(keys) })
    }
}
