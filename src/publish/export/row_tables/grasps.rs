//! Tables of grasp datasets: grasps, contacts of the closed hands, and trials.

use serde_json::{Map, Value as Json, json};

use super::{
    column::{OfSample, RowColumn, fact_columns, matrix, numbers, sample_columns},
    ladder::{OfLadder, ladder_columns},
    objects::{self, ObjectCounts},
    row_table::{RowTable, TableName, TableRow, WrittenTable, table_facts},
    series::SeriesRow,
    trials::TrialRow,
};
use crate::export::{
    error::ExportError,
    form::{ExportSelection, Written},
    selected::{SelectedSample, SelectedSamples},
    target::Target,
};
use format::{
    Channel, ClosedHand, Grasp, GraspLadder, GraspLadders, GraspRun, GraspTrial, GraspTrials, HeldContact,
    PressedContact, Product, TableTrial, WayObstacles, dataset::DatasetReader,
};
use kernel::{
    geom::{HandBase, Object, Pose},
    words::{BothWays, PathStage},
};
use tables::{
    ColumnType::{Boolean, F64, F64s, Text, Texts, U32, U64},
    Value,
};

/// Rows of a row group: 8 MB of grasps of a hand of a dozen joints.
const ROW_GROUP: usize = 4096;

/// Layout of the tables in words.
pub(super) const LAYOUT: &str = "\
    runs.parquet: one row per run; grasps.parquet: one row per grasp, kept or not, the runs in the dataset's order and the lowest \
    energy first in each; contacts.parquet: one row per contact of a closed hand, in the search and, where the \
    grasps were tried, in the trial; with trials trials.parquet: one row per trial, perturbed ones included, \
    and series.parquet: one row per 20 ms of chosen trials, with the forces of the links. \
    objects.parquet: one row per object. sample_index and rank join those of samples, object all. Poses are 16 numbers, 4 x 4 row-major, numpy.stack(column).reshape(-1, \
    4, 4)";

/// One grasp of a run.
pub(super) struct GraspRow<'a> {
    sample: &'a SelectedSample<'a>,
    rank: u32,
    grasp: &'a Grasp,
    trial: Option<&'a GraspTrial>,
    ladder: Option<&'a GraspLadder>,
    /// One value per resting pose of the object: the lowest point of the hand over the table, approaching in its posture and
    /// opened.
    clearances: [Vec<f64>; 2],
    /// The hand's base in the pregrasp.
    pregrasp: Pose<Object, HandBase>,
}

/// One run.
pub(super) struct RunRow<'a> {
    sample: &'a SelectedSample<'a>,
    run: &'a GraspRun,
}

/// One contact of a closed hand.
pub(super) struct ContactRow<'a> {
    sample: &'a SelectedSample<'a>,
    rank: u32,
    closed_in: &'static str,
    link: &'a str,
    contact: HeldContact,
    force: Option<f64>,
}

impl OfSample for RunRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfSample for GraspRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

impl OfLadder for GraspRow<'_> {
    fn ladder(&self) -> Option<&GraspLadder> {
        self.ladder
    }
}

impl OfSample for ContactRow<'_> {
    fn sample(&self) -> &SelectedSample<'_> {
        self.sample
    }
}

/// Writes the tables.
pub(super) fn write(
    reader: &DatasetReader,
    selection: &ExportSelection,
    target: &mut Target,
) -> Result<Written, ExportError> {
    let assets = reader.assets()?;
    let selected = SelectedSamples::of(reader, &assets.objects, selection)?;
    let (mut tables, mut counts): (Option<GraspTables>, _) = (None, ObjectCounts::default());
    selected.each(|stored, sample| {
        let (run, trials) = (stored.read::<GraspRun>()?, stored.find::<GraspTrials>()?);
        let ladders = stored.find::<GraspLadders>()?;
        counts.add([sample.id.subject]);
        let tables = match &mut tables {
            Some(tables) => tables,
            none => none.insert(GraspTables::create(reader, target, &run, trials.as_ref())?),
        };
        tables.push(sample, &run, trials.as_ref(), ladders.as_ref())
    })?;
    let objects = objects::write(reader, &assets.objects, &counts, target)?;
    let (grasps, facts) = tables.map_or(Ok((0, Map::new())), |tables| tables.finish(objects))?;
    let mut written = Written::selection(grasps, "grasps", selection);
    written.facts.extend(facts);
    Ok(written)
}

