//! The facts of a reachability dataset: what `inspect` prints.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};
use toml::Value;

use crate::{
    chart::{grouped, percent},
    inspection::{InspectionHeader, job_table, open_of},
};
use format::{
    Product, ReachabilityField,
    dataset::{DatasetError, DatasetReader, Manifest},
    extras::read_field,
};
use kernel::{
    files::Folder,
    geom::{Axis, AxisUnit, Covering, FieldMetric, PoseLabel, Proof},
    ids::ObjectId,
    words::Show,
};

/// Content of a reachability dataset. `Display` writes text; serialising gives JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReachabilityFacts {
    /// Facts that the inspections of all products share.
    #[serde(flatten)]
    pub header: InspectionHeader,
    /// The robot.
    pub robot: ReachabilityRobotFacts,
    /// The axes of the grid of poses: x, y, z, then roll, pitch, yaw, or direction and roll.
    pub axes: Vec<AxisFacts>,
    /// Covering of all rotations by its orientations.
    pub covering: CoveringFacts,
    /// Solver of the inverse kinematics: `auto`, `closed_form`, `numeric`; empty if the job's text does not state it.
    pub solver: String,
    /// Test of collisions: `exact`, `mujoco`, `none`; empty if the job's text does not state it.
    pub collisions: String,
    /// Number of positions (samples).
    pub positions: u64,
    /// Poses in all.
    pub poses: u64,
    /// Poses by label.
    pub labels: BTreeMap<String, u64>,
    /// Poses by evidence for their label.
    pub proofs: BTreeMap<String, u64>,
    /// The signed distances.
    pub field: FieldFacts,
}

/// The robot of a reachability dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReachabilityRobotFacts {
    /// Name of the robot.
    pub name: String,
    /// The robot by content.
    pub id: ObjectId,
    /// The planning group, from the base outward.
    pub joints: Vec<String>,
    /// The site that reaches the poses.
    pub target: String,
    /// The frame of the poses.
    pub frame: String,
    /// Other joints that the job fixes at a value [rad or m].
    pub fixed: BTreeMap<String, f64>,
}

/// One axis of a grid of poses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisFacts {
    /// `x` to `yaw`, or `direction`.
    pub name: String,
    /// Centre of cell 0 [m or rad].
    pub first: f64,
    /// Distance between neighbouring centres [m or rad].
    pub step: f64,
    /// Cells.
    pub count: u64,
    /// `m`, `rad`, or `healpix` for indices in the ring order of HEALPix pixels.
    pub unit: String,
    /// Whether the axis is periodic.
    pub periodic: bool,
}

/// Covering of all rotations by the orientations of a grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CoveringFacts {
    /// Largest angle between any rotation and the nearest orientation [rad].
    pub radius: f64,
    /// Likewise for the directions of the target's x axis, if the grid is made of directions [rad].
    pub directions: Option<f64>,
    /// Method by which the radius was determined.
    pub method: String,
    /// Text about the covering.
    pub words: String,
}

/// Signed distances over a grid of poses, negative inside the reachable set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FieldFacts {
    /// `standard` or `thesis`.
    pub profile: String,
    /// `metres` or `cells`.
    pub unit: String,
    /// Metres that count as much as one radian; `None` if cells are counted.
    pub radian_weight: Option<f64>,
    /// Smallest value, deepest inside; `None` if all labels are equal, because JSON has no infinity.
    pub min: Option<f64>,
    /// Largest value, farthest outside; `None` likewise.
    pub max: Option<f64>,
    /// Mean value; `None` likewise.
    pub mean: Option<f64>,
}

/// The facts of a finished reachability dataset: reads manifest, tables and field.
///
/// # Errors
/// When the dataset is not finished or of another product, or a file is missing or damaged.
pub fn inspect_reachability(folder: &Folder) -> Result<ReachabilityFacts, DatasetError> {
    facts_of(&open_of(folder, Product::REACHABILITY)?, &read_field(folder)?)
}

pub(crate) fn facts_of(reader: &DatasetReader, field: &ReachabilityField) -> Result<ReachabilityFacts, DatasetError> {
    let (manifest, header) = (reader.manifest(), &field.header);
    let job = job_table(reader)?;
    let word = |key: &str| job.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
    let fixed = job.get("robot").and_then(|robot| robot.get("fixed")).and_then(Value::as_table);
    let fixed = fixed.into_iter().flatten().filter_map(|(joint, value)| Some((joint.clone(), value.as_float()?)));
    let counts = PoseCounts::of(manifest);
    let finite = |value: f64| value.is_finite().then_some(value);
    let distances = || field.distances.iter().map(|distance| f64::from(*distance));
    let axis = |axis: &Axis| AxisFacts {
        name: axis.name.to_owned(),
        first: axis.first,
        step: axis.step,
        count: axis.count as u64,
        unit: axis.unit.name().to_owned(),
        periodic: axis.periodic,
    };
    Ok(ReachabilityFacts {
        header: InspectionHeader::of(reader, headline(reader)?)?,
        robot: ReachabilityRobotFacts {
            name: header.robot.clone(),
            id: header.robot_id,
            joints: header.joints.clone(),
            target: header.target.clone(),
            frame: header.frame.clone(),
            fixed: fixed.collect(),
        },
        axes: header.grid.axes().iter().map(axis).collect(),
        covering: {
            let covering = header.grid.covering();
            let Covering { radius, directions, method } = covering;
            CoveringFacts { radius, directions, method: method.to_owned(), words: covering.to_string() }
        },
        solver: word("solver"),
        collisions: word("collisions"),
        positions: manifest.counts.samples,
        poses: counts.poses(),
        labels: counts.labels,
        proofs: counts.proofs,
        field: FieldFacts {
            profile: header.profile().to_owned(),
            unit: header.unit().to_owned(),
            radian_weight: match header.metric {
                FieldMetric::Metres { rho } => Some(rho),
                FieldMetric::Cells => None,
            },
            min: finite(distances().fold(f64::INFINITY, f64::min)),
            max: finite(distances().fold(f64::NEG_INFINITY, f64::max)),
            mean: finite(distances().sum::<f64>() / field.distances.len() as f64),
        },
    })
}

