//! Products, channels and facts as rows of tables: everything that the format needs to know of a product stands in one
//! [`ProductFormat`], and ledgers, index columns, manifest counts, checks and metadata are derived from it.

use std::{fmt, ops::Deref};

use super::{CheckSample, ExtraFile, products::PRODUCTS};

/// A product as the format sees it: one row of the table of products.
pub struct ProductFormat {
    /// Name in files, job keys and on the command line.
    pub name: &'static str,
    /// Content of a dataset, one sentence.
    pub summary: &'static str,
    /// Noun of one sample and of several: `("view", "views")`.
    pub samples: Noun,
    /// Noun of one subject and of several: `("object", "objects")`.
    pub subjects: Noun,
    /// Whether the subjects are objects, which several datasets can share; otherwise robots or scenes.
    pub subjects_are_objects: bool,
    /// Meaning of the subject's digest, a sentence.
    pub subject_meaning: &'static str,
    /// Meaning of the item number in a sample's id, a sentence.
    pub item_meaning: &'static str,
    /// Channels in the order in which a sample's messages are written. Every kept sample has the first.
    pub channels: &'static [ChannelFormat],
    /// Facts of every sample, in the order of their columns.
    pub facts: &'static [FactFormat],
    /// Whether samples are split into training, validation and test.
    pub has_splits: bool,
    /// Whether the splits are those of another dataset, which announces its own leaks.
    pub inherits_splits: bool,
    /// Files of a finished dataset beside those that every dataset has.
    pub files: &'static [ExtraFile],
    /// Makes the checks of one thread.
    pub check: fn() -> Box<dyn CheckSample>,
}

/// A countable noun.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Noun {
    /// For one.
    pub one: &'static str,
    /// For none and for several.
    pub many: &'static str,
}

impl Noun {
    /// The form for a count: "1 view", "2 views".
    pub fn of(&self, count: u64) -> &'static str {
        if count == 1 { self.one } else { self.many }
    }
}

/// A channel of a product: one kind of message, with its own topic and schema.
pub struct ChannelFormat {
    /// MCAP topic, `/<product>/<name>`.
    pub topic: &'static str,
    /// Full name of the protobuf message.
    pub message: &'static str,
    /// `FileDescriptorSet` of the message: the schema that shards carry.
    pub descriptors: &'static [u8],
    /// Arrays of the message, for people: name, shape and type, meaning. `N` in a shape is the grid's resolution.
    pub arrays: &'static [ArrayFormat],
}

/// One array of a channel's message, in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArrayFormat {
    /// Name.
    pub name: &'static str,
    /// Shape and type; `N` stands for the resolution of the sample's grid.
    pub shape: &'static str,
    /// Meaning with unit.
    pub meaning: &'static str,
}

/// A fact of each sample, kept in tables so that nobody has to read the samples for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FactFormat {
    /// Name of its column.
    pub name: &'static str,
    /// Kind of its values.
    pub kind: FactKind,
    /// Topic of the channel that states it; a dataset without the channel has no such column. `None`: the first channel.
    pub topic: Option<&'static str>,
    /// Meaning with unit, a sentence.
    pub meaning: &'static str,
}

/// Kind of a fact's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FactKind {
    /// Whole number from 0 to 2^32 - 1 that adds up over samples; the manifest has its sum.
    Count,
    /// Whole number from 0 to 2^32 - 1 whose sum means nothing.
    Integer,
    /// Double.
    Number,
}

impl FactKind {
    /// Whether a value is one of this kind.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::Count | Self::Integer => value >= 0.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0,
            Self::Number => true,
        }
    }
}

/// Values of a product's facts for one sample, in the order of [`ProductFormat::facts`]. Whole numbers up to 2^32 - 1 are
/// exact in doubles.
#[derive(Clone, Debug, Default)]
pub struct Facts(Vec<f64>);

impl Facts {
    /// Facts out of their values.
    pub fn new(values: impl IntoIterator<Item = f64>) -> Self {
        Self(values.into_iter().collect())
    }

    /// The values.
    pub fn values(&self) -> &[f64] {
        &self.0
    }

    /// One value as a whole number.
    ///
    /// # Panics
    /// When there is no such fact.
    pub fn integer(&self, index: usize) -> u32 {
        self.0[index] as u32
    }

    /// Replaces one value.
    ///
    /// # Panics
    /// When there is no such fact.
    pub fn set(&mut self, index: usize, value: f64) {
        self.0[index] = value;
    }
}

impl PartialEq for Facts {
    /// Equal bits: a NaN equals itself.
    fn eq(&self, other: &Self) -> bool {
        self.0.iter().map(|value| value.to_bits()).eq(other.0.iter().map(|value| value.to_bits()))
    }
}

/// A product: an index into the table of products.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Product(u8);

