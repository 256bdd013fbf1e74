//! Tables of grasp datasets: grasps, contacts of the closed hands, and trials.

use serde_json::{Map, Value as Json, json};

use super::{
    column::{OfSample, RowColumn, RowTable, WrittenTable, matrix, numbers, sample_columns, table_facts},
    objects,
    series::{self, SeriesRow},
    trials::{self, TrialRow},
};
use crate::export::{
    error::ExportError,
    form::{ExportSelection, Written},
    selected::{SampleNames, SelectedSamples},
    target::Target,
};
use format::{
    Grasp, GraspRun, GraspTrial, GraspTrials, HeldContact, PressedContact, TableTrial, WayObstacles,
    dataset::DatasetReader,
};
use kernel::{
    geom::{HandBase, Object, Pose},
    words::{BothWays, PathStage},
};
use tables::{
    ColumnType::{Boolean, F64, F64s, Text, Texts, U32},
    Value,
};

/// Rows of a row group: 8 MB of grasps of a hand of a dozen joints.
const ROW_GROUP: usize = 4096;

/// Layout of the tables in words.
pub(super) const LAYOUT: &str = "\
    grasps.parquet: one row per grasp, kept or not, the runs in the dataset's order and the lowest energy \
    first in each; contacts.parquet: one row per contact of a closed hand, in the search and, where the \
    grasps were tried, in the trial; with trials trials.parquet: one row per trial, perturbed ones included, \
    and series.parquet: one row per 20 ms of chosen trials, with the forces of the links. \
    objects.parquet: one row per object. sample_index and rank join those of samples, object all. Poses are 16 numbers, 4 x 4 row-major, numpy.stack(column).reshape(-1, \
    4, 4)";

/// One grasp of a run.
struct GraspRow<'a> {
    names: &'a SampleNames<'a>,
    rank: u32,
    grasp: &'a Grasp,
    trial: Option<&'a GraspTrial>,
    /// One value per resting pose of the object: the lowest point of the hand over the table, as it comes shaped and as it
    /// comes opened.
    clearances: [Vec<f64>; 2],
    /// The hand's base in the pregrasp.
    pregrasp: Pose<Object, HandBase>,
}

/// One contact of a closed hand.
struct ContactRow<'a> {
    names: &'a SampleNames<'a>,
    rank: u32,
    closed_in: &'static str,
    link: &'a str,
    contact: HeldContact,
    force: Option<f64>,
}

impl OfSample for GraspRow<'_> {
    fn names(&self) -> &SampleNames<'_> {
        self.names
    }
}

impl OfSample for ContactRow<'_> {
    fn names(&self) -> &SampleNames<'_> {
        self.names
    }
}

/// Writes `grasps.parquet`, `contacts.parquet`, `objects.parquet` and, with trials, `trials.parquet` and `series.parquet`.
pub(super) fn write(
    reader: &DatasetReader,
    selection: &ExportSelection,
    target: &mut Target,
) -> Result<Written, ExportError> {
    let assets = reader.assets()?.objects;
    let selected = SelectedSamples::of(reader, &assets, selection)?;
    let mut tables: Option<GraspTables> = None;
    selected.each(|sample, names| {
        let (run, trials) = (sample.grasp_run()?, sample.grasp_trials()?);
        let tables = match &mut tables {
            Some(tables) => tables,
            none => none.insert(GraspTables::create(reader, target, &run, trials.as_ref())?),
        };
        tables.push(names, &run, trials.as_ref())
    })?;
    let objects = objects::write(reader, &assets, &selected, target)?;
    let (grasps, facts) = tables.map_or(Ok((0, Map::new())), |tables| tables.finish(objects))?;
    let mut written = Written::selection(grasps, "grasps", selection);
    written.facts.extend(facts);
    Ok(written)
}

/// The tables while they grow.
struct GraspTables {
    grasps: RowTable,
    contacts: RowTable,
    trials: Option<RowTable>,
    series: Option<RowTable>,
}

