//! The facts of a dataset of grasps, out of one pass over its runs.

use std::{collections::BTreeMap, fmt, path::Path};

use serde::{Deserialize, Serialize};

use super::{
    RunNotes, Spread,
    chart::{grouped, percent},
    survey::name_of,
    trials::{TrialSums, TrialsInspection},
};
use crate::{
    dataset::{DatasetError, DatasetReader, Fate, GraspCounts, NumberClass, Selection},
    ids::{Digest, JobDigest, ObjectId, Product, SampleIndex},
    record::{Grasp, GraspMethod, GraspRun, GraspTrials, GraspVerdict, HandNames, STRETCHES, type_digits},
};

/// What a dataset of grasps holds. `Display` is for people; serialised, it is for machines.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraspsInspection {
    /// The job's name; the folder's when the job has none.
    pub name: String,
    /// Program and version that made it.
    pub generator: String,
    /// Product: `grasps`.
    pub product: Product,
    /// Format on disk.
    pub format_version: u32,
    /// The digest that names the dataset.
    pub root: Digest,
    /// Digest of the samples of each class of numbers.
    pub classes: BTreeMap<NumberClass, Digest>,
    /// The job.
    pub job: JobDigest,
    /// The hand; `None` where no run was kept.
    pub hand: Option<String>,
    /// Runs of the plan: kept + rejected.
    pub runs: u64,
    /// Runs that found a legal state.
    pub kept_runs: u64,
    /// Runs that found none, by reason.
    pub rejected: BTreeMap<String, u64>,
    /// Runs whose seed was given up before they were over.
    pub given_up: u64,
    /// States that were closed, by verdict.
    pub verdicts: BTreeMap<String, u64>,
    /// Energies of all states.
    pub energy: Spread,
    /// Epsilon of the kept grasps, in the space that the job asks for.
    pub epsilon: Spread,
    /// Kept grasps by type, the most common first.
    pub types: Vec<TypeFacts>,
    /// Kept grasps on a table.
    #[serde(default)]
    pub table: TableFacts,
    /// What came of physical trials; absent without them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trials: Option<TrialsInspection>,
    /// Share of the steps that were accepted, in each tenth of the runs.
    pub acceptance: [f64; STRETCHES],
    /// Mean energy in each tenth of the runs; `None` before any legal state.
    pub course: [Option<f64>; STRETCHES],
    /// One row an object, sorted by name.
    pub objects: Vec<GraspedObject>,
    /// Shards.
    pub shards: u64,
    /// Size of all shards [bytes].
    pub shard_bytes: u64,
    /// Things a user should know.
    pub warnings: Vec<String>,
    /// What the run told about itself; part of no digest.
    pub notes: RunNotes,
}

/// A grasp type: the closed joints, binned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TypeFacts {
    /// Its number.
    pub kind: u32,
    /// Kept grasps of it.
    pub grasps: u64,
    /// Of them held in a trial; 0 without trials.
    pub held: u64,
    /// Its digits to base 5: spread, proximal joints of three fingers, their distal joints, roll of the wrist.
    pub digits: [u8; 8],
}

impl TypeFacts {
    pub(super) fn new(kind: u32, [grasps, held]: [u64; 2]) -> Self {
        Self { kind, grasps, held, digits: type_digits(kind).map(|digit| digit as u8) }
    }
}

/// Kept grasps of objects that rest on a table: where the hand stays above it while it comes and closes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TableFacts {
    /// Kept grasps.
    pub grasps: u64,
    /// Of them above the table in at least one pose of the object, the hand coming in the posture of the grasp.
    pub somewhere: u64,
    /// Of them above the table in the object's most likely pose.
    pub likely: u64,
    /// Of them above the table in at least one pose, the hand coming opened.
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
            "on a table the hand stays above it for {} of the kept grasps in some pose of the object ({} where it comes opened), \
             for {} in the most likely one",
            share(self.somewhere),
            share(self.opened),
            share(self.likely)
        )
    }
}

