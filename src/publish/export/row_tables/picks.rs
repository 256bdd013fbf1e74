//! Tables of picks: bodies, the evaluated grasps of each, and the outcomes of trials among the neighbours.

use std::collections::BTreeMap;

use serde_json::json;

use super::{
    bodies::{BodyName, BodyRow, ObjectNames, OfBody, body_columns},
    column::{HasContainer, OfSample, RowColumn, container_columns, fact_columns, matrix, numbers, sample_columns},
    objects::{self, ObjectCounts},
    pick_trials::{NeighbourRow, PressedRow, TouchRow, TrialRow},
    row_table::{RowTable, TableName, TableRow, table_facts},
};
use crate::export::{
    error::ExportError,
    form::{ExportSelection, Written},
    selected::{SelectedSample, SelectedSamples},
    target::Target,
};
use format::{
    Channel, DrawnPick, PickCandidate, PickCandidates, PickObstacle, PickPassage, PickSampling, PickTrial, PickTrials,
    Product, SceneContainer, dataset::DatasetReader,
};
use tables::{
    ColumnType::{Boolean, F64, F64s, Text, U32},
    Value,
};

/// Layout of the tables in words.
pub(super) const LAYOUT: &str = "\
    picks.parquet: one row per body whose grasps were evaluated; candidates.parquet: one row per evaluated grasp; bodies.parquet: one row per \
    body of the scene; with trials pick_trials.parquet: one row per trial, pick_contacts.parquet: one row per contact of the closed hand, \
    pick_touches.parquet: one row per other thing that the hand pressed on, pick_neighbours.parquet: one row per neighbour that could \
    move; objects.parquet: one row per object. sample_index and candidate join them. Poses are 16 numbers, 4 x 4 row-major";

/// One body with its grasps.
pub(super) struct PickRow<'a> {
    sample: &'a SelectedSample<'a>,
    body: BodyName<'a>,
    picks: &'a PickCandidates,
    hand: String,
    trials: Option<&'a PickTrials>,
    sampling: Option<&'a PickSampling>,
}

/// One grasp of a body.
pub(super) struct CandidateRow<'a> {
    sample: &'a SelectedSample<'a>,
    number: u32,
    candidate: &'a PickCandidate,
    nearest_free_rotation: Option<f64>,
    trial: Option<&'a PickTrial>,
    drawn: Option<&'a DrawnPick>,
}

/// The tables of trials while they grow.
struct TrialTables {
    trials: RowTable,
    contacts: RowTable,
    touches: RowTable,
    neighbours: RowTable,
}

/// The tables while they grow.
struct PickTables {
    picks: RowTable,
    candidates: RowTable,
    bodies: RowTable,
    trials: Option<TrialTables>,
}

/// Writes the tables.
pub(super) fn write(
    reader: &DatasetReader,
    selection: &ExportSelection,
    target: &mut Target,
) -> Result<Written, ExportError> {
    let assets = reader.assets()?;
    let names = ObjectNames::of(&assets.objects);
    let selected = SelectedSamples::of(reader, &assets.subjects, selection)?;
    let (mut tables, mut counts): (Option<PickTables>, _) = (None, ObjectCounts::default());
    selected.each(|stored, sample| {
        let (picks, trials) = (&stored.read::<PickCandidates>()?, stored.find::<PickTrials>()?);
        let sampling = stored.find::<PickSampling>()?;
        counts.add([picks.object()]);
        let tables = match &mut tables {
            Some(tables) => tables,
            none => none.insert(PickTables::create(reader, target, picks)?),
        };
        tables.push(sample, (picks, trials.as_ref(), sampling.as_ref()), &names)
    })?;
    let objects = objects::write(reader, &assets.objects, &counts, target)?;
    let mut written = Written::selection(selected.count(), "bodies", selection);
    let tables = tables.map_or(Ok(Vec::new()), PickTables::finish)?;
    written.facts.extend(table_facts(tables.into_iter().chain([objects])));
    Ok(written)
}

