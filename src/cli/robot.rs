//! `graspmill robot check`: a robot as a job reads it, and the pairs of bodies that need no checks.

use std::{
    collections::BTreeMap,
    f64::consts::PI,
    fmt::{self, Display},
};

use nalgebra::IsometryMatrix3;
use serde::Serialize;

use super::{
    args::RobotCheckArgs,
    exit::{Exit, Failure},
    pairs::{self, PairRow},
    printer::Printer,
};
use kernel::{
    description::{Description, Format},
    seed::Stream,
    words::Show,
};
use robot::{
    collision::Body,
    kinematics::{ClosedForm, Joint, JointKind, PlanningGroup},
};
use sim::{Collidable, RobotModel};

/// Result of the check.
#[derive(Serialize)]
struct Report {
    scene: String,
    #[serde(skip)]
    format: Format,
    digest: String,
    target: String,
    joints: Vec<JointRow>,
    /// Reason why inverse kinematics has no closed form; `None` if it has one.
    no_closed_form: Option<String>,
    bodies: Vec<BodyRow>,
    samples: u64,
    pairs: Vec<PairRow>,
    /// Checked pairs that touch at rest.
    touch_at_rest: Vec<[String; 2]>,
    /// MJCF that excludes the pairs that always or never touch from checks.
    exclude: Vec<String>,
}

#[derive(Serialize)]
struct JointRow {
    name: String,
    /// `rad` or `m`.
    unit: &'static str,
    /// `None` for a joint that rotates without limits.
    limits: Option<[f64; 2]>,
}

#[derive(Serialize)]
struct BodyRow {
    name: String,
    /// Last joint of the group that moves the body; `None` for a fixed body.
    moved_by: Option<String>,
    shapes: String,
    triangles: usize,
}

/// Checks a robot.
pub fn check(arguments: &RobotCheckArgs, printer: &Printer) -> Result<Exit, Failure> {
    let wrong = |error| pairs::wrong_robot(error);
    let fixed = fixed(&arguments.fixed)?;
    let joints: Vec<&str> = arguments.joints.iter().map(String::as_str).collect();
    let robot = RobotModel::open(&arguments.model).map_err(wrong)?;
    let group = robot.planning_group(&joints, &arguments.target, &fixed).map_err(wrong)?;
    let Collidable { bodies, rules, rest } = robot.collidable(&joints, &fixed).map_err(wrong)?;
    let digest = Description::read(&arguments.model).map_err(|error| Failure::new(Exit::BadSpec, error))?.digest;
    let checker = pairs::checker(&bodies, &rules)
        .map_err(|error| Failure::message(Exit::BadSpec, format!("{}: {error}", arguments.model.shown())))?;
    let mut stream = Stream::of_job(0, b"", "robot check");
    let configurations = (0..arguments.samples).map(|_| link_frames(&group, &anywhere(&group, &mut stream)));
    let counts = checker.count(configurations);
    let touch_at_rest = pairs::touching(&bodies, &rules, &checker, &link_frames(&group, &rest));
    let pairs = PairRow::all(&bodies, &rules, &counts);
    let samples = arguments.samples;
    let idle = |pair: &&PairRow| pair.always_touches(samples) || pair.never_touches(samples);
    let report = Report {
        scene: arguments.model.display().to_string(),
        format: robot.format(),
        digest: digest.to_string(),
        target: arguments.target.clone(),
        joints: group.joints().iter().map(joint_row).collect(),
        no_closed_form: ClosedForm::recognise(&group).err().map(|reason| reason.to_string()),
        bodies: bodies.bodies.iter().map(|body| body_row(body, &group)).collect(),
        samples: arguments.samples,
        touch_at_rest,
        exclude: pairs.iter().filter(idle).map(PairRow::exclude).collect(),
        pairs,
    };
    if arguments.json {
        printer.json(&report)?
    } else {
        printer.result(&report.to_string())
    }
    Ok(Exit::Complete)
}

/// `NAME=VALUE` arguments.
fn fixed(arguments: &[String]) -> Result<BTreeMap<String, f64>, Failure> {
    let read = |text: &String| {
        let (name, value) = text.split_once('=')?;
        let value = value.trim().parse().ok().filter(|value: &f64| value.is_finite())?;
        Some((name.trim().to_owned(), value))
    };
    let pair = |text| {
        read(text).ok_or_else(|| {
            Failure::message(
                Exit::BadSpec,
                format!("--fixed {text}: give a joint and its value, such as torso_lift_joint=0.1"),
            )
        })
    };
    arguments.iter().map(pair).collect()
}

/// Frames of the links, the world's first.
fn link_frames(group: &PlanningGroup, values: &[f64]) -> Vec<IsometryMatrix3<f64>> {
    let mut frames = vec![IsometryMatrix3::identity(); group.len() + 1];
    group.link_frames(values, &mut frames[1..]);
    frames
}

/// Draws joint values uniformly within the limits, or over the full circle for a joint without limits.
fn anywhere(group: &PlanningGroup, stream: &mut Stream) -> Vec<f64> {
    let range = |joint: &Joint| joint.limits.map_or([-PI, PI], |limits| [limits.low, limits.high]);
    group.joints().iter().map(range).map(|[low, high]| stream.uniform(low, high)).collect()
}

fn joint_row(joint: &Joint) -> JointRow {
    JointRow {
        name: joint.name.clone(),
        unit: if joint.kind == JointKind::Revolute { "rad" } else { "m" },
        limits: joint.limits.map(|limits| [limits.low, limits.high]),
    }
}

fn body_row(body: &Body, group: &PlanningGroup) -> BodyRow {
    let (shapes, triangles) = pairs::shapes(body);
    let moved_by = body.link.checked_sub(1).map(|joint| group.joints()[joint].name.clone());
    BodyRow { name: body.name.clone(), moved_by, shapes, triangles }
}

impl Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} ({})", self.scene, &self.digest[..16])?;
        writeln!(f, "\nplanning group, target {}", self.target)?;
        for joint in &self.joints {
            match joint.limits {
                Some([low, high]) => writeln!(f, "  {:24} {low} .. {high} {}", joint.name, joint.unit)?,
                None => writeln!(f, "  {:24} rotates without limits", joint.name)?,
            }
        }
        match &self.no_closed_form {
            None => writeln!(f, "inverse kinematics: closed form")?,
            Some(reason) => writeln!(f, "inverse kinematics: numeric; no closed form: {reason}")?,
        }
        writeln!(f, "\nbodies")?;
        for body in &self.bodies {
            let moved = body.moved_by.as_ref().map_or("fixed".to_owned(), |joint| format!("moved by {joint}"));
            let triangles = if body.triangles == 0 { String::new() } else { format!(", {} triangles", body.triangles) };
            writeln!(f, "  {:24} {moved:32} {}{triangles}", body.name, body.shapes)?;
        }
        writeln!(f, "\npairs, in {} random configurations", self.samples)?;
        pairs::write_pairs(f, &self.pairs, self.samples)?;
        match self.touch_at_rest.as_slice() {
            [] => writeln!(f, "\nat rest, nothing touches")?,
            pairs => {
                let pairs: Vec<_> = pairs.iter().map(|[one, other]| format!("{one} and {other}")).collect();
                writeln!(f, "\nat rest, these bodies touch, so a job would be refused: {}", pairs.join("; "))?;
            }
        }
        pairs::write_excludes(f, self.format, &self.exclude)
    }
}
