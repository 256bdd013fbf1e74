//! Sums over a description, compared with its bounds.

use std::{collections::BTreeMap, sync::Arc};

use super::{
    bounds::{BOUNDS, ElementBound, MAX_BYTES, MAX_DEPTH, MAX_ELEMENTS, REPLICATE, Rule},
    document::Document,
    error::{DescriptionError, TooLarge},
    statement::Statement,
};

/// Sums over a description.
#[derive(Clone, Debug, Default)]
struct Sums {
    /// Elements that are made, copies included.
    elements: f64,
    /// Elements of texts, each as often as it is read.
    read: f64,
    bytes: f64,
    /// Elements within each other.
    depth: usize,
    /// By the row of [`BOUNDS`].
    counts: BTreeMap<usize, f64>,
    /// The largest default of each attribute that takes memory, by element and attribute.
    defaults: Defaults,
}

type Defaults = BTreeMap<(String, &'static str), f64>;

/// Refuses a description that needs more than any robot, hand or scene does.
pub(super) fn check(document: &Arc<Document>) -> Result<(), DescriptionError> {
    Check::default().document(document).map(drop)
}

/// Sums of the documents that were checked, by their addresses: an attached model may attach others many times over.
#[derive(Default)]
struct Check {
    known: BTreeMap<*const Document, Sums>,
}

impl Check {
    fn document(&mut self, document: &Arc<Document>) -> Result<Sums, DescriptionError> {
        let address = Arc::as_ptr(document);
        if let Some(known) = self.known.get(&address) {
            return Ok(known.clone());
        }
        let mut sums = Sums { defaults: defaults(document), ..Sums::default() };
        // Copies of each element's content, and elements around that: parents come before their children.
        let mut within: Vec<(f64, usize)> = Vec::with_capacity(document.statements.len());
        for (index, statement) in document.statements.iter().enumerate() {
            let (times, depth) = statement.parent.map_or((1.0, 0), |parent| within[parent]);
            within.push((times * own_copies(statement), depth + 1));
            sums.elements += times;
            sums.depth = sums.depth.max(depth + 1);
            for (row, bound) in BOUNDS.iter().enumerate().filter(|(_, bound)| statement.is_or_defaults(bound.element)) {
                sums.add(row, bound, statement, times).map_err(|error| error.at(&statement.place))?;
            }
            sums.read += 1.0;
            // MuJoCo reads the file of each model again, whether it is attached or not.
            if let Some(model) = document.model(index) {
                sums.read += self.document(model)?.read;
            }
            if let Some(model) = document.attached(index) {
                let attached = self.document(model)?;
                sums.add_all(&attached, times);
                sums.depth = sums.depth.max(depth + attached.depth);
            }
            sums.check().map_err(|error| error.at(&statement.place))?;
        }
        self.known.insert(address, sums.clone());
        Ok(sums)
    }
}

impl Sums {
    /// Adds what a row counts for an element that occurs `times` times.
    fn add(&mut self, row: usize, bound: &ElementBound, statement: &Statement, times: f64) -> Result<(), TooLarge> {
        let is_default = !statement.is(bound.element);
        match bound.rule {
            Rule::Count { .. } | Rule::Copies { .. } | Rule::Memory { .. } if is_default => {}
            Rule::Count { .. } => *self.counts.entry(row).or_default() += times,
            Rule::Value { attribute, range: [least, most] } => {
                for (name, value) in bounded(statement, attribute) {
                    let wrong =
                        value.split_ascii_whitespace().map(number).any(|number| number < least || number > most);
                    if wrong {
                        return Err(TooLarge::Value {
                            element: statement.element.clone(),
                            attribute: name.clone(),
                            value: value.clone(),
                            range: [least, most],
                        });
                    }
                }
            }
            Rule::Copies { attribute, most } => {
                let made = product(&[statement.get(attribute).map(numbers_product)]);
                if made > most {
                    let (element, attribute) = (statement.element.clone(), attribute.to_owned());
                    return Err(TooLarge::Copies { element, attribute, copies: made, most });
                }
                self.elements += times * made;
            }
            Rule::Numbers { attribute, most } => {
                let count = statement.get(attribute).map_or(0, |value| value.split_ascii_whitespace().count());
                if count > most {
                    let (element, attribute) = (statement.element.clone(), attribute.to_owned());
                    return Err(TooLarge::Numbers { element, attribute, count, most });
                }
            }
            Rule::Memory { attributes, unit } => {
                let value = |attribute: &&'static str| {
                    let default = || self.defaults.get(&(statement.element.clone(), *attribute)).copied();
                    statement.get(attribute).map(numbers_product).or_else(default)
                };
                let values: Vec<Option<f64>> = attributes.iter().map(value).collect();
                if values.iter().any(Option::is_some) {
                    self.bytes += times * unit * product(&values);
                }
            }
        }
        Ok(())
    }

    /// Adds an attached model.
    fn add_all(&mut self, other: &Self, times: f64) {
        self.elements += times * other.elements;
        self.bytes += times * other.bytes;
        for (row, count) in &other.counts {
            *self.counts.entry(*row).or_default() += times * count;
        }
    }

    fn check(&self) -> Result<(), TooLarge> {
        let elements = self.elements.max(self.read);
        if elements > MAX_ELEMENTS {
            return Err(TooLarge::Elements { elements, most: MAX_ELEMENTS });
        }
        if self.depth > MAX_DEPTH {
            return Err(TooLarge::Depth);
        }
        if self.bytes > MAX_BYTES {
            return Err(TooLarge::Memory { bytes: self.bytes, most: MAX_BYTES });
        }
        for (row, count) in &self.counts {
            let ElementBound { element, rule: Rule::Count { most } } = BOUNDS[*row] else { continue };
            if *count > most {
                return Err(TooLarge::Count { element, count: *count, most });
            }
        }
        Ok(())
    }
}

