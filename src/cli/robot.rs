//! `graspmill robot check`: what a job would make of a robot, and which pairs of bodies need no checking.

use std::{
    collections::BTreeMap,
    f64::consts::PI,
    fmt::{self, Display, Write},
};

use serde::Serialize;

use super::{
    args::RobotCheckArgs,
    exit::{Exit, Failure},
    printer::Printer,
};
use crate::{
    assets::Description,
    collision::{Bodies, Body, Shape, TouchTest},
    kinematics::{ClosedForm, Joint, JointKind, PlanningGroup},
    seed::Stream,
    sim::{PairRule, RobotModel},
};

/// All that was found.
#[derive(Serialize)]
struct Report {
    scene: String,
    digest: String,
    target: String,
    joints: Vec<JointRow>,
    /// Why inverse kinematics has no closed form; `None` where it has one.
    no_closed_form: Option<String>,
    bodies: Vec<BodyRow>,
    samples: u64,
    pairs: Vec<PairRow>,
    /// Pairs that are checked and touch at rest.
    touch_at_rest: Vec<[String; 2]>,
    /// MJCF that keeps the pairs that always or never touch from being checked.
    exclude: Vec<String>,
}

#[derive(Serialize)]
struct JointRow {
    name: String,
    /// `rad` or `m`.
    unit: &'static str,
    /// `None` for a joint that turns without end.
    limits: Option<[f64; 2]>,
}

#[derive(Serialize)]
struct BodyRow {
    name: String,
    /// The joint of the group that moves it last; `None` for what stands still.
    moved_by: Option<String>,
    shapes: String,
    triangles: usize,
}

#[derive(Serialize)]
struct PairRow {
    bodies: [String; 2],
    /// `checked`, or why it is not: `adjacent`, `excluded` or `masked`.
    rule: &'static str,
    /// Samples in which the two touch.
    touches: u64,
}

/// Looks at a robot.
pub fn check(arguments: &RobotCheckArgs, printer: &Printer) -> Result<Exit, Failure> {
    let wrong = |error| Failure::new(Exit::BadSpec, error);
    let fixed = fixed(&arguments.fixed)?;
    let joints: Vec<&str> = arguments.joints.iter().map(String::as_str).collect();
    let robot = RobotModel::open(&arguments.scene).map_err(wrong)?;
    let group = robot.planning_group(&joints, &arguments.target, &fixed).map_err(wrong)?;
    let (bodies, rules) = robot.pairs(&joints, &fixed).map_err(wrong)?;
    let rest = robot.rest(&joints, &fixed).map_err(wrong)?;
    let digest = Description::read(&arguments.scene).map_err(|error| Failure::new(Exit::BadSpec, error))?.digest;
    let test = TouchTest::new(&bodies)
        .map_err(|error| Failure::message(Exit::BadSpec, format!("{}: {error}", arguments.scene.display())))?;
    let pairs: Vec<[usize; 2]> = rules.iter().map(|(pair, _)| *pair).collect();
    let mut stream = Stream::of_job(0, b"", "robot check");
    let counts = test.count(&group, &pairs, (0..arguments.samples).map(|_| anywhere(&group, &mut stream)));
    let at_rest = test.count(&group, &bodies.pairs, [rest]);
    let touching = bodies.pairs.iter().zip(at_rest).filter(|(_, count)| *count > 0);
    let touch_at_rest = touching.map(|(pair, _)| names(&bodies, *pair)).collect();
    let rows = rules.iter().zip(&counts).map(|((pair, rule), touches)| PairRow {
        bodies: names(&bodies, *pair),
        rule: word(*rule),
        touches: *touches,
    });
    let pairs: Vec<PairRow> = rows.collect();
    let idle =
        pairs.iter().filter(|pair| pair.is_checked() && (pair.touches == 0 || pair.touches == arguments.samples));
    let report = Report {
        scene: arguments.scene.display().to_string(),
        digest: digest.to_string(),
        target: arguments.target.clone(),
        joints: group.joints().iter().map(joint_row).collect(),
        no_closed_form: ClosedForm::recognise(&group).err().map(|reason| reason.to_string()),
        bodies: bodies.bodies.iter().map(|body| body_row(body, &group)).collect(),
        samples: arguments.samples,
        touch_at_rest,
        exclude: if arguments.samples == 0 { Vec::new() } else { idle.map(exclude).collect() },
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
                format!("--fixed {text}: give a joint and its value, as in torso_lift_joint=0.1"),
            )
        })
    };
    arguments.iter().map(pair).collect()
}

/// Joint values, uniform within the limits; a joint that turns without end, all round.
fn anywhere(group: &PlanningGroup, stream: &mut Stream) -> Vec<f64> {
    let range = |joint: &Joint| joint.limits.map_or([-PI, PI], |limits| [limits.low, limits.high]);
    group.joints().iter().map(range).map(|[low, high]| stream.uniform(low, high)).collect()
}

fn names(bodies: &Bodies, pair: [usize; 2]) -> [String; 2] {
    pair.map(|place| bodies.bodies[place].name.clone())
}

fn word(rule: PairRule) -> &'static str {
    match rule {
        PairRule::Checked => "checked",
        PairRule::Adjacent => "adjacent",
        PairRule::Excluded => "excluded",
        PairRule::Masked => "masked",
    }
}

