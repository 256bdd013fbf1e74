//! Patches of images around the palm and the fingertips of a grasp, with labels for heatmaps.

use prost::Message;

use super::{
    PatchFacts,
    arrays::{depths, is_same_depth},
};
use crate::codec::{
    Depth, RecordError,
    fields::{FOCAL_LENGTHS, broken, intrinsics, lengthy, named, pose, ranged},
    proto, sample_from_proto, wire,
};
use crate::products::grasps::{FORCE, WRENCH};
use kernel::{
    geom::{Approach, CameraCv, DepthCrop, Intrinsics, Object, Pose},
    ids::{Digest, ObjectId, SampleId},
    words::{TYPE_DIGITS, type_digits},
};

const MESSAGE: &str = "HeatmapPatch";
const COLOUR: &str = "PatchColour";

/// Points of a hand with patches around them: palm, F0, F1, F2.
pub const PATCH_POINTS: usize = 4;
/// Common names of these points.
pub const POINT_NAMES: [&str; PATCH_POINTS] = ["palm", "F0", "F1", "F2"];
/// The word in [`HeatmapPatch::label`] of labels that are those of trials.
pub const TRIAL_LABEL: &str = "trial";
/// Values that a label may be: -epsilon, the energy, or the outcome of trials.
const LABELS: [&str; 3] = ["epsilon", "energy", TRIAL_LABEL];

/// A point on a hand, and the patch around it.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchPoint {
    /// Name in the hand's description: the approach frame, or a contact.
    pub name: String,
    /// Where it is, in `Object` [m].
    pub point: [f64; 3],
    /// Projection [px].
    pub pixel: [f64; 2],
    /// The left and top pixel of its patch.
    pub corner: [u32; 2],
}

/// Depth patches around the palm and the fingertips of one grasp, as a depth camera sees them, with labels (thesis ch.
/// 4).
#[derive(Clone, Debug, PartialEq)]
pub struct HeatmapPatch {
    /// Which sample: the object, and the grasp's index among those of the chosen types as its item.
    pub sample: SampleId,
    /// Root digest of the exact numbers of the dataset that holds the grasp.
    pub grasps: Digest,
    /// Run in that dataset: the number of the seed.
    pub run: u32,
    /// Rank in that run.
    pub rank: u32,
    /// Index of its type in `types`.
    pub type_index: u32,
    /// The chosen types, the most common first.
    pub types: Vec<u32>,
    /// Energy that annealing minimised, before closing.
    pub energy: f64,
    /// Epsilon of the closed hand, in `space`.
    pub epsilon: f64,
    /// The space of epsilon: `force` or `wrench`.
    pub space: String,
    /// The hand's name.
    pub hand: String,
    /// Digest of the hand.
    pub hand_id: ObjectId,
    /// The camera [px].
    pub camera: Intrinsics,
    /// Quirk of the thesis: the focal length that points are projected with [px]; `None` where it is the camera's.
    pub point_focal_length: Option<f64>,
    /// Pose of the object in camera axes.
    pub camera_from_object: Pose<CameraCv, Object>,
    /// The approach frame: origin on the palm, z towards the object.
    pub object_from_approach: Pose<Object, Approach>,
    /// Palm, F0, F1, F2.
    pub points: [PatchPoint; PATCH_POINTS],
    /// Side of each patch [px].
    pub side: u32,
    /// Depth along the optical axis [m], NaN = no return. Shape (points, side, side), row-major.
    pub depth: Vec<f32>,
    /// Kind of the label: `epsilon` (-epsilon), `energy`, or `trial` (-1 held, 1 failed, 0 not known:
    /// [`trial_value`](super::trial_value)).
    pub label: String,
    /// The label; it may be any finite number.
    pub value: f32,
}

impl HeatmapPatch {
    /// The type of the grasp.
    ///
    /// # Panics
    /// When `type_index` is not an index into `types`; a decoded record has one.
    pub fn kind(&self) -> u32 {
        self.types[self.type_index as usize]
    }

