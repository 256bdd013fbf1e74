//! A TOML document as a tree in which every value has its location: in the file or in an override.

use std::{collections::BTreeMap, ops::Range};

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{
    errors::{FormError, FormProblem, Mistakes, OVERRIDE},
    path::{Path, Step},
    requirement::Finding,
    source::{Location, Source},
};

/// A document merged with its overrides.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// Name of the document as a whole, for messages.
    name: String,
    /// The file first, then one text per override.
    sources: Vec<Source>,
    pub(super) root: Node,
}

/// One value with the locations of the value and its key; by default an empty table at the start.
#[derive(Clone, Debug, PartialEq, Default)]
pub(super) struct Node {
    /// The value.
    pub value: NodeValue,
    /// Location of the key, or of the value for an element of an array.
    pub key_span: Span,
    /// Location of the value.
    pub span: Span,
}

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum NodeValue {
    Boolean(bool),
    Integer(i64),
    Float(f64),
    Text(String),
    Datetime(String),
    Array(Vec<Node>),
    Table(BTreeMap<String, Node>),
}

/// Bytes of one of the document's sources.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub(super) struct Span {
    source: usize,
    range: Range<usize>,
}

impl Default for NodeValue {
    fn default() -> Self {
        Self::Table(BTreeMap::new())
    }
}

impl Document {
    /// Reads `text` (called `label` in messages) and applies the overrides, each `dotted.key=value`: tables are merged key by
    /// key, everything else is replaced, later overrides win.
    ///
    /// The document contains everything that can be read, and the list contains every syntax error.
    pub fn read(label: &str, text: &str, overrides: &[String]) -> (Self, Mistakes) {
        let (name, sources) = (label.to_owned(), vec![Source::new(label, text)]);
        let mut document = Self { name, sources, root: Node::default() };
        let (table, syntax) = DeTable::parse_recoverable(text);
        let mut errors = Mistakes::default();
        for error in syntax {
            let span = Span { source: 0, range: error.span().unwrap_or(0..0) };
            errors.push(syntax_error(document.location(&span), error.message().trim()));
        }
        document.root.value = NodeValue::Table(document.table(table.into_inner(), 0, &mut errors));
        for text in overrides {
            document.lay_over(text, &mut errors);
        }
        (document, errors)
    }

    /// Renames the document for messages: `14 errors in {name}`. The default name is the label of its file.
    #[must_use]
    pub fn named(self, name: &str) -> Self {
        Self { name: name.to_owned(), ..self }
    }

    /// Name of the document as a whole, for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether a value is written at a path.
    pub fn has(&self, path: impl Into<Path>) -> bool {
        self.node(&path.into()).is_some()
    }

    /// The string at a path, if there is one.
    pub fn text(&self, path: impl Into<Path>) -> Option<&str> {
        match &self.node(&path.into())?.value {
            NodeValue::Text(text) => Some(text),
            _ => None,
        }
    }

    /// Type and value at a path.
    pub fn finding(&self, path: impl Into<Path>) -> Option<Finding> {
        self.node(&path.into()).map(Node::finding)
    }

    /// Location to report for a path: its value, or else the key of the nearest written value above it.
    pub fn location_of(&self, path: impl Into<Path>) -> Location {
        let mut node = &self.root;
        for step in &path.into().0 {
            match node.child(step) {
                Some(child) => node = child,
                None => return self.location(&node.key_span),
            }
        }
        self.location(&node.span)
    }

    /// The values without their locations.
    pub fn to_table(&self) -> toml::Table {
        self.root.to_table()
    }

    fn node(&self, path: &Path) -> Option<&Node> {
        path.0.iter().try_fold(&self.root, |node, step| node.child(step))
    }

    pub(super) fn location(&self, span: &Span) -> Location {
        let location = self.sources[span.source].location(&span.range);
        // An override is one line, which its number identifies.
        if span.source > 0 { Location { line: span.source as u32, ..location } } else { location }
    }

