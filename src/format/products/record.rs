//! Records: messages of samples as types.

use super::Channel;
use crate::RecordError;

/// A record of samples: one message on one channel, for [`Sample::read`](crate::dataset::Sample::read) and
/// [`Sample::find`](crate::dataset::Sample::find).
pub trait Record: Sized {
    /// Channel of the record. Products that share a record have a topic each for it; where a record has several channels in one
    /// product, this is its first.
    const CHANNEL: Channel;

    /// Reads and checks a payload.
    const DECODE: fn(&[u8]) -> Result<Self, RecordError>;
}
