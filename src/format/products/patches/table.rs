//! The table under the object of some patches.

use nalgebra::Vector3;
use prost::Message;

use super::HeatmapPatch;
use crate::codec::{
    RecordError,
    fields::{broken, pose, ranged},
    proto, sample_from_proto, wire,
};
use kernel::{
    geom::{CameraCv, Pose, World},
    ids::SampleId,
};

const MESSAGE: &str = "PatchTable";

/// Depth in an image behind the table's top that rounding explains [m].
const BEHIND: f64 = 1e-4;

/// The table under the object, as the camera sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchTable {
    /// Which sample: that of the [`HeatmapPatch`].
    pub sample: SampleId,
    /// Index into the object's resting poses in the asset table.
    pub resting_pose: u32,
    /// The resting pose's world in camera axes: the table's top is its plane z = 0, z points up.
    pub camera_from_table: Pose<CameraCv, World>,
}

impl PatchTable {
    /// Depth along the optical axis of the table's plane in a direction of sight whose z is 1, in camera axes; `None` where it
    /// does not meet the plane in front of the camera.
    pub fn depth_along(&self, sight: &Vector3<f64>) -> Option<f64> {
        let normal = self.camera_from_table.rotation().matrix().column(2).into_owned();
        let along = normal.dot(sight);
        let depth = normal.dot(self.camera_from_table.translation()) / along;
        (depth > 0.0 && depth.is_finite()).then_some(depth)
    }

    /// Checks that the camera is above the table, and that nothing is seen through it.
    ///
    /// # Errors
    /// When it is not.
    pub fn check_beside(&self, patch: &HeatmapPatch) -> Result<(), RecordError> {
        let height = self.camera_from_table.inverse().translation().z;
        ranged(MESSAGE, "camera_from_table", height, height > 0.0, "with the camera above the table")?;
        for (index, point) in patch.points.iter().enumerate() {
            for (k, depth) in (0..).zip(patch.depth_of(index)) {
                let [u, v] = [k % patch.side + point.corner[0], k / patch.side + point.corner[1]]
                    .map(|pixel| f64::from(pixel) + 0.5);
                let sight = patch.camera.unproject(u, v, 1.0);
                let behind = self.depth_along(&sight.coords).map_or(0.0, |table| f64::from(*depth) - table);
                ranged(
                    MESSAGE,
                    "camera_from_table",
                    behind,
                    behind.is_nan() || behind <= BEHIND,
                    "in front of everything seen behind it",
                )?;
            }
        }
        Ok(())
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        wire::sample(out, 1, &self.sample);
        wire::uint32(out, 2, self.resting_pose);
        wire::doubles(out, 3, &self.camera_from_table.to_rows());
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When the pose is not a rigid motion.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::PatchTable::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample)?;
        let camera_from_table = pose(MESSAGE, "camera_from_table", &raw.camera_from_table)?;
        Ok(Self { sample, resting_pose: raw.resting_pose, camera_from_table })
    }
}
