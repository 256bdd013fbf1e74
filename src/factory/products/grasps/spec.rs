//! The keys of a job for grasps.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::sections::spec::{HandSpec, ObjectsSpec, SplitSpec};

/// Defaults of the profile `standard`, and the ones that `thesis` changes.
pub const PROFILES: [&str; 2] = [include_str!("profiles/standard.toml"), include_str!("profiles/thesis.toml")];

/// A job that searches for grasps of a hand on each object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GraspsSpec {
    /// Sources of the objects: one or several `[[objects]]` entries, each with exactly one of `folder`, `list`,
    /// `package` and `built_in`.
    #[schemars(length(min = 1))]
    pub objects: Vec<ObjectsSpec>,
    /// The hand, which must have eigengrasps.
    // Without an `Option` a mistake in it would hide those of the other keys.
    #[schemars(required)]
    pub hand: Option<HandSpec>,
    /// Extent of the search.
    pub grasps: GraspRunsSpec,
    /// Simulated annealing of the hand's pose and posture. Its energy also rates the states of the other samplers.
    pub annealing: AnnealingSpec,
    /// Settings of `sampler = "uniform"`.
    pub uniform: UniformSpec,
    /// Settings of `sampler = "antipodal"`.
    pub antipodal: AntipodalSpec,
    /// Settings of `sampler = "approach"`.
    pub approach: ApproachSpec,
    /// Criteria for kept grasps, evaluated after the hand has closed. Rejected states stay in the dataset, with the
    /// reason.
    pub keep: KeepSpec,
    /// Physical trials: the hand closes on the free object in a simulation, lifts and shakes it. Default: no
    /// trials. Trials change no grasp.
    #[schemars(extend("examples" = [{ "friction": 0.5 }]))]
    pub physics: Option<PhysicsSpec>,
    /// Objects for training, validation and test; an item is a run.
    pub split: SplitSpec,
    /// The files of the dataset.
    pub shards: RunShardsSpec,
}

impl GraspsSpec {
    /// The standard defaults, without objects and a hand.
    pub fn standard() -> Self {
        form::decode_own(&format!("objects = []\n{}", PROFILES[0]))
    }
}

/// Extent of the search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GraspRunsSpec {
    /// Runs per object. Each run of annealing starts from a separate seed; seeds are spread evenly over the surface.
    #[schemars(range(min = 1, max = 10_000), extend("x-unit" = "runs"))]
    pub seeds: u32,
    /// Sampler that proposes states of the hand, which are then closed and evaluated.
    #[schemars(extend("examples" = ["uniform"]))]
    pub sampler: SamplerSpec,
}

/// Sampler that proposes states of the hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SamplerSpec {
    /// A search by simulated annealing: `[annealing]`.
    Annealing,
    /// Approaches spread evenly around an axis of the object, without a search: `[uniform]`.
    Uniform,
    /// The hand on two points on opposite sides of the object, without a search: `[antipodal]`. A gripper, whose two
    /// pads one motor slides towards each other, holds them between its pads; every other hand between two of its
    /// contacts that face each other in a posture of its eigengrasps.
    Antipodal,
    /// A hand with several fingers that comes along the surface normal of a point, without a search: `[approach]`. Its posture is one
    /// of its eigengrasps, a little wider than the part of the object across the approach: a pinch, a tripod or a wrap.
    Approach,
}

/// Approaches around an axis, at right angles to it, spread evenly: the opened hand moves in from afar until it meets
/// the object or its approach frame is on the axis, and closes there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UniformSpec {
    /// Grasps per run.
    #[schemars(range(min = 1, max = 1000), extend("x-unit" = "grasps"))]
    pub grasps: u32,
    /// The axis of each run.
    #[schemars(extend("examples" = ["any"]))]
    pub poses: AxisSpec,
    /// Rolls of the hand about its approach, which the grasps of a run use one after another. At 0 the approach frame's
    /// x axis is at right angles to the axis, to the right along the approach.
    #[schemars(length(min = 1, max = 1000), extend("x-unit" = "rad", "examples" = [[0.0]]))]
    pub rolls: Vec<f64>,
}

/// Axis of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AxisSpec {
    /// The object's z axis, through the middle of its box; each run at a different height, spread evenly.
    Upright,
    /// Any direction, drawn for each run, through the middle of the box: the object's z axis under any rotation.
    Any,
}

