//! The sink that producers write samples into.

use super::ProduceError;
use format::{Channel, Facts};
use kernel::ids::SampleId;

/// A sample that a producer finished.
#[derive(Debug)]
pub struct MadeSample<'a> {
    /// Identity of the sample.
    pub sample: SampleId,
    /// Facts of the sample; those of a reject are what was known when it was rejected.
    pub facts: Facts,
    /// Fate of the sample.
    pub fate: MadeFate<'a>,
}

/// Fate of a finished sample; a reject is data, not an error.
#[derive(Clone, Copy, Debug)]
pub enum MadeFate<'a> {
    /// Payloads in the order of the channels.
    Kept(&'a [(Channel, Vec<u8>)]),
    /// Left out, and counted.
    Rejected {
        /// Reason, as a name that is counted.
        reason: &'static str,
        /// Reason with numbers, for people.
        detail: &'a str,
    },
}

/// Receiver of finished samples.
pub type TakeSample<'a> = dyn FnMut(&MadeSample<'_>) -> Result<(), ProduceError> + 'a;

/// A sink for the samples of one thread: the producer fills one payload per channel and then keeps or rejects the sample.
/// Buffers keep their memory from sample to sample.
pub struct SampleSink {
    payloads: Vec<(Channel, Vec<u8>)>,
}

impl SampleSink {
    /// A sink for samples with these channels.
    pub fn new(channels: impl IntoIterator<Item = Channel>) -> Self {
        Self { payloads: channels.into_iter().map(|channel| (channel, Vec::new())).collect() }
    }

    /// A writer of samples that `take` receives one by one.
    pub fn writer<'s>(&'s mut self, take: &'s mut TakeSample<'s>) -> SampleWriter<'s> {
        SampleWriter { payloads: &mut self.payloads, take, samples: 0 }
    }
}

/// Writes the samples of one item.
pub struct SampleWriter<'s> {
    payloads: &'s mut [(Channel, Vec<u8>)],
    take: &'s mut TakeSample<'s>,
    samples: u32,
}

impl SampleWriter<'_> {
    /// Whether samples have a channel.
    pub fn stores(&self, channel: Channel) -> bool {
        self.payloads.iter().any(|(stored, _)| *stored == channel)
    }

    /// Empty buffer for the payload of a channel; `None` when samples do not have the channel.
    pub fn payload(&mut self, channel: Channel) -> Option<&mut Vec<u8>> {
        let (_, payload) = self.payloads.iter_mut().find(|(stored, _)| *stored == channel)?;
        payload.clear();
        Some(payload)
    }

    /// Finishes a sample whose payloads are filled.
    ///
    /// # Errors
    /// When the sample cannot be stored.
    pub fn keep(&mut self, sample: SampleId, facts: impl Into<Facts>) -> Result<(), ProduceError> {
        self.samples += 1;
        (self.take)(&MadeSample { sample, facts: facts.into(), fate: MadeFate::Kept(self.payloads) })
    }

    /// Finishes a sample that is left out.
    ///
    /// # Errors
    /// When it cannot be accounted for.
    pub fn reject(
        &mut self,
        sample: SampleId,
        facts: impl Into<Facts>,
        reason: &'static str,
        detail: &str,
    ) -> Result<(), ProduceError> {
        self.samples += 1;
        (self.take)(&MadeSample { sample, facts: facts.into(), fate: MadeFate::Rejected { reason, detail } })
    }

    /// Samples finished so far.
    pub fn samples(&self) -> u32 {
        self.samples
    }
}
