//! The facts of a dataset of grasps, from one pass over its runs.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use super::{
    trials::{TrialSums, TrialsInspection},
    ways::WayFacts,
};
use crate::{
    chart::{grouped, percent},
    grasp_types::TypeFacts,
    inspection::{InspectionHeader, open_of},
    tally::{Spread, SpreadRow},
};
use format::{
    Channel, Grasp, GraspFacts, GraspLadders, GraspMethod, GraspRun, GraspTrials, HandNames, LadderLabel, Product,
    dataset::{AssetRow, DatasetError, DatasetReader, Fate, Manifest, Selection, layout::ASSETS},
};
use kernel::{
    files::Folder,
    geom::RestingPose,
    ids::{ObjectId, SampleIndex},
    words::{GraspVerdict, STRETCHES, Show, counted},
};

/// Content of a dataset of grasps. `Display` writes text; serialising gives JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraspsInspection {
    /// Facts that the inspections of all products share.
    #[serde(flatten)]
    pub header: InspectionHeader,
    /// The hand; `None` if no run was kept.
    pub hand: Option<String>,
    /// Runs of the plan: kept + rejected.
    pub runs: u64,
    /// Runs that found a legal state.
    pub kept_runs: u64,
    /// Runs without a legal state, by reason.
    pub rejected: BTreeMap<String, u64>,
    /// Runs whose seed was given up early.
    pub given_up: u64,
    /// Runs over pairs of points or approaches that drew their whole budget before they had their states.
    #[serde(default)]
    pub budget_spent: u64,
    /// Closed states by verdict.
    pub verdicts: BTreeMap<String, u64>,
    /// Energies of all states.
    pub energy: Spread,
    /// Epsilon of the kept grasps, in the space that the job selects.
    pub epsilon: Spread,
    /// Kept grasps by type, the most common first.
    pub types: Vec<TypeFacts>,
    /// Kept grasps on a table.
    #[serde(default)]
    pub table: TableFacts,
    /// Closed grasps by the approaches on which the hand is free.
    #[serde(default)]
    pub ways: WayFacts,
    /// Outcomes of physical trials; absent without them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trials: Option<TrialsInspection>,
    /// Share of the steps that were accepted, in each tenth of the runs.
    pub acceptance: [f64; STRETCHES],
    /// Mean energy in each tenth of the runs; `None` before any legal state.
    pub course: [Option<f64>; STRETCHES],
    /// One row per object, sorted by name.
    pub objects: Vec<GraspObjectFacts>,
}

/// Kept grasps of objects that rest on a table, by whether the hand stays above the table while it approaches and closes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TableFacts {
    /// Kept grasps.
    pub grasps: u64,
    /// Kept grasps above the table in at least one pose of the object, approaching in the posture of the grasp.
    pub somewhere: u64,
    /// Kept grasps above the table in the object's most likely pose.
    pub likely: u64,
    /// Kept grasps above the table in at least one pose, approaching opened.
    pub opened: u64,
}

impl TableFacts {
    fn add(&mut self, grasp: &Grasp) {
        self.grasps += 1;
        self.somewhere += u64::from(grasp.clearances.iter().any(|[shaped, _]| *shaped >= 0.0));
        self.likely += u64::from(grasp.is_above_table(0));
        self.opened += u64::from(grasp.clearances.iter().any(|[_, opened]| *opened >= 0.0));
    }

    /// One line.
    pub fn in_words(&self) -> String {
        let share = |count: u64| percent(count as f64 / self.grasps.max(1) as f64);
        format!(
            "the hand stays above the table for {} of the kept grasps in some pose of the object ({} if it approaches opened), and for {} in the most likely pose",
            share(self.somewhere),
            share(self.opened),
            share(self.likely)
        )
    }
}

