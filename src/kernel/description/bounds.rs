//! Bounds of a description. MuJoCo takes whatever memory and time a few letters of XML ask for, so that counts, sizes and nesting
//! are checked before it compiles anything.
//!
//! [`BOUNDS`] is the only declaration: the check follows it, a test tries every row, and `docs/mjcf.md` prints it.

use std::{collections::BTreeMap, sync::Arc};

use super::{
    document::Document,
    error::{DescriptionError, TooLarge},
    statement::Statement,
};

/// Most elements of a description with all that it includes and attaches, each counted as often as `replicate` and `attach` copy it.
/// Robots and hands have some hundred, the largest scenes some thousand.
pub const MAX_ELEMENTS: f64 = 20_000.0;

/// Most elements around one.
pub const MAX_DEPTH: usize = 200;

/// Most files that include or attach each other in a row.
pub const MAX_FILES_DEEP: usize = 16;

/// Most memory that sizes and counts in attributes may ask for [bytes].
pub const MAX_BYTES: f64 = 256.0 * 1024.0 * 1024.0;

/// A bound of an element or of its attributes.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// The element, as `section/element`, or `section/*` for all of a section.
    pub element: &'static str,
    /// Count, value or memory that is bounded.
    pub rule: Rule,
}

/// Count, value or memory that a [`Bound`] limits.
#[derive(Clone, Copy, Debug)]
pub enum Rule {
    /// The number of such elements, copies included.
    Count {
        /// Largest number.
        most: f64,
    },
    /// Each number of an attribute.
    Value {
        /// The attribute.
        attribute: &'static str,
        /// Smallest and largest number.
        range: [f64; 2],
    },
    /// The product of all numbers of an attribute, which makes as many elements.
    Copies {
        /// The attribute.
        attribute: &'static str,
        /// Largest product.
        most: f64,
    },
    /// Number of numbers in an attribute.
    Numbers {
        /// The attribute.
        attribute: &'static str,
        /// Largest number of numbers.
        most: usize,
    },
    /// The product of the numbers of attributes, of which each unit takes memory. All rows share [`MAX_BYTES`].
    Memory {
        /// The attributes.
        attributes: &'static [&'static str],
        /// Memory of a unit [bytes].
        unit: f64,
    },
}

/// The element that copies its content.
const REPLICATE: &str = "body/replicate";

const fn count(element: &'static str, most: f64) -> Bound {
    Bound { element, rule: Rule::Count { most } }
}

const fn at_most(element: &'static str, attribute: &'static str, most: f64) -> Bound {
    Bound { element, rule: Rule::Value { attribute, range: [f64::NEG_INFINITY, most] } }
}

const fn within(element: &'static str, attribute: &'static str, range: [f64; 2]) -> Bound {
    Bound { element, rule: Rule::Value { attribute, range } }
}

const fn copies(element: &'static str, attribute: &'static str, most: f64) -> Bound {
    Bound { element, rule: Rule::Copies { attribute, most } }
}

const fn numbers(element: &'static str, attribute: &'static str, most: usize) -> Bound {
    Bound { element, rule: Rule::Numbers { attribute, most } }
}