/// The tables while they are written.
struct GraspTables {
    runs: RowTable,
    grasps: RowTable,
    contacts: RowTable,
    trials: Option<RowTable>,
    series: Option<RowTable>,
}

impl GraspTables {
    /// Starts the tables; the first run and its trials determine joints, links and the tables.
    fn create(
        reader: &DatasetReader,
        target: &mut Target,
        run: &GraspRun,
        trials: Option<&GraspTrials>,
    ) -> Result<Self, ExportError> {
        let hand = &run.hand;
        let facts = [
            ("hand", json!(hand.name)),
            ("joints", json!(hand.joints)),
            ("driven", json!(hand.driven)),
            ("quality_space", json!(run.method.space)),
        ];
        let links = [facts[0].clone(), ("links", json!(hand.links))];
        let has_series = trials.is_some_and(|trials| trials.method.series_interval.is_some());
        let trials = trials.map(|_| RowTable::create::<TrialRow>(reader, target, &facts[..2])).transpose()?;
        let series = has_series.then(|| RowTable::create::<SeriesRow>(reader, target, &links)).transpose()?;
        Ok(Self {
            runs: RowTable::create::<RunRow>(reader, target, &facts[..1])?,
            grasps: RowTable::create::<GraspRow>(reader, target, &facts)?,
            contacts: RowTable::create::<ContactRow>(reader, target, &[])?,
            trials,
            series,
        })
    }

    /// Adds a run with its grasps.
    fn push(
        &mut self,
        sample: &SelectedSample<'_>,
        run: &GraspRun,
        trials: Option<&GraspTrials>,
        ladders: Option<&GraspLadders>,
    ) -> Result<(), ExportError> {
        self.runs.extend([RunRow { sample, run }])?;
        let tried = Tried { trials, ladders };
        self.grasps
            .extend((0..).zip(&run.grasps).map(|(rank, grasp)| GraspRow::new(sample, run, tried, (rank, grasp))))?;
        self.contacts.extend((0..).zip(&run.grasps).flat_map(|of| ContactRow::of_grasp(sample, run, tried, of)))?;
        if let (Some(table), Some(trials)) = (&mut self.trials, trials) {
            table.extend(TrialRow::all(sample, trials))?;
        }
        if let (Some(table), Some(trials)) = (&mut self.series, trials) {
            table.extend(SeriesRow::all(sample, trials))?;
        }
        Ok(())
    }

    /// Finishes the tables, except that of the objects; also returns the number of grasps.
    fn finish(self, objects: WrittenTable) -> Result<(u64, Map<String, Json>), ExportError> {
        let grasps = self.grasps.finish()?;
        let (count, mut tables) = (grasps.rows, vec![self.runs.finish()?, grasps, self.contacts.finish()?, objects]);
        for table in self.trials.into_iter().chain(self.series) {
            tables.push(table.finish()?);
        }
        Ok((count, table_facts(tables)))
    }
}

impl<'a> GraspRow<'a> {
    fn new(sample: &'a SelectedSample<'a>, run: &GraspRun, tried: Tried<'a>, (rank, grasp): (u32, &'a Grasp)) -> Self {
        let trial = tried.trials.and_then(|trials| trial_of(trials, rank));
        let ladder = tried.ladders.and_then(|ladders| ladders.ladder_of(rank));
        let clearances = [0, 1].map(|way| grasp.clearances.iter().map(|lowest| lowest[way]).collect());
        let pregrasp = grasp.object_from_base_back(run.method.stand_off);
        Self { sample, rank, grasp, trial, ladder, clearances, pregrasp }
    }
}