/// One object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraspObjectFacts {
    /// Name in the job.
    pub name: String,
    /// The object by content.
    pub object: ObjectId,
    /// Runs of annealing.
    pub runs: u64,
    /// Runs without a legal state.
    #[serde(default)]
    pub rejected: u64,
    /// Runs whose seed was given up early.
    pub given_up: u64,
    /// States with each verdict, in the order of [`GraspVerdict::ALL`].
    pub verdicts: [u64; GraspVerdict::ALL.len()],
    /// Tried grasps, and those that held in the air or whose graded label is held; zeros without trials.
    pub trials: [u64; 2],
    /// Poses in which the object rests on a table.
    #[serde(default)]
    pub resting: u64,
    /// Probability of the most likely pose; `None` if none is known.
    #[serde(default)]
    pub likely: Option<f64>,
    /// Facts of the object's kept grasps on a table.
    #[serde(default)]
    pub table: TableFacts,
    /// Lowest energy of any state.
    pub best_energy: Option<f64>,
    /// Highest epsilon of a kept grasp.
    pub best_epsilon: Option<f64>,
}

impl GraspObjectFacts {
    /// Total number of states.
    pub fn found(&self) -> u64 {
        self.verdicts.iter().sum()
    }
}

/// A grasp of a dataset: its run, and its index in the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct GraspIndex {
    pub run: SampleIndex,
    pub grasp: usize,
}