const fn memory(element: &'static str, attributes: &'static [&'static str], unit: f64) -> Bound {
    Bound { element, rule: Rule::Memory { attributes, unit } }
}

/// Every bound. What the element asks for was found by setting each number of MuJoCo's schema to a million and to a billion, and each
/// element a hundred thousand times.
pub const BOUNDS: &[Bound] = &[
    // Time grows with the square of these counts, memory with the square of the constraints.
    count("keyframe/key", 1000.0),
    count("body/joint", 1000.0),
    count("body/freejoint", 1000.0),
    count("body/geom", 5000.0),
    count("equality/*", 1000.0),
    count("contact/pair", 10_000.0),
    count("default/default", 1000.0),
    // Copies.
    within(REPLICATE, "count", [1.0, 1000.0]),
    copies("body/composite", "count", 1000.0),
    copies("body/flexcomp", "count", 1000.0),
    at_most("body/flexcomp", "cellcount", 100.0),
    at_most("deformable/flex", "cellcount", 100.0),
    at_most("composite/skin", "subgrid", 10.0),
    // Files that hold no data but sizes.
    at_most("asset/hfield", "nrow", 2048.0),
    at_most("asset/hfield", "ncol", 2048.0),
    memory("asset/hfield", &["nrow", "ncol"], 16.0),
    at_most("asset/texture", "width", 4096.0),
    at_most("asset/texture", "height", 24_576.0),
    at_most("asset/texture", "nchannel", 4.0),
    // Six sides of a cube, three channels.
    memory("asset/texture", &["width", "height"], 18.0),
    at_most("asset/mesh", "params", 256.0),
    at_most("body/camera", "resolution", 16_384.0),
    // Data beside the state.
    at_most("mujoco/size", "nuser_*", 100.0),
    at_most("mujoco/size", "nuserdata", 10_000.0),
    at_most("mujoco/size", "nkey", 1000.0),
    numbers("*/*", "user", 100),
    at_most("custom/numeric", "size", 500.0),
    at_most("sensor/user", "dim", 1000.0),
    memory("sensor/user", &["dim"], 24.0),
    at_most("sensor/*", "nsample", 1000.0),
    memory("sensor/*", &["nsample"], 512.0),
    at_most("sensor/contact", "num", 1000.0),
    memory("sensor/contact", &["num"], 512.0),
    at_most("actuator/*", "nsample", 1000.0),
    memory("actuator/*", &["nsample"], 64.0),
    at_most("actuator/general", "actdim", 1000.0),
    at_most("actuator/plugin", "actdim", 1000.0),
    // Work in each step.
    at_most("mujoco/option", "iterations", 10_000.0),
    at_most("mujoco/option", "ls_iterations", 10_000.0),
    at_most("mujoco/option", "noslip_iterations", 10_000.0),
    at_most("mujoco/option", "ccd_iterations", 10_000.0),
    at_most("mujoco/option", "sdf_iterations", 1000.0),
    at_most("mujoco/option", "sdf_initpoints", 1000.0),
];

/// Sums over a description.
#[derive(Clone, Debug, Default)]
struct Sums {
    elements: f64,
    bytes: f64,
    /// Elements within each other.
    depth: usize,
    /// By the row of [`BOUNDS`].
    counts: BTreeMap<usize, f64>,
    /// The largest default of each attribute that takes memory, by element and attribute.
    defaults: Defaults,
}

type Defaults = BTreeMap<(String, &'static str), f64>;

/// Refuses a description that asks for more than any robot, hand or scene needs.
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
    /// Adds what a row says of an element that stands `times` times.
    fn add(&mut self, row: usize, bound: &Bound, statement: &Statement, times: f64) -> Result<(), TooLarge> {
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
        if self.elements > MAX_ELEMENTS {
            return Err(TooLarge::Elements { elements: self.elements, most: MAX_ELEMENTS });
        }
        if self.depth > MAX_DEPTH {
            return Err(TooLarge::Depth);
        }
        if self.bytes > MAX_BYTES {
            return Err(TooLarge::Memory { bytes: self.bytes, most: MAX_BYTES });
        }
        for (row, count) in &self.counts {
            let Bound { element, rule: Rule::Count { most } } = BOUNDS[*row] else { continue };
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

/// The product of values; one that is missing counts as the largest of the others, and no value at all as 1.
fn product(values: &[Option<f64>]) -> f64 {
    let largest = values.iter().flatten().copied().fold(1.0, f64::max);
    values.iter().map(|value| value.unwrap_or(largest)).product()
}

/// The product of all numbers of an attribute, each at least 1.
fn numbers_product(value: &str) -> f64 {
    value.split_ascii_whitespace().map(number).map(|number| number.max(1.0)).product()
}

/// A number as MuJoCo reads it; what is none counts as 0: MuJoCo refuses it itself.
fn number(word: &str) -> f64 {
    let number = word.parse::<f64>().unwrap_or(0.0);
    if number.is_nan() { f64::INFINITY } else { number }
}
