//! A reachability job, checked.

use std::{collections::BTreeMap, path::PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    geom::{FieldMetric, PoseGrid},
    ids::ObjectId,
};

/// Which poses of which robot are labelled how.
#[derive(Clone, Debug, PartialEq)]
pub struct ReachabilityJob {
    /// The robot.
    pub robot: Robot,
    /// The poses, in the robot's frame.
    pub poses: PoseGrid,
    /// What finds joint values.
    pub solver: Solver,
    /// What counts as a collision.
    pub collisions: Collisions,
    /// What the signed distances count, and how they are found.
    pub metric: FieldMetric,
}

impl ReachabilityJob {
    /// Positions of the grid.
    pub fn positions(&self) -> u32 {
        self.poses.positions() as u32
    }

    /// Cells of one position.
    pub fn orientations(&self) -> u32 {
        self.poses.orientations() as u32
    }
}

/// A robot and its planning group.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// Its description, an MJCF file.
    pub scene: PathBuf,
    /// Its name in the description, for people.
    pub name: String,
    /// The description by content, with all that it includes, whatever its place.
    pub id: ObjectId,
    /// The joints that move, from the base outward.
    pub joints: Vec<String>,
    /// The site that is brought to the poses.
    pub target: String,
    /// The body or site that stands still whose frame the poses are in; MuJoCo's name of the world's body is [`WORLD`].
    pub frame: String,
    /// Values of joints that stand still [rad or m], by name.
    pub fixed: BTreeMap<String, f64>,
}

/// The frame of poses where a job names none.
pub const WORLD: &str = "world";

/// What finds joint values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Solver {
    /// The closed form where the arm has one, the numeric solver otherwise.
    Auto,
    /// The closed form: misses nothing. An arm that has none is refused.
    ClosedForm,
    /// The numeric solver: finds what its starts lead to.
    Numeric,
}

/// What counts as a collision, and who finds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Collisions {
    /// Our own test of the description's shapes; meshes as they are.
    Exact,
    /// MuJoCo's contacts: meshes as their convex hulls.
    Mujoco,
    /// Nothing collides: kinematics alone.
    None,
}