/// Input of a page, except the pictures.
pub(crate) struct GraspSurvey {
    pub facts: GraspsInspection,
    /// Energies of all states, then epsilons of kept grasps.
    pub energies: Vec<f64>,
    pub epsilons: Vec<f64>,
    /// Method and hand of the first run.
    pub method: Option<(GraspMethod, HandNames)>,
    /// Grasps of each object to show, with the reasons.
    pub picks: BTreeMap<ObjectId, Vec<(&'static str, GraspIndex)>>,
}

/// The facts of a finished dataset of grasps: reads tables, ledgers and every run, one chunk at a time.
///
/// # Errors
/// When the dataset is not finished or of another product, or a file is missing or damaged.
pub fn inspect_grasps(folder: &Folder) -> Result<GraspsInspection, DatasetError> {
    Ok(GraspSurvey::of(&open_of(folder, Product::GRASPS)?)?.facts)
}

/// Sums of one pass.
#[derive(Default)]
struct Pass {
    objects: BTreeMap<ObjectId, ObjectSums>,
    energies: Vec<f64>,
    epsilons: Vec<f64>,
    /// Kept grasps of each type, and those that held.
    types: BTreeMap<u32, [u64; 2]>,
    table: TableFacts,
    ways: WayFacts,
    trials: TrialSums,
    /// Accepted steps and steps; sum and count of mean energies.
    course: [(u64, f64, f64, u64); STRETCHES],
    method: Option<(GraspMethod, HandNames)>,
}

#[derive(Default)]
struct ObjectSums {
    runs: u64,
    rejected: u64,
    given_up: u64,
    verdicts: [u64; GraspVerdict::ALL.len()],
    trials: [u64; 2],
    table: TableFacts,
    /// The state with the lowest energy.
    lowest: Option<(f64, GraspIndex)>,
    /// The best and the worst kept grasp, by epsilon.
    extremes: Option<[(f64, GraspIndex); 2]>,
    /// Tried grasp with the highest epsilon for each of [`JUDGEMENTS`]: lifted off a table, otherwise held, failed.
    judged: [Option<(f64, GraspIndex)>; JUDGEMENTS.len()],
}

/// Outcomes of the trials of a grasp, in the order in which they are shown.
const JUDGEMENTS: [&str; 3] = ["lifted off a table", "held in the air", "failed in its trial"];

impl ObjectSums {
    /// One grasp that held and one that failed if there are trials; else the best and the worst kept grasp, or the state with the
    /// lowest energy.
    fn picks(&self) -> Vec<(&'static str, GraspIndex)> {
        let [lifted, held, failed] = [0, 1, 2].map(|row| self.judged[row].map(|(_, grasp)| (JUDGEMENTS[row], grasp)));
        if lifted.or(held).or(failed).is_some() {
            return lifted.or(held).into_iter().chain(failed).collect();
        }
        match (self.extremes, self.lowest) {
            (Some([(_, best), (_, worst)]), _) if best == worst => vec![("the only kept grasp", best)],
            (Some([(_, best), (_, worst)]), _) => vec![("highest epsilon", best), ("lowest epsilon", worst)],
            (None, Some((_, lowest))) => vec![("none kept: lowest energy", lowest)],
            (None, None) => Vec::new(),
        }
    }
}

impl Pass {
    fn run(&mut self, index: SampleIndex, run: &GraspRun) {
        if self.method.is_none() {
            self.method = Some((run.method.clone(), run.hand.clone()));
        }
        for (sums, stretch) in self.course.iter_mut().zip(&run.course) {
            sums.0 += u64::from(stretch.accepted);
            sums.1 += f64::from(run.steps) / STRETCHES as f64;
            if !stretch.mean_energy.is_nan() {
                sums.2 += stretch.mean_energy;
                sums.3 += 1;
            }
        }
        let object = self.objects.entry(run.sample.subject).or_default();
        for (rank, grasp) in run.grasps.iter().enumerate() {
            self.energies.push(grasp.energy);
            self.ways.add(grasp);
            object.verdicts[grasp.verdict as usize] += 1;
            let here = GraspIndex { run: index, grasp: rank };
            if object.lowest.is_none_or(|(lowest, _)| grasp.energy < lowest) {
                object.lowest = Some((grasp.energy, here));
            }
            if grasp.verdict != GraspVerdict::Kept {
                continue;
            }
            self.table.add(grasp);
            object.table.add(grasp);
            if let Some(kind) = grasp.kind {
                self.types.entry(kind).or_default()[0] += 1;
            }
            let epsilon = grasp.epsilon(&run.method);
            self.epsilons.push(epsilon);
            let here = (epsilon, here);
            let [best, worst] = object.extremes.get_or_insert([here; 2]);
            if epsilon > best.0 {
                *best = here;
            }
            if epsilon < worst.0 {
                *worst = here;
            }
        }
    }
}

impl Pass {
    fn trials(&mut self, index: SampleIndex, run: &GraspRun, trials: &GraspTrials) {
        self.trials.add(run, trials);
        for trial in &trials.trials {
            let is_lifted = trial.table.as_ref().is_some_and(|table| table.outcome.verdict.is_held());
            let judgement = if is_lifted { 0 } else { 2 - usize::from(trial.outcome.verdict.is_held()) };
            self.judge(index, run, trial.grasp, (trial.outcome.verdict.is_held(), Some(judgement)));
        }
    }

    /// Graded labels: a grasp that holds at some levels only is shown neither as held nor as failed.
    fn ladders(&mut self, index: SampleIndex, run: &GraspRun, ladders: &GraspLadders) {
        for ladder in &ladders.ladders {
            let judgement = match ladder.label() {
                LadderLabel::Held => Some(usize::from(ladder.resting_pose.is_none())),
                LadderLabel::Failed => Some(2),
                LadderLabel::Untested | LadderLabel::Partial | LadderLabel::Blocked => None,
            };
            self.judge(index, run, ladder.grasp, (ladder.label() == LadderLabel::Held, judgement));
        }
    }

