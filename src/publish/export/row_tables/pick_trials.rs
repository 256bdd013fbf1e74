//! Rows of trials among neighbours: verdicts, contacts of the closed hand, other touched things, and moved neighbours.

use super::{
    column::{OfSample, RowColumn, matrix, numbers, sample_columns},
    row_table::{TableName, TableRow},
};
use crate::export::selected::SelectedSample;
use format::{AwakeNeighbour, PickTrial, PickTrials, PressedContact, PressedThing, Product};
use tables::{
    ColumnType::{Boolean, F64, F64s, Text, U32},
    Value,
};

/// One trial.
pub(super) struct TrialRow<'a> {
    sample: &'a SelectedSample<'a>,
    trial: &'a PickTrial,
}

/// One contact of the closed hand with the body.
pub(super) struct TouchRow<'a> {
    sample: &'a SelectedSample<'a>,
    candidate: u32,
    link: &'a str,
    contact: &'a PressedContact,
}

/// One thing other than the body that the hand pressed on.
pub(super) struct PressedRow<'a> {
    sample: &'a SelectedSample<'a>,
    candidate: u32,
    thing: &'a PressedThing,
}

/// One neighbour that could move.
pub(super) struct NeighbourRow<'a> {
    sample: &'a SelectedSample<'a>,
    candidate: u32,
    neighbour: &'a AwakeNeighbour,
}

impl<'a> TrialRow<'a> {
    /// The trials of a body, by candidate.
    pub fn all(sample: &'a SelectedSample<'a>, trials: &'a PickTrials) -> impl Iterator<Item = Self> {
        trials.trials.iter().map(move |trial| Self { sample, trial })
    }
}

impl<'a> TouchRow<'a> {
    /// The contacts of the hands that closed, by candidate.
    pub fn all(sample: &'a SelectedSample<'a>, trials: &'a PickTrials) -> impl Iterator<Item = Self> {
        trials.trials.iter().flat_map(move |PickTrial { candidate, contacts, .. }| {
            contacts.iter().map(move |contact| {
                let link = trials.links[contact.link as usize].as_str();
                Self { sample, candidate: *candidate, link, contact }
            })
        })
    }
}

impl<'a> PressedRow<'a> {
    /// Things that hands pressed on, by candidate, in order of time.
    pub fn all(sample: &'a SelectedSample<'a>, trials: &'a PickTrials) -> impl Iterator<Item = Self> {
        let row = move |(candidate, thing)| Self { sample, candidate, thing };
        trials.trials.iter().flat_map(|trial| trial.touched.iter().map(|thing| (trial.candidate, thing))).map(row)
    }
}

impl<'a> NeighbourRow<'a> {
    /// The neighbours that could move, by candidate.
    pub fn all(sample: &'a SelectedSample<'a>, trials: &'a PickTrials) -> impl Iterator<Item = Self> {
        let row = move |(candidate, neighbour)| Self { sample, candidate, neighbour };
        trials.trials.iter().flat_map(|trial| trial.awake.iter().map(|awake| (trial.candidate, awake))).map(row)
    }
}

