//! A TOML document as a tree whose every node knows where it was written: in the file or in a `--set`.

use std::{collections::BTreeMap, fmt, ops::Range};

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::errors::{JobError, Place, Problem};

/// A document and the overrides laid over it.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// The file first, then one text an override.
    sources: Vec<Source>,
    /// The root table.
    pub root: Node,
}

#[derive(Clone, Debug, PartialEq)]
struct Source {
    label: String,
    text: String,
}

/// One value and where it and its key stand.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// The value.
    pub value: NodeValue,
    /// Where the key stands, or the value itself for an element of an array.
    pub key_span: Span,
    /// Where the value stands.
    pub span: Span,
}

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub enum NodeValue {
    /// `true` or `false`.
    Boolean(bool),
    /// A whole number.
    Integer(i64),
    /// A number with a point, finite or not.
    Float(f64),
    /// A string.
    Text(String),
    /// A date or time: no key of a job wants one.
    Datetime(String),
    /// An array.
    Array(Vec<Node>),
    /// A table.
    Table(BTreeMap<String, Node>),
}

/// Bytes of one of the document's sources.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Span {
    source: usize,
    range: Range<usize>,
}

/// One step from a node to a node below it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Step {
    /// A key of a table.
    Key(String),
    /// An element of an array.
    Index(usize),
}

/// The way from the root to a node; shown as `objects[1].meshes."a b".unit`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Path(pub Vec<Step>);

impl Path {
    /// The path one key further.
    pub fn key(&self, key: &str) -> Self {
        let mut steps = self.0.clone();
        steps.push(Step::Key(key.to_owned()));
        Self(steps)
    }

    /// The path one element further.
    pub fn index(&self, index: usize) -> Self {
        let mut steps = self.0.clone();
        steps.push(Step::Index(index));
        Self(steps)
    }

    /// From a dotted path of plain keys.
    pub fn of(dotted: &str) -> Self {
        Self(dotted.split('.').filter(|key| !key.is_empty()).map(|key| Step::Key(key.to_owned())).collect())
    }

