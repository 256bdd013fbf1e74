//! Rows of simulated trials: one per trial, the perturbed ones after that under the given conditions.

use super::{
    column::{OfSample, RowColumn, matrix, numbers, sample_columns},
    row_table::{TableName, TableRow},
};
use crate::export::selected::SelectedSample;
use format::{ClosedHand, GraspTrial, GraspTrials, PerturbedTrial, Product, TrialOutcome};
use tables::{
    ColumnType::{Boolean, F64, F64s, Text, U32},
    Value,
};

/// One simulated trial.
pub(super) struct TrialRow<'a> {
    sample: &'a SelectedSample<'a>,
    rank: u32,
    /// Number of the perturbed trial, and its conditions; `None` under the given conditions.
    perturbed: Option<(u32, &'a PerturbedTrial)>,
    friction: f64,
    mass: f64,
    outcome: &'a TrialOutcome,
    closed: Option<&'a ClosedHand>,
    /// Translation [m] and rotation [rad] of the object per phase.
    slips: [Vec<f64>; 2],
}

impl OfSample for TrialRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl<'a> TrialRow<'a> {
    /// The trials of a run, in the order of its grasps.
    pub fn all(sample: &'a SelectedSample<'a>, trials: &'a GraspTrials) -> impl Iterator<Item = Self> {
        let slips = |outcome: &TrialOutcome| [0, 1].map(|way| outcome.slips.iter().map(|slip| slip[way]).collect());
        trials.trials.iter().flat_map(move |GraspTrial { grasp: rank, outcome, closed, perturbed, .. }| {
            let given = Self {
                sample,
                rank: *rank,
                perturbed: None,
                friction: trials.method.friction,
                mass: trials.method.mass,
                outcome,
                closed: closed.as_ref(),
                slips: slips(outcome),
            };
            let perturbed = (0..).zip(perturbed).map(move |(number, trial)| Self {
                sample,
                rank: *rank,
                perturbed: Some((number, trial)),
                friction: trial.friction,
                mass: trial.mass,
                outcome: &trial.outcome,
                closed: None,
                slips: slips(&trial.outcome),
            });
            [given].into_iter().chain(perturbed)
        })
    }
}

impl TableRow for TrialRow<'_> {
    const TABLE: TableName = TableName {
        name: "trials",
        row: "trial",
        group: 4096,
        meaning: "One row per simulated trial: first the trial under the given conditions, then the perturbed trials. Roll-outs are only \
                  counted, in `grasps.parquet`.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend(condition_columns());
        columns.extend(outcome_columns());
        columns
    }
}

/// Columns of the tried grasp, and of the conditions.
fn condition_columns<'a>() -> [RowColumn<TrialRow<'a>>; 6] {
    [
        RowColumn::new("rank", U32, "number of the grasp in its run", |row: &TrialRow<'a>| Value::U32(row.rank)),
        RowColumn::optional(
            "perturbation",
            U32,
            "number of the perturbed trial; none under the given conditions",
            |row| row.perturbed.map_or(Value::Empty, |(number, _)| Value::U32(number)),
        ),
        RowColumn::new("friction", F64, "coefficient of friction of the object against the hand", |row| {
            Value::F64(row.friction)
        }),
        RowColumn::new("mass", F64, "mass of the object [kg]", |row| Value::F64(row.mass)),
        RowColumn::optional(
            "shift",
            F64s,
            "3 numbers: offset of the object along the axes of the hand's base [m]; none under the given conditions",
            |row| numbers(row.perturbed.map(|(_, trial)| trial.shift.as_slice())),
        ),
        RowColumn::optional(
            "turn",
            F64s,
            "3 numbers: rotation of the object about its centre of mass, an axis times an angle [rad]; none under the given \
             conditions",
            |row| numbers(row.perturbed.map(|(_, trial)| trial.turn.as_slice())),
        ),
    ]
}

/// Columns of the outcome.
fn outcome_columns<'a>() -> [RowColumn<TrialRow<'a>>; 18] {
    [
        RowColumn::new(
            "verdict",
            Text,
            "held, starts_too_deep, not_touching, one_link, lost_closing, lost_lifting, lost_shaking, lost_turned, let_go or \
             unstable",
            |row| Value::Text(row.outcome.verdict.name()),
        ),
        RowColumn::new("held", Boolean, "whether the object stayed in the hand", |row| {
            Value::Boolean(row.outcome.verdict.is_held())
        }),
        RowColumn::new("time", F64, "time of the decision, since the trial began [s]", |row| {
            Value::F64(row.outcome.time)
        }),
        RowColumn::new("closing_time", F64, "duration of closing [s]", |row| Value::F64(row.outcome.closing_time)),
        RowColumn::new("closed_at_rest", Boolean, "whether the hand had come to rest by then", |row| {
            Value::Boolean(row.outcome.closed_at_rest)
        }),
        RowColumn::new("start_penetration", F64, "overlap of hand and mesh when it began [m]", |row| {
            Value::F64(row.outcome.penetration[0])
        }),
        RowColumn::new("closed_penetration", F64, "overlap when gravity is switched on [m]", |row| {
            Value::F64(row.outcome.penetration[1])
        }),
        RowColumn::new("shaken_penetration", F64, "deepest overlap after that [m]", |row| {
            Value::F64(row.outcome.penetration[2])
        }),
        RowColumn::new(
            "farthest",
            F64,
            "largest displacement of the object in the hand since gravity was switched on [m]",
            |row| Value::F64(row.outcome.farthest),
        ),
        RowColumn::new("slips", F64s, "displacement of the object in each phase that it survived [m]", |row| {
            numbers(Some(&row.slips[0]))
        }),
        RowColumn::new("turns", F64s, "rotation of the object in each phase that it survived [rad]", |row| {
            numbers(Some(&row.slips[1]))
        }),
        RowColumn::new("force", F64, "sum of the normal forces when gravity is switched on [N]", |row| {
            Value::F64(row.outcome.force)
        }),
        RowColumn::new("links", U32, "links of the hand that touch at the end", |row| Value::U32(row.outcome.links)),
        RowColumn::new("opened_by", F64, "share of their range that the fingers backed off before, 0 to 1", |row| {
            Value::F64(row.outcome.opened_by)
        }),
        RowColumn::new("drawn_back", F64, "distance that the hand drew back before [m]", |row| {
            Value::F64(row.outcome.drawn_back)
        }),
        RowColumn::new("warnings", U32, "warnings of MuJoCo", |row| Value::U32(row.outcome.warnings)),
        RowColumn::optional(
            "closed_joints",
            F64s,
            "all joints of the hand when gravity is switched on [rad or m]; none if it did not close, and for perturbed trials",
            |row| numbers(row.closed.map(|closed| closed.joints.as_slice())),
        ),
        RowColumn::optional(
            "closed_object_from_base",
            F64s,
            "16 numbers: pose of the hand's base in the object's frame then [m]",
            |row| row.closed.map_or(Value::Empty, |closed| matrix(&closed.object_from_base)),
        ),
    ]
}