impl GraspTables {
    /// Begins the tables; the first run and its trials say what joints and links are called, and which tables there are.
    fn create(
        reader: &DatasetReader,
        target: &mut Target,
        run: &GraspRun,
        trials: Option<&GraspTrials>,
    ) -> Result<Self, ExportError> {
        let (hand, is_tried) = (&run.hand, trials.is_some());
        let facts = [
            ("hand", json!(hand.name)),
            ("joints", json!(hand.joints)),
            ("driven", json!(hand.driven)),
            ("quality_space", json!(run.method.space)),
        ];
        let grasps = ("grasps", "grasp", ROW_GROUP);
        let contacts = ("contacts", "contact", 8 * ROW_GROUP);
        let grasps = RowTable::create(grasps, &grasp_columns(is_tried), (reader, &mut *target), &facts)?;
        let contacts = RowTable::create(contacts, &contact_columns(), (reader, &mut *target), &[])?;
        let has_series = trials.is_some_and(|trials| trials.method.series_interval.is_some());
        let trials = is_tried.then(|| {
            RowTable::create(("trials", "trial", ROW_GROUP), &trials::columns(), (reader, &mut *target), &facts[..2])
        });
        let series = has_series.then(|| {
            let facts = [facts[0].clone(), ("links", json!(hand.links))];
            RowTable::create(("series", "sample", 8 * ROW_GROUP), &series::columns(), (reader, target), &facts)
        });
        Ok(Self { grasps, contacts, trials: trials.transpose()?, series: series.transpose()? })
    }

    /// Adds the grasps of a run.
    fn push(
        &mut self,
        names: &SampleNames<'_>,
        run: &GraspRun,
        trials: Option<&GraspTrials>,
    ) -> Result<(), ExportError> {
        let (grasp_columns, contact_columns) = (grasp_columns(trials.is_some()), contact_columns());
        for (rank, grasp) in (0..).zip(&run.grasps) {
            let trial = trials.and_then(|trials| trial_of(trials, rank));
            let clearances = [0, 1].map(|way| grasp.clearances.iter().map(|lowest| lowest[way]).collect());
            let pregrasp = grasp.object_from_base_back(run.method.stand_off);
            self.grasps.push(&grasp_columns, &GraspRow { names, rank, grasp, trial, clearances, pregrasp })?;
            for contact in &grasp.contacts {
                let link = run.hand.links[contact.link as usize].as_str();
                let row = ContactRow { names, rank, closed_in: "search", link, contact: *contact, force: None };
                self.contacts.push(&contact_columns, &row)?;
            }
            let closed = trial.and_then(|trial| trial.closed.as_ref());
            if let (Some(trials), Some(closed)) = (trials, closed) {
                for PressedContact { link, point, normal, distance, force } in closed.contacts.iter().copied() {
                    let contact = HeldContact { link, point, normal, distance };
                    let (link, force) = (trials.links[link as usize].as_str(), Some(force));
                    let row = ContactRow { names, rank, closed_in: "trial", link, contact, force };
                    self.contacts.push(&contact_columns, &row)?;
                }
            }
        }
        if let (Some(table), Some(trials)) = (&mut self.trials, trials) {
            let columns = trials::columns();
            for row in TrialRow::all(names, trials) {
                table.push(&columns, &row)?;
            }
        }
        if let (Some(table), Some(trials)) = (&mut self.series, trials) {
            let columns = series::columns();
            for row in SeriesRow::all(names, trials) {
                table.push(&columns, &row)?;
            }
        }
        Ok(())
    }

    /// Ends the tables, beside that of the objects; also returns the count of grasps.
    fn finish(self, objects: WrittenTable) -> Result<(u64, Map<String, Json>), ExportError> {
        let grasps = self.grasps.finish()?;
        let (count, mut tables) = (grasps.rows, vec![grasps, self.contacts.finish()?, objects]);
        for table in self.trials.into_iter().chain(self.series) {
            tables.push(table.finish()?);
        }
        Ok((count, table_facts(tables)))
    }
}

