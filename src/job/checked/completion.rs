//! A completion job, checked.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use crate::voxel::Truth;
use crate::{
    assets::{AssetRecord, MeshRefusal, MeshSource},
    geom::{Intrinsics, ViewSet},
    ids::ObjectId,
    render::SensorModel,
};

/// What a completion job makes of which objects.
#[derive(Clone, Debug, PartialEq)]
pub struct CompletionJob {
    /// The objects, sorted by name; no two have the same content.
    pub objects: Vec<JobObject>,
    /// Meshes that cannot be used; the run goes on without them and ends with exit code 3.
    pub refused: Vec<MeshRefusal>,
    /// How samples are made.
    pub settings: Completion,
    /// Who trains and who tests.
    pub split: SplitSettings,
}

impl CompletionJob {
    /// The same job without touch by hands, which changes no other channel of its samples.
    pub fn without_hands(&self) -> Self {
        let mut job = self.clone();
        job.settings.touch.by_hand = None;
        job
    }
}

/// The camera of an MJCF scene that gave the numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneCamera {
    /// The scene file.
    pub scene: PathBuf,
    /// The camera's name in it.
    pub camera: String,
    /// Image width [px].
    pub width: u32,
    /// Image height [px].
    pub height: u32,
}

/// One object of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct JobObject {
    /// How to prepare the mesh again.
    pub source: MeshSource,
    /// The package that holds the file, where one does: a resolved job names it instead of a path.
    pub package: Option<PackageFile>,
    /// What it is.
    pub asset: AssetRecord,
    /// What it weighs, where the job knows and something depends on it.
    pub mass: Option<KnownMass>,
}

/// What an object weighs.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownMass {
    /// [kg].
    pub kilograms: f64,
    /// Where that is known from; may be empty.
    pub source: String,
}

/// A file of a package of meshes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PackageFile {
    /// The package's name.
    pub package: String,
    /// Path below the package's folder, with `/`.
    pub file: String,
}

impl JobObject {
    /// The object by content.
    pub fn id(&self) -> ObjectId {
        self.asset.object
    }
}

/// Settings of the shape-completion product.
#[derive(Clone, Debug, PartialEq)]
pub struct Completion {
    /// How the object is turned.
    pub views: ViewSet,
    /// About which point.
    pub pivot: Pivot,
    /// The camera.
    pub camera: Intrinsics,
    /// Where the camera's numbers come from, when from a scene.
    pub scene: Option<SceneCamera>,
    /// How far the pivot is from the camera.
    pub distance: Distance,
    /// Who makes the depth image.
    pub renderer: Renderer,
    /// What the sensor adds to it; `None` is a perfect sensor.
    pub sensor: Option<SensorModel>,
    /// Cells along each axis of the grids, 1 to 128.
    pub resolution: u32,
    /// `thesis` quirk: cells with index 0 on any axis are dropped from both grids.
    pub drop_index_zero: bool,
    /// `thesis` quirk: the 256^3 solid also holds every cell that the surface crosses, as binvox does.
    pub solid_with_surface: bool,
    /// When a cell of the complete grid is occupied.
    pub truth: Truth,
    /// Which pairs are kept.
    pub gate: Gate,
    /// What is stored beside partial and complete.
    pub channels: Channels,
    /// What is touched.
    pub touch: Touch,
}

/// The point that an object is turned about, and that stands at the stated distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pivot {
    /// Centre of the bounding box.
    BoxCentre,
    /// Origin of the mesh's own frame (`thesis`).
    MeshOrigin,
}

/// Distance from the camera to the pivot along the optical axis [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distance {
    /// The same for every sample.
    Fixed(f64),
    /// Uniform, drawn per sample.
    Range {
        /// Shortest [m].
        min: f64,
        /// Longest [m].
        max: f64,
    },
    /// So that the sphere around the object's box fills this share of the shorter image side.
    Fit {
        /// 0 to 1.
        share: f64,
    },
}

/// Who makes the depth image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Renderer {
    /// Our z-buffer in the projected box.
    Raster,
    /// MuJoCo's `mj_multiRay`.
    MujocoRay,
    /// MuJoCo's `mjr_render` over EGL.
    MujocoGl,
}

