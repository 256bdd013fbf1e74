//! Grasps of all bodies of a scene in one image.

use super::rows::{ForbiddenGrasp, SeenGrasp};
use crate::codec::{Depth, DepthCoding, RecordError, fields::ranged};
use crate::products::{
    patches::{TRIAL_LABEL, is_same_depth, trial_value},
    picks::PickState,
};
use kernel::{
    geom::{CameraCv, DepthCrop, Intrinsics, Pose, World},
    ids::{Digest, ObjectId, SampleId},
};

/// Meaning of the labels of grasps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeatmapLabel {
    /// Outcome of trials among the neighbours, as in labels of patches: -1 held, 1 failed, 0 not known.
    Trial,
    /// -1 for every grasp whose hand approaches and closes without touching anything else.
    Free,
}

impl HeatmapLabel {
    /// Every meaning.
    pub const ALL: [Self; 2] = [Self::Trial, Self::Free];

    /// The name on disk.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trial => TRIAL_LABEL,
            Self::Free => "free",
        }
    }

    /// The label of a free grasp.
    pub fn value(self, state: PickState) -> f32 {
        match self {
            Self::Trial => trial_value(state.label()),
            Self::Free => -1.0,
        }
    }
}

/// Grasps of all bodies of a settled scene that come from the camera's side of an image: where palm and fingertips of the closed
/// hand would be, and how good each grasp is.
///
/// For the hot path keep one and refill it.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneHeatmap {
    /// Which sample: that of the view.
    pub sample: SampleId,
    /// Digest of the exact numbers of the dataset of picks.
    pub picks: Digest,
    /// Digest of its numbers of physics; `None` without trials.
    pub trials: Option<Digest>,
    /// Name of the hand.
    pub hand: String,
    /// Digest of the hand's description and table.
    pub hand_id: ObjectId,
    /// Names of the points in the hand's description: the approach frame, whose origin is the palm, then contacts.
    pub names: Vec<String>,
    /// The chosen grasp types, the most common first; empty for a hand without types, whose grasps count as one type.
    pub types: Vec<u32>,
    /// Meaning of the labels.
    pub label: HeatmapLabel,
    /// Largest angle between approaches and the camera's axis [rad].
    pub angle: f64,
    /// The camera [px].
    pub camera: Intrinsics,
    /// Pose of the camera.
    pub world_from_camera: Pose<World, CameraCv>,
    /// Side of each patch [px].
    pub side: u32,
    /// Side of the squares that patches in metres show [m]; `None` without these.
    pub size: Option<f64>,
    /// Whether the dataset of picks has grasps of each body.
    pub evaluated: Vec<bool>,
    /// Free grasps of other types, or without a type.
    pub other_types: u32,
    /// Free grasps of the chosen types, by body and candidate.
    pub grasps: Vec<SeenGrasp>,
    /// Grasps that are not free, by body and candidate: background, wherever they are.
    pub forbidden: Vec<ForbiddenGrasp>,
}

impl SceneHeatmap {
    /// Number of types that maps distinguish, at least 1.
    pub fn count_types(&self) -> usize {
        self.types.len().max(1)
    }

    /// Dense maps, as of [`PatchHeatmap`](crate::PatchHeatmap): in the pixel that holds a point the lowest label of all points
    /// there, 0 elsewhere. Grasps that are not free add no points. Shape (points * types, height, width), row-major; the map of a
    /// type and a point is `points * type_index + point`.
    pub fn maps(&self) -> Vec<f32> {
        let (width, count) = (self.camera.width as usize, self.names.len());
        let pixels = width * self.camera.height as usize;
        let mut maps: Vec<f32> = vec![0.0; count * self.count_types() * pixels];
        for grasp in self.grasps.iter().filter(|grasp| grasp.value != 0.0) {
            for (index, point) in grasp.points.iter().enumerate() {
                let Some([column, row]) = point.pixel_in(&self.camera) else { continue };
                let map = count * grasp.type_index as usize + index;
                let cell = &mut maps[map * pixels + row as usize * width + column as usize];
                *cell = if *cell == 0.0 { grasp.value } else { cell.min(grasp.value) };
            }
        }
        maps
    }

    /// Checks that the surfaces in the points' pixels are those of the depth of the image, up to the step in which it is stored.
    ///
    /// # Errors
    /// When they are not, or the image is of another size.
    pub fn check_depth(&self, depth: &Depth) -> Result<(), RecordError> {
        const DEPTH: &str = "Depth";
        const MESSAGE: &str = "SceneHeatmap";
        let DepthCrop { left, top, width, height, .. } = depth.crop;
        ranged(DEPTH, "width", f64::from(width), left + width <= self.camera.width, "inside the image")?;
        ranged(DEPTH, "height", f64::from(height), top + height <= self.camera.height, "inside the image")?;
        // A depth that does not fit into the steps has no return.
        let is_stored = |surface: f32, stored: f32| match depth.coding {
            DepthCoding::F32 => is_same_depth(surface, stored),
            DepthCoding::U16 { .. } if stored.is_nan() => true,
            DepthCoding::U16 { step } => (f64::from(surface) - f64::from(stored)).abs() <= 0.501 * step,
        };
        for point in self.grasps.iter().flat_map(|grasp| &grasp.points) {
            let Some([column, row]) = point.pixel_in(&self.camera) else { continue };
            let fits = is_stored(point.surface, depth.crop.at(column, row));
            ranged(MESSAGE, "surfaces", f64::from(point.surface), fits, "the depth of the image in the point's pixel")?;
        }
        Ok(())
    }
}