/// Hands on pairs of points whose line is within the friction cones of both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AntipodalSpec {
    /// Budget of a run: the largest number of pairs of points that it draws. With `depth = "any"` the run ends earlier,
    /// once it has `best` states.
    #[schemars(range(min = 1, max = 10_000_000), extend("x-unit" = "pairs"))]
    pub pairs: u32,
    /// Friction coefficient of these cones, separate from that of quality and trials. Cones narrower than those of the
    /// contacts leave friction in reserve.
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 10))]
    pub friction: f64,
    /// Number of states that a run keeps, no two alike.
    #[schemars(range(min = 1, max = 1000), extend("x-unit" = "states"))]
    pub best: u32,
    /// Position along the fingers at which the hand holds a pair.
    #[schemars(extend("examples" = ["any"]))]
    pub depth: PairDepthSpec,
    /// Support of the object while the hand closes.
    #[schemars(extend("examples" = ["table"]))]
    pub support: SupportSpec,
    /// With `support = "table"`: smallest height of the hand over the table, on the last 10 cm of its approach and while it
    /// closes.
    #[schemars(range(min = 0, max = 0.1), extend("x-unit" = "m"))]
    pub margin: f64,
    /// With `support = "table"`: resting pose of the object in each run.
    #[schemars(extend("examples" = ["most_likely"]))]
    pub resting_pose: RestingSpec,
}

/// Approaches along the normals of the object's surface, with the hand preshaped to the part that lies across. The hand comes from
/// afar until it meets the object, backs off by a drawn distance, and closes there; the way is free of the object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ApproachSpec {
    /// Budget of a run: the largest number of approaches that it draws. The run ends earlier, once it has `best` states.
    #[schemars(range(min = 1, max = 10_000_000), extend("x-unit" = "approaches"))]
    pub draws: u32,
    /// Largest angle between an approach and the inward normal of the point towards which the hand comes.
    #[schemars(range(min = 0, max = 1.5), extend("x-unit" = "rad"))]
    pub cone: f64,
    /// Coefficient of the friction cones within which the line between the two sides of a part is, separate from the friction of
    /// quality and trials.
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 10))]
    pub friction: f64,
    /// Number of states that a run keeps, no two alike.
    #[schemars(range(min = 1, max = 1000), extend("x-unit" = "states"))]
    pub best: u32,
}

/// Resting pose of an object in a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RestingSpec {
    /// Drawn for each run, by the probabilities of the poses.
    Sampled,
    /// The most probable one, in every run.
    MostLikely,
}

/// Position along the fingers at which a hand holds a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PairDepthSpec {
    /// Anywhere between the innermost contacts of a gripper's pads, or the middle of the two contacts of another hand,
    /// and 3 mm before the tips; the hand stays there. States are those that, once closed, both pads hold, or two links
    /// that press against each other; no two states are within 2 cm and 15 degrees of each other, also if one is
    /// rotated by 180 degrees about the approach of a gripper that is the same after it.
    Any,
    /// Half way along a gripper's pads; the hand then advances to the object by `keep.advance`. States are the best by
    /// energy, without duplicates as in annealing.
    Middle,
}

/// Support of an object while a hand closes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SupportSpec {
    /// No support: the hand can approach from any side.
    None,
    /// A table: the object rests on it in a resting pose, and the hand approaches from above or from the side and stays
    /// above the table.
    Table,
}

/// Simulated annealing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AnnealingSpec {
    /// Steps per run.
    #[schemars(range(min = 1, max = 10_000_000), extend("x-unit" = "steps"))]
    pub steps: u32,
    /// Energy to minimise.
    pub energy: EnergySpec,
    /// The space in which the potential's epsilon is measured.
    pub space: SpaceSpec,
    /// Friction coefficient of the potential.
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 10))]
    pub friction: f64,
    /// Factor of the potential, which brings both energies to the scale of the temperatures.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub potential_scale: f64,
    /// Whether the schedule of temperatures is stretched over the steps, so that short runs also end cold. If false,
    /// step i has the temperature of step i of 70,000.
    pub whole_schedule: bool,
    /// Whether only states of lower energy are accepted (plain descent), for comparison.
    #[schemars(extend("examples" = [true]))]
    pub descent: bool,
    /// The frame in which position and rotation of the hand are searched.
    pub frame: FrameSpec,
    /// Range of the amplitudes of the eigengrasps: `joints`, as far as the joints allow, or `{ clamped = 4.0 }`.
    #[schemars(extend("examples" = [{ "clamped": 4.0 }]))]
    pub amplitudes: AmplitudesSpec,
    /// Number of states that a run keeps, no two alike.
    #[schemars(range(min = 1, max = 1000), extend("x-unit" = "states"))]
    pub best: u32,
    /// Steps in a row without a feasible neighbour after which a run is abandoned.
    #[schemars(range(min = 1, max = 10_000_000), extend("x-unit" = "steps"))]
    pub max_failures: u32,
}

/// Energy that annealing minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EnergySpec {
    /// Distances of the virtual contacts from the surface, and the angles by which their normals point past it.
    Contact,
    /// The potential, -epsilon of the weighted virtual contacts, where it is below 0, otherwise the contact energy.
    ContactAndPotential,
}

