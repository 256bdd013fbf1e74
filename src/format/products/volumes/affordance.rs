//! Record of the grasps in a volume.

use nalgebra::Point3;
use prost::Message;

use super::SceneVolume;
use crate::codec::{
    RecordError,
    fields::{broken, lengthy, ranged},
    proto, sample_from_proto, wire,
};
use crate::products::{patches::flags, picks::PickState};
use kernel::{
    ids::{Digest, ObjectId, SampleId},
    voxel::VolumeGrid,
};

const MESSAGE: &str = "VolumeAffordance";

/// Tolerance of the length of a quaternion.
const UNIT_TOLERANCE: f64 = 1e-9;

/// Grasps of the bodies of a scene in the cube of a volume, a row per free grasp whose centre is inside.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeAffordance {
    /// Which sample: that of the volume.
    pub sample: SampleId,
    /// The cube of voxels: that of the volume.
    pub grid: VolumeGrid,
    /// Digest of the exact numbers of the dataset of picks.
    pub picks: Digest,
    /// Digest of its numbers of physics; `None` without trials.
    pub trials: Option<Digest>,
    /// Name of the hand.
    pub hand: String,
    /// Digest of the hand's description and table.
    pub hand_id: ObjectId,
    /// Whether the dataset of picks has grasps of each body.
    pub evaluated: Vec<bool>,
    /// Grasps of the scene that collide with each of [`PickObstacle::NAMES`](crate::PickObstacle::NAMES).
    pub forbidden: [u32; 4],
    /// Free grasps whose centre is outside the cube.
    pub outside: u32,
    /// The grasps, by body and candidate.
    pub grasps: Vec<VoxelGrasp>,
}

/// A free grasp in a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelGrasp {
    /// Number of the body, from 1.
    pub body: u32,
    /// Index of the candidate in the body's sample of picks.
    pub candidate: u32,
    /// State by trials.
    pub state: PickState,
    /// Middle between the pads of a closed gripper, in `Volume` [m]; for any other hand, the mean of the contacts of the closed
    /// hand.
    pub centre: [f64; 3],
    /// Rotation of the hand, expressed in the volume's frame, as a unit quaternion x, y, z, w with w not below 0: x along the
    /// closing line, z along the approach.
    pub rotation: [f64; 4],
    /// Free width between the pads of the closed hand [m]; 0 for a hand without a width.
    pub width: f64,
}

impl VolumeAffordance {
    /// Number of the voxel of a cube that contains a point in `Volume` [m]; `None` outside.
    pub fn voxel_of(grid: &VolumeGrid, point: &Point3<f64>) -> Option<u32> {
        let n = grid.resolution;
        let mut number = 0;
        for value in point.iter() {
            let index = (value / grid.voxel()).floor();
            if !(0.0..f64::from(n)).contains(&index) {
                return None;
            }
            number = number * n + index as u32;
        }
        Some(number)
    }

    /// Number of the voxel that contains the centre of a grasp of the record.
    pub fn voxel(&self, grasp: &VoxelGrasp) -> u32 {
        Self::voxel_of(&self.grid, &grasp.centre.into()).unwrap_or_default()
    }

