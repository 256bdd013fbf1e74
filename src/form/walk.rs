//! Comparison of a document with a schema: every mistake is reported, and none stops the comparison.
//!
//! Values that do not fit are removed from the document and replaced by a default or a placeholder, so that later checks can
//! report their mistakes in the same run.

use std::{collections::BTreeSet, mem, sync::Arc};

use serde_json::Value;

use super::{
    checker::Checker,
    document::{Node, NodeValue},
    errors::FormProblem,
    names::did_you_mean,
    path::Path,
    requirement::{Bounds, Requirement, choices, is_required},
    schema::{Schema, digits_of_pattern},
};

/// Knowledge about keys beyond the schema. `()` has none.
pub trait Hints {
    /// Remedy for an unknown key, the last of its path, that is not similar to a known one.
    fn unknown_key(&self, path: &Path, key: &str) -> Option<String>;

    /// Requirement to report for a missing key instead of the schema's, and a remedy.
    fn missing(&self, path: &Path) -> Option<(Requirement, String)>;

    /// Path of the key that took the place of an unknown one.
    fn renamed_key(&self, _path: &Path) -> Option<Path> {
        None
    }

    /// The word that took the place of one that is not among the choices of a key.
    fn renamed_value(&self, _path: &Path, _value: &str) -> Option<String> {
        None
    }
}

impl Hints for () {
    fn unknown_key(&self, _: &Path, _: &str) -> Option<String> {
        None
    }

    fn missing(&self, _: &Path) -> Option<(Requirement, String)> {
        None
    }
}

impl Checker {
    /// Compares the document with a schema, reports values that do not fit, and removes them from the document.
    pub fn check_schema(&mut self, schema: &Schema, hints: &dyn Hints) {
        let mut root = mem::take(&mut self.document.root);
        Walk { checker: self, hints }.value(&mut root, schema.value(), &Path::default());
        self.document.root = root;
    }
}

struct Walk<'a> {
    checker: &'a mut Checker,
    hints: &'a dyn Hints,
}