impl PickTables {
    /// Begins the tables; the first sample names hand and joints.
    fn create(reader: &DatasetReader, target: &mut Target, first: &PickCandidates) -> Result<Self, ExportError> {
        let facts = [("hand", json!(first.hand)), ("joints", json!(first.joints))];
        let has_trials = reader.manifest().channels().contains(&Channel::PICK_TRIALS);
        Ok(Self {
            picks: RowTable::create::<PickRow>(reader, target, &facts[..1])?,
            candidates: RowTable::create::<CandidateRow>(reader, target, &facts)?,
            bodies: RowTable::create::<BodyRow>(reader, target, &[])?,
            trials: has_trials.then(|| TrialTables::create(reader, target)).transpose()?,
        })
    }

    /// Adds a body with its grasps.
    fn push<'a>(
        &mut self,
        sample: &'a SelectedSample<'a>,
        (picks, trials, sampling): (&'a PickCandidates, Option<&'a PickTrials>, Option<&'a PickSampling>),
        names: &'a ObjectNames<'a>,
    ) -> Result<(), ExportError> {
        let (body, hand) = (BodyName::new(picks.body(), picks.object(), names), picks.hand_id.to_string());
        self.picks.extend([PickRow { sample, body, picks, hand, trials, sampling }])?;
        let tried = trials.iter().flat_map(|trials| &trials.trials);
        let tried: BTreeMap<u32, &PickTrial> = tried.map(|trial| (trial.candidate, trial)).collect();
        let rotations = picks.nearest_free_rotations();
        let row = |(number, candidate): (u32, &'a PickCandidate)| {
            let nearest_free_rotation = rotations[number as usize];
            let trial = tried.get(&number).copied();
            let drawn = sampling.and_then(|sampling| sampling.drawn.get(number as usize));
            CandidateRow { sample, number, candidate, nearest_free_rotation, trial, drawn }
        };
        self.candidates.extend((0..).zip(&picks.candidates).map(row))?;
        self.bodies.extend(BodyRow::all(sample, names, &picks.bodies))?;
        match (&mut self.trials, trials) {
            (Some(tables), Some(trials)) => tables.push(sample, trials),
            _ => Ok(()),
        }
    }

    /// Ends the tables.
    fn finish(self) -> Result<Vec<super::row_table::WrittenTable>, ExportError> {
        let Self { picks, candidates, bodies, trials } = self;
        let trials = trials
            .into_iter()
            .flat_map(|TrialTables { trials, contacts, touches, neighbours }| [trials, contacts, touches, neighbours]);
        [picks, candidates, bodies].into_iter().chain(trials).map(RowTable::finish).collect()
    }
}

impl TrialTables {
    fn create(reader: &DatasetReader, target: &mut Target) -> Result<Self, ExportError> {
        Ok(Self {
            trials: RowTable::create::<TrialRow>(reader, target, &[])?,
            contacts: RowTable::create::<TouchRow>(reader, target, &[])?,
            touches: RowTable::create::<PressedRow>(reader, target, &[])?,
            neighbours: RowTable::create::<NeighbourRow>(reader, target, &[])?,
        })
    }

    fn push<'a>(&mut self, sample: &'a SelectedSample<'a>, trials: &'a PickTrials) -> Result<(), ExportError> {
        self.trials.extend(TrialRow::all(sample, trials))?;
        self.contacts.extend(TouchRow::all(sample, trials))?;
        self.touches.extend(PressedRow::all(sample, trials))?;
        self.neighbours.extend(NeighbourRow::all(sample, trials))
    }
}

impl OfSample for PickRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfBody for PickRow<'_> {
    fn body(&self) -> &BodyName<'_> {
        &self.body
    }
}

impl HasContainer for PickRow<'_> {
    fn container(&self) -> &SceneContainer {
        &self.picks.container
    }
}

impl OfSample for CandidateRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

