//! Requirements of a schema on a value, and the values found instead.

use std::fmt;

use serde_json::Value;

/// A requirement on a value.
#[derive(Clone, Debug, PartialEq)]
pub enum Requirement {
    /// One of several words.
    Choice(Vec<String>),
    /// One of several forms.
    AnyOf(Vec<Requirement>),
    /// `true` or `false`.
    Boolean,
    /// A whole number.
    Integer(Box<Bounds>),
    /// A number.
    Number(Box<Bounds>),
    /// A string.
    Text,
    /// An array.
    Array {
        /// Minimum number of elements.
        min: Option<u64>,
        /// Maximum number of elements.
        max: Option<u64>,
        /// Requirement on each element.
        each: Box<Requirement>,
    },
    /// A table.
    Table {
        /// Required keys; all keys if none is required, no keys if they are free.
        keys: Vec<String>,
    },
    /// Text about a requirement that a schema cannot express.
    Words(String),
}

impl From<&str> for Requirement {
    fn from(words: &str) -> Self {
        Self::Words(words.to_owned())
    }
}

impl From<String> for Requirement {
    fn from(words: String) -> Self {
        Self::Words(words)
    }
}

impl From<Bounds> for Requirement {
    fn from(bounds: Bounds) -> Self {
        Self::Number(Box::new(bounds))
    }
}

/// The range of a number.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Bounds {
    /// Smallest value.
    pub min: Option<f64>,
    /// Largest value.
    pub max: Option<f64>,
    /// Exclusive lower bound.
    pub above: Option<f64>,
    /// Exclusive upper bound.
    pub below: Option<f64>,
    /// Unit from `x-unit`.
    pub unit: Option<String>,
}

impl Bounds {
    /// Reads the range from a schema.
    pub(super) fn of(schema: &Value) -> Self {
        let limit = |keyword: &str| schema[keyword].as_f64();
        Self {
            min: limit("minimum"),
            max: limit("maximum"),
            above: limit("exclusiveMinimum"),
            below: limit("exclusiveMaximum"),
            unit: schema["x-unit"].as_str().map(str::to_owned),
        }
    }

    /// Whether a number is finite and within the range.
    pub fn contains(&self, number: f64) -> bool {
        number.is_finite()
            && self.min.is_none_or(|min| number >= min)
            && self.max.is_none_or(|max| number <= max)
            && self.above.is_none_or(|above| number > above)
            && self.below.is_none_or(|below| number < below)
    }
}

impl fmt::Display for Bounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The limits of the number's type are of no use to people.
        let said = |limit: Option<f64>| limit.filter(|limit| *limit < f64::from(u32::MAX));
        let (min, max, above, below) = (said(self.min), said(self.max), said(self.above), said(self.below));
        let has_low = min.or(above).is_some();
        match (min, above) {
            (Some(min), _) => write!(f, " from {min}")?,
            (None, Some(above)) => write!(f, " above {above}")?,
            (None, None) => {}
        }
        match (max, below) {
            (Some(max), _) if has_low => write!(f, " to {max}")?,
            (Some(max), _) => write!(f, " up to {max}")?,
            (None, Some(below)) => write!(f, " below {below}")?,
            (None, None) => {}
        }
        self.unit.iter().try_for_each(|unit| write!(f, " [{unit}]"))
    }
}

impl Requirement {
    /// Reads the requirement from a schema.
    pub(super) fn of(schema: &Value) -> Self {
        if let Some(choices) = choices(schema) {
            return Self::Choice(choices);
        }
        if let Some(branches) = schema["anyOf"].as_array() {
            return Self::AnyOf(branches.iter().map(Self::of).collect());
        }
        match schema["type"].as_str() {
            Some("integer") => Self::Integer(Box::new(Bounds::of(schema))),
            Some("number") => Bounds::of(schema).into(),
            Some("boolean") => Self::Boolean,
            Some("string") => Self::Text,
            Some("array") => Self::Array {
                min: schema["minItems"].as_u64(),
                max: schema["maxItems"].as_u64(),
                each: Box::new(Self::of(&schema["items"])),
            },
            Some("object") => {
                let properties = schema["properties"].as_object().into_iter().flatten();
                let all: Vec<String> = properties.map(|(key, _)| key.clone()).collect();
                let required: Vec<String> = all.iter().filter(|key| is_required(schema, key)).cloned().collect();
                Self::Table { keys: if required.is_empty() { all } else { required } }
            }
            _ => Self::Words("another value".to_owned()),
        }
    }
}