impl Product {
    /// The product of a name, for constants: an unknown name does not compile.
    pub(crate) const fn named(name: &str) -> Self {
        let mut index = 0;
        while index < PRODUCTS.len() {
            if is_equal(PRODUCTS[index].name, name) {
                return Self(index as u8);
            }
            index += 1;
        }
        panic!("a product that is not in the table")
    }

    /// Every product, in the order of the table.
    pub fn all() -> impl ExactSizeIterator<Item = Self> + Clone {
        (0..PRODUCTS.len() as u8).map(Self)
    }

    /// The product of a name; `None` for any other text.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::all().find(|product| product.name == name)
    }

    /// The first channel, which every kept sample has.
    pub fn leading(self) -> Channel {
        Channel { product: self, index: 0 }
    }

    /// Every channel, in order.
    pub fn channels(self) -> impl ExactSizeIterator<Item = Channel> {
        (0..self.channels.len() as u8).map(move |index| Channel { product: self, index })
    }

    /// The facts that a dataset with these channels has, with their indices in the table.
    pub fn facts_of(self, channels: &[Channel]) -> impl Iterator<Item = (usize, &'static FactFormat)> {
        let row = PRODUCTS[usize::from(self.0)];
        let stored = |fact: &FactFormat| fact.topic.is_none_or(|topic| channels.iter().any(|each| each.topic == topic));
        row.facts.iter().enumerate().filter(move |(_, fact)| stored(fact))
    }
}

/// Whether two texts are equal, in a constant.
const fn is_equal(one: &str, other: &str) -> bool {
    let (one, other) = (one.as_bytes(), other.as_bytes());
    let mut index = 0;
    while index < one.len() && index < other.len() && one[index] == other[index] {
        index += 1;
    }
    one.len() == other.len() && index == one.len()
}

impl Deref for Product {
    type Target = ProductFormat;

    fn deref(&self) -> &'static ProductFormat {
        PRODUCTS[usize::from(self.0)]
    }
}

impl fmt::Display for Product {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl fmt::Debug for Product {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl serde::Serialize for Product {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name)
    }
}

impl<'de> serde::Deserialize<'de> for Product {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::from_name(&name).ok_or_else(|| serde::de::Error::custom(format!("'{name}' is no product")))
    }
}

/// A channel: a product, and an index into its channels.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Channel {
    product: Product,
    index: u8,
}

impl Channel {
    /// The channel of a topic, for constants: an unknown topic does not compile.
    pub(crate) const fn at(topic: &str) -> Self {
        let mut product = 0;
        while product < PRODUCTS.len() {
            let channels = PRODUCTS[product].channels;
            let mut index = 0;
            while index < channels.len() {
                if is_equal(channels[index].topic, topic) {
                    return Self { product: Product(product as u8), index: index as u8 };
                }
                index += 1;
            }
            product += 1;
        }
        panic!("a topic that is not in the table")
    }

    /// The channel of a topic; `None` for a topic that this version does not know.
    pub fn from_topic(topic: &str) -> Option<Self> {
        Product::all().flat_map(Product::channels).find(|channel| channel.topic == topic)
    }

    /// The product whose samples have such messages.
    pub fn product(self) -> Product {
        self.product
    }

    /// Last part of the topic, for column names and people.
    pub fn name(self) -> &'static str {
        let row: &'static ChannelFormat = &PRODUCTS[usize::from(self.product.0)].channels[usize::from(self.index)];
        row.topic.rsplit('/').next().unwrap_or_default()
    }
}

impl Deref for Channel {
    type Target = ChannelFormat;

    fn deref(&self) -> &'static ChannelFormat {
        &PRODUCTS[usize::from(self.product.0)].channels[usize::from(self.index)]
    }
}

impl fmt::Debug for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.topic)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The part of a Markdown text below a heading of the third level, up to the next heading.
    fn section<'a>(text: &'a str, heading: &str) -> &'a str {
        let (_, rest) = text.split_once(&format!("\n### {heading}\n")).expect("the heading");
        rest.split("\n## ").next().and_then(|rest| rest.split("\n### ").next()).unwrap_or_default()
    }

    #[test]
    fn the_documentation_lists_every_channel_and_fact() {
        let text = include_str!("../../docs/format.md");
        for product in Product::all() {
            let (first, rest) = product.name.split_at(1);
            let section = section(text, &(first.to_uppercase() + rest));
            for channel in product.channels() {
                let message = channel.message.trim_start_matches("graspmill.");
                let line = format!("\n| `{}` | `{message}` |", channel.topic);
                assert!(section.contains(&line), "{product}: no line '{line}'");
            }
            for FactFormat { name, kind, meaning, .. } in product.facts {
                let kind = match kind {
                    FactKind::Count => "count",
                    FactKind::Integer => "integer",
                    FactKind::Number => "number",
                };
                let line = format!("\n| `{name}` | {kind} | {meaning} |");
                assert!(section.contains(&line), "{product}: no line '{line}'");
            }
        }
    }
}