/// Columns of the conditions and the protocol of trials.
fn protocol_columns<'a>() -> [RowColumn<PickRow<'a>>; 16] {
    fn of(row: &PickRow<'_>, value: fn(&PickTrials) -> f64) -> Value<'static> {
        row.trials.map_or(Value::Empty, |trials| Value::F64(value(trials)))
    }
    let columns = [
        RowColumn::optional("mass", F64, "mass of the body [kg]", |row: &PickRow<'a>| of(row, |trials| trials.mass)),
        RowColumn::optional("friction", F64, "coefficient of friction of the body against the hand", |row| {
            of(row, |trials| trials.friction)
        }),
        RowColumn::optional(
            "torsion",
            F64,
            "torque about a contact's normal is at most friction times this times the force [m]",
            |row| of(row, |trials| trials.torsion),
        ),
        RowColumn::optional("rolling", F64, "rolling friction among bodies [m]", |row| {
            of(row, |trials| trials.rolling)
        }),
        RowColumn::optional("awake", Text, "bodies that may move: near or all", |row| {
            row.trials.map_or(Value::Empty, |trials| Value::Text(trials.awake.name()))
        }),
        RowColumn::optional("stand_off", F64, "distance along its approach at which the hand starts [m]", |row| {
            of(row, |trials| trials.protocol.approach[0])
        }),
        RowColumn::optional("approach_time", F64, "time of the approach [s]", |row| {
            of(row, |trials| trials.protocol.approach[1])
        }),
        RowColumn::optional("start_depth", F64, "deepest overlap at the start [m]", |row| {
            of(row, |trials| trials.protocol.start_depth)
        }),
        RowColumn::optional("closing_time", F64, "longest closing [s]", |row| {
            of(row, |trials| trials.protocol.closing_time)
        }),
        RowColumn::optional("lift", F64, "height of the lift [m]", |row| of(row, |trials| trials.protocol.lift[0])),
        RowColumn::optional("lift_time", F64, "time of the lift [s]", |row| of(row, |trials| trials.protocol.lift[1])),
        RowColumn::optional("hold_time", F64, "time for which the hand holds the body after the lift [s]", |row| {
            of(row, |trials| trials.protocol.hold_time)
        }),
        RowColumn::optional(
            "least_raised",
            F64,
            "smallest height gain of the centre of mass of a held body [m]",
            |row| of(row, |trials| trials.protocol.least_raised),
        ),
        RowColumn::optional("lost_distance", F64, "a body that moves farther in the hand is lost [m]", |row| {
            of(row, |trials| trials.protocol.lost[0])
        }),
        RowColumn::optional("lost_angle", F64, "a body that rotates more in the hand is lost [rad]", |row| {
            of(row, |trials| trials.protocol.lost[1])
        }),
        RowColumn::optional(
            "carried_height",
            F64,
            "a neighbour that is this much higher at the end was carried along [m]",
            |row| of(row, |trials| trials.protocol.carried_height),
        ),
    ];
    columns.map(|column| column.of_channel(Channel::PICK_TRIALS))
}

/// Columns of how the grasps of a body were sampled in its scene.
fn sampling_columns<'a>() -> [RowColumn<PickRow<'a>>; 4] {
    let columns = [
        RowColumn::optional(
            "cone_friction",
            F64,
            "coefficient of friction of the cone in which the second point of a pair lies",
            |row: &PickRow<'a>| row.sampling.map_or(Value::Empty, |sampling| Value::F64(sampling.friction)),
        ),
        RowColumn::optional("half_angle", F64, "largest angle between the approach and straight down [rad]", |row| {
            row.sampling.map_or(Value::Empty, |sampling| Value::F64(sampling.half_angle))
        }),
        RowColumn::optional("budget", U32, "poses at most", |row| {
            row.sampling.map_or(Value::Empty, |sampling| Value::U32(sampling.budget))
        }),
        RowColumn::optional(
            "blocked_by",
            Text,
            "obstacle of most poses at the last stage that one reached, of a body without a free grasp",
            |row| {
                let obstacle = row.sampling.and_then(|sampling| sampling.poses.blocked_by());
                obstacle.map_or(Value::Empty, |obstacle| Value::Text(PickObstacle::NAMES[obstacle]))
            },
        ),
    ];
    columns.map(|column| column.of_channel(Channel::PICK_SAMPLING))
}

/// Columns of the draw of a grasp that was sampled in its scene.
fn drawn_columns<'a>() -> [RowColumn<CandidateRow<'a>>; 4] {
    let columns = [
        RowColumn::optional(
            "scheme",
            Text,
            "draw of the first point between the pads: area, thickness or cells",
            |row: &CandidateRow<'a>| row.drawn.map_or(Value::Empty, |drawn| Value::Text(drawn.scheme.name())),
        ),
        RowColumn::optional(
            "points",
            F64s,
            "6 numbers: the two points between the pads, in the object's frame [m]",
            |row| numbers(row.drawn.map(|drawn| drawn.points.as_flattened())),
        ),
        RowColumn::optional("opening", F64, "distance between the opened pads [m]", |row| {
            row.drawn.map_or(Value::Empty, |drawn| Value::F64(drawn.opening))
        }),
        RowColumn::optional("depth", F64, "distance of the fingertips past the points along the approach [m]", |row| {
            row.drawn.map_or(Value::Empty, |drawn| Value::F64(drawn.depth))
        }),
    ];
    columns.map(|column| column.of_channel(Channel::PICK_SAMPLING))
}

