//! Statements of a camera file, whatever its syntax: keys, lists and scalars.

use super::problem::CameraProblem;

/// Most levels of lists and keys.
pub(super) const MAX_DEPTH: usize = 16;

/// A value with the line that it begins in, from 1; 0 where the syntax has none.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Statement {
    pub(super) line: usize,
    pub(super) value: Value,
}

/// Content of a statement.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    /// Numbers, words, true and false, as they are written; empty for nothing.
    Scalar(String),
    List(Vec<Statement>),
    /// Keys in their order, each once.
    Map(Vec<(String, Statement)>),
}

impl Statement {
    pub(super) fn scalar(line: usize, text: impl Into<String>) -> Self {
        Self { line, value: Value::Scalar(text.into()) }
    }

    /// The keys of a map; none for anything else.
    pub(super) fn keys(&self) -> &[(String, Self)] {
        match &self.value {
            Value::Map(keys) => keys,
            Value::Scalar(_) | Value::List(_) => &[],
        }
    }

    /// The value of a key.
    pub(super) fn get(&self, key: &str) -> Option<&Self> {
        self.keys().iter().find(|(name, _)| name == key).map(|(_, value)| value)
    }

    /// Whether the map has the key.
    pub(super) fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// The key for messages, with its line where it is known.
    pub(super) fn place(&self, key: &str) -> String {
        if self.line > 0 { format!("{key} (line {})", self.line) } else { key.to_owned() }
    }

    /// The scalar as a text.
    pub(super) fn text(&self, key: &str, remedy: &'static str) -> Result<&str, CameraProblem> {
        match &self.value {
            Value::Scalar(text) => Ok(text),
            Value::List(_) => Err(CameraProblem::content(self.place(key), "a list", remedy)),
            Value::Map(_) => Err(CameraProblem::content(self.place(key), "further keys", remedy)),
        }
    }

    /// The scalar as a number.
    pub(super) fn number(&self, key: &str, remedy: &'static str) -> Result<f64, CameraProblem> {
        let text = self.text(key, remedy)?;
        let number = text.parse().ok();
        number.ok_or_else(|| CameraProblem::content(self.place(key), format!("'{text}' is no number"), remedy))
    }

    /// The scalar as a whole number of pixels or the like.
    pub(super) fn whole(&self, key: &str, remedy: &'static str) -> Result<u32, CameraProblem> {
        let number = self.number(key, remedy)?;
        if number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number) {
            Ok(number as u32)
        } else {
            Err(CameraProblem::content(self.place(key), format!("{number} is no whole number"), remedy))
        }
    }

    /// The numbers of a list, of a list of rows, or of a matrix with `data`, row by row.
    pub(super) fn numbers(&self, key: &str, remedy: &'static str) -> Result<Vec<f64>, CameraProblem> {
        let mut numbers = Vec::new();
        match &self.value {
            Value::Map(_) => {
                const MATRIX: [&str; 5] = ["rows", "cols", "dt", "data", "type_id"];
                if let Some((other, value)) = self.keys().iter().find(|(name, _)| !MATRIX.contains(&name.as_str())) {
                    let found = "a key that no matrix has";
                    return Err(CameraProblem::content(value.place(&format!("{key}.{other}")), found, remedy));
                }
                let Some(data) = self.get("data") else {
                    return Err(CameraProblem::content(self.place(key), "a matrix without `data`", remedy));
                };
                data.collect_numbers(key, remedy, &mut numbers)?;
                let side =
                    |name: &str| self.get(name).map(|side| side.whole(&format!("{key}.{name}"), remedy)).transpose();
                if let (Some(rows), Some(columns)) = (side("rows")?, side("cols")?)
                    && u64::from(rows) * u64::from(columns) != numbers.len() as u64
                {
                    let found = format!("{} numbers for {rows} rows of {columns}", numbers.len());
                    return Err(CameraProblem::content(self.place(key), found, remedy));
                }
            }
            Value::List(_) | Value::Scalar(_) => self.collect_numbers(key, remedy, &mut numbers)?,
        }
        Ok(numbers)
    }

    fn collect_numbers(&self, key: &str, remedy: &'static str, numbers: &mut Vec<f64>) -> Result<(), CameraProblem> {
        match &self.value {
            Value::List(items) => items.iter().try_for_each(|item| item.collect_numbers(key, remedy, numbers)),
            // A key without a value is an empty list.
            Value::Scalar(text) if text.is_empty() => Ok(()),
            Value::Scalar(_) | Value::Map(_) => {
                numbers.push(self.number(key, remedy)?);
                Ok(())
            }
        }
    }
}