    fn lay_over(&mut self, text: &str, errors: &mut Mistakes) {
        let source = self.sources.len();
        self.sources.push(Source::new(OVERRIDE, text));
        // A value that is not TOML is read as a string, so that `--set name=mugs` needs no quotes within quotes.
        let quoted = text.split_once('=').map(|(key, value)| {
            format!("{} = \"{}\"", key.trim(), value.trim().replace('\\', "\\\\").replace('"', "\\\""))
        });
        let message = match DeTable::parse(text) {
            // Empty texts and comments are valid TOML without a value.
            Ok(table) if table.get_ref().is_empty() => "expected key=value".to_owned(),
            Ok(table) => {
                let table = self.table(table.into_inner(), source, errors);
                return self.root.lay_over(table);
            }
            Err(error) => error.message().trim().to_owned(),
        };
        match quoted.as_deref().map(DeTable::parse) {
            Some(Ok(table)) => {
                let mut table = self.table(table.into_inner(), source, errors);
                // Locations are those of the given text: the key before '=', the value after it.
                let split = text.find('=').unwrap_or(text.len());
                table.values_mut().for_each(|node| node.point_at(source, split, text.len()));
                self.root.lay_over(table);
            }
            failed => {
                let message = if failed.is_some() { message } else { "expected key=value".to_owned() };
                errors.push(syntax_error(self.location(&Span { source, range: 0..text.len() }), &message));
            }
        }
    }

    fn table(&self, table: DeTable<'_>, source: usize, errors: &mut Mistakes) -> BTreeMap<String, Node> {
        let entries = table.into_iter().map(|(key, value)| {
            let key_span = Span { source, range: key.span() };
            (key.into_inner().into_owned(), self.node_of(value, key_span, errors))
        });
        entries.collect()
    }

    fn node_of(&self, value: Spanned<DeValue<'_>>, key_span: Span, errors: &mut Mistakes) -> Node {
        let source = key_span.source;
        let span = Span { source, range: value.span() };
        let value = match value.into_inner() {
            DeValue::String(text) => NodeValue::Text(text.into_owned()),
            DeValue::Boolean(boolean) => NodeValue::Boolean(boolean),
            DeValue::Datetime(datetime) => NodeValue::Datetime(datetime.to_string()),
            DeValue::Integer(number) => {
                NodeValue::Integer(i64::from_str_radix(number.as_str(), number.radix()).unwrap_or_else(|_| {
                    let expected = "a whole number from -2^63 to 2^63 - 1".into();
                    let problem =
                        FormProblem::OutOfRange { expected, found: Finding::Written(number.as_str().to_owned()) };
                    errors.push(FormError { location: self.location(&span), key: String::new(), problem, help: None });
                    0
                }))
            }
            // TOML's grammar is stricter than this parser's, except for the names of infinity and NaN, which both accept.
            DeValue::Float(number) => NodeValue::Float(number.as_str().parse().unwrap_or(f64::NAN)),
            DeValue::Array(array) => {
                let elements = array.into_iter().map(|element| {
                    let span = Span { source, range: element.span() };
                    self.node_of(element, span, errors)
                });
                NodeValue::Array(elements.collect())
            }
            DeValue::Table(table) => NodeValue::Table(self.table(table, source, errors)),
        };
        Node { value, key_span, span }
    }
}

fn syntax_error(location: Location, message: &str) -> FormError {
    let problem = FormProblem::Syntax { message: message.to_owned() };
    FormError { location, key: String::new(), problem, help: None }
}

impl Node {
    fn child(&self, step: &Step) -> Option<&Self> {
        match (&self.value, step) {
            (NodeValue::Table(table), Step::Key(key)) => table.get(key),
            (NodeValue::Array(array), Step::Index(index)) => array.get(*index),
            _ => None,
        }
    }

