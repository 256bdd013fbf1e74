//! Record of the picture of a scene from above.

use prost::Message;

use crate::codec::{
    RecordError,
    fields::{FOCAL_LENGTHS, broken, lengthy, ranged},
    proto, sample_from_proto, wire,
};
use kernel::{
    geom::{CameraCv, Intrinsics, Pose, World},
    ids::SampleId,
};

const MESSAGE: &str = "SceneOverview";

/// A scene from above, for people: by a pinhole camera over the world's origin that looks straight down, its image's right along
/// x and its up along y.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneOverview {
    /// Which sample.
    pub sample: SampleId,
    /// Image width and height [px].
    pub size: [u32; 2],
    /// Focal length [px].
    pub focal: f64,
    /// Height of the camera above the floor [m].
    pub camera_z: f64,
    /// Shape (height, width): 0 floor or nothing, 1 to 254 the body in front, [`SceneOverview::WALLS`] the container.
    pub instances: Vec<u8>,
    /// Depth along the optical axis [0.1 mm], 0 where nothing is. Shape (height, width).
    pub depths: Vec<u16>,
}

impl SceneOverview {
    /// Instance of the container.
    pub const WALLS: u8 = 255;

    /// Unit of the depths [m].
    pub const STEP: f64 = 1e-4;

    /// The camera.
    pub fn camera(&self) -> Intrinsics {
        let [width, height] = self.size;
        let [cx, cy] = self.size.map(|side| f64::from(side) / 2.0);
        Intrinsics { width, height, fx: self.focal, fy: self.focal, cx, cy, near: 0.01 }
    }

    /// The camera's pose.
    pub fn camera_from_world(&self) -> Pose<CameraCv, World> {
        // Half a turn about x.
        Pose::from_rows(&[1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, self.camera_z])
    }

    /// Depth of a pixel [m]; NaN where nothing is.
    ///
    /// # Panics
    /// When it is outside the image.
    pub fn depth(&self, column: u32, row: u32) -> f32 {
        match self.depths[(row * self.size[0] + column) as usize] {
            0 => f32::NAN,
            depth => (f64::from(depth) * Self::STEP) as f32,
        }
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        wire::sample(out, 1, &self.sample);
        wire::uint32(out, 2, self.size[0]);
        wire::uint32(out, 3, self.size[1]);
        wire::double(out, 4, self.focal);
        wire::double(out, 5, self.camera_z);
        wire::bytes(out, 6, &self.instances);
        let depths: Vec<u8> = self.depths.iter().flat_map(|depth| depth.to_le_bytes()).collect();
        wire::bytes(out, 7, &depths);
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length or a range does not hold.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::SceneOverview::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample)?;
        for (field, side) in [("width", raw.width), ("height", raw.height)] {
            ranged(MESSAGE, field, f64::from(side), (1..=4096).contains(&side), "1 to 4096")?;
        }
        let height = raw.camera_z;
        ranged(MESSAGE, "camera_z", height, height > 0.0 && height.is_finite(), "positive and finite")?;
        let pixels = raw.width as usize * raw.height as usize;
        lengthy(MESSAGE, "instances", pixels, raw.instances.len())?;
        lengthy(MESSAGE, "depths", 2 * pixels, raw.depths.len())?;
        let depths = raw.depths.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
        let overview = Self {
            sample,
            size: [raw.width, raw.height],
            focal: raw.focal,
            camera_z: raw.camera_z,
            instances: raw.instances,
            depths,
        };
        ranged(MESSAGE, "focal", overview.focal, overview.camera().checked().is_ok(), FOCAL_LENGTHS)?;
        Ok(overview)
    }
}
