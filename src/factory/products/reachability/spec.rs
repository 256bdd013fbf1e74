//! The keys of a reachability job.

use std::{collections::BTreeMap, path::PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::settings::{CollisionTest, IkSolver};
use crate::sections::Profile;

/// Defaults of the profile `standard`, and the ones that `thesis` changes.
pub const PROFILES: [&str; 2] = [include_str!("profiles/standard.toml"), include_str!("profiles/thesis.toml")];

/// A job that labels every pose of a grid: whether the robot's end effector reaches it without a collision.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReachabilitySpec {
    /// The robot, with the joints that move and the frame to bring to the poses.
    // Without an `Option` a mistake in it would hide those of the other keys.
    #[schemars(required)]
    pub robot: Option<RobotSpec>,
    /// The poses: every combination of six axes, or of three axes of position, directions and roll. R = Rz(yaw) Ry(pitch)
    /// Rx(roll).
    #[schemars(required)]
    pub poses: Option<PosesSpec>,
    /// Solver that finds joint values.
    #[schemars(extend("examples" = ["closed_form"]))]
    pub solver: IkSolver,
    /// Collision test.
    #[schemars(extend("examples" = ["mujoco"]))]
    pub collisions: CollisionTest,
    /// The signed distance to the border of the reachable set.
    pub field: FieldSpec,
    /// The files of the dataset.
    pub shards: PositionShardsSpec,
}

impl ReachabilitySpec {
    /// The standard defaults, without robot and poses.
    pub fn standard() -> Self {
        form::decode_own(PROFILES[0])
    }
}

/// A robot and its planning group.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RobotSpec {
    /// The robot's description, an MJCF or URDF file; relative to the job file. Its surroundings are part of it.
    #[schemars(extend("examples" = ["../scenes/fetch.xml"]))]
    pub model: PathBuf,
    /// The planning group: the joints that move, by name, from the base outward.
    #[schemars(length(min = 1), extend("examples" = [["shoulder", "elbow", "wrist"]]))]
    pub joints: Vec<String>,
    /// The site, or else the body (a link of a URDF), whose frame reaches the poses.
    #[schemars(length(min = 1), extend("examples" = ["wrist_roll_link"]))]
    pub target: String,
    /// The body or site in whose frame the poses are expressed; it must be fixed. Default: the world.
    #[schemars(length(min = 1), extend("examples" = ["base_link"]))]
    pub frame: Option<String>,
    /// Values of fixed joints, by name: radians, or metres if they slide. A joint that follows one of them by
    /// `<equality><joint>` follows its value; all other joints have the values of the description.
    #[schemars(extend("examples" = [{ "torso_lift_joint": 0.1 }]))]
    pub fixed: Option<BTreeMap<String, f64>>,
    /// Content that the description must have (64 hexadecimal digits); a resolved job pins it.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub content: Option<String>,
}

/// The grid of poses, in the frame of `robot.frame`: positions along x, y and z, and at each the same orientations: either
/// `roll`, `pitch` and `yaw` or `directions` and `roll`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PosesSpec {
    /// Positions along the frame's x axis.
    #[schemars(extend("examples" = [{ "from": 0.0, "to": 1.2, "step": 0.1 }]))]
    pub x: SpanSpec,
    /// Positions along the frame's y axis.
    #[schemars(extend("examples" = [{ "from": -1.1, "to": 1.1, "step": 0.1 }]))]
    pub y: SpanSpec,
    /// Positions along the frame's z axis.
    #[schemars(extend("examples" = [{ "from": 0.0, "to": 2.0, "step": 0.1 }]))]
    pub z: SpanSpec,
    /// Cells in a full rotation about the target's x axis, the first at -pi.
    #[schemars(range(min = 1, max = 4096), extend("x-unit" = "cells", "examples" = [2]))]
    pub roll: u32,
    /// Cells in a full rotation about the y axis, the first at -pi. With `yaw`, unless `directions` are given.
    #[schemars(range(min = 1, max = 4096), extend("x-unit" = "cells", "examples" = [8]))]
    pub pitch: Option<u32>,
    /// Cells in a full rotation about the z axis, the first at -pi. With `pitch`, unless `directions` are given.
    #[schemars(range(min = 1, max = 4096), extend("x-unit" = "cells", "examples" = [8]))]
    pub yaw: Option<u32>,
    /// In place of `pitch` and `yaw`: the directions of the target's x axis, spread evenly over the sphere.
    #[schemars(extend("examples" = [{ "healpix": 2 }]))]
    pub directions: Option<DirectionsSpec>,
}

/// Directions spread evenly over the sphere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DirectionsSpec {
    /// Resolution n of HEALPix: its 12 n^2 pixel centres in ring order, 48 at 2. The largest angle from any direction to the
    /// nearest of them is 48.2, 23.6, 15.6, 11.7 degrees at 1, 2, 3, 4.
    #[schemars(range(min = 1, max = 16), extend("examples" = [2]))]
    pub healpix: u32,
}

/// Positions in equal steps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpanSpec {
    /// The first position.
    #[schemars(extend("x-unit" = "m", "examples" = [0.0]))]
    pub from: f64,
    /// End of the positions, exclusive.
    #[schemars(extend("x-unit" = "m", "examples" = [1.2]))]
    pub to: f64,
    /// Distance from one position to the next, above zero.
    #[schemars(extend("x-unit" = "m", "examples" = [0.1]))]
    pub step: f64,
}

/// The signed distance field: negative inside the reachable set.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FieldSpec {
    /// `standard`: exact distance to the nearest cell of the other label, in metres. `thesis`: fast marching, in cells, all
    /// axes equal.
    #[schemars(extend("examples" = ["thesis"]))]
    pub profile: Profile,
    /// With `profile = "standard"`: metres equivalent to one radian. Default: 0.127 (45 degrees are equivalent to 0.1
    /// m).
    #[schemars(extend("x-unit" = "m/rad", "exclusiveMinimum" = 0, "examples" = [0.2]))]
    pub radian_weight: Option<f64>,
}

/// The files of the dataset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PositionShardsSpec {
    /// Positions per shard, each with all its orientations. Default: the number that gives about 65,536 poses. Changes
    /// no label.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "positions", "examples" = [512]))]
    pub positions: Option<u32>,
}
