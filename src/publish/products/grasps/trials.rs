//! The facts of simulated trials, from the same pass as the grasps.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use super::calibration::{Calibration, CalibrationSums, CalibrationView};
use crate::{
    chart::{Bar, Ink, bar_chart, grouped, percent},
    markup::Markup,
    tally::Spread,
};
use format::{GraspLabel, GraspRun, GraspTrials, TrialMethod, TrialVerdict, TriedStates};
use kernel::words::GraspVerdict;

/// Outcomes of grasp trials in MuJoCo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrialsInspection {
    /// Grasps that were tried.
    pub tried: u64,
    /// Tried grasps by verdict.
    pub verdicts: BTreeMap<String, u64>,
    /// Tried grasps, and those that held, by the verdict on their quality.
    #[serde(default)]
    pub by_quality: BTreeMap<String, [u64; 2]>,
    /// Grasps that were also tried on a table, by verdict; absent without such trials.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on_table: Option<BTreeMap<String, u64>>,
    /// Tried grasps by label, which combines all trials of a grasp.
    #[serde(default)]
    pub labels: BTreeMap<String, u64>,
    /// Held grasps tried under variants of the conditions; absent without variants.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variants: Option<VariantsInspection>,
    /// Perturbed runs.
    pub perturbed: u64,
    /// Perturbed runs whose outcome, held or not, differs from that of the grasp itself.
    pub turned: u64,
    /// Overlap of hand and object when gravity was switched on, for grasps that held [m].
    pub closed_penetration: Spread,
    /// Largest overlap after that, for grasps that held [m].
    pub shaken_penetration: Spread,
    /// Slip of the object in the hand during the lift, or the first direction of gravity, for grasps that held [m].
    pub slip: Spread,
    /// Trials whose forces are stored over time: in the air, and on a table.
    #[serde(default)]
    pub series: [u64; 2],
    /// Closings that timed out before the hand came to rest.
    pub not_at_rest: u64,
    /// Probability of success of the grasps with roll-outs; `None` without roll-outs.
    pub success: Option<Spread>,
    /// Calibration of this probability; `None` if no grasp has both roll-outs and perturbed runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<Calibration>,
    /// Tried states, friction and gravity of the first sample, and sources of masses.
    pub conditions: String,
}

/// Trials of held grasps under variants of the conditions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct VariantsInspection {
    /// Grasps that were tried under all variants.
    pub grasps: u64,
    /// Grasps that hold under all of them.
    pub robust: u64,
    /// Name of each variant and the grasps that hold under it, in the order of the records.
    pub held: Vec<(String, u64)>,
}

impl VariantsInspection {
    /// One line.
    fn in_words(&self) -> String {
        let [robust, grasps] = [self.robust, self.grasps].map(grouped);
        let each: Vec<String> = self.held.iter().map(|(name, held)| format!("{name} {}", grouped(*held))).collect();
        format!("{robust} of {grasps} held grasps hold under every variant ({})", each.join(", "))
    }
}

impl TrialsInspection {
    /// Tried grasps that held.
    pub fn held(&self) -> u64 {
        self.verdicts.get(TrialVerdict::Held.name()).copied().unwrap_or(0)
    }

    /// One line with the counts.
    pub fn in_words(&self) -> String {
        format!("{} grasps tried, {}", grouped(self.tried), held_in_words(&self.verdicts))
    }

    /// One line with the counts of labels.
    pub fn labels_in_words(&self) -> String {
        let count = |label: GraspLabel| {
            let grasps = self.labels.get(label.name()).copied().unwrap_or(0);
            format!("{} {}", grouped(grasps), label.name())
        };
        let labels = [
            GraspLabel::Held,
            GraspLabel::Failed,
            GraspLabel::Borderline,
            GraspLabel::Unconfirmed,
            GraspLabel::Untested,
        ];
        format!("labels from all trials: {}", labels.map(count).join(", "))
    }