    /// Whether `self` is `other` or lies above it.
    pub fn holds(&self, other: &Self) -> bool {
        other.0.starts_with(&self.0)
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, step) in self.0.iter().enumerate() {
            match step {
                Step::Key(key) => {
                    if place > 0 {
                        f.write_str(".")?;
                    }
                    if is_bare(key) { f.write_str(key)? } else { write!(f, "\"{}\"", key.escape_debug())? }
                }
                Step::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

/// Whether a key needs no quotes.
fn is_bare(key: &str) -> bool {
    !key.is_empty() && key.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-')
}

impl Document {
    /// Reads `text` (labelled `label` in messages) and lays the overrides, each `dotted.key=value`, over it.
    ///
    /// Everything that can be read is in the document, every syntax error in the list.
    pub fn read(label: &str, text: &str, overrides: &[String]) -> (Self, Vec<JobError>) {
        let mut document = Self {
            sources: vec![Source { label: label.to_owned(), text: text.to_owned() }],
            root: Node {
                value: NodeValue::Table(BTreeMap::new()),
                key_span: Span { source: 0, range: 0..0 },
                span: Span { source: 0, range: 0..0 },
            },
        };
        let (table, syntax) = DeTable::parse_recoverable(text);
        let mut errors = Vec::new();
        for error in syntax {
            let place = document.place(&Span { source: 0, range: error.span().unwrap_or(0..0) });
            errors.push(JobError::at(place, "", Problem::Syntax { message: error.message().trim().to_owned() }));
        }
        document.root.value = NodeValue::Table(document.table(table.into_inner(), 0, &mut errors));
        for text in overrides {
            document.lay_over(text, &mut errors);
        }
        (document, errors)
    }

    /// Where a span stands, for messages.
    pub fn place(&self, span: &Span) -> Place {
        let Source { label, text } = &self.sources[span.source];
        let place = Place::in_text(label, text, span.range.clone());
        // An override is one line: its number tells which.
        if span.source > 0 { Place { line: span.source as u32, ..place } } else { place }
    }

    /// The node at a path.
    pub fn get(&self, path: &Path) -> Option<&Node> {
        path.0.iter().try_fold(&self.root, |node, step| node.child(step))
    }

    /// Whether something is written at a dotted path of plain keys.
    pub fn has(&self, dotted: &str) -> bool {
        self.get(&Path::of(dotted)).is_some()
    }

    /// Where to point for a path: its value, else the key of the nearest node above that was written.
    pub fn place_of(&self, path: &Path) -> Place {
        let mut node = &self.root;
        for step in &path.0 {
            match node.child(step) {
                Some(child) => node = child,
                None => return self.place(&node.key_span),
            }
        }
        self.place(&node.span)
    }

    fn lay_over(&mut self, text: &str, errors: &mut Vec<JobError>) {
        let source = self.sources.len();
        // A value that is no TOML is taken as a string, so that `--set name=mugs` needs no quotes within quotes.
        let quoted = text.split_once('=').map(|(key, value)| {
            format!("{} = \"{}\"", key.trim(), value.trim().replace('\\', "\\\\").replace('"', "\\\""))
        });
        let parsed = DeTable::parse(text).map_err(|error| error.message().trim().to_owned());
        let again = quoted.as_deref().filter(|quoted| parsed.is_err() && DeTable::parse(quoted).is_ok());
        self.sources.push(Source { label: "--set".to_owned(), text: text.to_owned() });
        let table = match (parsed, again) {
            (Ok(table), _) => self.table(table.into_inner(), source, errors),
            (Err(_), Some(quoted)) => {
                let mut table = match DeTable::parse(quoted) {
                    Ok(table) => self.table(table.into_inner(), source, errors),
                    Err(_) => BTreeMap::new(),
                };
                // Point at the text as given: the key up to '=', the value behind it.
                let split = text.find('=').unwrap_or(text.len());
                table.values_mut().for_each(|node| node.point_at(source, split, text.len()));
                table
            }
            (Err(message), None) => {
                let place = self.place(&Span { source, range: 0..text.len() });
                let message = if quoted.is_some() { message } else { "expected key=value".to_owned() };
                errors.push(JobError::at(place, "", Problem::Syntax { message }));
                return;
            }
        };
        lay_table(&mut self.root, table);
    }

    fn table(&self, table: DeTable<'_>, source: usize, errors: &mut Vec<JobError>) -> BTreeMap<String, Node> {
        let entries = table.into_iter().map(|(key, value)| {
            let key_span = Span { source, range: key.span() };
            let node = self.node(value, key_span, source, errors);
            (key.into_inner().into_owned(), node)
        });
        entries.collect()
    }

    fn node(&self, value: Spanned<DeValue<'_>>, key_span: Span, source: usize, errors: &mut Vec<JobError>) -> Node {
        let span = Span { source, range: value.span() };
        let value = match value.into_inner() {
            DeValue::String(text) => NodeValue::Text(text.into_owned()),
            DeValue::Boolean(boolean) => NodeValue::Boolean(boolean),
            DeValue::Datetime(datetime) => NodeValue::Datetime(datetime.to_string()),
            DeValue::Integer(number) => {
                NodeValue::Integer(i64::from_str_radix(number.as_str(), number.radix()).unwrap_or_else(|_| {
                    let found = number.as_str().to_owned();
                    let expected = "a whole number from -2^63 to 2^63 - 1".to_owned();
                    let problem = Problem::OutOfRange { expected, found };
                    errors.push(JobError::at(self.place(&span), "", problem));
                    0
                }))
            }
            // TOML's grammar is stricter than this parser's, up to the names of infinity and NaN, which it knows too.
            DeValue::Float(number) => NodeValue::Float(number.as_str().parse().unwrap_or(f64::NAN)),
            DeValue::Array(array) => NodeValue::Array(
                array
                    .into_iter()
                    .map(|element| {
                        let span = Span { source, range: element.span() };
                        self.node(element, span, source, errors)
                    })
                    .collect(),
            ),
            DeValue::Table(table) => NodeValue::Table(self.table(table, source, errors)),
        };
        Node { value, key_span, span }
    }
}

/// Lays one table over another: tables are joined, everything else is replaced.
fn lay_table(below: &mut Node, above: BTreeMap<String, Node>) {
    if let NodeValue::Table(table) = &mut below.value {
        for (key, node) in above {
            match (table.get_mut(&key), node) {
                (Some(old), Node { value: NodeValue::Table(new), key_span, span })
                    if matches!(old.value, NodeValue::Table(_)) =>
                {
                    let _ = (key_span, span);
                    lay_table(old, new);
                }
                (_, node) => {
                    table.insert(key, node);
                }
            }
        }
    }
}

impl Node {
    fn child(&self, step: &Step) -> Option<&Node> {
        match (&self.value, step) {
            (NodeValue::Table(table), Step::Key(key)) => table.get(key),
            (NodeValue::Array(array), Step::Index(index)) => array.get(*index),
            _ => None,
        }
    }

    /// Gives the node and all below it the spans of an override: keys left of `split`, values right of it.
    fn point_at(&mut self, source: usize, split: usize, end: usize) {
        self.key_span = Span { source, range: 0..split };
        self.span = Span { source, range: (split + 1).min(end)..end };
        if let NodeValue::Table(table) = &mut self.value {
            table.values_mut().for_each(|node| node.point_at(source, split, end));
        }
    }

    /// What the node is, for messages: `the string "mm"`, `the table`, `3`.
    pub fn describe(&self) -> String {
        match &self.value {
            NodeValue::Boolean(boolean) => boolean.to_string(),
            NodeValue::Integer(number) => number.to_string(),
            NodeValue::Float(number) => number.to_string(),
            NodeValue::Text(text) => format!("the string \"{text}\""),
            NodeValue::Datetime(text) => format!("the date {text}"),
            NodeValue::Array(array) => format!("an array of {}", array.len()),
            NodeValue::Table(table) => {
                let keys: Vec<&str> = table.keys().map(String::as_str).collect();
                format!("a table with the keys {}", keys.join(", "))
            }
        }
    }

    /// The same value for serde.
    pub fn to_toml(&self) -> toml::Value {
        match &self.value {
            NodeValue::Boolean(boolean) => toml::Value::Boolean(*boolean),
            NodeValue::Integer(number) => toml::Value::Integer(*number),
            NodeValue::Float(number) => toml::Value::Float(*number),
            NodeValue::Text(text) | NodeValue::Datetime(text) => toml::Value::String(text.clone()),
            NodeValue::Array(array) => toml::Value::Array(array.iter().map(Node::to_toml).collect()),
            NodeValue::Table(table) => {
                toml::Value::Table(table.iter().map(|(key, node)| (key.clone(), node.to_toml())).collect())
            }
        }
    }
}
