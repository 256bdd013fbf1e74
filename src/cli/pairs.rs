//! Pairs of bodies that move relative to each other: how often they touch, and the text about it.

use std::{
    collections::BTreeMap,
    fmt::{self, Write},
};

use serde::Serialize;

use kernel::{description::Format, geom::NoSurface};
use nalgebra::IsometryMatrix3;
use robot::collision::{Bodies, Body, CollisionChecker, Shape};
use sim::{HandError, PairRule, RobotError, exclude_line, place_of_excludes};

use super::exit::{Exit, Failure};

/// Two bodies and how often they touch.
#[derive(Serialize)]
pub struct PairRow {
    /// Their names.
    pub bodies: [String; 2],
    /// `checked`, or the reason for skipping the pair: `adjacent`, `excluded` or `masked`.
    pub rule: &'static str,
    /// Samples in which the two touch.
    pub touches: u64,
}

impl PairRow {
    /// Rows of all pairs, with the number of touches of each.
    pub fn all(bodies: &Bodies, rules: &[([usize; 2], PairRule)], counts: &[u64]) -> Vec<Self> {
        let row = |((pair, rule), touches): (&([usize; 2], PairRule), &u64)| Self {
            bodies: names(bodies, *pair),
            rule: word(*rule),
            touches: *touches,
        };
        rules.iter().zip(counts).map(row).collect()
    }

    /// MJCF that excludes this pair from checks.
    pub fn exclude(&self) -> String {
        exclude_line(&self.bodies)
    }

    /// Whether it is checked, and touches in all samples.
    pub fn always_touches(&self, samples: u64) -> bool {
        self.is_checked() && samples > 0 && self.touches == samples
    }

    /// Whether it is checked, and touches in no sample.
    pub fn never_touches(&self, samples: u64) -> bool {
        self.is_checked() && samples > 0 && self.touches == 0
    }

    fn is_checked(&self) -> bool {
        self.rule == "checked"
    }

    fn plain(&self) -> String {
        self.bodies.join(" - ")
    }
}

/// Collision test that maps and trials use, for all pairs that move relative to each other, in the order of their rules.
///
/// # Errors
/// When a shape has no surface.
pub fn checker(bodies: &Bodies, rules: &[([usize; 2], PairRule)]) -> Result<CollisionChecker, NoSurface> {
    CollisionChecker::new(&bodies.clone().with_pairs(rules.iter().map(|(pair, _)| *pair).collect()))
}

/// Checked pairs that touch with the links at these frames, starting with the world's.
pub fn touching(
    bodies: &Bodies,
    rules: &[([usize; 2], PairRule)],
    checker: &CollisionChecker,
    links: &[IsometryMatrix3<f64>],
) -> Vec<[String; 2]> {
    let checked = rules.iter().enumerate().filter(|(_, (_, rule))| *rule == PairRule::Checked);
    checked.filter(|(index, _)| checker.pair(*index, links)).map(|(_, (pair, _))| names(bodies, *pair)).collect()
}

/// Failure for a robot that cannot be checked: a mistake in its description, or too little memory.
pub fn wrong_robot(error: RobotError) -> Failure {
    let exit = if matches!(error, RobotError::Memory { .. }) { Exit::Failed } else { Exit::BadSpec };
    Failure::new(exit, error)
}

/// Failure for a hand that cannot be checked.
pub fn wrong_hand(error: HandError) -> Failure {
    match error {
        HandError::Robot(error) => wrong_robot(error),
        error => Failure::new(Exit::BadSpec, error),
    }
}

/// Names of a pair's bodies.
fn names(bodies: &Bodies, pair: [usize; 2]) -> [String; 2] {
    pair.map(|index| bodies.bodies[index].name.clone())
}

/// A body's shapes by kind, as `2 box, 1 mesh`, and the triangles of its meshes.
pub fn shapes(body: &Body) -> (String, usize) {
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
    (kinds.into_iter().map(|(kind, count)| format!("{count} {kind}")).collect::<Vec<_>>().join(", "), triangles)
}

fn word(rule: PairRule) -> &'static str {
    match rule {
        PairRule::Checked => "checked",
        PairRule::Adjacent => "adjacent",
        PairRule::Excluded => "excluded",
        PairRule::Masked => "masked",
    }
}

/// Writes the state of the pairs, rule by rule.
pub fn write_pairs(f: &mut fmt::Formatter<'_>, pairs: &[PairRow], samples: u64) -> fmt::Result {
    let of_rule = |rule: &'static str| pairs.iter().filter(move |pair| pair.rule == rule);
    list(f, "adjacent, never checked", of_rule("adjacent").map(PairRow::plain))?;
    list(f, "disabled by contype and conaffinity", of_rule("masked").map(PairRow::plain))?;
    list(f, "always touch", pairs.iter().filter(|pair| pair.always_touches(samples)).map(PairRow::plain))?;
    list(f, "never touch", pairs.iter().filter(|pair| pair.never_touches(samples)).map(PairRow::plain))?;
    let share = |pair: &PairRow| {
        format!("{} {:.2} %", PairRow::plain(pair), 100.0 * pair.touches as f64 / samples.max(1) as f64)
    };
    let sometimes = |pair: &&PairRow| pair.touches > 0 && pair.touches < samples;
    list(f, "sometimes touch", of_rule("checked").filter(sometimes).map(share))?;
    let excluded = of_rule("excluded").count();
    writeln!(f, "  excluded by the scene: {excluded}")?;
    list(f, "excluded, but sometimes touch", of_rule("excluded").filter(sometimes).map(share))
}

/// Writes a heading and its items, one per line; nothing without items.
fn list(f: &mut fmt::Formatter<'_>, heading: &str, items: impl Iterator<Item = String>) -> fmt::Result {
    let mut text = String::new();
    let mut count = 0;
    for item in items {
        writeln!(text, "    {item}")?;
        count += 1;
    }
    if count == 0 { Ok(()) } else { write!(f, "  {heading}: {count}\n{text}") }
}

/// Writes the lines that a description should contain.
pub fn write_excludes(f: &mut fmt::Formatter<'_>, format: Format, exclude: &[String]) -> fmt::Result {
    if exclude.is_empty() {
        return Ok(());
    }
    writeln!(f, "\nto skip unnecessary checks, add this to {}:\n  <contact>", place_of_excludes(format))?;
    exclude.iter().try_for_each(|line| writeln!(f, "    {line}"))?;
    writeln!(f, "  </contact>")
}
