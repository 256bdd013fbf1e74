//! From the keys of a reachability job to a job that makes sense: every mistake that the schema cannot see.

use std::{collections::BTreeMap, f64::consts::TAU, path::Path as FilePath};

use super::{
    robot_faults::{RobotFault, RobotKey, robot_faults},
    settings::{ReachabilityJob, Robot, WORLD},
    spec::{DirectionsSpec, FieldSpec, PosesSpec, ReachabilitySpec, RobotSpec, SpanSpec},
};
use crate::sections::{Profile, pinned_description, tidy};
use form::{Checker, Path, did_you_mean};
use kernel::{
    description::Description,
    geom::{Axis, AxisUnit, FieldMetric, HealPix, InvalidPoseGrid, METRES_PER_RADIAN, PoseGrid},
    ids::ObjectId,
};

/// Largest count of poses of a job: a field is in memory (14 bytes per pose) while it is made.
const MAX_POSES: usize = 100_000_000;

/// The whole job; `None` when robot or poses are wrong, which is reported.
pub(super) fn job(checker: &mut Checker, spec: &ReachabilitySpec, folder: &FilePath) -> Option<ReachabilityJob> {
    let robot = spec.robot.as_ref().and_then(|robot| read_robot(checker, robot, folder));
    let poses = spec.poses.as_ref().and_then(|poses| grid(checker, poses));
    let directed = spec.poses.as_ref().is_some_and(|poses| poses.directions.is_some());
    let metric = metric(checker, &spec.field, directed);
    Some(ReachabilityJob { robot: robot?, poses: poses?, solver: spec.solver, collisions: spec.collisions, metric })
}

fn read_robot(checker: &mut Checker, spec: &RobotSpec, folder: &FilePath) -> Option<Robot> {
    let before = checker.count();
    let path = Path::from("robot.joints");
    for (index, joint) in spec.joints.iter().enumerate() {
        if spec.joints[..index].contains(joint) {
            checker.invalid(path.index(index), "each joint once", format!("`{joint}` twice"));
        }
    }
    let fixed: BTreeMap<String, f64> = spec.fixed.clone().unwrap_or_default();
    for name in fixed.keys().filter(|name| spec.joints.contains(name)) {
        checker.contradiction(Path::from("robot.fixed").key(name), &path, "a joint is either moved or fixed");
    }
    let file = tidy(&folder.join(&spec.model));
    let Description { name, digest } =
        pinned_description(checker, "robot", "robot", &file, Description::read(&file), spec.content.as_deref())?;
    let (joints, target) = (spec.joints.clone(), spec.target.clone());
    let frame = spec.frame.clone().unwrap_or_else(|| WORLD.to_owned());
    let robot = Robot { file, name, id: ObjectId(digest), joints, target, frame, fixed };
    robot_faults(&robot).into_iter().for_each(|fault| report(checker, &robot, fault));
    (checker.count() == before).then_some(robot)
}

/// Reports a fault at its key.
fn report(checker: &mut Checker, robot: &Robot, fault: RobotFault) {
    let RobotFault { key, message, present } = fault;
    let joints = Path::from("robot.joints");
    let (path, what, wanted) = match &key {
        RobotKey::Scene => (Path::from("robot.model"), "robot", None),
        RobotKey::Target => (Path::from("robot.target"), "target", Some(robot.target.as_str())),
        RobotKey::Frame => (Path::from("robot.frame"), "frame", Some(robot.frame.as_str())),
        RobotKey::Joints(None) => (joints, "planning group", None),
        RobotKey::Joints(Some(index)) => (joints.index(*index), "joint", robot.joints.get(*index).map(String::as_str)),
        RobotKey::Fixed(name) => (Path::from("robot.fixed").key(name), "joint", Some(name.as_str())),
    };
    let help = wanted.and_then(|wanted| did_you_mean(wanted, present.iter().map(String::as_str)));
    checker.not_found(path, what, message).help_if(help);
}

/// Orientations of every position.
enum Orientations {
    /// Cells of roll, pitch and yaw.
    Axes([u32; 3]),
    /// Directions, and cells of roll.
    Sphere(HealPix, u32),
}

fn orientations(checker: &mut Checker, spec: &PosesSpec) -> Option<Orientations> {
    let &PosesSpec { roll, pitch, yaw, directions, .. } = spec;
    if let Some(DirectionsSpec { healpix }) = directions {
        for (key, _) in [("poses.pitch", pitch), ("poses.yaw", yaw)].iter().filter(|(_, given)| given.is_some()) {
            checker.contradiction(*key, "poses.directions", "directions replace pitch and yaw; remove one of them");
        }
        let directions = HealPix::new(healpix).expect("the schema requires a resolution from 1 to 16");
        return (pitch.is_none() && yaw.is_none()).then_some(Orientations::Sphere(directions, roll));
    }
    // Invalid directions were reported: pitch and yaw are not missing.
    if checker.is_wrong("poses.directions") {
        return None;
    }
    for (key, _) in [("pitch", pitch), ("yaw", yaw)].iter().filter(|(_, given)| given.is_none()) {
        let report = checker.missing(Path::from("poses").key(key), "a whole number from 1 to 4096 [cells]");
        report.help("give `pitch` and `yaw`, or `directions = { healpix = 2 }` instead");
    }
    Some(Orientations::Axes([roll, pitch?, yaw?]))
}