    /// Counts a tried grasp; `judgement` is a row of [`JUDGEMENTS`] for which it may be shown.
    fn judge(&mut self, index: SampleIndex, run: &GraspRun, rank: u32, (is_held, judgement): (bool, Option<usize>)) {
        let object = self.objects.entry(run.sample.subject).or_default();
        object.trials = [object.trials[0] + 1, object.trials[1] + u64::from(is_held)];
        let Some(grasp) = run.grasps.get(rank as usize) else { return };
        if let Some(judged) = judgement.map(|row| &mut object.judged[row]) {
            let epsilon = grasp.epsilon(&run.method);
            if judged.is_none_or(|(best, _)| epsilon > best) {
                *judged = Some((epsilon, GraspIndex { run: index, grasp: rank as usize }));
            }
        }
        if let Some(kind) = grasp.kind.filter(|_| grasp.verdict == GraspVerdict::Kept) {
            self.types.entry(kind).or_default()[1] += u64::from(is_held);
        }
    }
}

impl GraspSurvey {
    /// Reads all of a dataset, one chunk at a time.
    pub fn of(reader: &DatasetReader) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        let mut pass = Pass::default();
        for shard in 0..manifest.shards.len() {
            for row in reader.ledger(shard)?.rows {
                let object = pass.objects.entry(row.sample.subject).or_default();
                object.runs += 1;
                object.rejected += u64::from(matches!(row.fate, Fate::Rejected { .. }));
                object.given_up += u64::from(GraspFacts::from(&row.facts).given_up);
            }
        }
        for sample in reader.iter(Selection::default()) {
            let sample = sample?;
            let run = sample.read::<GraspRun>()?;
            pass.run(sample.index, &run);
            if let Some(trials) = sample.find::<GraspTrials>()? {
                pass.trials(sample.index, &run, &trials);
            }
            if let Some(ladders) = sample.find::<GraspLadders>()? {
                pass.ladders(sample.index, &run, &ladders);
            }
        }
        let mut objects: Vec<GraspObjectFacts> = Vec::new();
        for row in reader.assets()?.objects {
            let resting = resting_poses(reader, &row)?;
            let sums = pass.objects.entry(row.object).or_default();
            objects.push(GraspObjectFacts {
                name: row.name,
                object: row.object,
                runs: sums.runs,
                rejected: sums.rejected,
                given_up: sums.given_up,
                verdicts: sums.verdicts,
                trials: sums.trials,
                resting: resting.len() as u64,
                likely: resting.first().map(|pose| pose.probability),
                table: sums.table,
                best_energy: sums.lowest.map(|(energy, _)| energy),
                best_epsilon: sums.extremes.map(|[best, _]| best.0),
            });
        }
        objects.sort_by(|a, b| a.name.cmp(&b.name));
        let facts = facts(reader, &mut pass, objects)?;
        let picks = pass.objects.iter().map(|(object, sums)| (*object, sums.picks())).collect();
        let Pass { energies, epsilons, method, .. } = pass;
        Ok(Self { facts, energies, epsilons, method, picks })
    }
}

fn facts(
    reader: &DatasetReader,
    pass: &mut Pass,
    objects: Vec<GraspObjectFacts>,
) -> Result<GraspsInspection, DatasetError> {
    let manifest = reader.manifest();
    let mut types: Vec<TypeFacts> = pass.types.iter().map(|(kind, count)| TypeFacts::new(*kind, *count)).collect();
    types.sort_by_key(|row| (std::cmp::Reverse(row.grasps), row.kind));
    Ok(GraspsInspection {
        header: InspectionHeader::of(reader, headline(reader.manifest()))?,
        hand: pass.method.as_ref().map(|(_, hand)| hand.name.clone()),
        runs: manifest.counts.samples,
        kept_runs: manifest.counts.kept,
        rejected: manifest.counts.rejected.clone(),
        given_up: manifest.counts.fact("given_up"),
        budget_spent: manifest.counts.fact("budget_spent"),
        verdicts: counted_verdicts(manifest),
        energy: Spread::of(pass.energies.clone()),
        epsilon: Spread::of(pass.epsilons.clone()),
        types,
        table: pass.table,
        ways: pass.ways,
        trials: std::mem::take(&mut pass.trials).finish(),
        acceptance: pass.course.map(|(accepted, steps, ..)| if steps > 0.0 { accepted as f64 / steps } else { 0.0 }),
        course: pass.course.map(|(.., sum, count)| (count > 0).then(|| sum / count as f64)),
        objects,
    })
}