impl TableRow for PickRow<'_> {
    const TABLE: TableName = TableName {
        name: "picks",
        row: "pick",
        group: 4096,
        meaning: "One row per body whose grasps were evaluated. Datasets with trials have the columns from `mass` to `carried_height` and \
                  the counts of trials; datasets whose grasps are sampled in the scene those from `cone_friction` to `blocked_by` and the \
                  counts of poses.",
    };

    fn columns(product: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend(body_columns());
        columns.extend(container_columns());
        columns.extend([
            RowColumn::new("hand", Text, "name of the hand", |row: &Self| Value::Text(&row.picks.hand)),
            RowColumn::new("hand_digest", Text, "digest of the hand's description and table", |row| {
                Value::Text(&row.hand)
            }),
            RowColumn::new(
                "take",
                Text,
                "choice of the stored grasps: tried, held, kept or closed; or sampled",
                |row| Value::Text(row.picks.take.name()),
            ),
            RowColumn::new(
                "rolls",
                U32,
                "number of directions about its closing line in which each grasp is evaluated",
                |row| Value::U32(row.picks.rolls),
            ),
            RowColumn::new("margin", F64, "distance that the hand keeps from everything except the body [m]", |row| {
                Value::F64(row.picks.margin)
            }),
        ]);
        columns.extend(protocol_columns());
        columns.extend(sampling_columns());
        let facts = fact_columns(product, &columns);
        columns.extend(facts);
        columns
    }
}

impl TableRow for CandidateRow<'_> {
    const TABLE: TableName = TableName {
        name: "candidates",
        row: "candidate",
        group: 8192,
        meaning: "One row per evaluated grasp. `run` and `rank` name the stored grasp (`item` and `rank` of `grasps.parquet`); where \
                  grasps are sampled in the scene, `rank` is the number of the pose, and there are `scheme` to `depth`. Datasets \
                  with trials have `trial` and `held`. `graspmill.joints` in the table's metadata is JSON: names of the joints of \
                  `closed_joints`.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("candidate", U32, "index among the candidates of the body", |row: &Self| {
                Value::U32(row.number)
            }),
            RowColumn::new("run", U32, "number of the run of the stored grasp", |row| Value::U32(row.candidate.run)),
            RowColumn::new("rank", U32, "number of the stored grasp in that run", |row| Value::U32(row.candidate.rank)),
            RowColumn::new("direction", U32, "number of its direction; 0 is the stored grasp", |row| {
                Value::U32(row.candidate.direction)
            }),
            RowColumn::new(
                "world_from_base",
                F64s,
                "16 numbers: pose of the hand's base in the world, where the hand closes [m]",
                |row| matrix(&row.candidate.world_from_base),
            ),
            RowColumn::new(
                "free_ways",
                Text,
                "ways of approach on which the hand touches nothing but the body: opened, posture, both or none",
                |row| Value::Text(row.candidate.free_ways().name()),
            ),
            RowColumn::optional(
                "nearest_free_rotation",
                F64,
                "smallest rotation about its closing line by which the grasp becomes free, in steps of the evaluated directions, from -pi to pi; 0 of a \
                 free one, none where no direction of the stored grasp is free [rad]",
                |row| row.nearest_free_rotation.map_or(Value::Empty, Value::F64),
            ),
        ]);
        columns.extend(posture_columns());
        columns.extend(opened_columns());
        columns.extend([RowColumn::optional(
            "closed_joints",
            F64s,
            "all joints of the hand closed on the body without the other bodies [rad or m]; none if no way is free",
            |row: &Self| numbers((!row.candidate.closed.is_empty()).then_some(row.candidate.closed.as_slice())),
        )]);
        let of_trials = [
            RowColumn::optional(
                "trial",
                Text,
                "verdict on its trial (pick_trials.parquet); none if it was not tried",
                |row: &Self| row.trial.map_or(Value::Empty, |trial| Value::Text(trial.verdict.name())),
            ),
            RowColumn::optional("held", Boolean, "whether it held in the trial; none if it was not tried", |row| {
                row.trial.map_or(Value::Empty, |trial| Value::Boolean(trial.verdict.is_held()))
            }),
        ];
        columns.extend(of_trials.map(|column| column.of_channel(Channel::PICK_TRIALS)));
        columns.extend(drawn_columns());
        columns
    }
}

