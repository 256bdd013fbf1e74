//! The keys of a job for scenes.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::import::spec::ImportSpec;
use crate::sections::spec::{ObjectsSpec, SplitSpec, UnitSpec};

/// Defaults of the profile `standard`, and the ones that `thesis` changes.
pub const PROFILES: [&str; 2] = [include_str!("profiles/standard.toml"), include_str!("profiles/thesis.toml")];

/// A job that settles bodies in a container: true meshes at rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ScenesSpec {
    /// Sources of the objects: one or several `[[objects]]` entries, each with exactly one of `folder`, `list`,
    /// `package` and `built_in`.
    #[schemars(length(min = 1))]
    pub objects: Vec<ObjectsSpec>,
    /// Arrangement of the bodies of a scene.
    #[schemars(extend("examples" = ["bin"]))]
    pub mode: ModeSpec,
    /// Bodies per scene: a number (10), or a range from which each scene draws one.
    #[schemars(extend("examples" = [{ "min": 1, "max": 15 }]))]
    pub count: CountSpec,
    /// Whether a scene can contain an object twice.
    pub repeats: bool,
    /// Scenes per split. Those of `training` and `holdout` have training objects.
    pub scenes: ScenesPerSplitSpec,
    /// The rectangle of a plane, for every mode except `bin`.
    pub table: TableSpec,
    /// Region of the table for the middles of bodies, with `mode = "table"`; by default the whole table.
    #[schemars(extend("examples" = [{ "around": [-0.5, 0.0], "radius": [0.3, 0.5] }]))]
    pub region: Option<RegionSpec>,
    /// The open box of `mode = "bin"`.
    pub container: ContainerSpec,
    /// The walls of `mode = "pile"`.
    pub pile: PileSpec,
    /// The simulation in which bodies settle.
    pub physics: ScenePhysicsSpec,
    /// Imported arrangements in place of drawn ones.
    pub import: Option<ImportSpec>,
    /// Objects for training, validation and test.
    pub split: SplitSpec,
    /// The files of the dataset.
    pub shards: SceneShardsSpec,
}

impl ScenesSpec {
    /// The standard defaults, without objects.
    pub fn standard() -> Self {
        form::decode_own(&format!("objects = []\n{}", PROFILES[0]))
    }
}

/// Arrangement of the bodies of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ModeSpec {
    /// All at once on a plane, each in a resting pose drawn by its probability, rotated about the vertical at random.
    Table,
    /// Dropped on a plane one after another, in any rotation.
    Heap,
    /// Dropped into an open box one after another, in any rotation.
    Bin,
    /// All at once on a plane, upright and close together: each in the resting pose whose up direction is nearest to z
    /// of its mesh, rotated about the vertical at random, at the free position that is closest to the middle.
    Packed,
    /// Dropped between four walls on a plane one after another, in any rotation; once they rest the walls are lifted away, and the
    /// bodies settle again.
    Pile,
}

/// Bodies per scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum CountSpec {
    /// One number for all scenes.
    Exactly(#[schemars(range(min = 1, max = 20))] u32),
    /// Drawn for each scene. A scene that loses bodies over the wall is kept if `min` are left.
    Between(CountRangeSpec),
}

/// Range of the count of bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CountRangeSpec {
    /// Smallest number.
    #[schemars(range(min = 1, max = 20), extend("x-unit" = "bodies", "examples" = [1]))]
    pub min: u32,
    /// Largest number.
    #[schemars(range(min = 1, max = 20), extend("x-unit" = "bodies", "examples" = [15]))]
    pub max: u32,
}

/// Scenes per split.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScenesPerSplitSpec {
    /// Scenes of training objects.
    #[schemars(range(max = 1_000_000), extend("x-unit" = "scenes", "examples" = [8000]))]
    pub training: u32,
    /// Other arrangements of training objects.
    #[schemars(range(max = 1_000_000), extend("x-unit" = "scenes", "examples" = [500]))]
    pub holdout: u32,
    /// Scenes of validation objects.
    #[schemars(range(max = 1_000_000), extend("x-unit" = "scenes", "examples" = [500]))]
    pub validation: u32,
    /// Scenes of test objects.
    #[schemars(range(max = 1_000_000), extend("x-unit" = "scenes", "examples" = [1000]))]
    pub test: u32,
}

/// The rectangle of a plane that bodies are put on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TableSpec {
    /// Sides along x and y. A body whose centre of mass ends outside is lost.
    #[schemars(inner(range(min = 0.05, max = 10)), extend("x-unit" = "m"))]
    pub size: [f64; 2],
}

/// A region of a table, in the frame of its middle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum RegionSpec {
    /// A rectangle along the sides of the table.
    Rectangle(RectangleSpec),
    /// A ring, such as the region that an arm reaches from its shoulder.
    Ring(RingSpec),
}

/// A rectangle along the sides of the table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangleSpec {
    /// Range along x.
    #[schemars(inner(range(min = -10, max = 10)), extend("x-unit" = "m"))]
    pub x: [f64; 2],
    /// Range along y.
    #[schemars(inner(range(min = -10, max = 10)), extend("x-unit" = "m"))]
    pub y: [f64; 2],
}

