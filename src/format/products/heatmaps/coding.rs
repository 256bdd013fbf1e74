//! A heatmap of a scene as it is on disk.

use prost::Message;

use super::{
    heatmap::{HeatmapLabel, SceneHeatmap},
    row_coding::{MESSAGE, encode_forbidden, encode_grasps, forbidden_of, grasps_of},
};
use crate::codec::{
    RecordError,
    fields::{broken, intrinsics, lengthy, named, pose, ranged},
    proto, sample_from_proto, wire,
};
use crate::products::patches::flags;
use kernel::ids::{Digest, ObjectId};

/// Largest number of points of a hand.
const MAX_POINTS: usize = 16;

impl SceneHeatmap {
    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        out.reserve(360 * self.grasps.len() + 24 * self.forbidden.len() + 512);
        wire::sample(out, 1, &self.sample);
        wire::bytes(out, 2, &self.picks.0);
        wire::bytes(out, 3, self.trials.as_ref().map_or(&[][..], |trials| &trials.0));
        wire::bytes(out, 4, self.hand.as_bytes());
        wire::bytes(out, 5, &self.hand_id.0.0);
        self.names.iter().for_each(|name| wire::element(out, 6, name.as_bytes()));
        wire::uint32s(out, 7, self.types.iter().copied());
        wire::bytes(out, 8, self.label.name().as_bytes());
        wire::double(out, 9, self.angle);
        wire::camera(out, 10, &self.camera);
        wire::doubles(out, 11, &self.world_from_camera.to_rows());
        wire::uint32(out, 12, self.side);
        wire::double(out, 13, self.size.unwrap_or_default());
        wire::bytes_of(out, 14, self.evaluated.iter().map(|known| u8::from(*known)));
        wire::uint32(out, 15, self.other_types);
        encode_grasps(&self.grasps, out);
        encode_forbidden(&self.forbidden, out);
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When lengths do not fit each other, a number is out of range, a pose is not a rigid motion, a name is unknown, rows are
    /// out of order, a point is not where it is projected to, a patch is not around its point or extends beyond the image, a
    /// label is not that of its state, or visibility does not follow from the depths.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let mut raw = proto::SceneHeatmap::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample.take())?;
        let count = raw.names.len();
        ranged(MESSAGE, "names", count as f64, (1..=MAX_POINTS).contains(&count), "1 to 16 points")?;
        let names = HeatmapLabel::ALL.map(HeatmapLabel::name);
        named(MESSAGE, "label", &raw.label, &names)?;
        let angle = raw.angle;
        ranged(MESSAGE, "angle", angle, (0.0..=std::f64::consts::PI).contains(&angle), "0 to pi")?;
        ranged(MESSAGE, "side", f64::from(raw.side), (1..=1024).contains(&raw.side), "1 to 1024")?;
        ranged(MESSAGE, "size", raw.size, raw.size >= 0.0 && raw.size.is_finite(), "positive, or absent")?;
        let trials = if raw.trials.is_empty() { None } else { Some(digest("trials", &raw.trials)?) };
        let mut heatmap = Self {
            sample,
            picks: digest("picks", &raw.picks)?,
            trials,
            hand_id: ObjectId(digest("hand_digest", &raw.hand_digest)?),
            label: HeatmapLabel::ALL[names.iter().position(|name| *name == raw.label).unwrap_or_default()],
            angle,
            camera: intrinsics(MESSAGE, raw.camera.take())?,
            world_from_camera: pose(MESSAGE, "world_from_camera", &raw.world_from_camera)?,
            side: raw.side,
            size: (raw.size > 0.0).then_some(raw.size),
            evaluated: flags(MESSAGE, "evaluated", &raw.evaluated)?,
            other_types: raw.other_types,
            grasps: Vec::new(),
            forbidden: Vec::new(),
            hand: std::mem::take(&mut raw.hand),
            names: std::mem::take(&mut raw.names),
            types: std::mem::take(&mut raw.types),
        };
        let bodies = heatmap.evaluated.len();
        ranged(MESSAGE, "evaluated", bodies as f64, bodies > 0, "a scene with a body")?;
        heatmap.grasps = grasps_of(&heatmap, &raw)?;
        heatmap.forbidden = forbidden_of(&heatmap, &raw)?;
        Ok(heatmap)
    }
}

fn digest(field: &'static str, bytes: &[u8]) -> Result<Digest, RecordError> {
    lengthy(MESSAGE, field, 32, bytes.len())?;
    Ok(Digest(bytes.try_into().unwrap_or_default()))
}