/// Columns of the path of the hand that approaches in its posture.
fn posture_columns<'a>() -> [RowColumn<CandidateRow<'a>>; 5] {
    [
        RowColumn::new(
            "free",
            Boolean,
            "whether the hand that approaches in its posture touches nothing but the body",
            |row| is_free(&row.candidate.ways.shaped),
        ),
        RowColumn::optional(
            "blocked_by",
            Text,
            "obstacle for the hand that approaches in its posture: ground, container, own object or neighbour; none for a free \
             grasp",
            |row| obstacle(&row.candidate.ways.shaped),
        ),
        RowColumn::optional(
            "stage",
            Text,
            "part of the path with the obstacle: pregrasp, approach or closing",
            |row| stage(&row.candidate.ways.shaped),
        ),
        RowColumn::optional("neighbour", U32, "number of the body that is the obstacle", |row| {
            neighbour(&row.candidate.ways.shaped)
        }),
        RowColumn::new(
            "clearance",
            F64,
            "distance from the obstacle, negative where they overlap; for a free grasp the smallest distance from anything but \
             the body, up to 0.01 [m]",
            |row| Value::F64(row.candidate.ways.shaped.clearance),
        ),
    ]
}

/// Columns of the path of the hand that approaches opened.
fn opened_columns<'a>() -> [RowColumn<CandidateRow<'a>>; 5] {
    [
        RowColumn::new(
            "free_opened",
            Boolean,
            "as free, for the hand that approaches opened and takes its posture where it closes",
            |row| is_free(&row.candidate.ways.opened),
        ),
        RowColumn::optional("blocked_by_opened", Text, "as blocked_by, for the hand that approaches opened", |row| {
            obstacle(&row.candidate.ways.opened)
        }),
        RowColumn::optional(
            "stage_opened",
            Text,
            "part of the path with the obstacle: pregrasp, approach, shaping or closing",
            |row| stage(&row.candidate.ways.opened),
        ),
        RowColumn::optional("neighbour_opened", U32, "as neighbour, for the hand that approaches opened", |row| {
            neighbour(&row.candidate.ways.opened)
        }),
        RowColumn::new("clearance_opened", F64, "as clearance, for the hand that approaches opened [m]", |row| {
            Value::F64(row.candidate.ways.opened.clearance)
        }),
    ]
}

fn is_free(passage: &PickPassage) -> Value<'static> {
    Value::Boolean(passage.is_free())
}

fn obstacle(passage: &PickPassage) -> Value<'static> {
    passage
        .blocked
        .map_or(Value::Empty, |blocked| Value::Text(PickObstacle::NAMES[usize::from(blocked.by.number()) - 1]))
}

fn stage(passage: &PickPassage) -> Value<'static> {
    passage.blocked.map_or(Value::Empty, |blocked| Value::Text(blocked.stage.name()))
}

fn neighbour(passage: &PickPassage) -> Value<'static> {
    match passage.blocked.map(|blocked| blocked.by) {
        Some(PickObstacle::Neighbour(number)) => Value::U32(number),
        _ => Value::Empty,
    }
}