impl<'a> ContactRow<'a> {
    /// Contacts of a grasp in the search and, if it was tried, in the trial.
    fn of_grasp(
        sample: &'a SelectedSample<'a>,
        run: &'a GraspRun,
        tried: Tried<'a>,
        (rank, grasp): (u32, &'a Grasp),
    ) -> impl Iterator<Item = Self> {
        let searched = grasp.contacts.iter().map(move |contact| {
            let link = run.hand.links[contact.link as usize].as_str();
            Self { sample, rank, closed_in: "search", link, contact: *contact, force: None }
        });
        let pressed = tried.closed(rank).into_iter().flat_map(move |(closed, links)| {
            closed.contacts.iter().map(move |contact| {
                let PressedContact { link, point, normal, distance, force } = *contact;
                let (contact, link) = (HeldContact { link, point, normal, distance }, links[link as usize].as_str());
                Self { sample, rank, closed_in: "trial", link, contact, force: Some(force) }
            })
        });
        searched.chain(pressed)
    }
}

/// Trials of a run, by either method of labels.
#[derive(Clone, Copy)]
struct Tried<'a> {
    trials: Option<&'a GraspTrials>,
    ladders: Option<&'a GraspLadders>,
}

impl<'a> Tried<'a> {
    /// The closed hand of a grasp in its trial, with the names of its links.
    fn closed(self, rank: u32) -> Option<(&'a ClosedHand, &'a [String])> {
        let trial = self.trials.and_then(|trials| Some((trial_of(trials, rank)?.closed.as_ref()?, &trials.links)));
        let ladder = self.ladders.and_then(|ladders| Some((ladders.ladder_of(rank)?.closed.as_ref()?, &ladders.links)));
        trial.or(ladder).map(|(closed, links)| (closed, links.as_slice()))
    }
}

/// The trial of a grasp; `None` if it was not tried.
fn trial_of(trials: &GraspTrials, rank: u32) -> Option<&GraspTrial> {
    trials.trials.binary_search_by_key(&rank, |trial| trial.grasp).ok().map(|index| &trials.trials[index])
}

impl TableRow for RunRow<'_> {
    const TABLE: TableName = TableName {
        name: "runs",
        row: "run",
        group: 16384,
        meaning: "One row per kept run: progress of its search, and its number of grasps per verdict.",
    };

    fn columns(product: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend([
            RowColumn::new("asked_steps", U32, "steps of the search that the job sets", |row: &Self| {
                Value::U32(row.run.asked_steps)
            }),
            RowColumn::new("steps", U32, "steps that were taken; fewer if the seed was given up", |row| {
                Value::U32(row.run.steps)
            }),
            RowColumn::new("failed_steps", U32, "steps without a legal neighbour", |row| Value::U32(row.run.failed)),
            RowColumn::new("tries", U64, "neighbours that were evaluated", |row| Value::U64(row.run.tries)),
            RowColumn::new("potentials", U64, "tries whose wrench space was evaluated", |row| {
                Value::U64(row.run.potentials)
            }),
            RowColumn::new("resting_poses", U32, "resting poses of the object", |row| {
                Value::U32(row.run.resting_poses)
            }),
        ]);
        let facts = fact_columns(product, &columns);
        columns.extend(facts);
        columns
    }
}

impl TableRow for GraspRow<'_> {
    const TABLE: TableName = TableName {
        name: "grasps",
        row: "grasp",
        group: ROW_GROUP,
        meaning: "One row per grasp, kept or not. Datasets with `[physics]` in the job have the columns from `trial` on, or with \
                  `physics.labels = \"ladder\"` those from `graded_label` on; states without a trial are untested, not bad. `graspmill.joints`, `graspmill.driven`, `graspmill.hand` and `graspmill.quality_space` in \
                  the table's metadata are JSON: names of the joints of `joints` and of the driven joints, name of the hand, and the space \
                  of the epsilon that decides which grasps are kept. `grasp_frame` of the Python package (docs/python.md) returns the same \
                  table without an export.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend(hand_columns());
        columns.extend(way_columns());
        columns.extend(quality_columns());
        columns.extend(outcome_columns().map(|column| column.of_channel(Channel::GRASP_TRIALS)));
        columns.extend(ladder_columns().into_iter().map(|column| column.of_channel(Channel::GRASP_LADDERS)));
        columns
    }
}