/// The trial of a grasp; `None` where it was not tried.
fn trial_of(trials: &GraspTrials, rank: u32) -> Option<&GraspTrial> {
    trials.trials.binary_search_by_key(&rank, |trial| trial.grasp).ok().map(|index| &trials.trials[index])
}

fn grasp_columns<'a>(is_tried: bool) -> Vec<RowColumn<GraspRow<'a>>> {
    let mut columns = sample_columns();
    columns.extend(hand_columns());
    columns.extend(way_columns());
    columns.extend(quality_columns());
    if is_tried {
        columns.extend(outcome_columns());
    }
    columns
}

/// Columns of the verdict and of the hand: where it is, and its joints.
fn hand_columns<'a>() -> [RowColumn<GraspRow<'a>>; 14] {
    [
        RowColumn::new("rank", U32, "number of the grasp in its run, the lowest energy first", |row: &GraspRow<'a>| {
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
            "type of the grasp, the closed joints in bins; none where the hand has none",
            |row| row.grasp.kind.map_or(Value::Empty, Value::U32),
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
            "between the pads of the closed hand [m]; none where it means nothing",
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
            "one number per resting pose of the object: lowest point of the hand over the table as it comes in its posture and \
             closes [m]; empty where it penetrates",
            |row| numbers(Some(&row.clearances[0])),
        ),
        RowColumn::new(
            "clearances_opened",
            F64s,
            "the same where it comes opened and takes on its posture there [m]",
            |row| numbers(Some(&row.clearances[1])),
        ),
    ]
}

/// Columns of the ways on which the hand comes, and of what is in these.
fn way_columns<'a>() -> [RowColumn<GraspRow<'a>>; 7] {
    [
        RowColumn::new(
            "free_ways",
            Text,
            "ways on which the object is not in the way of the hand, without a table: opened, posture, both or none",
            |row: &GraspRow<'a>| Value::Text(row.grasp.free_ways(None).name()),
        ),
        RowColumn::optional(
            "object_in_way_posture",
            Text,
            "part of the way on which the object is in the way of the hand that comes in its posture: pregrasp or approach; none where \
             it is not, or where the hand penetrates",
            |row| object_in_way(row, |ways| ways.shaped),
        ),
        RowColumn::optional(
            "object_in_way_opened",
            Text,
            "the same of the hand that comes opened and takes on its posture where it closes: pregrasp, approach or shaping",
            |row| object_in_way(row, |ways| ways.opened),
        ),
        RowColumn::optional(
            "pregrasp",
            F64s,
            "driven joints of the pregrasp, without a table: as opening where that way is free, else as posture [rad or m]; none where \
             neither is",
            |row| numbers(row.grasp.pregrasp(None)),
        ),
        RowColumn::new(
            "free_ways_on_table",
            Texts,
            "one text per resting pose of the object: as free_ways, with the table in the way below a clearance of 0",
            |row| Value::Texts(per_pose(row, |grasp, pose| grasp.free_ways(Some(pose)).name())),
        ),
        RowColumn::new(
            "obstacles_posture_on_table",
            Texts,
            "one text per resting pose of the object: object, table, object and table, or empty: what is in the way of the hand that \
             comes in its posture",
            |row| Value::Texts(per_pose(row, |grasp, pose| obstacles(grasp, pose, |ways| ways.shaped))),
        ),
        RowColumn::new("obstacles_opened_on_table", Texts, "the same of the hand that comes opened", |row| {
            Value::Texts(per_pose(row, |grasp, pose| obstacles(grasp, pose, |ways| ways.opened)))
        }),
    ]
}