/// Number of reachable poses.
pub(super) fn headline(reader: &DatasetReader) -> Result<String, DatasetError> {
    let counts = PoseCounts::of(reader.manifest());
    let (reachable, poses) = (counts.labels.get(PoseLabel::Reachable.name()).copied().unwrap_or(0), counts.poses());
    let share = percent(reachable as f64 / poses.max(1) as f64);
    Ok(format!("{} of {} poses are reachable: {share}", grouped(reachable), grouped(poses)))
}

/// Counts of poses by the names of labels and of proofs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PoseCounts {
    pub labels: BTreeMap<String, u64>,
    pub proofs: BTreeMap<String, u64>,
}

impl PoseCounts {
    /// Counts of a manifest.
    pub fn of(manifest: &Manifest) -> Self {
        let count = |name: &str, fact: &str| (name.to_owned(), manifest.counts.fact(fact));
        Self {
            labels: PoseLabel::ALL.map(|label| count(label.name(), label.name())).into(),
            proofs: Proof::ALL.map(|proof| count(proof.name(), &format!("by_{}", proof.name()))).into(),
        }
    }

    /// Poses in all.
    pub fn poses(&self) -> u64 {
        self.labels.values().sum()
    }

    /// Lines with the counts: by label with their shares, then by evidence.
    pub fn in_words(&self) -> Vec<String> {
        let share = |count: u64| percent(count as f64 / self.poses().max(1) as f64);
        let row =
            |name: &str, count: u64| format!("{:>13} {} ({})", grouped(count), name.replace('_', " "), share(count));
        let count = |counts: &BTreeMap<String, u64>, name: &str| counts.get(name).copied().unwrap_or(0);
        let labels = PoseLabel::ALL.into_iter().rev().map(|label| row(label.name(), count(&self.labels, label.name())));
        let known = Proof::ALL.into_iter().map(|proof| (proof.name(), count(&self.proofs, proof.name())));
        let known = known.filter(|(_, count)| *count > 0).map(|(name, count)| row(&format!("known by {name}"), count));
        labels.chain(known).collect()
    }
}

impl fmt::Display for ReachabilityFacts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { robot, field, .. } = self;
        self.header.write_names(f)?;
        writeln!(f, "  job       {}", self.header.job)?;
        writeln!(f, "  robot     {}, content {}", robot.name.shown(), robot.id.0.short())?;
        writeln!(
            f,
            "  group     {} -> {}, poses in {}",
            robot.joints.join(", ").shown(),
            robot.target.shown(),
            robot.frame.shown()
        )?;
        for (joint, value) in &robot.fixed {
            writeln!(f, "  fixed     {joint} = {value}")?;
        }
        writeln!(f, "  solver    {}, collisions {}", self.solver, self.collisions)?;
        self.header.write_shards(f)?;
        writeln!(f)?;
        for AxisFacts { name, first, step, count, unit, periodic } in &self.axes {
            if unit == AxisUnit::HealPix.name() {
                writeln!(f, "  {name:<9} {count:>4} of the x axis, HEALPix centres in ring order")?;
                continue;
            }
            let wraps = if *periodic { ", periodic" } else { "" };
            writeln!(f, "  {name:<8}  {count:>4} from {first:.4} {unit} in steps of {step:.4} {unit}{wraps}")?;
        }
        writeln!(f, "  covering  {}", self.covering.words)?;
        writeln!(f, "\n{} poses at {} positions", grouped(self.poses), grouped(self.positions))?;
        let counts = PoseCounts { labels: self.labels.clone(), proofs: self.proofs.clone() };
        for line in counts.in_words() {
            writeln!(f, "{line}")?;
        }
        match (field.min, field.max, field.mean) {
            (Some(min), Some(max), Some(mean)) => {
                let FieldFacts { profile, unit, radian_weight, .. } = field;
                let weight = radian_weight.map_or_else(String::new, |rho| format!(", a radian counts {rho} m"));
                writeln!(
                    f,
                    "\nfield ({profile}): {min:.4} to {max:.4} {unit}, mean {mean:.4}; negative inside{weight}"
                )?;
            }
            _ => writeln!(f, "\nfield ({}): infinite, because all labels are equal", field.profile)?,
        }
        if let Some(speed) = &self.header.notes.speed {
            let rate = grouped(speed.rate().round() as u64);
            writeln!(f, "speed: {rate} positions/s: {:.1} s on {} threads", speed.seconds, speed.threads)?;
        }
        self.header.write_warnings(f)
    }
}