    /// One line with the counts of trials that are stored over time; `None` without any.
    pub fn series_in_words(&self) -> Option<String> {
        let [in_air, on_table] = self.series.map(grouped);
        let words = format!("forces and drift over time of {in_air} trials in the air, {on_table} on a table");
        (self.series != [0; 2]).then_some(words)
    }

    /// One line with the counts of trials on a table; `None` without them.
    pub fn on_table_in_words(&self) -> Option<String> {
        let verdicts = self.on_table.as_ref()?;
        let tried = verdicts.values().sum();
        Some(format!("{} grasps tried on a table, {}", grouped(tried), held_in_words(verdicts)))
    }
}

/// Count and share of the trials that held, and the other verdicts.
fn held_in_words(verdicts: &BTreeMap<String, u64>) -> String {
    let count = |verdict: TrialVerdict| verdicts.get(verdict.name()).copied();
    let other =
        |verdict: TrialVerdict| Some(format!("{} {}", grouped(count(verdict)?), verdict.name().replace('_', " ")));
    let others: Vec<String> = TrialVerdict::ALL.into_iter().skip(1).filter_map(other).collect();
    let others = if others.is_empty() { String::new() } else { format!(" ({})", others.join(", ")) };
    let (held, tried) = (count(TrialVerdict::Held).unwrap_or(0), verdicts.values().sum::<u64>());
    format!("{} of them held: {}{others}", grouped(held), percent(held as f64 / tried.max(1) as f64))
}

impl fmt::Display for TrialsInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\n{}; {}", self.in_words(), self.conditions)?;
        if self.perturbed > 0 {
            let share = percent(self.turned as f64 / self.perturbed as f64);
            writeln!(
                f,
                "  {} of {} perturbed runs have a different outcome: {share}",
                grouped(self.turned),
                grouped(self.perturbed)
            )?;
        }
        for (name, spread) in self.spreads() {
            let Spread { median, p95, max, .. } = spread;
            let [median, p95, max] = [median, p95, max].map(|metres| 1e3 * metres);
            writeln!(f, "  {name:<24} median {median:.3} mm, 95 % {p95:.3}, max {max:.3}")?;
        }
        if let Some(success) = &self.success {
            writeln!(f, "  probability of success   median {:.2}, mean {:.2}", success.median, success.mean)?;
        }
        if let Some(calibration) = &self.calibration {
            writeln!(f, "  {}", calibration.in_words())?;
        }
        if let Some(words) = self.on_table_in_words() {
            writeln!(f, "  {words}")?;
        }
        for [verdict, tried, held] in self.quality_rows() {
            writeln!(f, "  {:<24} {tried} tried, {held} held", format!("verdict {verdict}"))?;
        }
        writeln!(f, "  {}", self.labels_in_words())?;
        if let Some(variants) = &self.variants {
            writeln!(f, "  {}", variants.in_words())?;
        }
        if let Some(words) = self.series_in_words() {
            writeln!(f, "  {words}")?;
        }
        Ok(())
    }
}

impl TrialsInspection {
    /// Quality verdict, tried grasps, and those that held with their share.
    fn quality_rows(&self) -> Vec<[String; 3]> {
        let row = |verdict: GraspVerdict| {
            let [tried, held] = *self.by_quality.get(verdict.name())?;
            let share = percent(held as f64 / tried.max(1) as f64);
            Some([verdict.name().replace('_', " "), grouped(tried), format!("{} ({share})", grouped(held))])
        };
        GraspVerdict::ALL.into_iter().filter_map(row).collect()
    }