impl TableRow for ContactRow<'_> {
    const TABLE: TableName = TableName {
        name: "contacts",
        row: "contact",
        group: 8 * ROW_GROUP,
        meaning: "One row per contact of a closed hand: of every grasp that the search closed, and, for tried grasps, of the hand in the \
                  simulation when gravity is switched on.",
    };

    fn columns(_: Product) -> Vec<RowColumn<Self>> {
        let mut columns = sample_columns();
        columns.extend(contact_columns());
        columns
    }
}

/// Columns of the verdict and of the hand's pose and joints.
fn hand_columns<'a>() -> [RowColumn<GraspRow<'a>>; 15] {
    [
        RowColumn::new("rank", U32, "number of the grasp in its run, lowest energy first", |row: &GraspRow<'a>| {
            Value::U32(row.rank)
        }),
        RowColumn::new(
            "verdict",
            Text,
            "kept, penetrates, open_hand, no_force_closure, low_quality or below_table",
            |row| Value::Text(row.grasp.verdict.name()),
        ),
        RowColumn::optional(
            "type",
            U32,
            "type of the grasp, the closed joints in bins; none for a hand without types",
            |row| row.grasp.kind.map_or(Value::Empty, Value::U32),
        ),
        RowColumn::optional(
            "point_scheme",
            Text,
            "scheme by which the first point of its pair, or the point of its approach, was drawn: area, thickness or cells; none without points",
            |row| row.grasp.point_scheme.map_or(Value::Empty, |scheme| Value::Text(scheme.name())),
        ),
        RowColumn::new(
            "object_from_base",
            F64s,
            "16 numbers: pose of the hand's base in the object's frame [m]",
            |row| matrix(&row.grasp.object_from_base),
        ),
        RowColumn::new(
            "object_from_approach",
            F64s,
            "16 numbers: pose of the approach frame in the object's frame, origin on the palm, z towards the object [m]",
            |row| matrix(&row.grasp.object_from_approach),
        ),
        RowColumn::new(
            "object_from_base_pregrasp",
            F64s,
            "16 numbers: pose of the hand's base in the pregrasp, back along the approach [m]",
            |row| matrix(&row.pregrasp),
        ),
        RowColumn::optional(
            "width",
            F64,
            "free width between the pads of the closed hand [m]; none for a hand without a width",
            |row| row.grasp.width.map_or(Value::Empty, Value::F64),
        ),
        RowColumn::new("opening", F64s, "driven joints of the opened hand [rad or m]", |row| {
            numbers(Some(&row.grasp.opening))
        }),
        RowColumn::new("posture", F64s, "driven joints before closing [rad or m]", |row| {
            numbers(Some(&row.grasp.posture))
        }),
        RowColumn::new("amplitudes", F64s, "amplitudes of the eigengrasps in that posture", |row| {
            numbers(Some(&row.grasp.amplitudes))
        }),
        RowColumn::new("joints_before", F64s, "all joints before closing [rad or m]", |row| {
            numbers(Some(&row.grasp.joints_before))
        }),
        RowColumn::new("joints", F64s, "all joints of the closed hand [rad or m]", |row| {
            numbers(Some(&row.grasp.joints))
        }),
        RowColumn::new(
            "clearances",
            F64s,
            "one number per resting pose of the object: lowest point of the hand over the table as it approaches in its posture \
             and closes [m]; empty if it penetrates",
            |row| numbers(Some(&row.clearances[0])),
        ),
        RowColumn::new(
            "clearances_opened",
            F64s,
            "the same if it approaches opened and takes its posture where it closes [m]",
            |row| numbers(Some(&row.clearances[1])),
        ),
    ]
}

