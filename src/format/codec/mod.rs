//! The codec that all records share: generated protobuf types, hand-written encoders, checks of decoded fields.
//!
//! Encoding is written by hand, in tag order, straight from the record's own memory; decoding goes through the generated
//! types and then checks every length, range and count, so that a decoded record can be trusted.

mod depth;
mod error;
pub(crate) mod fields;
#[cfg(test)]
pub(crate) mod tests;
pub(crate) mod wire;

pub use depth::{Depth, DepthCoding};
pub use error::RecordError;

use kernel::ids::{Digest, ItemId, ObjectId, SampleId};

#[allow(dead_code, reason = "TactileContacts is read as HandContacts, which has its fields")]
pub(crate) mod proto {
    include!("../generated/graspmill.rs");
}

/// The id of a decoded message's sample.
pub(crate) fn sample_from_proto(
    message: &'static str,
    sample: Option<proto::SampleId>,
) -> Result<SampleId, RecordError> {
    let sample = sample.ok_or(RecordError::Missing { message, field: "sample" })?;
    let subject = sample.subject.as_slice().try_into().map_err(|_| RecordError::Length {
        message,
        field: "sample.subject",
        expected: 32,
        found: sample.subject.len(),
    })?;
    Ok(SampleId {
        subject: ObjectId(Digest(subject)),
        item: ItemId(sample.item),
        instance: sample.instance,
        camera: sample.camera,
    })
}