    fn spreads(&self) -> [(&'static str, &Spread); 3] {
        [
            ("penetration when closed", &self.closed_penetration),
            ("penetration when shaken", &self.shaken_penetration),
            ("slip during the lift", &self.slip),
        ]
    }
}

/// Sums of one pass.
#[derive(Default)]
pub(crate) struct TrialSums {
    tried: u64,
    verdicts: BTreeMap<String, u64>,
    by_quality: BTreeMap<String, [u64; 2]>,
    on_table: Option<BTreeMap<String, u64>>,
    labels: BTreeMap<String, u64>,
    variants: VariantsInspection,
    perturbed: u64,
    turned: u64,
    depths: [Vec<f64>; 2],
    slips: Vec<f64>,
    not_at_rest: u64,
    series: [u64; 2],
    success: Vec<f64>,
    calibration: CalibrationSums,
    /// Tried grasps by the origin of their object's mass.
    masses: BTreeMap<String, u64>,
    method: Option<TrialMethod>,
}

impl TrialSums {
    pub fn add(&mut self, run: &GraspRun, trials: &GraspTrials) {
        if self.method.is_none() {
            self.method = Some(trials.method.clone());
            self.on_table = trials.method.table_friction.map(|_| BTreeMap::new());
            self.variants.held = trials.method.variants.iter().map(|name| (name.clone(), 0)).collect();
        }
        *self.masses.entry(trials.method.mass_from.clone()).or_default() += trials.trials.len() as u64;
        for trial in &trials.trials {
            let outcome = &trial.outcome;
            self.tried += 1;
            if let Some(grasp) = run.grasps.get(trial.grasp as usize) {
                let [tried, held] = self.by_quality.entry(grasp.verdict.name().to_owned()).or_default();
                *tried += 1;
                *held += u64::from(outcome.verdict.is_held());
            }
            if let (Some(on_table), Some(trial)) = (&mut self.on_table, &trial.table) {
                *on_table.entry(trial.outcome.verdict.name().to_owned()).or_default() += 1;
            }
            *self.labels.entry(trial.label().name().to_owned()).or_default() += 1;
            if let Some(is_robust) = trial.is_robust() {
                self.variants.grasps += 1;
                self.variants.robust += u64::from(is_robust);
                for ((_, held), verdict) in self.variants.held.iter_mut().zip(&trial.variants) {
                    *held += u64::from(verdict.is_held());
                }
            }
            *self.verdicts.entry(outcome.verdict.name().to_owned()).or_default() += 1;
            self.perturbed += trial.perturbed.len() as u64;
            self.turned += trial.turned() as u64;
            self.success.extend(trial.success());
            self.calibration.add(trial);
            self.series[0] += u64::from(trial.series.is_some());
            self.series[1] += u64::from(trial.table.as_ref().is_some_and(|table| table.series.is_some()));
            self.not_at_rest += u64::from(outcome.closing_time > 0.0 && !outcome.closed_at_rest);
            if outcome.verdict.is_held() {
                self.depths[0].push(outcome.penetration[1]);
                self.depths[1].push(outcome.penetration[2]);
                self.slips.extend(outcome.slips.first().map(|[moved, _]| *moved));
            }
        }
    }