/// The attributes of an element that a name means: `nuser_*` all that begin so.
fn bounded<'s>(statement: &'s Statement, attribute: &str) -> impl Iterator<Item = &'s (String, String)> {
    let (begin, is_open) = attribute.strip_suffix('*').map_or((attribute, false), |begin| (begin, true));
    statement.attributes.iter().filter(move |(name, _)| if is_open { name.starts_with(begin) } else { name == begin })
}

/// Copies that an element makes of its content.
fn own_copies(statement: &Statement) -> f64 {
    if statement.is(REPLICATE) { product(&[statement.get("count").map(numbers_product)]) } else { 1.0 }
}

/// The largest defaults of attributes that take memory.
fn defaults(document: &Document) -> Defaults {
    let mut found = Defaults::new();
    for statement in document.statements.iter().filter(|statement| statement.within == "default") {
        for bound in BOUNDS.iter().filter(|bound| statement.is_or_defaults(bound.element)) {
            let Rule::Memory { attributes, .. } = bound.rule else { continue };
            for attribute in attributes {
                let value = statement.get(attribute).map_or(0.0, numbers_product);
                let largest = found.entry((statement.element.clone(), *attribute)).or_default();
                *largest = value.max(*largest);
            }
        }
    }
    found
}

/// The product of values; a missing value counts as the largest of the others, and no value at all as 1.
fn product(values: &[Option<f64>]) -> f64 {
    let largest = values.iter().flatten().copied().fold(1.0, f64::max);
    values.iter().map(|value| value.unwrap_or(largest)).product()
}

/// The product of all numbers of an attribute, each at least 1.
fn numbers_product(value: &str) -> f64 {
    value.split_ascii_whitespace().map(number).map(|number| number.max(1.0)).product()
}

/// A number as MuJoCo reads it; a word that is not a number counts as 0, since MuJoCo refuses it itself.
fn number(word: &str) -> f64 {
    let number = word.parse::<f64>().unwrap_or(0.0);
    if number.is_nan() { f64::INFINITY } else { number }
}
