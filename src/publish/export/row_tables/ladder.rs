//! Columns of graded labels.

use super::column::RowColumn;
use format::{FailureReason, GraspLadder, LadderLevel, LevelResult, LevelTrial, TrialVerdict};
use tables::{
    ColumnType::{Boolean, F64, F64s, Text, Texts, U32},
    Value,
};

/// Imbalance of the normal forces below which the hand has closed symmetrically: they cancel but for a quarter.
const SYMMETRIC: f64 = 0.25;

/// A row about a grasp that may have a graded label.
pub(super) trait OfLadder {
    /// Levels of the grasp; `None` if it was not tried.
    fn ladder(&self) -> Option<&GraspLadder>;
}

/// A value of a tried grasp.
fn of<R: OfLadder>(row: &R, value: impl FnOnce(&GraspLadder) -> Value<'static>) -> Value<'static> {
    row.ladder().map_or(Value::Empty, value)
}

/// A value of the trial at the level nominal.
fn of_nominal<R: OfLadder>(row: &R, value: impl FnOnce(&LevelTrial) -> Value<'static>) -> Value<'static> {
    let nominal = row.ladder().and_then(|ladder| ladder.level(LadderLevel::Nominal)).and_then(LevelResult::trial);
    nominal.map_or(Value::Empty, value)
}

/// A text for each level; none for a blocked grasp.
fn texts(ladder: &GraspLadder, text: fn(&LevelResult) -> &'static str) -> Value<'static> {
    ladder.levels.as_ref().map_or(Value::Empty, |levels| Value::Texts(levels.iter().map(text).collect()))
}

/// A number for each level, NaN where no trial was made; none for a blocked grasp.
fn numbers(ladder: &GraspLadder, number: fn(&LevelTrial) -> f64) -> Value<'static> {
    let number = |level: &LevelResult| level.trial().map_or(f64::NAN, number);
    ladder.levels.as_ref().map_or(Value::Empty, |levels| Value::F64s(levels.iter().map(number).collect()))
}

fn state(level: &LevelResult) -> &'static str {
    match level {
        LevelResult::Tried(trial) => trial.outcome.verdict.name(),
        LevelResult::Inferred(true) => "inferred held",
        LevelResult::Inferred(false) => "inferred lost",
        LevelResult::Unknown => "unknown",
    }
}

/// Columns of the label and the levels, of datasets with graded labels.
pub(super) fn ladder_columns<R: OfLadder>() -> Vec<RowColumn<R>> {
    let mut columns = label_columns().into_iter().chain(level_columns()).collect::<Vec<_>>();
    columns.extend(closing_columns());
    columns
}

fn label_columns<R: OfLadder>() -> [RowColumn<R>; 7] {
    [
        RowColumn::optional(
            "graded_label",
            Text,
            "held: success of 0.75 or more; partial; failed: success of 0, and lost by the second motor law, too; blocked: no way of \
             approach is free; untested; none if it was not tried",
            |row| of(row, |ladder| Value::Text(ladder.label().name())),
        ),
        RowColumn::optional(
            "success",
            F64,
            "share of the four levels at which it holds, 0 for a blocked one; none if untested",
            |row| of(row, |ladder| ladder.success().map_or(Value::Empty, Value::F64)),
        ),
        RowColumn::optional("graded_trials", U32, "trials that were made for the label", |row| {
            of(row, |ladder| Value::U32(ladder.trials() as u32))
        }),
        RowColumn::optional(
            "reason",
            Text,
            "why it failed at the level nominal, or at the easiest level that it lost: blocked, nothing, pushed_away, ejected, \
             one_sided, slipped_lift, rotated_lift, slipped_shake, rotated_shake, let_go, unstable or starts_too_deep; none if it \
             lost no level",
            |row| of(row, |ladder| ladder.reason().map_or(Value::Empty, |reason| Value::Text(reason.name()))),
        ),
        RowColumn::optional(
            "graded_pose",
            U32,
            "resting pose of the object on whose table it was tried; none in the air",
            |row| of(row, |ladder| ladder.resting_pose.map_or(Value::Empty, Value::U32)),
        ),
        RowColumn::optional(
            "graded_obstacles",
            Texts,
            "2 texts: obstacles for the hand that approaches in its posture, and opened: object, table, object and table, or empty",
            |row| {
                of(row, |ladder| Value::Texts(vec![ladder.obstacles.shaped.words(), ladder.obstacles.opened.words()]))
            },
        ),
        RowColumn::optional(
            "second_law",
            Text,
            "verdict at the easiest level by the second motor law, of a grasp that lost that level",
            |row| of(row, |ladder| ladder.second_law.as_ref().map_or(Value::Empty, |trial| verdict(trial))),
        ),
    ]
}

fn verdict(trial: &LevelTrial) -> Value<'static> {
    let verdict: TrialVerdict = trial.outcome.verdict;
    Value::Text(verdict.name())
}

fn level_columns<R: OfLadder>() -> [RowColumn<R>; 5] {
    [
        RowColumn::optional(
            "levels",
            Texts,
            "4 texts, for the levels easy, nominal, adverse and hard: verdict of the trial, inferred held, inferred lost or unknown",
            |row| of(row, |ladder| texts(ladder, state)),
        ),
        RowColumn::optional("level_reasons", Texts, "4 texts: reason of a failed trial, or empty", |row| {
            of(row, |ladder| {
                texts(ladder, |level| level.trial().and_then(|trial| trial.reason).map_or("", FailureReason::name))
            })
        }),
        RowColumn::optional(
            "level_slips",
            F64s,
            "4 numbers: largest displacement of the object in the hand, followed up to 60 mm [m]; NaN without a trial",
            |row| of(row, |ladder| numbers(ladder, |trial| trial.outcome.farthest)),
        ),
        RowColumn::optional(
            "level_rotations",
            F64s,
            "4 numbers: largest rotation of the object in the hand [rad]; NaN without a trial",
            |row| of(row, |ladder| numbers(ladder, |trial| trial.rotation)),
        ),
        RowColumn::optional(
            "level_depths",
            F64s,
            "4 numbers: deepest overlap of hand and object from when the hand had closed [m]; NaN without a trial",
            |row| of(row, |ladder| numbers(ladder, LevelTrial::deepest)),
        ),
    ]
}

/// Columns of the closing hand at the level nominal.
fn closing_columns<R: OfLadder>() -> [RowColumn<R>; 5] {
    [
        RowColumn::optional(
            "closing_moved",
            F64,
            "displacement of the object while the hand closed, at the level nominal [m]",
            |row| of_nominal(row, |trial| Value::F64(trial.closing[0])),
        ),
        RowColumn::optional("closing_turned", F64, "rotation of the object then [rad]", |row| {
            of_nominal(row, |trial| Value::F64(trial.closing[1]))
        }),
        RowColumn::optional("closed_links", U32, "links that pressed on the object when the hand had closed", |row| {
            of_nominal(row, |trial| Value::U32(trial.closed_links))
        }),
        RowColumn::optional(
            "imbalance",
            F64,
            "magnitude of the sum of the normal forces then by the sum of their magnitudes, 0 to 1",
            |row| of_nominal(row, |trial| Value::F64(trial.imbalance)),
        ),
        RowColumn::optional(
            "symmetric",
            Boolean,
            "whether the hand closed symmetrically: an imbalance below 0.25",
            |row| of_nominal(row, |trial| Value::Boolean(trial.imbalance < SYMMETRIC)),
        ),
    ]
}
