//! Which points of a hand the surface in a depth image hides.

use prost::Message;

use super::{
    HeatmapPatch, PATCH_POINTS, PatchHeatmap,
    arrays::{depths, flags, is_same_depth},
};
use crate::codec::{
    RecordError,
    fields::{broken, lengthy, ranged},
    proto, sample_from_proto, wire,
};
use kernel::ids::SampleId;

const MESSAGE: &str = "PatchVisibility";

/// A point is visible unless it is further than this behind the depth in its pixel [m]: half a pixel of a steep surface at 2 m,
/// and more than a fingertip's skin.
pub const VISIBLE_TOLERANCE: f64 = 5e-3;

/// Whether a point of this depth along the optical axis [m] is seen where the image has the depth `surface` [m], NaN = no return.
pub fn is_visible(depth: f64, surface: f32) -> bool {
    surface.is_nan() || depth <= f64::from(surface) + VISIBLE_TOLERANCE
}

/// Which of the points of a grasp the depth image shows.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchVisibility {
    /// Which sample: that of the [`HeatmapPatch`].
    pub sample: SampleId,
    /// Depth of the image in the pixel of each point [m], NaN = no return.
    pub surfaces: [f32; PATCH_POINTS],
    /// Whether each point is visible ([`is_visible`]): nothing in the image is in front of it.
    pub visible: [bool; PATCH_POINTS],
    /// Whether each of [`PatchHeatmap::points`] is visible; none without a heatmap.
    pub heatmap_visible: Vec<bool>,
}

impl PatchVisibility {
    /// Points of the grasp that are visible.
    pub fn count(&self) -> u32 {
        self.visible.iter().map(|visible| u32::from(*visible)).sum()
    }

    /// Checks that these are the depths in the patches of the points, that what is visible follows from them, and that the marks
    /// of the heatmap, where there is one, have the number of its points, and that those of the own grasp are the same.
    ///
    /// # Errors
    /// When they are not.
    pub fn check_beside(&self, patch: &HeatmapPatch, heatmap: Option<&PatchHeatmap>) -> Result<(), RecordError> {
        for (index, point) in patch.points.iter().enumerate() {
            let surface = self.surfaces[index];
            // Rounding can move a pixel on the border of a patch out of it.
            let [column, row] = [0, 1]
                .map(|axis| (point.pixel[axis].floor() as u32).saturating_sub(point.corner[axis]).min(patch.side - 1));
            let seen = patch.depth_of(index)[(row * patch.side + column) as usize];
            let same = is_same_depth(seen, surface);
            ranged(MESSAGE, "surfaces", f64::from(surface), same, "the depth of the patch in the pixel of its point")?;
            let depth = patch.camera_from_object.point(&point.point.into()).z;
            let says = self.visible[index] == is_visible(depth, surface);
            ranged(
                MESSAGE,
                "visible",
                f64::from(u8::from(self.visible[index])),
                says,
                "the visibility that follows from the depths",
            )?;
        }
        let points = heatmap.map_or(&[][..], |heatmap| &heatmap.points);
        lengthy(MESSAGE, "heatmap_visible", points.len(), self.heatmap_visible.len())?;
        for (point, visible) in points.iter().zip(&self.heatmap_visible) {
            let is_own = (point.run, point.rank) == (patch.run, patch.rank);
            let says = !is_own || self.visible[point.point as usize] == *visible;
            ranged(MESSAGE, "heatmap_visible", f64::from(u8::from(*visible)), says, "that of the patch's own grasp")?;
        }
        Ok(())
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        wire::sample(out, 1, &self.sample);
        wire::floats_one_nan(out, 2, &self.surfaces);
        wire::bytes(out, 3, &self.visible.map(u8::from));
        wire::bytes_of(out, 4, self.heatmap_visible.iter().map(|visible| u8::from(*visible)));
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length does not hold or a number is out of range.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::PatchVisibility::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample)?;
        lengthy(MESSAGE, "surfaces", 4 * PATCH_POINTS, raw.surfaces.len())?;
        lengthy(MESSAGE, "visible", PATCH_POINTS, raw.visible.len())?;
        let surfaces = depths(MESSAGE, "surfaces", &raw.surfaces)?;
        let visible = flags(MESSAGE, "visible", &raw.visible)?;
        Ok(Self {
            sample,
            surfaces: std::array::from_fn(|point| surfaces[point]),
            visible: std::array::from_fn(|point| visible[point]),
            heatmap_visible: flags(MESSAGE, "heatmap_visible", &raw.heatmap_visible)?,
        })
    }
}
