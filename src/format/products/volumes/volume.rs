//! Record of a fused volume.

use prost::Message;

use crate::codec::{
    RecordError,
    fields::{broken, intrinsics, lengthy, pose, ranged, resolution},
    proto, sample_from_proto, wire,
};
use kernel::{
    geom::{CameraCv, Intrinsics, Pose, Volume, World},
    ids::SampleId,
    voxel::VolumeGrid,
};

const MESSAGE: &str = "SceneVolume";

/// Truncated signed distances fused from depth images of one settled scene.
///
/// For the hot path keep one and refill it: its arrays keep their memory.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneVolume {
    /// Which sample; its item is the number of the fusion.
    pub sample: SampleId,
    /// The cube of voxels.
    pub grid: VolumeGrid,
    /// Distance at which values are truncated [m].
    pub truncation: f64,
    /// Pose of the cube in the scene: the origin is a corner.
    pub world_from_volume: Pose<World, Volume>,
    /// The images, by the number of their view.
    pub views: Vec<FusedView>,
    /// Mean signed distances in steps of `truncation / 32767`: positive in front of the observed surface, -32767 to 32767; 0 in
    /// unobserved voxels. Voxel (x, y, z) is value `(x * resolution + y) * resolution + z`.
    pub steps: Vec<i16>,
    /// Number of images averaged in each value.
    pub weights: Vec<u8>,
}

/// An image that was fused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FusedView {
    /// Number of the view of the scene.
    pub view: u32,
    /// Index of the camera of the views that made it.
    pub camera: u32,
    /// The camera [px].
    pub intrinsics: Intrinsics,
    /// Pose of the camera in the scene.
    pub world_from_camera: Pose<World, CameraCv>,
}

impl SceneVolume {
    /// An empty volume, to be filled.
    pub fn empty(sample: SampleId, grid: VolumeGrid, truncation: f64) -> Self {
        Self {
            sample,
            grid,
            truncation,
            world_from_volume: Pose::identity(),
            views: Vec::new(),
            steps: vec![0; grid.voxels()],
            weights: vec![0; grid.voxels()],
        }
    }

    /// Count of the voxels that at least one image observed.
    pub fn observed(&self) -> u32 {
        self.weights.iter().filter(|weight| **weight > 0).count() as u32
    }

    /// Count of the observed voxels that are nearer to the observed surface than the truncation.
    pub fn near(&self) -> u32 {
        let voxels = self.steps.iter().zip(&self.weights);
        voxels.filter(|(steps, weight)| **weight > 0 && steps.unsigned_abs() < i16::MAX.unsigned_abs()).count() as u32
    }

    /// Distance of a voxel in units of the truncation, -1 to 1.
    pub fn value(&self, index: usize) -> f64 {
        f64::from(self.steps[index]) / f64::from(i16::MAX)
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        out.reserve(3 * self.steps.len() + 160 * self.views.len() + 256);
        wire::sample(out, 1, &self.sample);
        wire::uint32(out, 2, self.grid.resolution);
        wire::double(out, 3, self.grid.size);
        wire::double(out, 4, self.truncation);
        wire::doubles(out, 5, &self.world_from_volume.to_rows());
        wire::uint32s(out, 6, self.views.iter().map(|view| view.view));
        wire::uint32s(out, 7, self.views.iter().map(|view| view.camera));
        self.views.iter().for_each(|view| wire::camera(out, 8, &view.intrinsics));
        wire::doubles_of(out, 9, self.views.iter().flat_map(|view| view.world_from_camera.to_rows()));
        if !self.steps.is_empty() {
            wire::bytes_header(out, 10, 2 * self.steps.len());
            out.extend(self.steps.iter().flat_map(|steps| steps.to_le_bytes()));
        }
        wire::bytes(out, 11, &self.weights);
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length, a range, a rotation or a weight does not hold.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::SceneVolume::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample)?;
        let grid = VolumeGrid { resolution: resolution(MESSAGE, raw.resolution)?, size: raw.size };
        for (field, length) in [("size", raw.size), ("truncation", raw.truncation)] {
            ranged(MESSAGE, field, length, length > 0.0 && length.is_finite(), "positive and finite")?;
        }
        let count = raw.views.len();
        ranged(MESSAGE, "views", count as f64, (1..=255).contains(&count), "1 to 255 images")?;
        let descent = raw.views.windows(2).find(|pair| pair[0] >= pair[1]);
        ranged(MESSAGE, "views", descent.map_or(0.0, |pair| f64::from(pair[1])), descent.is_none(), "ascending")?;
        lengthy(MESSAGE, "cameras", count, raw.cameras.len())?;
        lengthy(MESSAGE, "intrinsics", count, raw.intrinsics.len())?;
        lengthy(MESSAGE, "world_from_camera", 12 * count, raw.world_from_camera.len())?;
        let mut views = Vec::with_capacity(count);
        for (index, camera) in raw.intrinsics.into_iter().enumerate() {
            views.push(FusedView {
                view: raw.views[index],
                camera: raw.cameras[index],
                intrinsics: intrinsics(MESSAGE, Some(camera))?,
                world_from_camera: pose(MESSAGE, "world_from_camera", &raw.world_from_camera[12 * index..][..12])?,
            });
        }
        lengthy(MESSAGE, "values", 2 * grid.voxels(), raw.values.len())?;
        lengthy(MESSAGE, "weights", grid.voxels(), raw.weights.len())?;
        let steps: Vec<i16> =
            raw.values.chunks_exact(2).map(|bytes| i16::from_le_bytes([bytes[0], bytes[1]])).collect();
        for (steps, weight) in steps.iter().zip(&raw.weights) {
            let fits = usize::from(*weight) <= count;
            ranged(MESSAGE, "weights", f64::from(*weight), fits, "at most the count of images")?;
            let fits = *steps != i16::MIN && (*weight > 0 || *steps == 0);
            ranged(MESSAGE, "values", f64::from(*steps), fits, "-32767 to 32767, 0 in unobserved voxels")?;
        }
        Ok(Self {
            sample,
            grid,
            truncation: raw.truncation,
            world_from_volume: pose(MESSAGE, "world_from_volume", &raw.world_from_volume)?,
            views,
            steps,
            weights: raw.weights,
        })
    }
}