    /// Merges a table into the node: tables are merged, everything else is replaced.
    fn lay_over(&mut self, above: BTreeMap<String, Self>) {
        let NodeValue::Table(below) = &mut self.value else { return };
        for (key, node) in above {
            match (below.get_mut(&key), node.value) {
                (Some(old), NodeValue::Table(new)) if matches!(old.value, NodeValue::Table(_)) => old.lay_over(new),
                (_, value) => {
                    below.insert(key, Self { value, ..node });
                }
            }
        }
    }

    /// Sets the spans of the node and all nodes below it to those of an override: keys left of `split`, values right of it.
    fn point_at(&mut self, source: usize, split: usize, end: usize) {
        self.key_span = Span { source, range: 0..split };
        self.span = Span { source, range: (split + 1).min(end)..end };
        if let NodeValue::Table(table) = &mut self.value {
            table.values_mut().for_each(|node| node.point_at(source, split, end));
        }
    }

    /// Type and value of the node, for messages.
    pub fn finding(&self) -> Finding {
        match &self.value {
            NodeValue::Boolean(boolean) => Finding::Boolean(*boolean),
            NodeValue::Integer(number) => Finding::Integer(*number),
            NodeValue::Float(number) => Finding::Float(*number),
            NodeValue::Text(text) => Finding::Text(text.clone()),
            NodeValue::Datetime(text) => Finding::Datetime(text.clone()),
            NodeValue::Array(array) => Finding::Array(array.len()),
            NodeValue::Table(table) => Finding::Table(table.keys().cloned().collect()),
        }
    }

    /// The values of a table without their locations.
    pub fn to_table(&self) -> toml::Table {
        match &self.value {
            NodeValue::Table(table) => table.iter().map(|(key, node)| (key.clone(), node.to_toml())).collect(),
            _ => toml::Table::new(),
        }
    }

    /// The value without its location.
    fn to_toml(&self) -> toml::Value {
        match &self.value {
            NodeValue::Boolean(boolean) => toml::Value::Boolean(*boolean),
            NodeValue::Integer(number) => toml::Value::Integer(*number),
            NodeValue::Float(number) => toml::Value::Float(*number),
            NodeValue::Text(text) | NodeValue::Datetime(text) => toml::Value::String(text.clone()),
            NodeValue::Array(array) => toml::Value::Array(array.iter().map(Self::to_toml).collect()),
            NodeValue::Table(_) => toml::Value::Table(self.to_table()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, overrides: &[&str]) -> (Document, Mistakes) {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        Document::read("a.toml", text, &overrides)
    }

    #[test]
    fn overrides_join_tables_and_replace_the_rest() {
        let (document, errors) = read("a = { b = 1, c = [1, 2] }\n", &["a.c=[3]", "a.d=x y", "name=mugs"]);
        assert!(errors.is_empty());
        let expected: toml::Table = "a = { b = 1, c = [3], d = \"x y\" }\nname = \"mugs\"".parse().unwrap();
        assert_eq!(document.to_table(), expected);
        assert_eq!(document.text("name"), Some("mugs"));
        assert!(document.has("a.d") && !document.has("a.e"));
    }

    #[test]
    fn values_and_keys_know_their_places() {
        let (document, _) = read("[a]\nb = 1\n", &["a.c=two words"]);
        let location = |path: &str| document.location_of(path).to_string();
        assert_eq!(location("a.b"), "a.toml:2:5");
        // No value is written there: use the key of the nearest table.
        assert_eq!(location("a.x"), "a.toml:1:2");
        // The first override.
        assert_eq!(location("a.c"), "--set:1:5");
    }

    #[test]
    fn what_cannot_be_read_does_not_hide_the_rest() {
        let (document, errors) = read("a = \nb = 99999999999999999999\nc = 3\n", &["no value", "=3", "", "# c"]);
        let codes: Vec<&str> = errors.iter().map(|error| error.problem.code()).collect();
        assert_eq!(codes, ["syntax", "out_of_range", "syntax", "syntax", "syntax", "syntax"]);
        assert!(document.has("c"));
    }
}
