//! Record of the occluder between the camera and the object.

use prost::Message;

use crate::codec::{
    RecordError,
    fields::{broken, lengthy, named, ranged, triples},
    proto, sample_from_proto, wire,
};
use kernel::{geom::DepthCrop, ids::SampleId};

const MESSAGE: &str = "Occlusion";
/// Longest side of an image [px].
const MAX_SIDE: u32 = 16_384;

/// An occluder between the camera and the object: a convex solid, and the pixels that see it.
///
/// For the hot path keep one and refill it: its lists keep their memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Occlusion {
    /// Which sample.
    pub sample: SampleId,
    /// Kind of the occluder: one of [`Occlusion::KINDS`].
    pub kind: &'static str,
    /// Pixels of a perfect image that would see the object without the occluder.
    pub object_pixels: u32,
    /// Pixels of these that see the occluder instead.
    pub hidden_pixels: u32,
    /// Corners of the occluder, which is their convex hull, in `CameraCv` [m].
    pub corners: Vec<[f32; 3]>,
    /// Pixels of a perfect image that see the occluder.
    pub mask: PixelMask,
}

/// A crop of an image whose pixels are set or not.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PixelMask {
    /// First column of the image in the crop [px].
    pub left: u32,
    /// First row of the image in the crop [px].
    pub top: u32,
    /// Width of the crop [px].
    pub width: u32,
    /// Height of the crop [px].
    pub height: u32,
    /// One bit per pixel, row-major, least significant bit of a byte first; bits after the last pixel are 0.
    pub bits: Vec<u8>,
}

/// Counts of pixels of an occlusion, for tables.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OcclusionFacts {
    /// 1 if the view has an occluder, else 0.
    pub occluded: u32,
    /// Share of the object's pixels that the occluder hides, 0 to 1.
    pub hidden_share: f64,
}

impl PixelMask {
    /// Sets the pixels with a return of a depth crop, and no other.
    pub fn set(&mut self, crop: &DepthCrop) {
        (self.left, self.top, self.width, self.height) = (crop.left, crop.top, crop.width, crop.height);
        self.bits.clear();
        self.bits.resize(crop.depth.len().div_ceil(8), 0);
        for (index, _) in crop.depth.iter().enumerate().filter(|(_, depth)| !depth.is_nan()) {
            self.bits[index / 8] |= 1 << (index % 8);
        }
    }

    /// Whether a pixel of the whole image is set.
    pub fn get(&self, column: u32, row: u32) -> bool {
        let (x, y) = (column.wrapping_sub(self.left), row.wrapping_sub(self.top));
        let index = y as usize * self.width as usize + x as usize;
        x < self.width && y < self.height && self.bits[index / 8] >> (index % 8) & 1 != 0
    }

    /// The whole image of this size [px]: whether each pixel is set. Shape (height, width), row-major.
    pub fn whole(&self, width: u32, height: u32) -> Vec<bool> {
        (0..height).flat_map(|row| (0..width).map(move |column| self.get(column, row))).collect()
    }

    /// Count of the set pixels.
    pub fn count(&self) -> u32 {
        self.bits.iter().map(|byte| byte.count_ones()).sum()
    }
}

impl Occlusion {
    /// Kinds of occluders: nothing, a piece between camera and object, and an edge across the whole image.
    pub const KINDS: [&str; 3] = ["none", "neighbour", "half_space"];

    /// A view without an occluder.
    pub fn none(sample: SampleId) -> Self {
        Self {
            sample,
            kind: Self::KINDS[0],
            object_pixels: 0,
            hidden_pixels: 0,
            corners: Vec::new(),
            mask: PixelMask::default(),
        }
    }

    /// Counts for tables.
    pub fn facts(&self) -> OcclusionFacts {
        let hidden_share = f64::from(self.hidden_pixels) / f64::from(self.object_pixels.max(1));
        OcclusionFacts { occluded: u32::from(self.kind != Self::KINDS[0]), hidden_share }
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        wire::sample(out, 1, &self.sample);
        wire::bytes(out, 2, self.kind.as_bytes());
        wire::uint32(out, 3, self.object_pixels);
        wire::uint32(out, 4, self.hidden_pixels);
        wire::floats(out, 5, self.corners.as_flattened());
        let PixelMask { left, top, width, height, bits } = &self.mask;
        for (field, value) in (6..).zip([left, top, width, height]) {
            wire::uint32(out, field, *value);
        }
        wire::bytes(out, 10, bits);
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length, range or count does not hold, or the kind is unknown.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let message = proto::Occlusion::decode(payload).map_err(broken(MESSAGE))?;
        named(MESSAGE, "kind", &message.kind, &Self::KINDS)?;
        let kind = Self::KINDS.into_iter().find(|kind| *kind == message.kind).unwrap_or(Self::KINDS[0]);
        let proto::Occlusion { object_pixels, hidden_pixels, left, top, width, height, .. } = message;
        for (field, side) in [("width", width), ("height", height)] {
            ranged(MESSAGE, field, f64::from(side), side <= MAX_SIDE, "0 to 16384")?;
        }
        let pixels = width as usize * height as usize;
        lengthy(MESSAGE, "mask", pixels.div_ceil(8), message.mask.len())?;
        let mask = PixelMask { left, top, width, height, bits: message.mask };
        let last = mask.bits.last().map_or(0, |last| u32::from(*last) >> (8 - (8 * mask.bits.len() - pixels)));
        ranged(MESSAGE, "mask", f64::from(last), last == 0, "without bits after the last pixel")?;
        let most = object_pixels.min(mask.count());
        ranged(
            MESSAGE,
            "hidden_pixels",
            f64::from(hidden_pixels),
            hidden_pixels <= most,
            "at most the pixels of both",
        )?;
        let corners = triples(MESSAGE, "corners", &message.corners)?;
        // Without an occluder there is nothing to describe; a solid has at least four corners.
        let fits = if kind == Self::KINDS[0] { corners.is_empty() && pixels == 0 } else { corners.len() >= 4 };
        ranged(MESSAGE, "corners", corners.len() as f64, fits, "at least 4, without an occluder 0")?;
        let sample = sample_from_proto(MESSAGE, message.sample)?;
        Ok(Self { sample, kind, object_pixels, hidden_pixels, corners, mask })
    }
}
