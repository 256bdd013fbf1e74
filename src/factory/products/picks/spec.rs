//! The keys of a job for picks.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{products::settled::ScenesSourceSpec, sections::spec::HandSpec};
use format::{AwakeBodies, TakenGrasps};

/// Defaults of the profile `standard`, and the ones that `thesis` changes.
pub const PROFILES: [&str; 2] = [include_str!("profiles/standard.toml"), include_str!("profiles/thesis.toml")];

/// A job that evaluates grasps in settled scenes, sampled there or stored ones of the lone objects: which are reachable without
/// touching anything else, and whether some of them succeed among the neighbours.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PicksSpec {
    /// The scenes, a finished dataset.
    pub scenes: ScenesSourceSpec,
    /// Stored grasps, a finished dataset; without one, grasps are sampled in the scene.
    pub grasps: PickGraspsSpec,
    /// The hand; that of the stored grasps, where they are used.
    // Without an `Option` a mistake in it would hide those of the other keys.
    #[schemars(required)]
    pub hand: Option<HandSpec>,
    /// Grasps to evaluate, and grasps to try.
    pub picks: PickSpec,
    /// The files of the dataset.
    pub shards: PickShardsSpec,
}

impl PicksSpec {
    /// The standard defaults, without datasets and a hand.
    pub fn standard() -> Self {
        form::decode_own(PROFILES[0])
    }
}

/// Source of the grasps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PickGraspsSpec {
    /// The folder of a finished dataset of grasps of the scenes' objects; relative to the job file.
    #[schemars(extend("examples" = ["../datasets/clutter-grasps-quick"]))]
    pub dataset: Option<PathBuf>,
    /// The digest of its exact numbers (64 hexadecimal digits); a resolved job pins it.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub root: Option<String>,
    /// With `picks.grasps = "held"` or `"tried"`: the digest of its physics numbers (64 hexadecimal digits); a resolved job pins it.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub trials_root: Option<String>,
}

/// Grasps to evaluate, and grasps to try.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PickSpec {
    /// Source of the grasps. Default: `transferred` if `grasps.dataset` names a dataset, otherwise `scene`.
    #[schemars(extend("examples" = ["scene"]))]
    pub sampler: Option<SamplerSpec>,
    /// Stored grasps to use. Default: `held` if the dataset of grasps has trials, otherwise `kept`.
    #[schemars(extend("examples" = ["held"]))]
    pub grasps: Option<TakeSpec>,
    /// Directions in which each stored grasp is evaluated: the hand is rotated about its closing line through the mean
    /// of the grasp's contacts, evenly over the full circle, and closes again. Default: 16 for a hand whose two pads
    /// slide towards each other, and 1, only the stored grasp, for every other hand.
    #[schemars(range(min = 1, max = 360), extend("x-unit" = "directions", "examples" = [16]))]
    pub rolls: Option<u32>,
    /// Largest number of grasps to store per body. Stored grasps are drawn without replacement from all grasps of the object and
    /// their directions. With `sampler = "scene"`, sampling ends at this number of free grasps that are unlike each other; if it
    /// ends with fewer, the first blocked grasps are stored as well.
    #[schemars(range(min = 1, max = 100_000), extend("x-unit" = "grasps"))]
    pub candidates: u32,
    /// Smallest distance of the hand from everything except the body that it grasps.
    #[schemars(range(min = 0, max = 0.009), extend("x-unit" = "m"))]
    pub margin: f64,
    /// Largest number of free grasps to try per body in MuJoCo; 0 disables trials.
    #[schemars(range(max = 10_000), extend("x-unit" = "grasps"))]
    pub trials: u32,
    /// Bodies that can move in a trial.
    pub movable: MovableSpec,
    /// With `sampler = "scene"`: largest number of poses to draw per body.
    #[schemars(range(min = 1, max = 10_000_000), extend("x-unit" = "poses"))]
    pub poses: u32,
    /// With `sampler = "scene"`: largest angle between the approach and straight down.
    #[schemars(range(min = 1, max = 90), extend("x-unit" = "degree"))]
    pub half_angle_deg: f64,
    /// With `sampler = "scene"`: coefficient of friction of the cone in which the second of two opposite points lies. Trials have the
    /// friction of the scene's bodies.
    #[schemars(range(min = 0.01, max = 2))]
    pub cone_friction: f64,
}

/// Source of the grasps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SamplerSpec {
    /// Sampled on each body in its scene, with container and neighbours as obstacles; for hands whose two pads slide towards each
    /// other.
    Scene,
    /// Stored grasps of the lone objects, transferred to the scene.
    Transferred,
}

/// Choice of stored grasps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TakeSpec {
    /// All grasps that were tried.
    Tried,
    /// Grasps that held in every trial.
    Held,
    /// The kept grasps.
    Kept,
    /// All grasps whose closed hand touches with at least two links, regardless of their quality.
    Closed,
}

impl From<TakeSpec> for TakenGrasps {
    fn from(take: TakeSpec) -> Self {
        match take {
            TakeSpec::Tried => Self::Tried,
            TakeSpec::Held => Self::Held,
            TakeSpec::Kept => Self::Kept,
            TakeSpec::Closed => Self::Closed,
        }
    }
}

impl TakeSpec {
    /// The key of a choice of stored grasps; `None` where grasps are sampled.
    pub(super) fn of(take: TakenGrasps) -> Option<Self> {
        match take {
            TakenGrasps::Tried => Some(Self::Tried),
            TakenGrasps::Held => Some(Self::Held),
            TakenGrasps::Kept => Some(Self::Kept),
            TakenGrasps::Closed => Some(Self::Closed),
            TakenGrasps::Sampled => None,
        }
    }
}

/// Choice of bodies that can move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MovableSpec {
    /// Bodies that touch the grasped one or touch such a body, and bodies within 5 cm of the hand's path; the others
    /// are fixed.
    Near,
    /// All bodies.
    All,
}

impl From<MovableSpec> for AwakeBodies {
    fn from(movable: MovableSpec) -> Self {
        match movable {
            MovableSpec::Near => Self::Near,
            MovableSpec::All => Self::All,
        }
    }
}

impl From<AwakeBodies> for MovableSpec {
    fn from(movable: AwakeBodies) -> Self {
        match movable {
            AwakeBodies::Near => Self::Near,
            AwakeBodies::All => Self::All,
        }
    }
}

/// The files of the dataset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PickShardsSpec {
    /// Bodies per shard. Default: a thirty-second of all bodies, at least 8 and at most 64, since threads and tasks
    /// make whole shards. Changes no sample.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "bodies", "examples" = [64]))]
    pub samples: Option<u32>,
}
