//! A reachability job, checked.

use std::{collections::BTreeMap, path::PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use kernel::{
    geom::{FieldMetric, PoseGrid},
    ids::ObjectId,
};

/// Robot, poses and settings of a reachability job.
#[derive(Clone, Debug, PartialEq)]
pub struct ReachabilityJob {
    /// The robot.
    pub robot: Robot,
    /// The poses, in the robot's frame.
    pub poses: PoseGrid,
    /// Solver of the inverse kinematics.
    pub solver: IkSolver,
    /// Test for collisions.
    pub collisions: CollisionTest,
    /// Metric of the signed distances.
    pub metric: FieldMetric,
}

impl ReachabilityJob {
    /// Positions of the grid.
    pub fn positions(&self) -> u32 {
        self.poses.positions() as u32
    }

    /// Orientations per position.
    pub fn orientations(&self) -> u32 {
        self.poses.orientations() as u32
    }
}

/// A robot and its planning group.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// Description of the robot, an MJCF file.
    pub file: PathBuf,
    /// Name in the description, for people.
    pub name: String,
    /// Content of the description, with all files that it includes, in any folder.
    pub id: ObjectId,
    /// The joints that move, from the base outward.
    pub joints: Vec<String>,
    /// The site that is brought to the poses.
    pub target: String,
    /// The fixed body or site in whose frame the poses are expressed; see [`WORLD`].
    pub frame: String,
    /// Values of fixed joints [rad or m], by name.
    pub fixed: BTreeMap<String, f64>,
}

/// The frame of poses when a job names none: MuJoCo's name of the body of the world.
pub const WORLD: &str = "world";

/// Solver of the inverse kinematics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum IkSolver {
    /// The closed form where the arm has one, the numeric solver otherwise.
    Auto,
    /// The closed form: misses nothing. An arm that has none is refused.
    ClosedForm,
    /// The numeric solver: finds the solutions that its starts lead to.
    Numeric,
}

/// Test for collisions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CollisionTest {
    /// Our own test of the description's shapes; meshes as they are.
    Exact,
    /// MuJoCo's contacts: meshes as their convex hulls.
    Mujoco,
    /// Nothing collides: kinematics alone.
    None,
}