impl Walk<'_> {
    /// Reports a value that must be removed.
    fn reject(&mut self, node: &Node, path: &Path, problem: FormProblem) -> bool {
        self.checker.report_at(&node.span, path, problem);
        false
    }

    fn wrong_type(&mut self, node: &Node, expected: Requirement, path: &Path) -> bool {
        self.reject(node, path, FormProblem::WrongType { expected, found: node.finding() })
    }

    fn out_of_range(&mut self, node: &Node, schema: &Value, path: &Path) -> bool {
        let problem = FormProblem::OutOfRange { expected: Requirement::of(schema), found: node.finding() };
        self.reject(node, path, problem)
    }

    /// Checks a value; returns whether it may stay.
    fn value(&mut self, node: &mut Node, schema: &Value, path: &Path) -> bool {
        if let Some(choices) = choices(schema) {
            return self.choice(node, choices, path);
        }
        if let Some(branches) = schema["anyOf"].as_array() {
            if self.is_of_no_form(node, branches, path) {
                return false;
            }
            return match best_branch(node, branches) {
                Some(branch) => self.value(node, branch, path),
                None => self.wrong_type(node, Requirement::of(schema), path),
            };
        }
        match (&node.value, schema["type"].as_str()) {
            (NodeValue::Table(_), Some("object")) => self.table(node, schema, path),
            (NodeValue::Array(_), Some("array")) => self.array(node, schema, path),
            (NodeValue::Boolean(_), Some("boolean")) => true,
            (NodeValue::Text(text), Some("string")) => match digits_of_pattern(schema) {
                Some(count) if !is_hexadecimal(text, count) => {
                    let (expected, found) = (format!("{count} hexadecimal digits"), node.finding().to_string());
                    self.reject(node, path, FormProblem::Invalid { expected, found })
                }
                _ => true,
            },
            (NodeValue::Integer(number), Some("integer" | "number")) => {
                Bounds::of(schema).contains(*number as f64) || self.out_of_range(node, schema, path)
            }
            (NodeValue::Float(number), Some("number")) => {
                Bounds::of(schema).contains(*number) || self.out_of_range(node, schema, path)
            }
            _ => self.wrong_type(node, Requirement::of(schema), path),
        }
    }

    /// Reports the keys of a table if no form knows any of them: then no missing key can be reported.
    fn is_of_no_form(&mut self, node: &Node, branches: &[Value], path: &Path) -> bool {
        let NodeValue::Table(table) = &node.value else { return false };
        let forms = branches.iter().filter_map(|branch| branch["properties"].as_object());
        let known: BTreeSet<&String> = forms.flat_map(|properties| properties.keys()).collect();
        if known.is_empty() || table.is_empty() || table.keys().any(|key| known.contains(key)) {
            return false;
        }
        let known: Arc<[String]> = known.into_iter().cloned().collect();
        for (key, child) in table {
            self.unknown_key(child, key, &known, path);
        }
        true
    }

    fn unknown_key(&mut self, child: &Node, key: &str, known: &Arc<[String]>, path: &Path) {
        let path = path.key(key);
        let problem = FormProblem::UnknownKey { found: key.to_owned(), known: Arc::clone(known) };
        if let Some(new) = self.hints.renamed_key(&path) {
            self.checker.report_at(&child.key_span, &path, problem).help(format!("renamed to `{new}`"));
            // The new key is not reported as missing.
            self.checker.set_wrong(new);
            return;
        }
        let near = did_you_mean(key, known.iter().map(String::as_str));
        let help = near.or_else(|| self.hints.unknown_key(&path, key));
        self.checker.report_at(&child.key_span, &path, problem).help_if(help);
    }

    fn choice(&mut self, node: &Node, choices: Vec<String>, path: &Path) -> bool {
        let NodeValue::Text(found) = &node.value else {
            return self.wrong_type(node, Requirement::Choice(choices), path);
        };
        if choices.contains(found) {
            return true;
        }
        let renamed = self.hints.renamed_value(path, found).map(|new| format!("renamed to `\"{new}\"`"));
        let help = renamed.or_else(|| did_you_mean(found, choices.iter().map(String::as_str)));
        let problem = FormProblem::NotAChoice { found: found.clone(), choices };
        self.checker.report_at(&node.span, path, problem).help_if(help);
        false
    }

    fn array(&mut self, node: &mut Node, schema: &Value, path: &Path) -> bool {
        let NodeValue::Array(elements) = &mut node.value else { return false };
        let count = elements.len() as u64;
        let limit = |keyword: &str| schema[keyword].as_u64();
        if limit("minItems").is_some_and(|min| count < min) || limit("maxItems").is_some_and(|max| count > max) {
            return self.out_of_range(node, schema, path);
        }
        // Tables with mistakes stay, because later checks name elements by their index.
        let of_tables = schema["items"].get("properties").is_some();
        let (mut index, mut all_stay) = (0, true);
        elements.retain_mut(|element| {
            let stays = self.value(element, &schema["items"], &path.index(index)) || of_tables;
            index += 1;
            all_stay &= stays;
            stays
        });
        all_stay
    }

    fn table(&mut self, node: &mut Node, schema: &Value, path: &Path) -> bool {
        let NodeValue::Table(table) = &mut node.value else { return false };
        // Each value is checked by the schema of its key, or else by that of free keys; other keys are unknown.
        let mut known: Option<Arc<[String]>> = None;
        table.retain(|key, child| match schema_of_key(schema, key) {
            Some(below) => self.value(child, below, &path.key(key)),
            None => {
                let keys =
                    || schema["properties"].as_object().into_iter().flat_map(|keys| keys.keys().cloned()).collect();
                self.unknown_key(child, key, known.get_or_insert_with(keys), path);
                false
            }
        });
        // Missing required keys. A written key with a wrong value was already reported.
        let required = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
        let mut is_complete = true;
        for key in required.filter(|key| !table.contains_key(*key)) {
            is_complete = false;
            let below = path.key(key);
            if !self.checker.is_wrong(&below) {
                let (expected, help) = match self.hints.missing(&below) {
                    Some((expected, help)) => (expected, Some(help)),
                    None => (Requirement::of(&schema["properties"][key]), None),
                };
                self.checker.report_at(&node.key_span, &below, FormProblem::Missing { expected }).help_if(help);
            }
        }
        is_complete
    }
}

