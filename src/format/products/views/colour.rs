//! Images of scenes in colour.

use prost::Message;

use crate::codec::{
    RecordError,
    fields::{broken, lengthy, ranged},
    proto, sample_from_proto, wire,
};
use kernel::ids::SampleId;

const MESSAGE: &str = "SceneColour";

/// A settled scene in colour, as its camera sees it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneColour {
    /// Which sample.
    pub sample: SampleId,
    /// Width of the image [px].
    pub width: u32,
    /// Height of the image [px].
    pub height: u32,
    /// Red, green, blue. Shape (height, width), row-major.
    pub rgb: Vec<[u8; 3]>,
}

impl SceneColour {
    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        wire::sample(out, 1, &self.sample);
        wire::uint32(out, 2, self.width);
        wire::uint32(out, 3, self.height);
        wire::bytes(out, 4, self.rgb.as_flattened());
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length or range does not hold.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let proto::SceneColour { sample, width, height, rgb } =
            proto::SceneColour::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, sample)?;
        for (field, side) in [("width", width), ("height", height)] {
            ranged(MESSAGE, field, f64::from(side), side <= 16384, "at most 16384")?;
        }
        lengthy(MESSAGE, "rgb", 3 * width as usize * height as usize, rgb.len())?;
        Ok(Self { sample, width, height, rgb: rgb.as_chunks::<3>().0.to_vec() })
    }
}