impl fmt::Display for Requirement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Choice(choices) => {
                let quoted: Vec<String> = choices.iter().map(|choice| format!("\"{choice}\"")).collect();
                write!(f, "one of {}", quoted.join(", "))
            }
            Self::AnyOf(forms) => {
                let forms: Vec<String> = forms.iter().map(Self::to_string).collect();
                f.write_str(&forms.join(", or "))
            }
            Self::Boolean => f.write_str("true or false"),
            Self::Integer(bounds) => write!(f, "a whole number{bounds}"),
            Self::Number(bounds) => write!(f, "a number{bounds}"),
            Self::Text => f.write_str("a string"),
            Self::Array { min, max, each } => {
                f.write_str("an array")?;
                match (min, max) {
                    (Some(min), Some(max)) if min == max => write!(f, " of {min}")?,
                    (Some(min), Some(max)) => write!(f, " of {min} to {max}")?,
                    (Some(min), None) => write!(f, " of at least {min}")?,
                    (None, Some(max)) => write!(f, " of at most {max}")?,
                    (None, None) => {}
                }
                write!(f, ", each {each}")
            }
            Self::Table { keys } if keys.is_empty() => f.write_str("a table"),
            Self::Table { keys } => write!(f, "a table with {}", keys.join(", ")),
            Self::Words(words) => f.write_str(words),
        }
    }
}

/// Words of an enumeration.
pub(super) fn choices(schema: &Value) -> Option<Vec<String>> {
    let words = |list: &[Value], word: fn(&Value) -> Option<&str>| {
        list.iter().map(|value| word(value).map(str::to_owned)).collect::<Option<Vec<String>>>()
    };
    match schema["enum"].as_array() {
        Some(list) => words(list, Value::as_str),
        None => words(schema["oneOf"].as_array()?, |branch| branch["const"].as_str()),
    }
}

/// Whether the schema requires the key.
pub(super) fn is_required(schema: &Value, key: &str) -> bool {
    schema["required"].as_array().is_some_and(|list| list.iter().any(|known| known == key))
}

/// A value found where another one was required.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// `true` or `false`.
    Boolean(bool),
    /// A whole number.
    Integer(i64),
    /// A floating-point number, finite or not.
    Float(f64),
    /// A string.
    Text(String),
    /// A date or time.
    Datetime(String),
    /// An array of this length.
    Array(usize),
    /// A table with these keys.
    Table(Vec<String>),
    /// A number or field that could not be read, as written.
    Written(String),
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Boolean(boolean) => write!(f, "{boolean}"),
            Self::Integer(number) => write!(f, "{number}"),
            Self::Float(number) => write!(f, "{number}"),
            Self::Text(text) => write!(f, "the string \"{text}\""),
            Self::Datetime(text) => write!(f, "the date {text}"),
            Self::Array(length) => write!(f, "an array of {length}"),
            Self::Table(keys) => write!(f, "a table with the keys {}", keys.join(", ")),
            Self::Written(text) => f.write_str(text),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn requirements_are_said_as_people_say_them() {
        for (schema, words) in [
            (json!({ "type": "integer", "minimum": 1, "maximum": 128 }), "a whole number from 1 to 128"),
            (json!({ "type": "integer", "minimum": 0, "maximum": u32::MAX }), "a whole number from 0"),
            (json!({ "type": "number", "exclusiveMinimum": 0, "x-unit": "m" }), "a number above 0 [m]"),
            (json!({ "type": "number", "maximum": 100 }), "a number up to 100"),
            (json!({ "type": "number", "exclusiveMaximum": 1 }), "a number below 1"),
            (json!({ "enum": ["a", "b"] }), "one of \"a\", \"b\""),
            (json!({ "oneOf": [{ "const": "a" }] }), "one of \"a\""),
            (json!({ "type": "array", "items": { "type": "string" } }), "an array, each a string"),
            (
                json!({ "type": "array", "minItems": 3, "maxItems": 3, "items": { "type": "boolean" } }),
                "an array of 3, each true or false",
            ),
            (json!({ "type": "object", "properties": { "a": {}, "b": {} }, "required": ["b"] }), "a table with b"),
            (json!({ "type": "object", "properties": { "a": {}, "b": {} } }), "a table with a, b"),
            (json!({ "anyOf": [{ "type": "boolean" }, { "type": "object" }] }), "true or false, or a table"),
        ] {
            assert_eq!(Requirement::of(&schema).to_string(), words);
        }
    }

    #[test]
    fn bounds_hold_finite_numbers_alone() {
        let bounds = Bounds { above: Some(0.0), max: Some(1.0), ..Bounds::default() };
        let inside = [0.0, 0.5, 1.0, 1.5, f64::NAN, f64::INFINITY].map(|number| bounds.contains(number));
        assert_eq!(inside, [false, true, true, false, false, false]);
        assert!(!Bounds::default().contains(f64::NEG_INFINITY));
    }
}
