//! What is on disk: records, their protobuf codec and schema, the format's number.
//!
//! A record is one protobuf message on one MCAP topic (`proto/graspmill.proto`, `proto/reachability.proto`). Encoding is written by hand, in tag
//! order, straight from the record's own memory; decoding goes through the generated types and then checks every
//! length, range and count, so that a decoded record can be trusted. Names of objects, paths, clocks and sample
//! indices never enter a payload: the same sample has the same bytes in every dataset.

mod block;
mod channels;
mod depth;
mod error;
mod facts;
mod field;
mod pair;
#[cfg(test)]
mod tests;
mod wire;

pub(crate) mod proto {
    include!(concat!(env!("OUT_DIR"), "/graspmill.rs"));
}

pub use block::ReachabilityBlock;
pub use channels::{Cloud, Coverage, Implicit, Tsdf, Visibility};
pub use depth::{Depth, DepthCoding};
pub use error::RecordError;
pub use facts::{BlockFacts, PairFacts, SampleFacts};
pub use field::{FieldHeader, ReachabilityField};
pub use pair::VoxelPair;

use crate::ids::{Digest, ObjectId, Product, SampleId, ViewId};

/// Number of the format on disk; a reader refuses every other.
pub const FORMAT_VERSION: u32 = 1;

/// What a message of a shard holds; each has its own topic and schema.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Channel {
    /// [`VoxelPair`]: partial and complete grid, camera, poses; every completion sample has one.
    Pair,
    /// [`Visibility`]: cells seen to be free.
    Visibility,
    /// [`Depth`]: the depth crop.
    Depth,
    /// [`Cloud`]: the partial point cloud.
    Cloud,
    /// [`Tsdf`]: truncated signed distance.
    Tsdf,
    /// [`Coverage`]: share of each cell that is solid.
    Coverage,
    /// [`Implicit`]: samples for implicit networks.
    Implicit,
    /// [`ReachabilityBlock`]: labels, proofs and witnesses of one position; every reachability sample has one.
    Block,
}

impl Channel {
    /// Every channel, in the order in which a sample's messages are written.
    pub const ALL: [Self; 8] = [
        Self::Pair,
        Self::Visibility,
        Self::Depth,
        Self::Cloud,
        Self::Tsdf,
        Self::Coverage,
        Self::Implicit,
        Self::Block,
    ];

    /// The product whose samples have such messages.
    pub fn product(self) -> Product {
        match self {
            Self::Pair
            | Self::Visibility
            | Self::Depth
            | Self::Cloud
            | Self::Tsdf
            | Self::Coverage
            | Self::Implicit => Product::Completion,
            Self::Block => Product::Reachability,
        }
    }

    /// The channel that every sample of a product has; the facts of a sample are counted in it.
    pub fn leading(product: Product) -> Self {
        match product {
            Product::Completion => Self::Pair,
            Product::Reachability => Self::Block,
        }
    }

    /// MCAP topic.
    pub fn topic(self) -> &'static str {
        match self {
            Self::Pair => "/completion/pair",
            Self::Visibility => "/completion/visibility",
            Self::Depth => "/completion/depth",
            Self::Cloud => "/completion/cloud",
            Self::Tsdf => "/completion/tsdf",
            Self::Coverage => "/completion/coverage",
            Self::Implicit => "/completion/implicit",
            Self::Block => "/reachability/block",
        }
    }

    /// The last part of the topic, for column names and people.
    pub fn name(self) -> &'static str {
        self.topic().rsplit('/').next().unwrap_or_default()
    }

    /// Full name of the protobuf message.
    pub fn schema_name(self) -> &'static str {
        match self {
            Self::Pair => "graspmill.VoxelPair",
            Self::Visibility => "graspmill.Visibility",
            Self::Depth => "graspmill.Depth",
            Self::Cloud => "graspmill.Cloud",
            Self::Tsdf => "graspmill.Tsdf",
            Self::Coverage => "graspmill.Coverage",
            Self::Implicit => "graspmill.Implicit",
            Self::Block => "graspmill.ReachabilityBlock",
        }
    }

    /// The channel of a topic; `None` for a topic that this version does not know.
    pub fn from_topic(topic: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|channel| channel.topic() == topic)
    }
}

/// The `FileDescriptorSet` of a product's messages: the schema that each of its shards carries.
pub fn descriptors(product: Product) -> &'static [u8] {
    match product {
        Product::Completion => include_bytes!(concat!(env!("OUT_DIR"), "/graspmill.bin")),
        Product::Reachability => include_bytes!(concat!(env!("OUT_DIR"), "/reachability.bin")),
    }
}

/// Checks `payload` as [`VoxelPair::decode`] and its siblings do, and says whose it is; of a leading channel also its
/// facts.
///
/// # Errors
/// When the payload is no valid record of that channel.
pub fn check(channel: Channel, payload: &[u8]) -> Result<(SampleId, Option<SampleFacts>), RecordError> {
    let sample = match channel {
        Channel::Pair => {
            let pair = VoxelPair::decode(payload)?;
            return Ok((pair.sample, Some(pair.facts().into())));
        }
        Channel::Block => {
            let block = ReachabilityBlock::decode(payload)?;
            return Ok((block.sample, Some(block.facts().into())));
        }
        Channel::Visibility => Visibility::decode(payload)?.sample,
        Channel::Depth => Depth::decode(payload)?.sample,
        Channel::Cloud => Cloud::decode(payload)?.sample,
        Channel::Tsdf => Tsdf::decode(payload)?.sample,
        Channel::Coverage => Coverage::decode(payload)?.sample,
        Channel::Implicit => Implicit::decode(payload)?.sample,
    };
    Ok((sample, None))
}

fn sample_from_proto(message: &'static str, sample: Option<proto::SampleId>) -> Result<SampleId, RecordError> {
    let sample = sample.ok_or(RecordError::Missing { message, field: "sample" })?;
    let subject = sample.subject.as_slice().try_into().map_err(|_| RecordError::Length {
        message,
        field: "sample.subject",
        expected: 32,
        found: sample.subject.len(),
    })?;
    Ok(SampleId {
        subject: ObjectId(Digest(subject)),
        instance: sample.instance,
        view: ViewId(sample.view),
        camera: sample.camera,
    })
}
