//! A resolved reachability job as keys of a job file.

use std::path::Path;

use super::{
    settings::{ReachabilityJob, Robot, WORLD},
    spec::{DirectionsSpec, FieldSpec, PosesSpec, ReachabilitySpec, RobotSpec, SpanSpec},
};
use crate::sections::{Profile, keys_of, relative_to, with_slashes, without};
use kernel::geom::{Axis, FieldMetric, PoseGrid};

impl ReachabilityJob {
    /// Keys of the job file other than shards. With a folder the robot's file is named relative to it; otherwise the
    /// keys contain neither its file nor its content.
    pub(super) fn keys(&self, folder: Option<&Path>) -> toml::Table {
        let Self { robot, poses, solver, collisions, metric } = self;
        let mut spec = ReachabilitySpec::standard();
        (spec.solver, spec.collisions) = (*solver, *collisions);
        spec.robot = Some(robot_spec(robot, folder));
        spec.poses = Some(poses_spec(poses));
        spec.field = match *metric {
            FieldMetric::Metres { rho } => FieldSpec { profile: Profile::Standard, radian_weight: Some(rho) },
            FieldMetric::Cells => FieldSpec { profile: Profile::Thesis, radian_weight: None },
        };
        let idle: &[&str] = if folder.is_some() { &["shards"] } else { &["shards", "robot.model", "robot.content"] };
        without(keys_of(&spec), idle)
    }
}

fn robot_spec(robot: &Robot, folder: Option<&Path>) -> RobotSpec {
    let Robot { file, name: _, id, joints, target, frame, fixed } = robot;
    RobotSpec {
        model: folder.map(|folder| with_slashes(&relative_to(file, folder)).into()).unwrap_or_default(),
        joints: joints.clone(),
        target: target.clone(),
        frame: (frame != WORLD).then(|| frame.clone()),
        fixed: Some(fixed.clone()),
        content: Some(id.0.hex()),
    }
}

fn poses_spec(poses: &PoseGrid) -> PosesSpec {
    let [x, y, z] = (*poses.position_axes()).map(span);
    match poses {
        PoseGrid::Axes(grid) => {
            let [.., roll, pitch, yaw] = grid.axes().map(|axis| axis.count as u32);
            PosesSpec { x, y, z, roll, pitch: Some(pitch), yaw: Some(yaw), directions: None }
        }
        PoseGrid::Sphere(grid) => {
            let directions = Some(DirectionsSpec { healpix: grid.directions().nside() });
            PosesSpec { x, y, z, roll: grid.roll().count as u32, pitch: None, yaw: None, directions }
        }
    }
}

/// The positions of an axis; the end half a step behind the last one, so that no rounding moves their count.
fn span(axis: Axis) -> SpanSpec {
    let to = axis.first + (axis.count as f64 - 0.5) * axis.step;
    SpanSpec { from: axis.first, to, step: axis.step }
}