/// Maximum number of types in a table, the most common ones.
pub(super) const SHOWN_TYPES: usize = 10;

/// Text about the types that a table does not list, with the number of their grasps; `None` if it lists all.
pub(super) fn more_types_in_words(types: &[TypeFacts]) -> Option<String> {
    let more = types.get(SHOWN_TYPES..).filter(|more| !more.is_empty())?;
    let grasps = more.iter().map(|row| row.grasps).sum();
    let are = if more.len() == 1 { "is" } else { "are" };
    Some(format!("{} with {} {are} not listed", counted(more.len() as u64, "more type"), counted(grasps, "grasp")))
}

/// Counts of states by the names of their verdicts.
pub(super) type VerdictCounts = BTreeMap<String, u64>;

/// Counts of a manifest's states by verdict.
pub(super) fn counted_verdicts(manifest: &Manifest) -> VerdictCounts {
    let count = |verdict: GraspVerdict| {
        let name = verdict.name();
        (name.to_owned(), manifest.counts.fact(&format!("grasps_{name}")))
    };
    GraspVerdict::ALL.map(count).into()
}

/// Numbers of all states and of kept grasps.
pub(super) fn found_and_kept(verdicts: &VerdictCounts) -> [u64; 2] {
    [verdicts.values().sum(), verdicts.get(GraspVerdict::Kept.name()).copied().unwrap_or(0)]
}

/// One line with the counts of grasps.
pub(super) fn grasp_counts_in_words(verdicts: &VerdictCounts) -> String {
    let count = |verdict: GraspVerdict| verdicts.get(verdict.name()).copied().filter(|count| *count > 0);
    let other =
        |verdict: GraspVerdict| Some(format!("{} {}", grouped(count(verdict)?), verdict.name().replace('_', " ")));
    let others: Vec<String> = GraspVerdict::ALL.into_iter().skip(1).filter_map(other).collect();
    let [found, kept] = found_and_kept(verdicts);
    let others = if others.is_empty() { String::new() } else { format!(" ({})", others.join(", ")) };
    let share = percent(kept as f64 / found.max(1) as f64);
    format!("{} grasps found, {} of them kept: {share}{others}", grouped(found), grouped(kept))
}

/// Line with the grasps that held in trials, if there are trials, and those with force closure.
pub(super) fn headline(manifest: &Manifest) -> String {
    let [found, kept] = found_and_kept(&counted_verdicts(manifest)).map(grouped);
    if manifest.channels().contains(&Channel::GRASP_LADDERS) {
        let [held, partial, failed, blocked, tried] =
            ["graded_held", "graded_partial", "graded_failed", "graded_blocked", "graded_tried"]
                .map(|fact| grouped(manifest.counts.fact(fact)));
        return format!(
            "{held} of {tried} grasps are labelled held, {partial} partial, {failed} failed, {blocked} blocked; {kept} of {found} \
             found have force closure and are kept"
        );
    }
    if !manifest.channels().contains(&Channel::GRASP_TRIALS) {
        return format!("{kept} of {found} grasps found have force closure and are kept");
    }
    let [held, tried] = ["grasps_held", "grasps_tried"].map(|fact| grouped(manifest.counts.fact(fact)));
    format!("{held} of {tried} grasps held in trials; {kept} of {found} found have force closure and are kept")
}

