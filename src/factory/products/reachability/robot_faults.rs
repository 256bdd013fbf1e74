//! Faults of the robot of a job, key by key.

use std::collections::BTreeMap;

use super::settings::Robot;
use robot::kinematics::InvalidGroup;
use sim::{RobotError, RobotModel};

/// Reason why a robot does not support a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct RobotFault {
    /// Key at fault.
    pub key: RobotKey,
    /// Reason in words, with file and names.
    pub message: String,
    /// Names that are there instead.
    pub present: Vec<String>,
}

/// A key of `robot`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum RobotKey {
    /// `robot.model`.
    Scene,
    /// `robot.joints`, or one of them.
    Joints(Option<usize>),
    /// `robot.target`.
    Target,
    /// `robot.frame`.
    Frame,
    /// One of `robot.fixed`.
    Fixed(String),
}

/// Every fault of a robot's planning group; none when it is one.
pub(super) fn robot_faults(robot: &Robot) -> Vec<RobotFault> {
    let model = match RobotModel::open(&robot.file) {
        Ok(model) => model,
        // No fault of the job: the run ends with this error.
        Err(RobotError::Memory { .. }) => return Vec::new(),
        Err(error) => return vec![fault(robot, &error)],
    };
    let target = robot.target.as_str();
    // One name at a time finds all that are wrong; a group without a joint is refused as such when its names are fine.
    let none = BTreeMap::new();
    let alone = |joint: &String| model.planning_group(&[joint], target, &none).map(drop);
    let still = |name: &String| model.planning_group(&[], target, &BTreeMap::from([(name.clone(), 0.0)])).map(drop);
    let errors = robot.joints.iter().map(alone).chain(robot.fixed.keys().map(still)).filter_map(Result::err);
    let mut faults: Vec<RobotFault> = Vec::new();
    for error in errors.filter(|error| !matches!(error, RobotError::Group { source: InvalidGroup::NoJoint, .. })) {
        let fault = fault(robot, &error);
        if !faults.contains(&fault) {
            faults.push(fault);
        }
    }
    if !faults.is_empty() {
        return faults;
    }
    let joints: Vec<&str> = robot.joints.iter().map(String::as_str).collect();
    match model.planning_group(&joints, target, &robot.fixed) {
        Err(error) => vec![fault(robot, &error)],
        Ok(group) => {
            if let Err(error) = model.resting_frame(&robot.frame, &joints, &robot.fixed) {
                return vec![fault(robot, &error)];
            }
            let outward: Vec<String> = group.joints().iter().map(|joint| joint.name.clone()).collect();
            let message = format!("its joints from the base outward are {}", outward.join(", "));
            let fault = RobotFault { key: RobotKey::Joints(None), message, present: Vec::new() };
            if outward == robot.joints { Vec::new() } else { vec![fault] }
        }
    }
}

/// The key of an error.
fn fault(robot: &Robot, error: &RobotError) -> RobotFault {
    let joint = |name: &str| match robot.joints.iter().position(|joint| joint == name) {
        Some(index) => RobotKey::Joints(Some(index)),
        None if robot.fixed.contains_key(name) => RobotKey::Fixed(name.to_owned()),
        None => RobotKey::Joints(None),
    };
    let (key, present) = match error {
        // Faults of the description itself.
        RobotError::Refused { .. }
        | RobotError::Text { .. }
        | RobotError::Statements { .. }
        | RobotError::Memory { .. }
        | RobotError::Missing { .. }
        | RobotError::Mesh { .. }
        | RobotError::MeshInline { .. }
        | RobotError::Geom { .. }
        | RobotError::Surface { .. }
        | RobotError::Rest { .. }
        | RobotError::Unnamed { .. }
        | RobotError::Branches { .. } => (RobotKey::Scene, Vec::new()),
        RobotError::NoTarget { present, .. } => (RobotKey::Target, present.clone()),
        RobotError::NoFrame { present, .. } => (RobotKey::Frame, present.clone()),
        RobotError::FrameMoves { .. } => (RobotKey::Frame, Vec::new()),
        RobotError::NoJoint { name, present, .. } => (joint(name), present.clone()),
        RobotError::Contradicted { joint: name, .. } => (joint(name), Vec::new()),
        RobotError::NotMoved { joint: name, moving, .. } => (joint(name), moving.clone()),
        RobotError::Kind { joint: name, .. } => (joint(name), Vec::new()),
        RobotError::Group { source, .. } => match source {
            InvalidGroup::NoJoint => (RobotKey::Joints(None), Vec::new()),
            InvalidGroup::NoRange { name, .. } | InvalidGroup::Endless { name } | InvalidGroup::NotFinite { name } => {
                (joint(name), Vec::new())
            }
        },
    };
    RobotFault { key, message: error.to_string(), present }
}
