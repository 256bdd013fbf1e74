//! A resolved reachability job as text.

use std::path::Path;

use toml::Value;

use super::{Text, relative_to};
use crate::{
    geom::{Axis, FieldMetric, PoseGrid},
    job::{
        checked::{Collisions, ReachabilityJob, Robot, Solver, WORLD},
        discover,
    },
};

impl Text {
    /// Everything but the robot.
    pub(super) fn reachability(&mut self, job: &ReachabilityJob) {
        let ReachabilityJob { robot: _, poses, solver, collisions, metric } = job;
        let solver = match solver {
            Solver::Auto => "auto",
            Solver::ClosedForm => "closed_form",
            Solver::Numeric => "numeric",
        };
        let collisions = match collisions {
            Collisions::Exact => "exact",
            Collisions::Mujoco => "mujoco",
            Collisions::None => "none",
        };
        self.key("solver", solver);
        self.key("collisions", collisions);
        self.section("poses");
        for axis in poses.places() {
            self.key(axis.name, span(axis));
        }
        match poses {
            PoseGrid::Axes(grid) => {
                for axis in &grid.axes()[3..] {
                    self.key(axis.name, axis.count as i64);
                }
            }
            PoseGrid::Sphere(grid) => {
                self.key(grid.roll().name, grid.roll().count as i64);
                let nside = Value::from(i64::from(grid.directions().nside()));
                self.key("directions", Value::Table([("healpix".to_owned(), nside)].into_iter().collect()));
            }
        }
        self.section("field");
        match metric {
            FieldMetric::Metres { rho } => {
                self.key("profile", "standard");
                self.key("radian_weight", *rho);
            }
            FieldMetric::Cells => self.key("profile", "thesis"),
        }
    }

    /// The robot, with its file.
    pub(super) fn robot(&mut self, robot: &Robot, folder: &Path) {
        self.section("robot");
        self.key("scene", discover::with_slashes(&relative_to(&robot.scene, folder)));
        self.key("content", robot.id.0.hex());
        self.group_keys(robot);
    }

    /// The planning group alone: what the digest knows of the robot beside its content.
    pub(super) fn group(&mut self, robot: &Robot) {
        self.section("robot");
        self.group_keys(robot);
    }

    fn group_keys(&mut self, robot: &Robot) {
        let Robot { scene: _, name: _, id: _, joints, target, frame, fixed } = robot;
        self.list("joints", joints.iter().map(|joint| Value::from(joint.as_str())));
        self.key("target", target.as_str());
        // Older jobs had no such key: their digests stay.
        if frame != WORLD {
            self.key("frame", frame.as_str());
        }
        let fixed = fixed.iter().map(|(name, value)| (name.clone(), Value::from(*value)));
        self.key("fixed", Value::Table(fixed.collect()));
    }
}

/// The positions of an axis; the end half a step behind the last one, so that no rounding moves their count.
fn span(axis: &Axis) -> Value {
    let to = axis.first + (axis.count as f64 - 0.5) * axis.step;
    let keys = [("from", axis.first), ("to", to), ("step", axis.step)];
    Value::Table(keys.into_iter().map(|(key, value)| (key.to_owned(), Value::from(value))).collect())
}
