//! Truth for heatmaps over a whole image: where the palm and the fingertips of many grasps would be.

use prost::Message;

use super::{HeatmapPatch, PATCH_POINTS};
use crate::codec::{
    RecordError,
    fields::{broken, floats, lengthy, ranged},
    proto, sample_from_proto, wire,
};
use kernel::ids::SampleId;

const MESSAGE: &str = "PatchHeatmap";

/// A point of a grasp in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeatmapPoint {
    /// Run of the grasp in its dataset: the number of the seed.
    pub run: u32,
    /// Rank in that run.
    pub rank: u32,
    /// Index of its type among the chosen types.
    pub type_index: u32,
    /// Which point: 0 is the palm, then F0, F1, F2.
    pub point: u32,
    /// Projection [px], inside the image.
    pub pixel: [f64; 2],
    /// The grasp's label; lower is better.
    pub value: f32,
}

/// The points of all grasps of an object, of the chosen types, that come from the side of the camera of one of them.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchHeatmap {
    /// Which sample: that of the [`HeatmapPatch`] with the same camera.
    pub sample: SampleId,
    /// Width of the image [px].
    pub width: u32,
    /// Height of the image [px].
    pub height: u32,
    /// Number of chosen types.
    pub types: u32,
    /// Largest angle between the approaches of these grasps and the camera's axis [rad].
    pub angle: f64,
    /// The points inside the image, sorted by run, rank and point.
    pub points: Vec<HeatmapPoint>,
}

impl PatchHeatmap {
    /// Dense maps: in the pixel that holds a point the lowest value of all points there, 0 elsewhere (no grasp). Shape
    /// (4 * types, height, width), row-major; the map of a type and a point is `4 * type_index + point`, as in a label vector.
    /// Points of value 0, without a conclusive trial, are omitted.
    pub fn maps(&self) -> Vec<f32> {
        let pixels = self.width as usize * self.height as usize;
        let mut maps = vec![0.0; PATCH_POINTS * self.types as usize * pixels];
        let mut taken = vec![false; maps.len()];
        for point in self.points.iter().filter(|point| point.value != 0.0) {
            let map = PATCH_POINTS * point.type_index as usize + point.point as usize;
            let [column, row] = point.pixel.map(|pixel| pixel.floor() as usize);
            let cell = map * pixels + row * self.width as usize + column;
            // Quirk of the thesis: a label may be above 0 and still represent a grasp.
            maps[cell] = if taken[cell] { point.value.min(maps[cell]) } else { point.value };
            taken[cell] = true;
        }
        maps
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let points = &self.points;
        wire::sample(out, 1, &self.sample);
        wire::uint32(out, 2, self.width);
        wire::uint32(out, 3, self.height);
        wire::uint32(out, 4, self.types);
        wire::double(out, 5, self.angle);
        wire::uint32s(out, 6, points.iter().map(|point| point.run));
        wire::uint32s(out, 7, points.iter().map(|point| point.rank));
        wire::uint32s(out, 8, points.iter().map(|point| point.type_index));
        wire::uint32s(out, 9, points.iter().map(|point| point.point));
        wire::doubles_of(out, 10, points.iter().flat_map(|point| point.pixel));
        wire::singles(out, 11, points.iter().map(|point| point.value));
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When lengths do not fit each other, a number is out of range, a point is outside the image, or points are out of
    /// order.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::PatchHeatmap::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample)?;
        for (field, side) in [("width", raw.width), ("height", raw.height)] {
            ranged(MESSAGE, field, f64::from(side), (1..=16384).contains(&side), "1 to 16384")?;
        }
        ranged(MESSAGE, "types", f64::from(raw.types), (1..=4096).contains(&raw.types), "1 to 4096")?;
        ranged(MESSAGE, "angle", raw.angle, (0.0..=std::f64::consts::PI).contains(&raw.angle), "0 to pi")?;
        let values = floats(MESSAGE, "values", &raw.values, 1)?;
        let count = values.len();
        for (field, list) in
            [("runs", &raw.runs), ("ranks", &raw.ranks), ("type_indices", &raw.type_indices), ("points", &raw.points)]
        {
            lengthy(MESSAGE, field, count, list.len())?;
        }
        lengthy(MESSAGE, "pixels", 2 * count, raw.pixels.len())?;
        let mut points: Vec<HeatmapPoint> = Vec::with_capacity(count);
        for (index, value) in values.into_iter().enumerate() {
            let (type_index, point) = (raw.type_indices[index], raw.points[index]);
            ranged(MESSAGE, "type_indices", f64::from(type_index), type_index < raw.types, "below types")?;
            ranged(MESSAGE, "points", f64::from(point), point < PATCH_POINTS as u32, "0 to 3")?;
            let pixel = [raw.pixels[2 * index], raw.pixels[2 * index + 1]];
            for (pixel, side) in pixel.into_iter().zip([raw.width, raw.height]) {
                ranged(MESSAGE, "pixels", pixel, (0.0..f64::from(side)).contains(&pixel), "inside the image")?;
            }
            let next = HeatmapPoint { run: raw.runs[index], rank: raw.ranks[index], type_index, point, pixel, value };
            let key = |point: &HeatmapPoint| (point.run, point.rank, point.point);
            let sorted = points.last().is_none_or(|last| key(last) < key(&next));
            ranged(MESSAGE, "runs", f64::from(next.run), sorted, "sorted by run, rank and point")?;
            points.push(next);
        }
        Ok(Self { sample, width: raw.width, height: raw.height, types: raw.types, angle: raw.angle, points })
    }

    /// Checks that the grasp of `patch`, whose camera it is, is among them, unchanged.
    ///
    /// # Errors
    /// When it is not, or the image is another one.
    pub fn check_beside(&self, patch: &HeatmapPatch) -> Result<(), RecordError> {
        let (camera, types) = (&patch.camera, patch.types.len() as u32);
        ranged(MESSAGE, "width", f64::from(self.width), self.width == camera.width, "the camera's")?;
        ranged(MESSAGE, "height", f64::from(self.height), self.height == camera.height, "the camera's")?;
        ranged(MESSAGE, "types", f64::from(self.types), self.types == types, "as many as the patch has")?;
        for (index, point) in (0..).zip(&patch.points) {
            let own = HeatmapPoint {
                run: patch.run,
                rank: patch.rank,
                type_index: patch.type_index,
                point: index,
                pixel: point.pixel,
                value: patch.value,
            };
            ranged(
                MESSAGE,
                "points",
                f64::from(index),
                self.points.contains(&own),
                "with those of the patch's own grasp",
            )?;
        }
        Ok(())
    }
}
