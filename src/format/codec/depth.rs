//! The depth crop.

use prost::Message;

use crate::codec::{
    RecordError,
    fields::{lengthy, ranged},
    proto, sample_from_proto, wire,
};
use kernel::{geom::DepthCrop, ids::SampleId};

const MESSAGE: &str = "Depth";

/// Coding of depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthCoding {
    /// Metres as f32, NaN = no return.
    F32,
    /// Steps of this many metres as u16, 0 = no return; half a step is lost, and a depth that does not fit into 1 to
    /// 65,535 steps becomes "no return".
    U16 {
        /// Metres per step.
        step: f64,
    },
}

/// The part of a sample's depth image that holds the object.
#[derive(Clone, Debug, PartialEq)]
pub struct Depth {
    /// Which sample.
    pub sample: SampleId,
    /// Depth along the optical axis [m], NaN = no return.
    pub crop: DepthCrop,
    /// Coding in which the depth is written.
    pub coding: DepthCoding,
}

impl Depth {
    /// Appends the payload to `out`.
    ///
    /// # Panics
    /// If the crop's depth does not have `width * height` values.
    pub fn encode(&self, out: &mut Vec<u8>) {
        Self::encode_parts(&self.sample, &self.crop, self.coding, out);
    }

    /// [`Depth::encode`] without owning the crop, for the hot path.
    ///
    /// # Panics
    /// If the crop's depth does not have `width * height` values.
    pub fn encode_parts(sample: &SampleId, crop: &DepthCrop, coding: DepthCoding, out: &mut Vec<u8>) {
        assert_eq!(crop.depth.len(), crop.width as usize * crop.height as usize, "a crop has width * height depths");
        wire::sample(out, 1, sample);
        wire::uint32(out, 2, crop.left);
        wire::uint32(out, 3, crop.top);
        wire::uint32(out, 4, crop.width);
        wire::uint32(out, 5, crop.height);
        match coding {
            DepthCoding::F32 => wire::floats_one_nan(out, 7, &crop.depth),
            DepthCoding::U16 { step } => {
                wire::double(out, 6, step);
                if !crop.depth.is_empty() {
                    wire::bytes_header(out, 7, 2 * crop.depth.len());
                    out.extend(crop.depth.iter().flat_map(|depth| steps(*depth, step).to_le_bytes()));
                }
            }
        }
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length or range does not hold.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let depth = proto::Depth::decode(payload)
            .map_err(|error| RecordError::Protobuf { message: MESSAGE, problem: error.to_string() })?;
        let sample = sample_from_proto(MESSAGE, depth.sample)?;
        let proto::Depth { left, top, width, height, step, data, .. } = depth;
        for (field, side) in [("left", left), ("top", top), ("width", width), ("height", height)] {
            ranged(MESSAGE, field, f64::from(side), side <= 16384, "at most 16384")?;
        }
        ranged(MESSAGE, "step", step, step >= 0.0 && step.is_finite(), "0 or positive")?;
        let pixels = width as usize * height as usize;
        let (values, coding): (Vec<f32>, _) = if step == 0.0 {
            lengthy(MESSAGE, "data", 4 * pixels, data.len())?;
            let read = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            (data.chunks_exact(4).map(read).collect(), DepthCoding::F32)
        } else {
            lengthy(MESSAGE, "data", 2 * pixels, data.len())?;
            let read = |bytes: &[u8]| metres(u16::from_le_bytes([bytes[0], bytes[1]]), step);
            (data.chunks_exact(2).map(read).collect(), DepthCoding::U16 { step })
        };
        if let Some(value) = values.iter().find(|value| !(value.is_nan() || **value > 0.0 && value.is_finite())) {
            let allowed = "positive, or NaN for no return";
            return Err(RecordError::Range { message: MESSAGE, field: "data", value: f64::from(*value), allowed });
        }
        Ok(Self { sample, crop: DepthCrop { left, top, width, height, depth: values }, coding })
    }
}

fn steps(depth: f32, step: f64) -> u16 {
    // Half up by floor, not `round`: one exact operation on every machine. NaN compares false and becomes 0.
    let steps = (f64::from(depth) / step + 0.5).floor();
    if (1.0..=65535.0).contains(&steps) { steps as u16 } else { 0 }
}

fn metres(steps: u16, step: f64) -> f32 {
    if steps == 0 { f32::NAN } else { (f64::from(steps) * step) as f32 }
}
