//! Settings of a reachability job.

use std::{collections::BTreeMap, f64::consts::TAU, path::Path as FilePath};

use super::{Checker, described};
use crate::{
    assets::Description,
    geom::{Axis, AxisUnit, FieldMetric, HealPix, InvalidPoseGrid, METRES_PER_RADIAN, PoseGrid},
    ids::ObjectId,
    job::{
        checked::{Profile, ReachabilityJob, Robot, WORLD},
        document::Path,
        errors::Problem,
        spec::reachability::{DirectionsSpec, FieldSpec, PosesSpec, ReachabilitySpec, RobotSpec, SpanSpec},
    },
};

/// Most poses of a job: a field stands in memory (14 bytes each) when it is made.
const MOST_POSES: usize = 100_000_000;

/// Tries a robot's planning group: every fault that it finds.
///
/// Only the `sim` room compiles MJCF, so whoever reads a job passes it in.
pub type RobotReader<'a> = dyn Fn(&Robot) -> Vec<RobotFault> + 'a;

/// Why a robot cannot do what a job asks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotFault {
    /// Which key is to blame.
    pub key: RobotKey,
    /// Why, in words, with file and names.
    pub message: String,
    /// The names that are there instead.
    pub present: Vec<String>,
}

/// A key of `robot`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RobotKey {
    /// `robot.scene`.
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

/// The reader of a program without the simulator: refuses every robot.
pub fn no_robots(_: &Robot) -> Vec<RobotFault> {
    let message = "this build has no simulator to read a robot with (feature `sim`)".to_owned();
    vec![RobotFault { key: RobotKey::Scene, message, present: Vec::new() }]
}

/// The product's settings; `None` where robot or poses are wrong, which was reported.
pub(in crate::job) fn reachability(
    checker: &mut Checker<'_>,
    spec: &ReachabilitySpec,
    folder: &FilePath,
    robots: &RobotReader<'_>,
) -> Option<ReachabilityJob> {
    let robot = spec.robot.as_ref().and_then(|robot| read_robot(checker, robot, folder, robots));
    let poses = spec.poses.as_ref().and_then(|poses| grid(checker, poses));
    let directed = spec.poses.as_ref().is_some_and(|poses| poses.directions.is_some());
    let metric = metric(checker, &spec.field, directed);
    Some(ReachabilityJob { robot: robot?, poses: poses?, solver: spec.solver, collisions: spec.collisions, metric })
}

fn read_robot(
    checker: &mut Checker<'_>,
    spec: &RobotSpec,
    folder: &FilePath,
    robots: &RobotReader<'_>,
) -> Option<Robot> {
    let before = checker.errors.len();
    let path = Path::of("robot.joints");
    for (index, joint) in spec.joints.iter().enumerate() {
        if spec.joints[..index].contains(joint) {
            let found = format!("`{joint}` twice");
            let problem = Problem::Senseless { expected: "each joint once".to_owned(), found };
            checker.fail(&path.index(index), problem, None);
        }
    }
    let fixed: BTreeMap<String, f64> = spec.fixed.clone().unwrap_or_default();
    for name in fixed.keys().filter(|name| spec.joints.contains(name)) {
        let because = "a joint moves or stands still".to_owned();
        let problem = Problem::Contradiction { other: "robot.joints".to_owned(), because };
        checker.fail(&Path::of("robot.fixed").key(name), problem, None);
    }
    let scene = crate::job::discover::tidy(&folder.join(&spec.scene));
    let Description { name, digest } =
        described(checker, "robot", "robot", &scene, Description::read(&scene), spec.content.as_deref())?;
    let (joints, target) = (spec.joints.clone(), spec.target.clone());
    let frame = spec.frame.clone().unwrap_or_else(|| WORLD.to_owned());
    let robot = Robot { scene, name, id: ObjectId(digest), joints, target, frame, fixed };
    robots(&robot).into_iter().for_each(|fault| report(checker, &robot, fault));
    (checker.errors.len() == before).then_some(robot)
}

/// Blames the key that a fault is about.
fn report(checker: &mut Checker<'_>, robot: &Robot, fault: RobotFault) {
    let RobotFault { key, message, present } = fault;
    let joints = Path::of("robot.joints");
    let (path, what, wanted) = match &key {
        RobotKey::Scene => (Path::of("robot.scene"), "robot", None),
        RobotKey::Target => (Path::of("robot.target"), "target", Some(robot.target.as_str())),
        RobotKey::Frame => (Path::of("robot.frame"), "frame", Some(robot.frame.as_str())),
        RobotKey::Joints(None) => (joints, "planning group", None),
        RobotKey::Joints(Some(index)) => (joints.index(*index), "joint", robot.joints.get(*index).map(String::as_str)),
        RobotKey::Fixed(name) => (Path::of("robot.fixed").key(name), "joint", Some(name.as_str())),
    };
    let near = |wanted: &str| crate::job::decode::did_you_mean(wanted, present.iter().map(String::as_str));
    let help = wanted.and_then(near);
    checker.fail(&path, Problem::NotFound { what: what.to_owned(), detail: message }, help);
}

/// Which orientations every position has.
enum Turns {
    /// Cells of roll, pitch and yaw.
    Axes([u32; 3]),
    /// Directions, and cells of roll.
    Sphere(HealPix, u32),
}