/// Columns of the hand's approaches and their obstacles.
fn way_columns<'a>() -> [RowColumn<GraspRow<'a>>; 7] {
    [
        RowColumn::new(
            "free_ways",
            Text,
            "ways of approach that the object does not obstruct, without a table: opened, posture, both or none",
            |row: &GraspRow<'a>| Value::Text(row.grasp.free_ways(None).name()),
        ),
        RowColumn::optional(
            "object_in_way_posture",
            Text,
            "phase in which the object obstructs the hand that approaches in its posture: pregrasp or approach; none if it does \
             not, or if the hand penetrates",
            |row| object_in_way(row, |ways| ways.shaped),
        ),
        RowColumn::optional(
            "object_in_way_opened",
            Text,
            "the same for the hand that approaches opened and takes its posture where it closes: pregrasp, approach or shaping",
            |row| object_in_way(row, |ways| ways.opened),
        ),
        RowColumn::optional(
            "pregrasp",
            F64s,
            "driven joints of the pregrasp, without a table: as opening if that way is free, else as posture [rad or m]; none if \
             neither is",
            |row| numbers(row.grasp.pregrasp(None)),
        ),
        RowColumn::new(
            "free_ways_on_table",
            Texts,
            "one text per resting pose of the object: as free_ways, where the table obstructs below a clearance of 0",
            |row| Value::Texts(per_pose(row, |grasp, pose| grasp.free_ways(Some(pose)).name())),
        ),
        RowColumn::new(
            "obstacles_posture_on_table",
            Texts,
            "one text per resting pose of the object: obstacles for the hand that approaches in its posture: object, table, \
             object and table, or empty",
            |row| Value::Texts(per_pose(row, |grasp, pose| obstacles(grasp, pose, |ways| ways.shaped))),
        ),
        RowColumn::new("obstacles_opened_on_table", Texts, "the same for the hand that approaches opened", |row| {
            Value::Texts(per_pose(row, |grasp, pose| obstacles(grasp, pose, |ways| ways.opened)))
        }),
    ]
}

/// Part of an approach on which the object blocks the hand.
fn object_in_way(row: &GraspRow<'_>, way: fn(BothWays<Option<PathStage>>) -> Option<PathStage>) -> Value<'static> {
    row.grasp.object_in_way.and_then(way).map_or(Value::Empty, |stage| Value::Text(stage.name()))
}

/// A text for each resting pose of the object.
fn per_pose(row: &GraspRow<'_>, text: impl Fn(&Grasp, usize) -> &'static str) -> Vec<&'static str> {
    (0..row.grasp.clearances.len()).map(|pose| text(row.grasp, pose)).collect()
}

/// Obstacles for a hand on the table of a resting pose.
fn obstacles(grasp: &Grasp, pose: usize, way: fn(BothWays<WayObstacles>) -> WayObstacles) -> &'static str {
    grasp.obstacles(Some(pose)).map_or("", |ways| way(ways).words())
}

/// Columns of energies and quality.
fn quality_columns<'a>() -> [RowColumn<GraspRow<'a>>; 11] {
    [
        RowColumn::new("penetration", F64, "overlap of hand and mesh before closing [m]", |row: &GraspRow<'a>| {
            Value::F64(row.grasp.penetration)
        }),
        RowColumn::new("energy", F64, "energy that the search minimised; lower is better", |row| {
            Value::F64(row.grasp.energy)
        }),
        RowColumn::new("contact_energy", F64, "energy of the distances to the hand's contacts", |row| {
            Value::F64(row.grasp.contact_energy)
        }),
        RowColumn::new("potential", F64, "-epsilon of the weighted virtual contacts, or 1", |row| {
            Value::F64(row.grasp.potential)
        }),
        RowColumn::new(
            "epsilon_force",
            F64,
            "radius of the largest ball in the hull of contact forces; higher is better",
            |row| Value::F64(row.grasp.epsilon_force),
        ),
        RowColumn::new(
            "epsilon_wrench",
            F64,
            "radius of the largest ball in the hull of contact forces and torques; higher is better",
            |row| Value::F64(row.grasp.epsilon_wrench),
        ),
        RowColumn::new("volume", F64, "volume of that hull", |row| Value::F64(row.grasp.volume)),
        RowColumn::new("advance", F64, "distance that the hand moved along its approach before it closed [m]", |row| {
            Value::F64(row.grasp.advance)
        }),
        RowColumn::optional(
            "shift",
            F64s,
            "3 numbers: translation by which a gripper gave way, in its approach frame before that [m]; none if it did not",
            |row| numbers(row.grasp.shift.as_ref().map(<[f64; 3]>::as_slice)),
        ),
        RowColumn::optional(
            "turn",
            F64s,
            "3 numbers: rotation by which it gave way, an axis times an angle [rad]",
            |row| numbers(row.grasp.turn.as_ref().map(<[f64; 3]>::as_slice)),
        ),
        RowColumn::new("contacts", U32, "contacts of the closed hand", |row| {
            Value::U32(row.grasp.contacts.len() as u32)
        }),
    ]
}