/// A space of wrenches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpaceSpec {
    /// Forces only.
    Force,
    /// Forces and torques, with torques about the centre of mass and divided by the object's radius.
    Wrench,
}

/// A frame of the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrameSpec {
    /// Frame of the seed: origin on the surface, z along the inward normal, a random roll.
    Seed,
    /// Frame of the object, with its origin moved to the centre of its box.
    Object,
}

/// Range of amplitudes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum AmplitudesSpec {
    /// A range by name.
    Named(NamedAmplitudes),
    /// From minus to plus a number.
    Clamped(ClampedAmplitudes),
}

/// A named range of amplitudes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NamedAmplitudes {
    /// Range that the joints allow.
    Joints,
}

/// From minus to plus a number, joints held at their limits beyond.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClampedAmplitudes {
    /// The number.
    #[schemars(extend("exclusiveMinimum" = 0, "examples" = [4.0]))]
    pub clamped: f64,
}

/// Criteria for kept grasps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeepSpec {
    /// Friction coefficient of the quality.
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 10))]
    pub friction: f64,
    /// Edges of the friction cone.
    #[schemars(range(min = 3, max = 256), extend("x-unit" = "edges"))]
    pub cone_edges: u32,
    /// Makes the contacts soft fingers: largest torque about the normal per unit of normal force. Without it, contacts
    /// are hard points.
    #[schemars(extend("exclusiveMinimum" = 0, "examples" = [0.002], "x-unit" = "m"), range(max = 0.1))]
    pub torsion: Option<f64>,
    /// The wrench space in which force closure is required.
    pub space: SpaceSpec,
    /// Smallest epsilon in that space; force closure is required even at 0.
    #[schemars(range(min = 0, max = 1))]
    pub min_epsilon: f64,
    /// Largest advance of the hand along its approach before it closes. It stops where it meets the object; if it meets
    /// nothing, it closes where it started.
    #[schemars(range(min = 0, max = 0.2), extend("x-unit" = "m"))]
    pub advance: f64,
    /// Deepest overlap of hand and mesh before closing.
    #[schemars(range(min = 0, max = 0.01), extend("x-unit" = "m"))]
    pub max_penetration: f64,
    /// Keeps only grasps that are possible on a table: for at least one resting pose of the object, the hand stays
    /// above the table along the last 10 cm of its approach and while it closes.
    #[schemars(extend("examples" = [true]))]
    pub table: bool,
}

/// Physical trials of the states that a run found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhysicsSpec {
    /// States to try. All others are untried, which does not mean that they fail.
    #[serde(default)]
    #[schemars(extend("examples" = ["kept"]))]
    pub tried: TriedSpec,
    /// Coefficient of friction between object and hand.
    #[serde(default = "physics::friction")]
    #[schemars(range(min = 0, max = 10))]
    pub friction: f64,
    /// Mass of the object: `auto` uses `mass` or `material` of its entry or table, otherwise 3.7 kg/m^2 times the area
    /// of its convex hull; or a number for all objects [kg].
    #[serde(default = "physics::mass")]
    #[schemars(extend("examples" = [0.3]))]
    pub mass: MassSpec,
    /// Runs of a grasp under perturbed conditions, up to the first that differs from the trials before; all of them
    /// where its probability of success is measured. Standard deviations: friction 20 %, mass 10 %, the object's
    /// position 1 mm along each axis and its rotation 1 degree about each.
    #[serde(default = "physics::perturbed_runs")]
    #[schemars(range(min = 0, max = 1000), extend("x-unit" = "runs"))]
    pub perturbed_runs: u32,
    /// Share of the tried grasps whose probability of success is measured.
    #[serde(default = "physics::rollout_share")]
    #[schemars(range(min = 0, max = 1), extend("examples" = [0.1]))]
    pub rollout_share: f64,
    /// Number of further perturbed runs from which that probability is measured.
    #[serde(default = "physics::rollouts")]
    #[schemars(range(min = 1, max = 10_000), extend("x-unit" = "runs"))]
    pub rollouts: u32,
    /// Share of the held grasps that are also tried under seven variants: friction lower by 20 % and by 40 %, twice the
    /// mass, no support of the object while the hand closes, half the step, elliptic friction cones without `impratio`
    /// and iterations against slip, and MuJoCo's default solver settings. A grasp that holds under all of them is
    /// robust.
    #[serde(default = "physics::variant_share")]
    #[schemars(range(min = 0, max = 1))]
    pub variant_share: f64,
    /// Share of the tried grasps with stored time series of the links' forces on the object and of its drift in the
    /// hand, for the trial in the air and the one on the table: a sample every 20 ms, 2.6 kB per grasp of the Barrett
    /// hand.
    #[serde(default = "physics::series_share")]
    #[schemars(range(min = 0, max = 1))]
    pub series_share: f64,
    /// Trials that are repeated before their outcome becomes a label: grasps that held, once, with elliptic friction
    /// cones without `impratio` and iterations against slip, friction lower by 20 %, and no support of the object while
    /// the hand closes (`strict`: and then under MuJoCo's default solver settings); grasps that failed, with sharp
    /// edges of the hand's boxes, with the hand 2 mm nearer to the object, with friction higher by half, with half the
    /// mass, and by MuJoCo's own contacts of the mesh's triangles (where it has few enough), up to the first that
    /// holds. A grasp whose trials disagree is labelled borderline.
    #[serde(default = "physics::confirm")]
    pub confirm: ConfirmSpec,
    /// Maximum failed labels per held label in a run, rounded up, and at least one unless this is 0: a negative takes
    /// up to ten trials. All other grasps that fail their first trial stay unconfirmed.
    #[serde(default = "physics::failed_per_held")]
    #[schemars(range(min = 0, max = 1000), extend("examples" = [0.25]))]
    pub failed_per_held: f64,
    /// Gravity on the object once it is held.
    #[serde(default)]
    #[schemars(extend("examples" = ["six_directions"]))]
    pub gravity: GravitySpec,
    /// Also tries each state on a table: the object rests in the most likely of its resting poses in which the hand
    /// stays above the table, gravity is on, and only the table supports the object while the hand closes; then the
    /// hand lifts and shakes it.
    #[serde(default = "physics::table")]
    pub table: bool,
    /// Coefficient of friction between object and table, and between hand and table.
    #[serde(default = "physics::friction")]
    #[schemars(range(min = 0, max = 10))]
    pub table_friction: f64,
    /// Method by which trials become labels.
    #[serde(default)]
    #[schemars(extend("examples" = ["ladder"]))]
    pub labels: LabelsSpec,
}