/// The schema of a key's value, if the table may have the key.
fn schema_of_key<'a>(schema: &'a Value, key: &str) -> Option<&'a Value> {
    let free = || schema.get("additionalProperties").filter(|free| free.is_object());
    schema["properties"].get(key).or_else(free)
}

fn is_hexadecimal(text: &str, count: usize) -> bool {
    text.len() == count && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// The most likely intended form of a value.
fn best_branch<'a>(node: &Node, branches: &'a [Value]) -> Option<&'a Value> {
    let score = |branch: &Value| -> Option<usize> {
        match (&node.value, branch["type"].as_str()) {
            (NodeValue::Text(_), _) if choices(branch).is_some() => Some(0),
            (NodeValue::Boolean(_), Some("boolean"))
            | (NodeValue::Text(_), Some("string"))
            | (NodeValue::Array(_), Some("array"))
            | (NodeValue::Float(_) | NodeValue::Integer(_), Some("number")) => Some(0),
            (NodeValue::Integer(_), Some("integer")) => Some(1),
            (NodeValue::Table(table), Some("object")) => {
                let known = branch["properties"].as_object()?;
                Some(table.keys().filter(|key| known.contains_key(*key)).count())
            }
            _ => None,
        }
    };
    // The first of the best forms.
    let scored = branches.iter().filter_map(|branch| Some((score(branch)?, branch)));
    scored.rev().max_by_key(|(score, _)| *score).map(|(_, branch)| branch)
}

/// Inserts a placeholder for each missing required key, so that the whole can be read as its type.
pub(super) fn complete(node: &mut Node, schema: &Value) {
    if let Some(branches) = schema["anyOf"].as_array() {
        if let Some(branch) = best_branch(node, branches) {
            complete(node, branch);
        }
        return;
    }
    match &mut node.value {
        NodeValue::Array(elements) => elements.iter_mut().for_each(|element| complete(element, &schema["items"])),
        NodeValue::Table(table) => {
            for (key, child) in table.iter_mut() {
                schema_of_key(schema, key).into_iter().for_each(|below| complete(child, below));
            }
            for (key, below) in schema["properties"].as_object().into_iter().flatten() {
                if is_required(schema, key) && !table.contains_key(key) {
                    table.insert(key.clone(), placeholder(below));
                }
            }
        }
        _ => {}
    }
}

/// A value of the right type and, for numbers, within the range.
fn placeholder(schema: &Value) -> Node {
    let number = || {
        let bounds = Bounds::of(schema);
        let candidates = [Some(1.0), bounds.min, bounds.max, bounds.above.map(|above| above + 1.0)];
        candidates.into_iter().flatten().find(|number| bounds.contains(*number)).unwrap_or(0.0)
    };
    let value = match (choices(schema), schema["type"].as_str()) {
        (Some(choices), _) => NodeValue::Text(choices.first().cloned().unwrap_or_default()),
        (None, Some("boolean")) => NodeValue::Boolean(false),
        (None, Some("integer")) => NodeValue::Integer(number() as i64),
        (None, Some("number")) => NodeValue::Float(number()),
        (None, Some("array")) => {
            let count = schema["minItems"].as_u64().unwrap_or(0);
            NodeValue::Array((0..count).map(|_| placeholder(&schema["items"])).collect())
        }
        (None, Some("object")) => {
            let mut table = Node::default();
            complete(&mut table, schema);
            return table;
        }
        (None, Some(_)) => NodeValue::Text(String::new()),
        (None, None) => return schema["anyOf"].get(0).map(placeholder).unwrap_or_default(),
    };
    Node { value, ..Node::default() }
}