/// A ring around a point of the table's plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RingSpec {
    /// Middle of the ring, x and y; on the table or outside it.
    #[schemars(inner(range(min = -10, max = 10)), extend("x-unit" = "m"))]
    pub around: [f64; 2],
    /// Range of distances from the middle.
    #[schemars(inner(range(min = 0, max = 20)), extend("x-unit" = "m"))]
    pub radius: [f64; 2],
}

/// Container that bodies are dropped into: an open box, or a mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContainerSpec {
    /// A mesh file, or an MJCF file of boxes and meshes, in place of a box; relative to the job file. Its z axis must
    /// point out of the opening, its surface must be closed, and walls must surround a floor. The floor below the
    /// middle of its bounds is the world's origin.
    #[schemars(extend("examples" = ["../scenes/tote.stl"]))]
    pub mesh: Option<PathBuf>,
    /// Unit of the mesh file. Default: metres, the unit of MJCF files.
    pub unit: Option<UnitSpec>,
    /// Content that the mesh must have (64 hexadecimal digits); a resolved job pins it.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub content: Option<String>,
    /// Inner size along x, y and z. A body whose centre of mass ends outside the walls is lost.
    #[schemars(inner(range(min = 0.05, max = 10)), extend("x-unit" = "m"))]
    pub inner_size: [f64; 3],
    /// Thickness of walls and floor.
    #[schemars(range(min = 0.002, max = 0.5), extend("x-unit" = "m"))]
    pub wall: f64,
    /// Angle by which the side at positive y is raised, about the middle of the floor: the bin presents its bodies to a
    /// robot at negative y.
    #[schemars(range(min = 0, max = 45), extend("x-unit" = "degree"))]
    pub tilt_deg: f64,
}

/// Four walls around the middle of the table. They are lifted away and are not part of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PileSpec {
    /// Sides of the square between the walls.
    #[schemars(range(min = 0.05, max = 10), extend("x-unit" = "m"))]
    pub side: f64,
    /// Height of the walls.
    #[schemars(range(min = 0.02, max = 10), extend("x-unit" = "m"))]
    pub height: f64,
    /// Speed at which the walls are lifted away.
    #[schemars(range(min = 0.01, max = 2), extend("x-unit" = "m/s"))]
    pub lift_speed: f64,
}

/// The simulation in which bodies settle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScenePhysicsSpec {
    /// Coefficient of sliding friction: a number, or a range from which each body draws one. A contact has the larger
    /// coefficient of its two bodies; the container has none.
    #[schemars(extend("examples" = [[0.3, 0.9]]))]
    pub friction: FrictionSpec,
    /// Rolling friction, without which balls and cans never rest.
    #[schemars(range(min = 0.0, max = 0.1), extend("x-unit" = "m"))]
    pub rolling: f64,
    /// Length of a step.
    #[schemars(range(min = 0.0001, max = 0.004), extend("x-unit" = "s"))]
    pub timestep: f64,
    /// Time from one release to the next.
    #[schemars(range(min = 0.01, max = 10), extend("x-unit" = "s"))]
    pub release_interval: f64,
    /// Height of a body's lowest point above the bodies or the floor below it when it is released.
    #[schemars(range(min = 0.001, max = 2), extend("x-unit" = "m"))]
    pub release_height: f64,
    /// Speed below which all bodies count as resting; angular speeds are taken at half the diagonal of the body.
    #[schemars(range(min = 0.0001, max = 0.1), extend("x-unit" = "m/s"))]
    pub rest_speed: f64,
    /// Time for which bodies must rest.
    #[schemars(range(min = 0.05, max = 10), extend("x-unit" = "s"))]
    pub rest_time: f64,
    /// Time after the last release at which a scene that still moves is rejected.
    #[schemars(range(min = 0.5, max = 60), extend("x-unit" = "s"))]
    pub settle_timeout: f64,
    /// Time for which a scene is stepped again from its stored poses, at rest: a scene with a body that moves by 2 mm
    /// or 2 degrees is rejected.
    #[schemars(range(min = 0.1, max = 60), extend("x-unit" = "s"))]
    pub stability_time: f64,
    /// Factor of shorter steps in which bodies settle once more if they end up inside each other, such as thin walls
    /// that pass through each other between two steps; with 1 their scene is rejected at once.
    #[schemars(range(min = 1, max = 16))]
    pub substeps: u32,
    /// Number of times that dropped bodies that leave the container are dropped again if fewer than `count` would stay:
    /// the first time half as far from the middle as before, then half of that. With 0 their scene is rejected at once.
    #[schemars(range(min = 0, max = 10))]
    pub max_redrops: u32,
}

/// Coefficients of friction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum FrictionSpec {
    /// One coefficient for all bodies.
    Exactly(#[schemars(range(min = 0.05, max = 5))] f64),
    /// Range from which each body draws its coefficient.
    Between(#[schemars(inner(range(min = 0.05, max = 5)))] [f64; 2]),
}

/// The files of the dataset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneShardsSpec {
    /// Scenes per shard. Default: a thirty-second of all scenes, at least 4 and at most 64, since threads and tasks
    /// make whole shards. Changes no scene.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "scenes", "examples" = [64]))]
    pub scenes: Option<u32>,
}