impl OfSample for TrialRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfSample for TouchRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfSample for PressedRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfSample for NeighbourRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl TableRow for TrialRow<'_> {
    const TABLE: TableName = TableName {
        name: "pick_trials",
        row: "trial",
        group: 8192,
        meaning: "One row per trial among the neighbours. `candidate` joins it with `candidates.parquet`.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("candidate", U32, "index among the candidates of the body", |row: &Self| {
                Value::U32(row.trial.candidate)
            }),
            RowColumn::new(
                "verdict",
                Text,
                "held, starts_too_deep, not_touching, one_link, lost_approaching, lost_closing, lost_lifting, lost_holding, let_go, \
                 not_lifted or unstable",
                |row| Value::Text(row.trial.verdict.name()),
            ),
            RowColumn::new("held", Boolean, "whether the body was lifted and kept", |row| {
                Value::Boolean(row.trial.verdict.is_held())
            }),
            RowColumn::new("time", F64, "time of the decision, since the trial began [s]", |row| {
                Value::F64(row.trial.time)
            }),
            RowColumn::new("steps", U32, "steps of 2 ms that were simulated", |row| Value::U32(row.trial.steps)),
            RowColumn::new(
                "raised",
                F64,
                "height gain of the body's centre of mass at the end [m]",
                |row| Value::F64(row.trial.raised),
            ),
            RowColumn::new("penetration", F64, "deepest overlap of hand and body after the hand closed [m]", |row| {
                Value::F64(row.trial.penetration)
            }),
            RowColumn::optional(
                "object_from_base",
                F64s,
                "16 numbers: pose of the hand's base in the object's frame when it had closed [m]; none if it did not close",
                |row| row.trial.object_from_base.as_ref().map_or(Value::Empty, matrix),
            ),
            RowColumn::new("contacts", U32, "contacts of the closed hand with the body", |row| {
                Value::U32(row.trial.contacts.len() as u32)
            }),
        ]);
        columns
    }
}

impl TableRow for TouchRow<'_> {
    const TABLE: TableName = TableName {
        name: "pick_contacts",
        row: "contact",
        group: 32768,
        meaning: "One row per contact of a closed hand with its body.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("candidate", U32, "index among the candidates of the body", |row: &Self| {
                Value::U32(row.candidate)
            }),
            RowColumn::new("link", Text, "link of the hand that touches", |row| Value::Text(row.link)),
            RowColumn::new(
                "point",
                F64s,
                "3 numbers: on the body's surface, in the frame of the hand's base [m]",
                |row| numbers(Some(&row.contact.point)),
            ),
            RowColumn::new(
                "normal",
                F64s,
                "3 numbers: out of the body, unit length, in the frame of the hand's base",
                |row| numbers(Some(&row.contact.normal)),
            ),
            RowColumn::new("distance", F64, "from the body to the link [m], negative where it presses in", |row| {
                Value::F64(row.contact.distance)
            }),
            RowColumn::new("force", F64, "force along the normal [N]", |row| Value::F64(row.contact.force)),
        ]);
        columns
    }
}

impl TableRow for PressedRow<'_> {
    const TABLE: TableName = TableName {
        name: "pick_touches",
        row: "touch",
        group: 32768,
        meaning: "One row per thing that a hand pressed on in a trial, other than its body.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("candidate", U32, "index among the candidates of the body", |row: &Self| {
                Value::U32(row.candidate)
            }),
            RowColumn::new("thing", U32, "number of the body; 0 is the container or the plane", |row| {
                Value::U32(row.thing.thing)
            }),
            RowColumn::new(
                "phase",
                Text,
                "phase of the trial in which it was first touched: approach, closing, lift or hold",
                |row| Value::Text(row.thing.phase.name()),
            ),
            RowColumn::new("time", F64, "time of the first touch, since the trial began [s]", |row| {
                Value::F64(row.thing.time)
            }),
            RowColumn::new("force", F64, "largest normal force of one contact [N]", |row| Value::F64(row.thing.force)),
        ]);
        columns
    }
}

impl TableRow for NeighbourRow<'_> {
    const TABLE: TableName = TableName {
        name: "pick_neighbours",
        row: "neighbour",
        group: 32768,
        meaning: "One row per neighbour that could move in a trial.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("candidate", U32, "index among the candidates of the body", |row: &Self| {
                Value::U32(row.candidate)
            }),
            RowColumn::new("body", U32, "number of the neighbour, from 1", |row| Value::U32(row.neighbour.body)),
            RowColumn::new("moved", F64, "largest displacement of its centre of mass [m]", |row| {
                Value::F64(row.neighbour.moved)
            }),
            RowColumn::new("lifted", F64, "height gain of its centre of mass at the end [m]", |row| {
                Value::F64(row.neighbour.lifted)
            }),
        ]);
        columns
    }
}
