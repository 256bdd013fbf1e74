//! Rows of trials over time: one per sample, those of the trial in the air before those on a table.

use super::{
    column::{OfSample, RowColumn, sample_columns},
    row_table::{TableName, TableRow},
};
use crate::export::selected::SelectedSample;
use format::{GraspTrials, Product, SeriesMoment, TrialSeries, trial_phases};
use tables::{
    ColumnType::{Boolean, F64, F64s, Text, U32},
    Value,
};

/// One sample of a trial.
pub(super) struct SeriesRow<'a> {
    sample: &'a SelectedSample<'a>,
    rank: u32,
    is_on_table: bool,
    phase: &'static str,
    time: f64,
    moment: SeriesMoment<'a>,
    /// Force of each link of the hand [N].
    forces: Vec<f64>,
}

impl OfSample for SeriesRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl<'a> SeriesRow<'a> {
    /// The samples of a run's trials, in the order of its grasps.
    pub fn all(sample: &'a SelectedSample<'a>, trials: &'a GraspTrials) -> impl Iterator<Item = Self> {
        let interval = trials.method.series_interval.unwrap_or_default();
        let stored = trials.trials.iter().flat_map(|trial| {
            let on_table = trial.table.iter().flat_map(|table| &table.series).map(|series| (true, series));
            trial.series.iter().map(|series| (false, series)).chain(on_table).map(|of| (trial.grasp, of))
        });
        stored.flat_map(move |(rank, (is_on_table, series)): (u32, (bool, &'a TrialSeries))| {
            // A body on a table is lifted off it, regardless of the directions of gravity in the air.
            let phases = trial_phases(if is_on_table { "lifted" } else { &trials.method.gravity });
            series.moments().map(move |moment| {
                let mut forces = vec![0.0; trials.links.len()];
                for (link, force) in series.links.iter().zip(moment.forces) {
                    forces[*link as usize] = f64::from(*force);
                }
                let time = f64::from(moment.number + 1) * interval;
                Self { sample, rank, is_on_table, phase: phases[moment.phase], time, moment, forces }
            })
        })
    }
}

impl TableRow for SeriesRow<'_> {
    const TABLE: TableName = TableName {
        name: "series",
        row: "sample",
        group: 32768,
        meaning: "One row per 20 ms of the trials of chosen grasps (`physics.series_share`), the trial in the air before the trial on a \
                  table. `graspmill.links` in the table's metadata is JSON: names of the links of `forces`.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
        RowColumn::new("rank", U32, "number of the grasp in its run", |row: &Self| Value::U32(row.rank)),
        RowColumn::new("on_table", Boolean, "whether the trial is on a table, else in the air", |row| {
            Value::Boolean(row.is_on_table)
        }),
        RowColumn::new(
            "phase",
            Text,
            "closing, lift or shake; under six directions of gravity closing, -z, z, -y, y, -x or x",
            |row| Value::Text(row.phase),
        ),
        RowColumn::new("time", F64, "since the trial began [s]", |row| Value::F64(row.time)),
        RowColumn::new(
            "forces",
            F64s,
            "one number per link of the hand: sum of its normal forces on the object [N]",
            |row| Value::F64s(row.forces.as_slice().into()),
        ),
        RowColumn::new(
            "moved",
            F64,
            "displacement of the object's centre of mass in the hand since the hand began to close; after the closing phase, \
             since gravity was switched on [m]",
            |row| Value::F64(f64::from(row.moment.moved)),
        ),
        RowColumn::new("turned", F64, "rotation of the object in the hand since then [rad]", |row| {
            Value::F64(f64::from(row.moment.turned))
        }),
    ]);
        columns
    }
}