fn on_table<'a>(row: &GraspRow<'a>) -> Option<&'a TableTrial> {
    row.trial?.table.as_ref()
}

/// Columns of the outcome of a grasp's trial.
fn outcome_columns<'a>() -> [RowColumn<GraspRow<'a>>; 11] {
    fn count(row: &GraspRow<'_>, count: fn(&GraspTrial) -> usize) -> Value<'static> {
        row.trial.map_or(Value::Empty, |trial| Value::U32(count(trial) as u32))
    }
    [
        RowColumn::optional("trial", Text, "verdict on the trial (trials.parquet); none if it was not tried", |row| {
            row.trial.map_or(Value::Empty, |trial| Value::Text(trial.outcome.verdict.name()))
        }),
        RowColumn::optional("held", Boolean, "whether it held in the trial; none if it was not tried", |row| {
            row.trial.map_or(Value::Empty, |trial| Value::Boolean(trial.outcome.verdict.is_held()))
        }),
        RowColumn::optional("perturbed", U32, "trials under perturbed conditions", |row| {
            count(row, |trial| trial.perturbed.len())
        }),
        RowColumn::optional("perturbed_held", U32, "number of perturbed trials that held", |row| {
            count(row, |trial| trial.perturbed.iter().filter(|run| run.outcome.verdict.is_held()).count())
        }),
        RowColumn::optional("roll_outs", U32, "further trials of chosen grasps", |row| {
            count(row, |trial| trial.roll_outs[0] as usize)
        }),
        RowColumn::optional(
            "roll_outs_held",
            U32,
            "number of roll-outs that held; their share is a probability",
            |row| count(row, |trial| trial.roll_outs[1] as usize),
        ),
        RowColumn::optional(
            "label",
            Text,
            "combined result of all trials: held, failed, borderline if they disagree, unconfirmed if none held but not all were \
             made, untested; none without trials",
            |row| row.trial.map_or(Value::Empty, |trial| Value::Text(trial.label().name())),
        ),
        RowColumn::optional(
            "robust",
            Boolean,
            "whether it also holds under every variant of the conditions; none if no variant was tried",
            |row| row.trial.and_then(GraspTrial::is_robust).map_or(Value::Empty, Value::Boolean),
        ),
        RowColumn::optional(
            "table_pose",
            U32,
            "resting pose of the object in its trial on a table; none without such a trial",
            |row| on_table(row).map_or(Value::Empty, |trial| Value::U32(trial.resting_pose)),
        ),
        RowColumn::optional("table_trial", Text, "verdict on the trial on a table", |row| {
            on_table(row).map_or(Value::Empty, |trial| Value::Text(trial.outcome.verdict.name()))
        }),
        RowColumn::optional("held_on_table", Boolean, "whether it lifted the object from the table", |row| {
            row.trial.and_then(GraspTrial::is_held_on_table).map_or(Value::Empty, Value::Boolean)
        }),
    ]
}

/// Columns of a contact.
fn contact_columns<'a>() -> [RowColumn<ContactRow<'a>>; 7] {
    [
        RowColumn::new("rank", U32, "number of the grasp in its run", |row: &ContactRow<'a>| Value::U32(row.rank)),
        RowColumn::new(
            "closed_in",
            Text,
            "what closed the hand: search, or trial when gravity is switched on",
            |row| Value::Text(row.closed_in),
        ),
        RowColumn::new("link", Text, "link of the hand that touches", |row| Value::Text(row.link)),
        RowColumn::new("point", F64s, "3 numbers: on the object's surface, in the object's frame [m]", |row| {
            numbers(Some(&row.contact.point))
        }),
        RowColumn::new("normal", F64s, "3 numbers: out of the object, unit length, in the object's frame", |row| {
            numbers(Some(&row.contact.normal))
        }),
        RowColumn::new("distance", F64, "from the object to the link [m], negative where it presses in", |row| {
            Value::F64(row.contact.distance)
        }),
        RowColumn::optional("force", F64, "force along the normal [N]; none in the search", |row| {
            row.force.map_or(Value::Empty, Value::F64)
        }),
    ]
}