/// Part of a way on which the object is in the way of the hand.
fn object_in_way(row: &GraspRow<'_>, way: fn(BothWays<Option<PathStage>>) -> Option<PathStage>) -> Value<'static> {
    row.grasp.object_in_way.and_then(way).map_or(Value::Empty, |stage| Value::Text(stage.name()))
}

/// A text for each resting pose of the object.
fn per_pose(row: &GraspRow<'_>, text: impl Fn(&Grasp, usize) -> &'static str) -> Vec<&'static str> {
    (0..row.grasp.clearances.len()).map(|pose| text(row.grasp, pose)).collect()
}

/// Obstacles in the way of a hand on the table of a resting pose.
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
        RowColumn::new("advance", F64, "way of the hand along its approach before it closed [m]", |row| {
            Value::F64(row.grasp.advance)
        }),
        RowColumn::optional(
            "shift",
            F64s,
            "3 numbers: translation by which a gripper gave way, in its approach frame before that [m]; none where it did not",
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

/// Columns of what came of a grasp's trial.
fn outcome_columns<'a>() -> [RowColumn<GraspRow<'a>>; 11] {
    fn count(row: &GraspRow<'_>, count: fn(&GraspTrial) -> usize) -> Value<'static> {
        row.trial.map_or(Value::Empty, |trial| Value::U32(count(trial) as u32))
    }
    [
        RowColumn::optional(
            "trial",
            Text,
            "verdict on the trial (trials.parquet); none where it was not tried",
            |row| row.trial.map_or(Value::Empty, |trial| Value::Text(trial.outcome.verdict.name())),
        ),
        RowColumn::optional("held", Boolean, "whether it held in the trial; none where it was not tried", |row| {
            row.trial.map_or(Value::Empty, |trial| Value::Boolean(trial.outcome.verdict.is_held()))
        }),
        RowColumn::optional("perturbed", U32, "trials under perturbed conditions", |row| {
            count(row, |trial| trial.perturbed.len())
        }),
        RowColumn::optional("perturbed_held", U32, "number of them that held", |row| {
            count(row, |trial| trial.perturbed.iter().filter(|run| run.outcome.verdict.is_held()).count())
        }),
        RowColumn::optional("roll_outs", U32, "further trials of chosen grasps", |row| {
            count(row, |trial| trial.roll_outs[0] as usize)
        }),
        RowColumn::optional("roll_outs_held", U32, "number of them that held; their share is a probability", |row| {
            count(row, |trial| trial.roll_outs[1] as usize)
        }),
        RowColumn::optional(
            "label",
            Text,
            "what all trials of the grasp say together: held, failed, borderline where they disagree, unconfirmed where none held but not all were made, untested; none without trials",
            |row| row.trial.map_or(Value::Empty, |trial| Value::Text(trial.label().name())),
        ),
        RowColumn::optional(
            "robust",
            Boolean,
            "whether it holds under every variant of the conditions too; none where no variant was tried",
            |row| row.trial.and_then(GraspTrial::is_robust).map_or(Value::Empty, Value::Boolean),
        ),
        RowColumn::optional(
            "table_pose",
            U32,
            "resting pose of the object in which it was tried on a table as well; none where it was not",
            |row| on_table(row).map_or(Value::Empty, |trial| Value::U32(trial.resting_pose)),
        ),
        RowColumn::optional("table_trial", Text, "verdict on that trial", |row| {
            on_table(row).map_or(Value::Empty, |trial| Value::Text(trial.outcome.verdict.name()))
        }),
        RowColumn::optional("held_on_table", Boolean, "whether it lifted the object from the table", |row| {
            row.trial.and_then(GraspTrial::is_held_on_table).map_or(Value::Empty, Value::Boolean)
        }),
    ]
}

fn contact_columns<'a>() -> Vec<RowColumn<ContactRow<'a>>> {
    let mut columns = sample_columns();
    columns.extend([
        RowColumn::new("rank", U32, "number of the grasp in its run", |row: &ContactRow<'a>| Value::U32(row.rank)),
        RowColumn::new("closed_in", Text, "what closed the hand: search, or trial when gravity came on", |row| {
            Value::Text(row.closed_in)
        }),
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
    ]);
    columns
}