/// One object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraspedObject {
    /// Name in the job.
    pub name: String,
    /// The object by content.
    pub object: ObjectId,
    /// Runs of annealing.
    pub runs: u64,
    /// Of them rejected or given up.
    pub given_up: u64,
    /// States with each verdict, in the order of [`GraspVerdict::ALL`].
    pub verdicts: [u64; GraspVerdict::ALL.len()],
    /// Grasps that were tried, and of them held; zeros without trials.
    pub trials: [u64; 2],
    /// Poses in which it rests on a table.
    #[serde(default)]
    pub resting: u64,
    /// Probability of the most likely of them; `None` where none is known.
    #[serde(default)]
    pub likely: Option<f64>,
    /// Its kept grasps on a table.
    #[serde(default)]
    pub table: TableFacts,
    /// Lowest energy of any state.
    pub best_energy: Option<f64>,
    /// Highest epsilon of a kept grasp.
    pub best_epsilon: Option<f64>,
}

impl GraspedObject {
    /// States in all.
    pub fn found(&self) -> u64 {
        self.verdicts.iter().sum()
    }
}

/// A grasp of a dataset: which run, and its place among the run's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GraspPlace {
    pub run: SampleIndex,
    pub grasp: usize,
}

/// Everything that a page needs but the pictures.
pub(super) struct GraspSurvey {
    pub facts: GraspsInspection,
    /// Of all states, and of kept grasps.
    pub energies: Vec<f64>,
    pub epsilons: Vec<f64>,
    /// What the numbers were computed with, and the hand, of the first run.
    pub method: Option<(GraspMethod, HandNames)>,
    /// What to show of each object, and why.
    pub picks: BTreeMap<ObjectId, Vec<(&'static str, GraspPlace)>>,
}

/// The facts of a finished dataset of grasps: reads tables, ledgers and every run, one chunk at a time.
///
/// # Errors
/// When the dataset is not finished or of another product, or a file is missing or damaged.
pub fn inspect_grasps(folder: &Path) -> Result<GraspsInspection, DatasetError> {
    Ok(GraspSurvey::of(&DatasetReader::open(folder)?)?.facts)
}

/// What one pass gathers.
#[derive(Default)]
struct Pass {
    objects: BTreeMap<ObjectId, ObjectSums>,
    energies: Vec<f64>,
    epsilons: Vec<f64>,
    /// Kept grasps of each type, and of them held.
    types: BTreeMap<u32, [u64; 2]>,
    table: TableFacts,
    trials: TrialSums,
    /// Accepted steps and steps; sum and count of mean energies.
    course: [(u64, f64, f64, u64); STRETCHES],
    method: Option<(GraspMethod, HandNames)>,
}

#[derive(Default)]
struct ObjectSums {
    runs: u64,
    given_up: u64,
    verdicts: [u64; GraspVerdict::ALL.len()],
    trials: [u64; 2],
    /// Resting poses, and the probability of the first.
    resting: (u64, Option<f64>),
    table: TableFacts,
    /// The state of lowest energy.
    lowest: Option<(f64, GraspPlace)>,
    /// The best and the worst kept grasp, by epsilon.
    extremes: Option<[(f64, GraspPlace); 2]>,
}

impl ObjectSums {
    /// The best and the worst kept grasp; without one, the state of lowest energy.
    fn picks(&self) -> Vec<(&'static str, GraspPlace)> {
        match (self.extremes, self.lowest) {
            (Some([(_, best), (_, worst)]), _) if best == worst => vec![("the only", best)],
            (Some([(_, best), (_, worst)]), _) => vec![("best", best), ("worst", worst)],
            (None, Some((_, lowest))) => vec![("not kept", lowest)],
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
        let resting = &run.resting.poses;
        object.resting = (resting.len() as u64, resting.first().map(|pose| pose.probability));
        for (place, grasp) in run.grasps.iter().enumerate() {
            self.energies.push(grasp.energy);
            object.verdicts[grasp.verdict as usize] += 1;
            let here = GraspPlace { run: index, grasp: place };
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
    fn trials(&mut self, run: &GraspRun, trials: &GraspTrials) {
        self.trials.add(trials);
        let object = self.objects.entry(run.sample.subject).or_default();
        for trial in &trials.trials {
            let held = u64::from(trial.outcome.verdict.is_held());
            object.trials = [object.trials[0] + 1, object.trials[1] + held];
            if let Some(kind) = run.grasps.get(trial.grasp as usize).and_then(|grasp| grasp.kind) {
                self.types.entry(kind).or_default()[1] += held;
            }
        }
    }
}

impl GraspSurvey {
    /// Reads all of a dataset, one chunk at a time.
    pub fn of(reader: &DatasetReader) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        if manifest.product != Product::Grasps {
            return Err(DatasetError::Invalid {
                path: reader.folder().to_owned(),
                problem: format!("a dataset of {}, not of grasps", manifest.product),
                remedy: "`graspmill inspect` prints the facts of either",
            });
        }
        let mut pass = Pass::default();
        for shard in 0..manifest.shards.len() {
            for row in reader.ledger(shard)?.rows {
                let object = pass.objects.entry(row.sample.subject).or_default();
                let given_up = row.facts.grasps().is_some_and(|facts| facts.given_up);
                object.runs += 1;
                object.given_up += u64::from(given_up || matches!(row.fate, Fate::Rejected { .. }));
            }
        }
        for sample in reader.iter(Selection::default()) {
            let sample = sample?;
            let run = sample.grasp_run()?;
            pass.run(sample.index, &run);
            if let Some(trials) = sample.grasp_trials()? {
                pass.trials(&run, &trials);
            }
        }
        let mut objects: Vec<GraspedObject> = Vec::new();
        for row in reader.assets()?.objects {
            let sums = pass.objects.entry(row.object).or_default();
            objects.push(GraspedObject {
                name: row.name,
                object: row.object,
                runs: sums.runs,
                given_up: sums.given_up,
                verdicts: sums.verdicts,
                trials: sums.trials,
                resting: sums.resting.0,
                likely: sums.resting.1,
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
    objects: Vec<GraspedObject>,
) -> Result<GraspsInspection, DatasetError> {
    let manifest = reader.manifest();
    let counts = manifest.counts.grasps.clone().unwrap_or_default();
    let mut types: Vec<TypeFacts> = pass.types.iter().map(|(kind, count)| TypeFacts::new(*kind, *count)).collect();
    types.sort_by_key(|row| (std::cmp::Reverse(row.grasps), row.kind));
    Ok(GraspsInspection {
        name: name_of(reader)?,
        generator: manifest.generator.clone(),
        product: manifest.product,
        format_version: manifest.format_version,
        root: manifest.root,
        classes: manifest.classes.clone(),
        job: manifest.job,
        hand: pass.method.as_ref().map(|(_, hand)| hand.name.clone()),
        runs: manifest.counts.samples,
        kept_runs: manifest.counts.kept,
        rejected: manifest.counts.rejected.clone(),
        given_up: counts.given_up,
        verdicts: counts.verdicts,
        energy: Spread::of(pass.energies.clone()),
        epsilon: Spread::of(pass.epsilons.clone()),
        types,
        table: pass.table,
        trials: std::mem::take(&mut pass.trials).finish(),
        acceptance: pass.course.map(|(accepted, steps, ..)| if steps > 0.0 { accepted as f64 / steps } else { 0.0 }),
        course: pass.course.map(|(.., sum, count)| (count > 0).then(|| sum / count as f64)),
        objects,
        shards: manifest.shards.len() as u64,
        shard_bytes: manifest.shards.iter().map(|shard| shard.bytes).sum(),
        warnings: manifest.warnings.clone(),
        notes: RunNotes::read(reader.folder())?,
    })
}

/// One line with the counts of grasps.
pub fn grasp_counts_in_words(counts: &GraspCounts) -> String {
    let others = GraspVerdict::ALL.into_iter().skip(1).filter(|verdict| counts.of_verdict(*verdict) > 0);
    let others: Vec<String> =
        others.map(|verdict| format!("{} {}", grouped(counts.of_verdict(verdict)), verdict.name())).collect();
    let (found, kept) = (counts.found(), counts.of_verdict(GraspVerdict::Kept));
    let others = if others.is_empty() { String::new() } else { format!(" ({})", others.join(", ")) };
    let share = percent(kept as f64 / found.max(1) as f64);
    format!("{} grasps found, {} of them kept: {share}{others}", grouped(found), grouped(kept))
}

impl fmt::Display for GraspsInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {}, format {}, made by {}", self.name, self.product, self.format_version, self.generator)?;
        writeln!(f, "  root      {}", self.root)?;
        writeln!(f, "  job       {}", self.job)?;
        if let Some(hand) = &self.hand {
            writeln!(f, "  hand      {hand}")?;
        }
        let [runs, given_up, shards, bytes] = [self.runs, self.given_up, self.shards, self.shard_bytes].map(grouped);
        writeln!(f, "  runs      {runs}, {given_up} of them given up")?;
        for (reason, count) in &self.rejected {
            writeln!(f, "            {:>9} rejected: {reason}", grouped(*count))?;
        }
        writeln!(f, "  shards    {shards} with {bytes} bytes")?;
        let counts = GraspCounts { verdicts: self.verdicts.clone(), given_up: self.given_up, trials: None };
        writeln!(f, "\n{}", grasp_counts_in_words(&counts))?;
        writeln!(f, "\n                         min        5 %     median       95 %        max       mean")?;
        for (name, spread) in [("energy of all", &self.energy), ("epsilon of kept", &self.epsilon)] {
            let Spread { min, p05, median, p95, max, mean } = spread;
            write!(f, "  {name:<18}")?;
            for value in [min, p05, median, p95, max, mean] {
                write!(f, " {value:>10.4}")?;
            }
            writeln!(f)?;
        }
        writeln!(f, "  {}", self.table.in_words())?;
        if let Some(trials) = &self.trials {
            write!(f, "{trials}")?;
        }
        if !self.types.is_empty() {
            writeln!(f, "\ntype      grasps     held  spread  proximal  distal  roll")?;
        }
        for TypeFacts { kind, grasps, held, digits: [spread, a, b, c, d, e, g, roll] } in self.types.iter().take(8) {
            let held = if self.trials.is_some() { percent(*held as f64 / *grasps as f64) } else { "-".to_owned() };
            let grasps = grouped(*grasps);
            writeln!(f, "{kind:>6} {grasps:>9} {held:>8}  {spread:>6}  {a:>4} {b} {c}  {d:>2} {e} {g}  {roll:>4}")?;
        }
        let wide = self.objects.iter().map(|object| object.name.chars().count()).max().unwrap_or(0).clamp(6, 40);
        writeln!(
            f,
            "\n{:<wide$}    runs  given up    found     kept     held  rests  on table  best energy  best epsilon",
            "object"
        )?;
        let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.4}"));
        for object in &self.objects {
            let GraspedObject {
                name, runs, given_up, verdicts, trials, resting, table, best_energy, best_epsilon, ..
            } = object;
            let on_table = table.somewhere;
            let (found, kept) = (object.found(), verdicts[GraspVerdict::Kept as usize]);
            let (energy, epsilon) = (number(*best_energy), number(*best_epsilon));
            let held = if trials[0] > 0 { trials[1].to_string() } else { "-".to_owned() };
            writeln!(
                f,
                "{name:<wide$}  {runs:>6}  {given_up:>8} {found:>8} {kept:>8} {held:>8}  {resting:>5}  {on_table:>8}  \
                 {energy:>11}  {epsilon:>12}"
            )?;
        }
        if let Some(speed) = &self.notes.speed {
            writeln!(f, "\nspeed: {:.2} runs/s: {:.1} s on {} threads", speed.rate(), speed.seconds, speed.threads)?;
        }
        for line in &self.warnings {
            writeln!(f, "warning: {line}")?;
        }
        Ok(())
    }
}