fn turns(checker: &mut Checker<'_>, spec: &PosesSpec) -> Option<Turns> {
    let &PosesSpec { roll, pitch, yaw, directions, .. } = spec;
    if let Some(DirectionsSpec { healpix }) = directions {
        for (key, _) in [("poses.pitch", pitch), ("poses.yaw", yaw)].iter().filter(|(_, given)| given.is_some()) {
            checker.contradiction(
                key,
                "poses.directions",
                "directions are pitch and yaw in one; leave one of them out",
            );
        }
        let directions = HealPix::new(healpix).expect("the schema asks for a resolution from 1 to 16");
        return (pitch.is_none() && yaw.is_none()).then_some(Turns::Sphere(directions, roll));
    }
    // Directions that are none were reported: pitch and yaw are not what is missing.
    if checker.wrong.iter().any(|wrong| Path::of("poses.directions").holds(wrong)) {
        return None;
    }
    for (key, _) in [("pitch", pitch), ("yaw", yaw)].iter().filter(|(_, given)| given.is_none()) {
        let expected = "a whole number from 1 to 4096 [cells]".to_owned();
        let help = "give `pitch` and `yaw`, or `directions = { healpix = 2 }` in their place";
        checker.fail(&Path::of("poses").key(key), Problem::Missing { expected }, Some(help.to_owned()));
    }
    Some(Turns::Axes([roll, pitch?, yaw?]))
}

fn grid(checker: &mut Checker<'_>, spec: &PosesSpec) -> Option<PoseGrid> {
    let turns = turns(checker, spec);
    let span = |name: &'static str, span: &SpanSpec| Axis {
        name,
        unit: AxisUnit::Metre,
        first: span.from,
        step: span.step,
        count: cells_of(span),
        periodic: false,
    };
    let turn = |name: &'static str, count: u32| Axis {
        name,
        unit: AxisUnit::Radian,
        first: -TAU / 2.0,
        step: TAU / f64::from(count),
        count: count as usize,
        periodic: true,
    };
    let places = [span("x", &spec.x), span("y", &spec.y), span("z", &spec.z)];
    let [x, y, z] = places;
    let of_turns = |[roll, pitch, yaw]: [u32; 3]| [x, y, z, turn("roll", roll), turn("pitch", pitch), turn("yaw", yaw)];
    // One axis at a time among others that are fine: all mistakes at once.
    let axes = of_turns([1; 3]);
    let fine = axes.map(|axis| Axis { first: 0.0, step: 1.0, count: 1, periodic: false, ..axis });
    let before = checker.errors.len();
    for k in 0..places.len() {
        let mut alone = fine;
        alone[k] = axes[k];
        if let Err(error) = PoseGrid::new(alone) {
            let (key, expected) = blame(&error);
            checker.senseless(&key, expected, error.to_string());
        }
    }
    let turns = turns.filter(|_| checker.errors.len() == before)?;
    let grid = match turns {
        Turns::Axes(counts) => PoseGrid::new(of_turns(counts)),
        Turns::Sphere(directions, rolls) => PoseGrid::on_sphere(places, directions, rolls as usize),
    };
    match grid {
        Ok(grid) if grid.cells() <= MOST_POSES => Some(grid),
        Ok(grid) => {
            checker.senseless("poses", format!("at most {MOST_POSES} poses"), format!("{}", grid.cells()));
            None
        }
        Err(error) => {
            let (key, expected) = blame(&error);
            checker.senseless(&key, expected, error.to_string());
            None
        }
    }
}

/// Positions from `from` in steps, before `to`; a last step that is short by rounding is none.
fn cells_of(span: &SpanSpec) -> usize {
    let steps = (span.to - span.from) / span.step;
    let whole = libm::round(steps);
    // A saturating cast: NaN and what is negative become 0.
    (if (steps - whole).abs() < 1e-6 { whole } else { libm::ceil(steps) }) as usize
}

/// The key to blame for a grid that is none, and what it should be.
fn blame(error: &InvalidPoseGrid) -> (String, &'static str) {
    match error {
        InvalidPoseGrid::StepNotPositive { name, .. } => (format!("poses.{name}.step"), "a step above zero"),
        InvalidPoseGrid::NoCells { name } => (format!("poses.{name}.to"), "`to` above `from`"),
        InvalidPoseGrid::NotFinite { name, .. } => (format!("poses.{name}"), "finite positions"),
        InvalidPoseGrid::NotOneTurn { name, .. } | InvalidPoseGrid::WrongUnit { name, .. } => {
            (format!("poses.{name}"), "cells in a turn")
        }
        InvalidPoseGrid::TooManyOrientations { .. } => {
            ("poses.directions".to_owned(), "a lower resolution or fewer cells of roll")
        }
        InvalidPoseGrid::TooManyCells { .. } => ("poses".to_owned(), "fewer poses"),
    }
}

fn metric(checker: &mut Checker<'_>, spec: &FieldSpec, directed: bool) -> FieldMetric {
    match spec.profile {
        Profile::Standard => FieldMetric::Metres { rho: spec.radian_weight.unwrap_or(METRES_PER_RADIAN) },
        Profile::Thesis => {
            if spec.radian_weight.is_some() {
                let other = "field.profile = \"thesis\"";
                checker.contradiction("field.radian_weight", other, "the thesis's field counts cells");
            }
            if directed {
                let because = "the thesis's field counts cells along six axes; take `field.profile = \"standard\"`";
                checker.contradiction("field.profile", "poses.directions", because);
            }
            FieldMetric::Cells
        }
    }
}