fn joint_row(joint: &Joint) -> JointRow {
    JointRow {
        name: joint.name.clone(),
        unit: if joint.kind == JointKind::Revolute { "rad" } else { "m" },
        limits: joint.limits.map(|limits| [limits.low, limits.high]),
    }
}

fn body_row(body: &Body, group: &PlanningGroup) -> BodyRow {
    let (mut kinds, mut triangles) = (BTreeMap::new(), 0);
    for geometry in &body.geometries {
        let kind = match &geometry.shape {
            Shape::Box { .. } => "box",
            Shape::Sphere { .. } => "ball",
            Shape::Capsule { .. } => "capsule",
            Shape::Cylinder { .. } => "cylinder",
            Shape::Mesh(mesh) => {
                triangles += mesh.triangles.len();
                "mesh"
            }
        };
        *kinds.entry(kind).or_insert(0) += 1;
    }
    let shapes = kinds.into_iter().map(|(kind, count)| format!("{count} {kind}")).collect::<Vec<_>>().join(", ");
    let moved_by = body.link.checked_sub(1).map(|joint| group.joints()[joint].name.clone());
    BodyRow { name: body.name.clone(), moved_by, shapes, triangles }
}

/// A body of several sorts of geoms is excluded by its plain name.
fn exclude(pair: &PairRow) -> String {
    let [one, other] = pair.bodies.each_ref().map(|name| name.split(" (contype").next().unwrap_or_default());
    format!("<exclude body1=\"{one}\" body2=\"{other}\"/>")
}

impl PairRow {
    fn is_checked(&self) -> bool {
        self.rule == "checked"
    }
}

impl Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} ({})", self.scene, &self.digest[..16])?;
        writeln!(f, "\nplanning group, target {}", self.target)?;
        for joint in &self.joints {
            match joint.limits {
                Some([low, high]) => writeln!(f, "  {:24} {low} .. {high} {}", joint.name, joint.unit)?,
                None => writeln!(f, "  {:24} turns without end", joint.name)?,
            }
        }
        match &self.no_closed_form {
            None => writeln!(f, "inverse kinematics: closed form")?,
            Some(reason) => writeln!(f, "inverse kinematics: numeric; no closed form: {reason}")?,
        }
        writeln!(f, "\nbodies")?;
        for body in &self.bodies {
            let moved = body.moved_by.as_ref().map_or("stands still".to_owned(), |joint| format!("moved by {joint}"));
            let triangles = if body.triangles == 0 { String::new() } else { format!(", {} triangles", body.triangles) };
            writeln!(f, "  {:24} {moved:32} {}{triangles}", body.name, body.shapes)?;
        }
        writeln!(f, "\npairs, in {} random configurations", self.samples)?;
        let of_rule = |rule: &'static str| self.pairs.iter().filter(move |pair| pair.rule == rule);
        let checked = |touch: fn(u64, u64) -> bool| {
            of_rule("checked").filter(move |pair| self.samples > 0 && touch(pair.touches, self.samples))
        };
        list(f, "adjacent, never checked", of_rule("adjacent").map(Self::plain))?;
        list(f, "kept apart by contype and conaffinity", of_rule("masked").map(Self::plain))?;
        list(f, "always touch", checked(|touches, all| touches == all).map(Self::plain))?;
        list(f, "never touch", checked(|touches, _| touches == 0).map(Self::plain))?;
        let share = |pair: &PairRow| {
            format!("{} {:.2} %", Self::plain(pair), 100.0 * pair.touches as f64 / self.samples.max(1) as f64)
        };
        list(f, "touch sometimes", checked(|touches, all| touches > 0 && touches < all).map(share))?;
        let excluded = of_rule("excluded").count();
        writeln!(f, "  excluded by the scene: {excluded}")?;
        let hidden = of_rule("excluded").filter(|pair| pair.touches > 0 && pair.touches < self.samples);
        list(f, "excluded, but touch sometimes", hidden.map(share))?;
        match self.touch_at_rest.as_slice() {
            [] => writeln!(f, "\nat rest nothing touches")?,
            pairs => {
                let pairs: Vec<_> = pairs.iter().map(|[one, other]| format!("{one} and {other}")).collect();
                writeln!(f, "\nat rest these touch, and a job would be refused: {}", pairs.join("; "))?;
            }
        }
        if !self.exclude.is_empty() {
            writeln!(f, "\nto check only what matters, put this into the scene:\n  <contact>")?;
            self.exclude.iter().try_for_each(|line| writeln!(f, "    {line}"))?;
            writeln!(f, "  </contact>")?;
        }
        Ok(())
    }
}

impl Report {
    fn plain(pair: &PairRow) -> String {
        pair.bodies.join(" - ")
    }
}

/// A heading and its items, one a line; nothing where there are none.
fn list(f: &mut fmt::Formatter<'_>, heading: &str, items: impl Iterator<Item = String>) -> fmt::Result {
    let mut text = String::new();
    let mut count = 0;
    for item in items {
        writeln!(text, "    {item}")?;
        count += 1;
    }
    if count == 0 { Ok(()) } else { write!(f, "  {heading}: {count}\n{text}") }
}