fn grid(checker: &mut Checker, spec: &PosesSpec) -> Option<PoseGrid> {
    let orientations = orientations(checker, spec);
    let span = |name: &'static str, span: &SpanSpec| Axis {
        name,
        unit: AxisUnit::Metre,
        first: span.from,
        step: span.step,
        count: cells_of(span),
        periodic: false,
    };
    let full_turn = |name: &'static str, count: u32| Axis {
        name,
        unit: AxisUnit::Radian,
        first: -TAU / 2.0,
        step: TAU / f64::from(count),
        count: count as usize,
        periodic: true,
    };
    let position = [span("x", &spec.x), span("y", &spec.y), span("z", &spec.z)];
    let [x, y, z] = position;
    let six_axes = |[roll, pitch, yaw]: [u32; 3]| {
        [x, y, z, full_turn("roll", roll), full_turn("pitch", pitch), full_turn("yaw", yaw)]
    };
    // One axis at a time among others that are fine: all mistakes at once.
    let axes = six_axes([1; 3]);
    let fine = axes.map(|axis| Axis { first: 0.0, step: 1.0, count: 1, periodic: false, ..axis });
    let before = checker.count();
    for k in 0..position.len() {
        let mut alone = fine;
        alone[k] = axes[k];
        if let Err(error) = PoseGrid::new(alone) {
            let (key, expected) = fault_of(&error);
            checker.invalid(&key, expected, error.to_string());
        }
    }
    let orientations = orientations.filter(|_| checker.count() == before)?;
    let grid = match orientations {
        Orientations::Axes(counts) => PoseGrid::new(six_axes(counts)),
        Orientations::Sphere(directions, rolls) => PoseGrid::on_sphere(position, directions, rolls as usize),
    };
    match grid {
        Ok(grid) if grid.cells() <= MAX_POSES => Some(grid),
        Ok(grid) => {
            checker.invalid("poses", format!("at most {MAX_POSES} poses"), format!("{}", grid.cells()));
            None
        }
        Err(error) => {
            let (key, expected) = fault_of(&error);
            checker.invalid(&key, expected, error.to_string());
            None
        }
    }
}

/// Count of positions from `from` in steps, before `to`; a last step that is short by rounding does not count.
fn cells_of(span: &SpanSpec) -> usize {
    let steps = (span.to - span.from) / span.step;
    let whole = libm::round(steps);
    // A saturating cast: NaN and what is negative become 0.
    (if (steps - whole).abs() < 1e-6 { whole } else { libm::ceil(steps) }) as usize
}

/// The key at fault for an invalid grid, and its requirement.
fn fault_of(error: &InvalidPoseGrid) -> (String, &'static str) {
    match error {
        InvalidPoseGrid::StepNotPositive { name, .. } => (format!("poses.{name}.step"), "a step above zero"),
        InvalidPoseGrid::NoCells { name } => (format!("poses.{name}.to"), "`to` above `from`"),
        InvalidPoseGrid::NotFinite { name, .. } => (format!("poses.{name}"), "finite positions"),
        InvalidPoseGrid::NotOneTurn { name, .. } | InvalidPoseGrid::WrongUnit { name, .. } => {
            (format!("poses.{name}"), "cells in a full rotation")
        }
        InvalidPoseGrid::TooManyOrientations { .. } => {
            ("poses.directions".to_owned(), "a lower resolution or fewer cells of roll")
        }
        InvalidPoseGrid::TooManyCells { .. } => ("poses".to_owned(), "fewer poses"),
    }
}

fn metric(checker: &mut Checker, spec: &FieldSpec, directed: bool) -> FieldMetric {
    match spec.profile {
        Profile::Standard => FieldMetric::Metres { rho: spec.radian_weight.unwrap_or(METRES_PER_RADIAN) },
        Profile::Thesis => {
            if spec.radian_weight.is_some() {
                let other = "field.profile = \"thesis\"";
                checker.contradiction("field.radian_weight", other, "the field of the thesis counts cells");
            }
            if directed {
                let because = "the thesis's field counts cells along six axes; take `field.profile = \"standard\"`";
                checker.contradiction("field.profile", "poses.directions", because);
            }
            FieldMetric::Cells
        }
    }
}