    /// Free grasps of each of [`PickState::ALL`].
    pub fn states(&self) -> [u32; 3] {
        let mut states = [0; 3];
        self.grasps.iter().for_each(|grasp| states[grasp.state as usize] += 1);
        states
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let all = || self.grasps.iter();
        out.reserve(80 * self.grasps.len() + 256);
        wire::sample(out, 1, &self.sample);
        wire::uint32(out, 2, self.grid.resolution);
        wire::double(out, 3, self.grid.size);
        wire::bytes(out, 4, &self.picks.0);
        wire::bytes(out, 5, self.trials.as_ref().map_or(&[][..], |trials| &trials.0));
        wire::bytes(out, 6, self.hand.as_bytes());
        wire::bytes(out, 7, &self.hand_id.0.0);
        wire::bytes_of(out, 8, self.evaluated.iter().map(|known| u8::from(*known)));
        wire::uint32s(out, 9, self.forbidden.into_iter());
        wire::uint32(out, 10, self.outside);
        wire::uint32s(out, 11, all().map(|grasp| grasp.body));
        wire::uint32s(out, 12, all().map(|grasp| grasp.candidate));
        wire::uint32s(out, 13, all().map(|grasp| self.voxel(grasp)));
        wire::bytes_of(out, 14, all().map(|grasp| grasp.state as u8));
        wire::doubles_of(out, 15, all().flat_map(|grasp| grasp.centre));
        wire::doubles_of(out, 16, all().flat_map(|grasp| grasp.rotation));
        wire::doubles_of(out, 17, all().map(|grasp| grasp.width));
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When lengths do not fit each other, a number is out of range or not finite, a quaternion is not of length 1, a centre is
    /// not in its voxel, or rows are out of order.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::VolumeAffordance::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample.clone())?;
        let resolution = crate::codec::fields::resolution(MESSAGE, raw.resolution)?;
        ranged(MESSAGE, "size", raw.size, raw.size > 0.0 && raw.size.is_finite(), "positive and finite")?;
        lengthy(MESSAGE, "forbidden", 4, raw.forbidden.len())?;
        let trials = if raw.trials.is_empty() { None } else { Some(digest("trials", &raw.trials)?) };
        let evaluated = flags(MESSAGE, "evaluated", &raw.evaluated)?;
        let grid = VolumeGrid { resolution, size: raw.size };
        Ok(Self {
            sample,
            grid,
            picks: digest("picks", &raw.picks)?,
            trials,
            hand_id: ObjectId(digest("hand_digest", &raw.hand_digest)?),
            forbidden: std::array::from_fn(|index| raw.forbidden[index]),
            outside: raw.outside,
            grasps: grasps(&grid, &evaluated, &raw)?,
            evaluated,
            hand: raw.hand,
        })
    }

    /// Compares the record with the volume of its sample.
    ///
    /// # Errors
    /// When the two are of different cubes.
    pub fn check_beside(&self, volume: &SceneVolume) -> Result<(), RecordError> {
        let fits = self.grid == volume.grid;
        ranged(MESSAGE, "resolution", f64::from(self.grid.resolution), fits, "the cube of the volume")
    }
}

fn digest(field: &'static str, bytes: &[u8]) -> Result<Digest, RecordError> {
    lengthy(MESSAGE, field, 32, bytes.len())?;
    Ok(Digest(bytes.try_into().unwrap_or_default()))
}

fn grasps(
    grid: &VolumeGrid,
    evaluated: &[bool],
    raw: &proto::VolumeAffordance,
) -> Result<Vec<VoxelGrasp>, RecordError> {
    let count = raw.bodies.len();
    for (field, expected, found) in [
        ("candidates", count, raw.candidates.len()),
        ("voxels", count, raw.voxels.len()),
        ("states", count, raw.states.len()),
        ("centres", 3 * count, raw.centres.len()),
        ("rotations", 4 * count, raw.rotations.len()),
        ("widths", count, raw.widths.len()),
    ] {
        lengthy(MESSAGE, field, expected, found)?;
    }
    let states = PickState::all_of(MESSAGE, "states", &raw.states)?;
    let mut grasps: Vec<VoxelGrasp> = Vec::with_capacity(count);
    for (index, state) in states.into_iter().enumerate() {
        let (body, candidate, width) = (raw.bodies[index], raw.candidates[index], raw.widths[index]);
        let is_known = (body as usize).checked_sub(1).and_then(|index| evaluated.get(index)) == Some(&true);
        ranged(MESSAGE, "bodies", f64::from(body), is_known, "a body of the scene whose grasps were evaluated")?;
        let is_next = grasps.last().is_none_or(|last| [last.body, last.candidate] < [body, candidate]);
        ranged(MESSAGE, "candidates", f64::from(candidate), is_next, "sorted by body and candidate, none twice")?;
        let centre: [f64; 3] = std::array::from_fn(|axis| raw.centres[3 * index + axis]);
        let rotation: [f64; 4] = std::array::from_fn(|part| raw.rotations[4 * index + part]);
        let inside = VolumeAffordance::voxel_of(grid, &centre.into()) == Some(raw.voxels[index]);
        ranged(MESSAGE, "voxels", f64::from(raw.voxels[index]), inside, "the voxel that contains the centre")?;
        let length = rotation.iter().map(|part| part * part).sum::<f64>();
        let is_unit = (length - 1.0).abs() <= UNIT_TOLERANCE && rotation[3] >= 0.0;
        ranged(MESSAGE, "rotations", length, is_unit, "of unit length, w not below 0")?;
        ranged(MESSAGE, "widths", width, width.is_finite(), "finite")?;
        grasps.push(VoxelGrasp { body, candidate, state, centre, rotation, width });
    }
    Ok(grasps)
}