impl fmt::Display for GraspsInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.header.write_names(f)?;
        writeln!(f, "  job       {}", self.header.job)?;
        if let Some(hand) = &self.hand {
            writeln!(f, "  hand      {}", hand.shown())?;
        }
        let [runs, given_up] = [self.runs, self.given_up].map(grouped);
        write!(f, "  runs      {runs}, {given_up} given up early")?;
        match self.budget_spent {
            0 => writeln!(f)?,
            spent => writeln!(f, ", {} with their whole budget drawn", grouped(spent))?,
        }
        InspectionHeader::write_rejected(f, &self.rejected)?;
        self.header.write_shards(f)?;
        writeln!(f)?;
        if let Some(trials) = &self.trials {
            write!(f, "{trials}")?;
        }
        writeln!(f, "\n{}", grasp_counts_in_words(&self.verdicts))?;
        writeln!(f, "\n                         min        5 %     median       95 %        max       mean")?;
        for (name, spread) in [("energy of all", &self.energy), ("epsilon of kept", &self.epsilon)] {
            writeln!(f, "{}", SpreadRow::new(name, 4, spread))?;
        }
        writeln!(f, "  {}", self.table.in_words())?;
        self.ways.in_words().iter().try_for_each(|line| writeln!(f, "  {line}"))?;
        if !self.types.is_empty() {
            writeln!(f, "\ntype      grasps     held  spread  proximal  distal  roll")?;
        }
        for TypeFacts { kind, grasps, held, digits: [spread, a, b, c, d, e, g, roll] } in
            self.types.iter().take(SHOWN_TYPES)
        {
            let held = if self.trials.is_some() { percent(*held as f64 / *grasps as f64) } else { "-".to_owned() };
            let grasps = grouped(*grasps);
            writeln!(f, "{kind:>6} {grasps:>9} {held:>8}  {spread:>6}  {a:>4} {b} {c}  {d:>2} {e} {g}  {roll:>4}")?;
        }
        if let Some(more) = more_types_in_words(&self.types) {
            writeln!(f, "       {more}")?;
        }
        let wide = self.objects.iter().map(|object| object.name.chars().count()).max().unwrap_or(0).clamp(6, 40);
        writeln!(
            f,
            "\n{:<wide$}    runs  rejected  given up    found     kept     held  rests  on table  lowest energy  highest epsilon",
            "object"
        )?;
        let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.4}"));
        for object in &self.objects {
            let GraspObjectFacts {
                name,
                runs,
                rejected,
                given_up,
                verdicts,
                trials,
                resting,
                table,
                best_energy,
                best_epsilon,
                ..
            } = object;
            let on_table = table.somewhere;
            let (found, kept) = (object.found(), verdicts[GraspVerdict::Kept as usize]);
            let (energy, epsilon) = (number(*best_energy), number(*best_epsilon));
            let held = if trials[0] > 0 { trials[1].to_string() } else { "-".to_owned() };
            writeln!(
                f,
                "{name:<wide$}  {runs:>6}  {rejected:>8}  {given_up:>8} {found:>8} {kept:>8} {held:>8}  {resting:>5}  {on_table:>8}  \
                 {energy:>13}  {epsilon:>15}"
            )?;
        }
        if let Some(speed) = &self.header.notes.speed {
            writeln!(f, "\nspeed: {:.2} runs/s: {:.1} s on {} threads", speed.rate(), speed.seconds, speed.threads)?;
        }
        self.header.write_warnings(f)
    }
}

/// The resting poses of an object, the most likely first; empty if its row lists none.
pub(super) fn resting_poses(reader: &DatasetReader, row: &AssetRow) -> Result<Vec<RestingPose>, DatasetError> {
    let resting = row.resting().map_err(|error| DatasetError::Invalid {
        path: reader.folder().path_of(ASSETS),
        problem: error.to_string(),
        remedy: "delete manifest.json and `run` the job again: the shards are kept",
    })?;
    Ok(resting.map(|resting| resting.poses).unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_of_types_says_what_it_leaves_out() {
        let words = |count: u32| {
            let types: Vec<TypeFacts> = (0..count).map(|kind| TypeFacts::new(kind, [1, 0])).collect();
            more_types_in_words(&types)
        };
        assert_eq!((words(0), words(10)), (None, None));
        assert_eq!(words(11).as_deref(), Some("1 more type with 1 grasp is not listed"));
        assert_eq!(words(55).as_deref(), Some("45 more types with 45 grasps are not listed"));
    }
}