    /// Result; `None` if nothing was tried.
    pub fn finish(self) -> Option<TrialsInspection> {
        let method = self.method?;
        let masses: Vec<String> = match self.masses.len() {
            1 => self.masses.into_keys().collect(),
            _ => self.masses.iter().map(|(from, tried)| format!("{from} of {}", grouped(*tried))).collect(),
        };
        let [closed, shaken] = self.depths.map(Spread::of);
        let pull = if method.gravity == "six" { "gravity from six directions" } else { "lifted and shaken" };
        let tried = match method.tried {
            TriedStates::Kept => "only kept grasps",
            TriedStates::Closed => "every state that closes with two links",
        };
        Some(TrialsInspection {
            tried: self.tried,
            verdicts: self.verdicts,
            by_quality: self.by_quality,
            on_table: self.on_table,
            labels: self.labels,
            variants: (self.variants.grasps > 0).then_some(self.variants),
            perturbed: self.perturbed,
            turned: self.turned,
            closed_penetration: closed,
            shaken_penetration: shaken,
            slip: Spread::of(self.slips),
            not_at_rest: self.not_at_rest,
            series: self.series,
            success: (!self.success.is_empty()).then(|| Spread::of(self.success)),
            calibration: self.calibration.finish(),
            conditions: format!("{tried}, friction {}, {pull}, mass by {}", method.friction, masses.join(", by ")),
        })
    }
}

/// Trials as the page's template takes them.
#[derive(Serialize)]
pub(crate) struct TrialsView {
    /// Grasps that were tried, that held, and that failed.
    tried: String,
    held: String,
    failed: String,
    conditions: String,
    counts: String,
    labels: String,
    perturbed: Option<PerturbedView>,
    /// Tried grasps by verdict.
    verdicts: Markup,
    /// Quality verdict, tried grasps, and those that held.
    by_quality: Vec<[String; 3]>,
    /// Counts of trials on a table.
    on_table: Option<String>,
    /// Counts of trials that are stored over time.
    series: Option<String>,
    /// Variants of the conditions.
    variants: Option<VariantsView>,
    /// Name, median, 95th percentile and largest value of depths and slips of grasps that held.
    spreads: Vec<[String; 4]>,
    success: Option<SuccessView>,
    calibration: Option<CalibrationView>,
}

/// Trials under variants of the conditions.
#[derive(Serialize)]
struct VariantsView {
    grasps: String,
    robust: String,
    /// Name of the variant, grasps that hold under it, and their share.
    rows: Vec<[String; 3]>,
}

impl VariantsView {
    fn of(variants: &VariantsInspection) -> Self {
        let row = |(name, held): &(String, u64)| {
            let share = percent(*held as f64 / variants.grasps.max(1) as f64);
            [name.replace('_', " "), grouped(*held), share]
        };
        Self {
            grasps: grouped(variants.grasps),
            robust: grouped(variants.robust),
            rows: variants.held.iter().map(row).collect(),
        }
    }
}

/// Runs under perturbed conditions.
#[derive(Serialize)]
struct PerturbedView {
    runs: String,
    /// Share with a different outcome.
    turned: String,
}

/// Probabilities of success.
#[derive(Serialize)]
struct SuccessView {
    median: String,
    mean: String,
}

impl TrialsView {
    pub fn of(trials: &TrialsInspection) -> Self {
        let bars = TrialVerdict::ALL.into_iter().filter_map(|verdict| {
            let value = trials.verdicts.get(verdict.name()).copied()?;
            let ink = if verdict.is_held() { Ink::Partial } else { Ink::Reject };
            Some(Bar { label: verdict.name().replace('_', " "), value, ink })
        });
        let spreads = trials.spreads().map(|(name, Spread { median, p95, max, .. })| {
            let [median, p95, max] = [median, p95, max].map(|metres| format!("{:.3} mm", 1e3 * metres));
            [name.to_owned(), median, p95, max]
        });
        let success = trials.success.map(|Spread { median, mean, .. }| SuccessView {
            median: format!("{median:.2}"),
            mean: format!("{mean:.2}"),
        });
        Self {
            tried: grouped(trials.tried),
            held: grouped(trials.held()),
            failed: grouped(trials.tried - trials.held()),
            conditions: trials.conditions.clone(),
            counts: trials.in_words(),
            labels: trials.labels_in_words(),
            perturbed: (trials.perturbed > 0).then(|| PerturbedView {
                runs: grouped(trials.perturbed),
                turned: percent(trials.turned as f64 / trials.perturbed as f64),
            }),
            verdicts: bar_chart("grasps by verdict of their trial", &bars.collect::<Vec<_>>()),
            by_quality: trials.quality_rows(),
            on_table: trials.on_table_in_words(),
            series: trials.series_in_words(),
            variants: trials.variants.as_ref().map(VariantsView::of),
            spreads: spreads.into(),
            success,
            calibration: trials.calibration.as_ref().map(Calibration::view),
        }
    }
}
