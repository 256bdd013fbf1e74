//! Robots and hands of `scenes/`.

use std::f64::consts::PI;
use std::path::Path;

use graspmill::{
    contact::ContactSurface,
    geom::{EndEffector, Pose, World},
    kinematics::{Joint, PlanningGroup},
    seed::Stream,
    sim::{Effort, HandApproach, HandModel, RobotModel},
};
use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

pub const BARRETT: &str = "scenes/barrett_bh8_280.xml";
pub const GRIPPER: &str = "scenes/parallel_gripper.xml";
pub const FETCH: &str = "scenes/fetch.xml";
/// The Fetch out of its maker's meshes.
pub const FETCH_MESHES: &str = "scenes/fetch_meshes.xml";
/// The hand of a Franka Panda.
pub const PANDA_HAND: &str = "scenes/panda_hand.xml";
pub const TX60L: &str = "scenes/tx60l_table.xml";

/// The joints of the Fetch's arm, from the base outward.
pub const FETCH_ARM: [&str; 7] = [
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "upperarm_roll_joint",
    "elbow_flex_joint",
    "forearm_roll_joint",
    "wrist_flex_joint",
    "wrist_roll_joint",
];
/// The site at the end of the Fetch's arm.
pub const FETCH_SITE: &str = "wrist_roll_link";

pub const TX60L_JOINTS: [&str; 6] = ["joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6"];
pub const TX60L_SITE: &str = "hand";

/// Joint values anywhere within the limits; in a whole turn where a joint has none.
pub fn random_values(group: &PlanningGroup, stream: &mut Stream) -> Vec<f64> {
    let range = |joint: &Joint| joint.limits.map_or((-PI, PI), |limits| (limits.low, limits.high));
    group.joints().iter().map(range).map(|(low, high)| stream.uniform(low, high)).collect()
}

/// The largest difference of an entry of two poses [m or 1].
pub fn max_difference(a: &Pose<World, EndEffector>, b: &Pose<World, EndEffector>) -> f64 {
    a.to_rows().into_iter().zip(b.to_rows()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[track_caller]
pub fn open_robot(scene: impl AsRef<Path>) -> RobotModel {
    RobotModel::open(scene.as_ref()).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
pub fn open_hand(scene: impl AsRef<Path>) -> HandModel {
    HandModel::open(scene.as_ref()).unwrap_or_else(|error| panic!("{error}"))
}

/// An approach to a random point of the surface, from outside.
pub fn random_approach(surface: &ContactSurface, effort: Effort, draw: &mut Stream) -> HandApproach {
    let [share, u, v] = [(); 3].map(|()| draw.uniform(0.0, 1.0));
    let (target, normal) = surface.point_at(share, u, v).expect("a surface");
    let roll = Rotation3::from_axis_angle(&Vector3::z_axis(), draw.uniform(-3.1, 3.1));
    let aside = if normal.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    let rotation = Rotation3::face_towards(&-normal, &normal.cross(&aside)) * roll;
    let far = 0.5;
    let object_from_start = IsometryMatrix3::from_parts(Translation3::from(target.coords + normal * far), rotation);
    HandApproach { object_from_start, distance: far + 0.02, closed: 0.0, effort }
}