    /// The label vector of a point (0 is the palm): zeros but for one number, lower is better.
    /// Shape (4 * types): all four points of the most common type come first.
    pub fn labels(&self, point: usize) -> Vec<f32> {
        let mut labels = vec![0.0; PATCH_POINTS * self.types.len()];
        labels[PATCH_POINTS * self.type_index as usize + point] = self.value;
        labels
    }

    /// The camera that points are projected with: the one that sees, except for the quirk of the thesis.
    pub fn projection(&self) -> Intrinsics {
        self.camera.with_focal_length(self.point_focal_length)
    }

    /// Checks that the patches are cuts of a whole image.
    ///
    /// # Errors
    /// When the image has parts outside the camera's, or another depth in a pixel of a patch.
    pub fn check_image(&self, image: &Depth) -> Result<(), RecordError> {
        const IMAGE: &str = "Depth";
        let DepthCrop { left, top, width, height, .. } = image.crop;
        ranged(IMAGE, "width", f64::from(width), left + width <= self.camera.width, "inside the image")?;
        ranged(IMAGE, "height", f64::from(height), top + height <= self.camera.height, "inside the image")?;
        for (index, PatchPoint { corner: [left, top], .. }) in self.points.iter().enumerate() {
            for (k, depth) in (0..).zip(self.depth_of(index)) {
                let whole = image.crop.at(left + k % self.side, top + k / self.side);
                ranged(
                    IMAGE,
                    "data",
                    f64::from(whole),
                    is_same_depth(whole, *depth),
                    "that of the patch around each point",
                )?;
            }
        }
        Ok(())
    }

    /// The depth of the patch around a point.
    pub fn depth_of(&self, point: usize) -> &[f32] {
        let pixels = (self.side * self.side) as usize;
        &self.depth[point * pixels..(point + 1) * pixels]
    }

