//! What is on disk: records, their protobuf codec and schema, the format's number.
//!
//! A record is one protobuf message on one MCAP topic (`proto/graspmill.proto`). Encoding is written by hand, in tag
//! order, straight from the record's own memory; decoding goes through the generated types and then checks every
//! length, range and count, so that a decoded record can be trusted. Names of objects, paths, clocks and sample
//! indices never enter a payload: the same sample has the same bytes in every dataset.

mod channels;
mod depth;
mod error;
mod pair;
#[cfg(test)]
mod tests;
mod wire;

pub(crate) mod proto {
    include!(concat!(env!("OUT_DIR"), "/graspmill.rs"));
}

pub use channels::{Cloud, Coverage, Implicit, Tsdf, Visibility};
pub use depth::{Depth, DepthCoding};
pub use error::RecordError;
pub use pair::VoxelPair;

use crate::ids::{Digest, ObjectId, SampleId, ViewId};

/// Number of the format on disk; a reader refuses every other.
pub const FORMAT_VERSION: u32 = 1;

/// What a message of a completion shard holds; each has its own topic and schema.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Channel {
    /// [`VoxelPair`]: partial and complete grid, camera, poses; every sample has one.
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
}

impl Channel {
    /// Every channel, in the order in which a sample's messages are written.
    pub const ALL: [Self; 7] =
        [Self::Pair, Self::Visibility, Self::Depth, Self::Cloud, Self::Tsdf, Self::Coverage, Self::Implicit];

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
        }
    }

    /// The last part of the topic, for column names and people.
    pub fn name(self) -> &'static str {
        &self.topic()["/completion/".len()..]
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
        }
    }

    /// The channel of a topic; `None` for a topic that this version does not know.
    pub fn from_topic(topic: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|channel| channel.topic() == topic)
    }
}

/// The `FileDescriptorSet` of `proto/graspmill.proto`: the schema that every shard carries.
pub fn descriptors() -> &'static [u8] {
    include_bytes!(concat!(env!("OUT_DIR"), "/graspmill.bin"))
}

/// Checks `payload` as [`VoxelPair::decode`] and its siblings do, and says whose it is.
///
/// # Errors
/// When the payload is no valid record of that channel.
pub fn check(channel: Channel, payload: &[u8]) -> Result<SampleId, RecordError> {
    Ok(match channel {
        Channel::Pair => VoxelPair::decode(payload)?.sample,
        Channel::Visibility => Visibility::decode(payload)?.sample,
        Channel::Depth => Depth::decode(payload)?.sample,
        Channel::Cloud => Cloud::decode(payload)?.sample,
        Channel::Tsdf => Tsdf::decode(payload)?.sample,
        Channel::Coverage => Coverage::decode(payload)?.sample,
        Channel::Implicit => Implicit::decode(payload)?.sample,
    })
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
