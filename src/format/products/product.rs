//! Products and channels: indices into the table of products.

use std::{fmt, ops::Deref};

use super::PRODUCTS;
use crate::{ChannelFormat, FactFormat, ProductFormat};

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
        Self::from_name(&name).ok_or_else(|| serde::de::Error::custom(format!("'{name}' is not a product")))
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

    /// Products with a channel of this name and message, in the order of the table.
    pub fn products(self) -> impl Iterator<Item = Product> {
        let is_alike = move |other: Channel| other.name() == self.name() && other.message == self.message;
        Product::all().filter(move |product| product.channels().any(is_alike))
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
        let text = include_str!("../../../docs/format.md");
        for product in Product::all() {
            let (first, rest) = product.name.split_at(1);
            let section = section(text, &(first.to_uppercase() + rest));
            for channel in product.channels() {
                let message = channel.message.trim_start_matches("graspmill.");
                let line = format!("\n| `{}` | `{message}` |", channel.topic);
                assert!(section.contains(&line), "{product}: no line '{line}'");
            }
            for FactFormat { name, kind, meaning, .. } in product.facts {
                let line = format!("\n| `{name}` | {kind} | {meaning} |");
                assert!(section.contains(&line), "{product}: no line '{line}'");
            }
        }
    }
}