    /// Numbers for tables, without those of the marks.
    pub fn facts(&self) -> PatchFacts {
        let &Self { type_index, energy, epsilon, .. } = self;
        PatchFacts { kind: self.kind(), type_index, energy, epsilon, ..PatchFacts::default() }
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let points = &self.points;
        wire::sample(out, 1, &self.sample);
        wire::bytes(out, 2, &self.grasps.0);
        wire::uint32(out, 3, self.run);
        wire::uint32(out, 4, self.rank);
        wire::uint32(out, 5, self.kind());
        wire::uint32s(out, 6, type_digits(self.kind()).into_iter());
        wire::uint32(out, 7, self.type_index);
        wire::uint32s(out, 8, self.types.iter().copied());
        wire::double(out, 9, self.energy);
        wire::double(out, 10, self.epsilon);
        wire::bytes(out, 11, self.space.as_bytes());
        wire::bytes(out, 12, self.hand.as_bytes());
        wire::bytes(out, 13, &self.hand_id.0.0);
        wire::camera(out, 14, &self.camera);
        wire::doubles(out, 15, &self.camera_from_object.to_rows());
        wire::doubles(out, 16, &self.object_from_approach.to_rows());
        points.iter().for_each(|point| wire::element(out, 17, point.name.as_bytes()));
        wire::doubles_of(out, 18, points.iter().flat_map(|point| point.point));
        wire::doubles_of(out, 19, points.iter().flat_map(|point| point.pixel));
        let corners: [[u32; 2]; PATCH_POINTS] = points.each_ref().map(|point| point.corner);
        wire::uint32s(out, 20, corners.as_flattened().iter().copied());
        wire::uint32(out, 21, self.side);
        wire::floats_one_nan(out, 22, &self.depth);
        let labels: Vec<f32> = (0..PATCH_POINTS).flat_map(|point| self.labels(point)).collect();
        wire::floats(out, 23, &labels);
        wire::bytes(out, 24, self.label.as_bytes());
        wire::double(out, 25, self.point_focal_length.unwrap_or_default());
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When lengths do not fit each other, a number is out of range, a pose is not a rigid motion, a patch is not around its
    /// point or extends beyond the image, a point is not where it is projected to, or labels are not those of the type.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let mut raw = proto::HeatmapPatch::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample.take())?;
        let camera = intrinsics(MESSAGE, raw.camera.take())?;
        let camera_from_object = pose(MESSAGE, "camera_from_object", &raw.camera_from_object)?;
        let (types, type_index) = (raw.types.len(), raw.type_index as usize);
        ranged(MESSAGE, "type_index", type_index as f64, type_index < types, "an index into types")?;
        let kind = raw.types[type_index];
        ranged(MESSAGE, "type", f64::from(raw.r#type), raw.r#type == kind, "that of types at type_index")?;
        lengthy(MESSAGE, "digits", TYPE_DIGITS, raw.digits.len())?;
        ranged(MESSAGE, "digits", f64::from(kind), raw.digits == type_digits(kind), "those of the type")?;
        ranged(MESSAGE, "energy", raw.energy, raw.energy.is_finite(), "finite")?;
        let epsilon = raw.epsilon;
        ranged(MESSAGE, "epsilon", epsilon, epsilon >= 0.0 && epsilon.is_finite(), "0 or positive, and finite")?;
        named(MESSAGE, "space", &raw.space, &[FORCE, WRENCH])?;
        named(MESSAGE, "label", &raw.label, &LABELS)?;
        let value = value_of(&raw)?;
        let focal = raw.point_focal_length;
        let point_focal_length = (focal != 0.0).then_some(focal);
        let is_focal = camera.with_focal_length(point_focal_length).checked().is_ok();
        ranged(MESSAGE, "point_focal_length", focal, is_focal, FOCAL_LENGTHS)?;
        Ok(Self {
            sample,
            grasps: digest("grasps", &raw.grasps)?,
            run: raw.run,
            rank: raw.rank,
            type_index: raw.type_index,
            energy: raw.energy,
            epsilon,
            hand_id: ObjectId(digest("hand_digest", &raw.hand_digest)?),
            camera,
            point_focal_length,
            camera_from_object,
            object_from_approach: pose(MESSAGE, "object_from_approach", &raw.object_from_approach)?,
            points: points(&raw, &camera.with_focal_length(point_focal_length), &camera_from_object)?,
            side: raw.side,
            depth: depth(&raw)?,
            value,
            types: raw.types,
            space: raw.space,
            hand: raw.hand,
            label: raw.label,
        })
    }
}

fn digest(field: &'static str, bytes: &[u8]) -> Result<Digest, RecordError> {
    lengthy(MESSAGE, field, 32, bytes.len())?;
    Ok(Digest(bytes.try_into().unwrap_or_default()))
}

fn singles(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

fn depth(raw: &proto::HeatmapPatch) -> Result<Vec<f32>, RecordError> {
    let pixels = PATCH_POINTS * raw.side as usize * raw.side as usize;
    lengthy(MESSAGE, "depth", 4 * pixels, raw.depth.len())?;
    depths(MESSAGE, "depth", &raw.depth)
}

/// The number in the labels of a record whose type has been checked.
fn value_of(raw: &proto::HeatmapPatch) -> Result<f32, RecordError> {
    let each = PATCH_POINTS * raw.types.len();
    lengthy(MESSAGE, "labels", 4 * PATCH_POINTS * each, raw.labels.len())?;
    let labels = singles(&raw.labels);
    let index = PATCH_POINTS * raw.type_index as usize;
    let value = labels[index];
    ranged(MESSAGE, "labels", f64::from(value), value.is_finite(), "finite")?;
    for (point, row) in labels.chunks_exact(each).enumerate() {
        for (entry, label) in row.iter().enumerate() {
            let expected = if entry == index + point { value } else { 0.0 };
            let same = label.to_bits() == expected.to_bits();
            ranged(
                MESSAGE,
                "labels",
                f64::from(*label),
                same,
                "0 but at the type and the point, the same for all points",
            )?;
        }
    }
    let is_stated = match raw.label.as_str() {
        TRIAL_LABEL => [-1.0, 0.0, 1.0].contains(&value),
        label => value == if label == LABELS[0] { -raw.epsilon } else { raw.energy } as f32,
    };
    ranged(MESSAGE, "labels", f64::from(value), is_stated, "the number that label selects")?;
    Ok(value)
}

fn points(
    raw: &proto::HeatmapPatch,
    camera: &Intrinsics,
    camera_from_object: &Pose<CameraCv, Object>,
) -> Result<[PatchPoint; PATCH_POINTS], RecordError> {
    lengthy(MESSAGE, "names", PATCH_POINTS, raw.names.len())?;
    lengthy(MESSAGE, "points", 3 * PATCH_POINTS, raw.points.len())?;
    lengthy(MESSAGE, "pixels", 2 * PATCH_POINTS, raw.pixels.len())?;
    lengthy(MESSAGE, "corners", 2 * PATCH_POINTS, raw.corners.len())?;
    ranged(MESSAGE, "side", f64::from(raw.side), (1..=1024).contains(&raw.side), "1 to 1024")?;
    let side = raw.side;
    let points: [PatchPoint; PATCH_POINTS] = std::array::from_fn(|index| PatchPoint {
        name: raw.names[index].clone(),
        point: std::array::from_fn(|axis| raw.points[3 * index + axis]),
        pixel: std::array::from_fn(|axis| raw.pixels[2 * index + axis]),
        corner: std::array::from_fn(|axis| raw.corners[2 * index + axis]),
    });
    for PatchPoint { point, pixel, corner, .. } in &points {
        let seen = camera_from_object.point(&(*point).into());
        ranged(MESSAGE, "points", seen.z, seen.z >= camera.near, "in front of the camera")?;
        let (u, v) = camera.project(&seen);
        for ((pixel, stated), (corner, max)) in
            pixel.iter().zip([u, v]).zip(corner.iter().zip([camera.width, camera.height]))
        {
            ranged(MESSAGE, "pixels", *pixel, (pixel - stated).abs() < 1e-6, "the projections of points")?;
            let middle = f64::from(*corner) + f64::from(side) / 2.0;
            ranged(MESSAGE, "corners", f64::from(*corner), (middle - pixel).abs() <= 0.5 + 1e-6, "around its pixel")?;
            let inside = corner.checked_add(side).is_some_and(|end| end <= max);
            ranged(MESSAGE, "corners", f64::from(*corner), inside, "inside the image")?;
        }
    }
    Ok(points)
}

/// The patches of a [`HeatmapPatch`] in colour.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PatchColour {
    /// Which sample.
    pub sample: SampleId,
    /// Side of each patch [px].
    pub side: u32,
    /// Red, green, blue. Shape (points, side, side), row-major.
    pub rgb: Vec<[u8; 3]>,
}

impl PatchColour {
    /// The patch around a point.
    pub fn rgb_of(&self, point: usize) -> &[[u8; 3]] {
        let pixels = (self.side * self.side) as usize;
        &self.rgb[point * pixels..(point + 1) * pixels]
    }

    /// Appends the payload to `out`.
    pub fn encode(&self, out: &mut Vec<u8>) {
        wire::sample(out, 1, &self.sample);
        wire::uint32(out, 2, self.side);
        wire::bytes(out, 3, self.rgb.as_flattened());
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length does not hold.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::PatchColour::decode(payload).map_err(broken(COLOUR))?;
        let sample = sample_from_proto(COLOUR, raw.sample)?;
        ranged(COLOUR, "side", f64::from(raw.side), (1..=1024).contains(&raw.side), "1 to 1024")?;
        lengthy(COLOUR, "rgb", 3 * PATCH_POINTS * (raw.side * raw.side) as usize, raw.rgb.len())?;
        Ok(Self { sample, side: raw.side, rgb: raw.rgb.as_chunks::<3>().0.to_vec() })
    }
}