/// Method by which trials become labels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LabelsSpec {
    /// Trials in the air, on a table, perturbed and confirmed must agree: strict, and many states are left without a label.
    #[default]
    Agreement,
    /// Graded: the share of four levels of rising difficulty at which the grasp holds, by bisection with two or three trials,
    /// and the reason of a failure. A state whose ways of approach are both obstructed fails without a trial. Keys of the
    /// other method have no effect.
    Ladder,
}

/// Choice of the states to try.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TriedSpec {
    /// Every state whose closed hand touches with at least two links, regardless of its quality: only the trial decides
    /// whether it holds.
    #[default]
    Closed,
    /// Kept grasps only: a state that fails the criteria of `[keep]` stays untried.
    Kept,
}

/// Choice of the trials to repeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConfirmSpec {
    /// Trials that held, also under MuJoCo's default settings, and trials that failed: for hands whose fingers press at
    /// an angle, such as those with three or more fingers.
    Strict,
    /// Trials that held and trials that failed.
    Both,
    /// Only trials that failed: enough for grippers that are also tried on a table.
    Failed,
    /// None.
    None,
}

/// Defaults of missing keys of `[physics]`: the section itself has none.
mod physics {
    use super::{AutoMass, ConfirmSpec, MassSpec};

    pub(super) fn friction() -> f64 {
        0.5
    }

    pub(super) fn mass() -> MassSpec {
        MassSpec::Auto(AutoMass::Auto)
    }

    pub(super) fn perturbed_runs() -> u32 {
        2
    }

    pub(super) fn rollout_share() -> f64 {
        0.04
    }

    pub(super) fn rollouts() -> u32 {
        10
    }

    pub(super) fn variant_share() -> f64 {
        0.1
    }

    pub(super) fn series_share() -> f64 {
        0.05
    }

    pub(super) fn confirm() -> ConfirmSpec {
        ConfirmSpec::Both
    }

    pub(super) fn failed_per_held() -> f64 {
        1.0
    }

    pub(super) fn table() -> bool {
        true
    }
}

/// Mass of an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum MassSpec {
    /// By the table of objects, otherwise by its convex hull.
    Auto(AutoMass),
    /// One mass for all objects [kg].
    Kilograms(#[schemars(range(min = 0.001, max = 100))] f64),
}

/// A mass by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AutoMass {
    /// By the table of objects, otherwise by its convex hull.
    Auto,
}

/// Gravity on a held object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GravitySpec {
    /// Gravity along -z of the object's mesh; the hand lifts it by 10 cm in 1 s and shakes it by 20 mm at 2, 3 and 4 Hz for 1
    /// s.
    #[default]
    Lifted,
    /// Gravity along -z, z, -y, y, -x and x, half a second each.
    SixDirections,
}

/// The files of the dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunShardsSpec {
    /// Runs per shard; by default all runs of one object. Does not affect samples.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "runs", "examples" = [100]))]
    pub runs: Option<u32>,
}
