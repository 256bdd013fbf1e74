//! Products, channels and facts as rows of tables: everything that the format needs to know about a product is in one
//! [`ProductFormat`]; ledgers, index columns, manifest counts and metadata are derived from it.

use std::fmt;

use super::RecordError;
use kernel::ids::SampleId;

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
    /// Whether an item makes several samples, one per instance from 1; a shard then ends where an item ends.
    pub has_instances: bool,
    /// Channels in the order in which a sample's messages are written. Every kept sample has the first.
    pub channels: &'static [ChannelFormat],
    /// Facts of every sample, in the order of their columns.
    pub facts: &'static [FactFormat],
    /// Whether samples are split into training, validation and test.
    pub has_splits: bool,
    /// Whether the splits are those of another dataset, which announces its own leaks.
    pub inherits_splits: bool,
    /// Files of a finished dataset in addition to those that every dataset has.
    pub files: &'static [ExtraFile],
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
    pub fn for_count(&self, count: u64) -> &'static str {
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
    /// Decoder of a record that is checked by itself; `None` where the product's checks compare it with other records of its
    /// sample, or with its facts.
    pub decode: Option<RecordDecoder>,
}

/// Decodes and checks a payload, and returns the id of its sample.
pub type RecordDecoder = fn(&[u8]) -> Result<SampleId, RecordError>;

impl ChannelFormat {
    /// A channel, for rows of tables.
    pub const fn new(
        topic: &'static str,
        message: &'static str,
        descriptors: &'static [u8],
        arrays: &'static [ArrayFormat],
    ) -> Self {
        Self { topic, message, descriptors, arrays, decode: None }
    }

    /// The channel with the decoder of a record that is checked by itself.
    pub const fn decoded_by(self, decode: RecordDecoder) -> Self {
        Self { decode: Some(decode), ..self }
    }
}

/// One array of a channel's message, in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArrayFormat {
    /// Name.
    pub name: &'static str,
    /// Shape and type; `N` is the resolution of the sample's grid.
    pub shape: &'static str,
    /// Meaning with unit.
    pub meaning: &'static str,
}

impl ArrayFormat {
    /// An array, for rows of tables.
    pub const fn new(name: &'static str, shape: &'static str, meaning: &'static str) -> Self {
        Self { name, shape, meaning }
    }
}

/// A fact of each sample, stored in tables so that readers need not read the samples for it.
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

/// A file that only the datasets of one product have.
pub struct ExtraFile {
    /// Name inside the dataset's folder.
    pub name: &'static str,
    /// Content, one sentence.
    pub meaning: &'static str,
}

/// Kind of a fact's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FactKind {
    /// Whole number from 0 to 2^32 - 1 that adds up over samples; the manifest has its sum.
    Count,
    /// Whole number from 0 to 2^32 - 1 whose sum has no meaning.
    Integer,
    /// Double in a range.
    Number(FactRange),
}

/// Range of the numbers of a fact; NaN is in none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FactRange {
    /// From 0 to 1.
    Share,
    /// From 0, finite.
    FromZero,
    /// Finite.
    Finite,
    /// Finite, or plus infinity where a sample has no such number.
    FiniteOrNone,
}

impl FactKind {
    /// Whether a value is one of this kind.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::Count | Self::Integer => value >= 0.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0,
            Self::Number(range) => range.holds(value),
        }
    }
}

impl FactRange {
    /// All ranges.
    pub const ALL: [Self; 4] = [Self::Share, Self::FromZero, Self::Finite, Self::FiniteOrNone];

    /// Smallest and largest value; both are in the range.
    pub fn ends(self) -> [f64; 2] {
        match self {
            Self::Share => [0.0, 1.0],
            Self::FromZero => [0.0, f64::MAX],
            Self::Finite => [f64::MIN, f64::MAX],
            Self::FiniteOrNone => [f64::MIN, f64::INFINITY],
        }
    }

    /// Whether a value is in the range.
    pub fn holds(self, value: f64) -> bool {
        let [low, high] = self.ends();
        (low..=high).contains(&value)
    }
}

impl fmt::Display for FactKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count => f.write_str("count"),
            Self::Integer => f.write_str("integer"),
            Self::Number(range) => range.fmt(f),
        }
    }
}

impl fmt::Display for FactRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Share => "number, 0 to 1",
            Self::FromZero => "number, 0 or more",
            Self::Finite => "number",
            Self::FiniteOrNone => "number or infinity",
        })
    }
}

/// Values of a product's facts for one sample, in the order of [`ProductFormat::facts`]. Whole numbers up to 2^32 - 1 are
/// exact in doubles.
#[derive(Clone, Debug, Default)]
pub struct Facts(Vec<f64>);

impl Facts {
    /// Facts from their values.
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