/// Which pairs are kept; the others are rejects with a reason.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gate {
    /// Fewest occupied cells of the partial grid.
    pub min_partial_cells: u32,
    /// Least |partial AND complete| / |partial|; 0 asks for nothing.
    pub min_overlap: f64,
}

/// What is stored beside partial and complete.
#[derive(Clone, Debug, PartialEq)]
pub struct Channels {
    /// One more bit plane: cells that the camera sees to be free.
    pub visibility: bool,
    /// The depth crop.
    pub depth: Option<DepthFormat>,
    /// The partial point cloud.
    pub cloud: bool,
    /// Truncated signed distance at the same grid, with this truncation in cells.
    pub tsdf: Option<f64>,
    /// Share of each cell that is solid, 8 bits.
    pub coverage: bool,
    /// Samples for implicit networks.
    pub implicit: Option<ImplicitSamples>,
}

/// How a depth crop is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthFormat {
    /// Metres as f32, NaN = no return.
    F32,
    /// Steps of this many metres as u16, 0 = no return.
    U16 {
        /// Metres a step.
        step: f64,
    },
}

/// How many points an implicit network gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImplicitSamples {
    /// Points on the surface, with normals.
    pub surface: u32,
    /// Points in the grid's box, with signed distance.
    pub space: u32,
}

/// Kinds of touch that go with each pair.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Touch {
    /// Rays at random places.
    pub random_rays: Option<RandomRays>,
    /// By a hand.
    pub by_hand: Option<TouchByHand>,
}

impl Touch {
    /// Whether there is any.
    pub fn is_asked(&self) -> bool {
        self.random_rays.is_some() || self.by_hand.is_some()
    }
}

/// Touch by a hand; of its two kinds one at least.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchByHand {
    /// The hand.
    pub hand: JobHand,
    /// Feeling over what the camera did not see: so many approaches a view, at least 1; `None` without.
    pub exploration: Option<u32>,
    /// Taking hold once.
    pub grasp: bool,
}

impl TouchByHand {
    /// Approaches a view, of both kinds.
    pub fn approaches(&self) -> u32 {
        self.exploration.unwrap_or(0) + u32::from(self.grasp)
    }
}

/// A hand that a job names.
#[derive(Clone, Debug, PartialEq)]
pub struct JobHand {
    /// Its description, an MJCF file; its table stands beside it.
    pub scene: PathBuf,
    /// Its name in the description, for people.
    pub name: String,
    /// Description and table by content, with all that the description includes, whatever their place.
    pub id: ObjectId,
}

/// Rays from the object's far side towards the camera, along its optical axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RandomRays {
    /// Rays a view, at least 1.
    pub count: u32,
    /// What they meet.
    pub target: RayTarget,
}

/// What a ray meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayTarget {
    /// The mesh.
    Mesh,
    /// `thesis` quirk: cells of the complete grid, at their lower corners.
    Cells,
}

/// Who trains and who tests.
#[derive(Clone, Debug, PartialEq)]
pub struct SplitSettings {
    /// Share of the views of training objects that are held out.
    pub holdout_views: f64,
    /// The validation models, chosen among those that are no test models.
    pub validation_models: ModelChoice,
    /// The test models.
    pub test_models: ModelChoice,
    /// Split whole groups instead of objects.
    pub by_group: bool,
    /// Objects whose shapes coincide stay on one side; `false` allows twins to straddle.
    pub keep_twins_together: bool,
    /// Views of one object with equal rotations stay on one side; `false` (`thesis`) only counts those that straddle.
    pub keep_equal_views_together: bool,
    /// Nested subsets of the training models, smallest first.
    pub training_subsets: Vec<SubsetSize>,
}

/// Which models go to one side of the split.
#[derive(Clone, Debug, PartialEq)]
pub enum ModelChoice {
    /// About this share of them; each model decides for itself, so that adding one moves no other.
    Share(f64),
    /// Exactly so many where groups and twins allow it; adding a model can move one other.
    Count(u32),
    /// These objects, by name.
    Named(Vec<String>),
}

/// How many models a nested training subset holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SubsetSize {
    /// So many models.
    Models(u32),
    /// This share of them.
    Share(f64),
}
