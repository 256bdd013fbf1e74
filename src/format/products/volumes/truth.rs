//! Record of the truth of a volume.

use prost::Message;

use super::SceneVolume;
use crate::codec::{
    RecordError,
    fields::{broken, lengthy, pose, ranged, resolution},
    proto, sample_from_proto, wire,
};
use kernel::{
    geom::{Object, Pose, World},
    ids::{Digest, ObjectId, SampleId},
};

const MESSAGE: &str = "VolumeTruth";

/// Truth of a volume: what is at the centre of each voxel.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeTruth {
    /// Which sample.
    pub sample: SampleId,
    /// Voxels along each edge.
    pub resolution: u32,
    /// Per voxel, as in the volume: [`Self::FREE`], the number of the body from 1, [`Self::CONTAINER`] or [`Self::TABLE`].
    pub instances: Vec<u8>,
    /// The bodies of the scene, in its order: object and pose.
    pub bodies: Vec<(ObjectId, Pose<World, Object>)>,
}

impl VolumeTruth {
    /// Number of a voxel whose centre is free.
    pub const FREE: u8 = 0;

    /// Number of a voxel whose centre is in a wall or the floor of the container.
    pub const CONTAINER: u8 = 254;

    /// Number of a voxel whose centre is below the table.
    pub const TABLE: u8 = 255;

    /// Bodies of a scene, at most, as in images.
    pub const MAX_BODIES: usize = 252;

    /// Whether a number is a body's.
    pub fn is_body(number: u8) -> bool {
        (1..=Self::MAX_BODIES).contains(&usize::from(number))
    }

    /// Count of the voxels whose centre is inside a body.
    pub fn occupied(&self) -> u32 {
        self.instances.iter().filter(|number| Self::is_body(**number)).count() as u32
    }

    /// Count of the bodies that contain a voxel centre.
    pub fn bodies_inside(&self) -> u32 {
        let mut seen = [false; 256];
        self.instances.iter().for_each(|number| seen[usize::from(*number)] = true);
        (1..=self.bodies.len()).filter(|number| seen[*number]).count() as u32
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        out.reserve(self.instances.len() + 144 * self.bodies.len() + 128);
        wire::sample(out, 1, &self.sample);
        wire::uint32(out, 2, self.resolution);
        wire::bytes(out, 3, &self.instances);
        let objects: Vec<u8> = self.bodies.iter().flat_map(|(object, _)| object.0.0).collect();
        wire::bytes(out, 4, &objects);
        wire::doubles_of(out, 5, self.bodies.iter().flat_map(|(_, pose)| pose.to_rows()));
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length, a number or a rotation does not hold.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::VolumeTruth::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample)?;
        let resolution = resolution(MESSAGE, raw.resolution)?;
        lengthy(MESSAGE, "instances", (resolution as usize).pow(3), raw.instances.len())?;
        let count = raw.objects.len() / 32;
        let fits = (1..=Self::MAX_BODIES).contains(&count);
        ranged(MESSAGE, "objects", count as f64, fits, "1 to 252 bodies")?;
        lengthy(MESSAGE, "objects", 32 * count, raw.objects.len())?;
        lengthy(MESSAGE, "world_from_object", 12 * count, raw.world_from_object.len())?;
        let is_known = |number: u8| matches!(number, Self::CONTAINER | Self::TABLE) || usize::from(number) <= count;
        let strange = raw.instances.iter().find(|number| !is_known(**number));
        let allowed = "free, a body of the scene, container or table";
        ranged(MESSAGE, "instances", strange.map_or(0.0, |number| f64::from(*number)), strange.is_none(), allowed)?;
        let mut bodies = Vec::with_capacity(count);
        for (object, rows) in raw.objects.chunks_exact(32).zip(raw.world_from_object.chunks_exact(12)) {
            let object = ObjectId(Digest(object.try_into().expect("32 bytes")));
            bodies.push((object, pose(MESSAGE, "world_from_object", rows)?));
        }
        Ok(Self { sample, resolution, instances: raw.instances, bodies })
    }

    /// Compares the record with the volume of its sample.
    ///
    /// # Errors
    /// When the two are of different grids.
    pub fn check_beside(&self, volume: &SceneVolume) -> Result<(), RecordError> {
        let fits = self.resolution == volume.grid.resolution;
        ranged(MESSAGE, "resolution", f64::from(self.resolution), fits, "that of the volume")
    }
}
