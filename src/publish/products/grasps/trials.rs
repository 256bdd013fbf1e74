//! The facts of physical trials, out of the same pass as the grasps.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use super::calibration::{Calibration, CalibrationSums, CalibrationView};
use crate::{
    chart::{Bar, Ink, bar_chart, grouped, percent},
    markup::Markup,
    tally::Spread,
};
use format::{GraspTrials, TrialMethod, TrialVerdict};

/// Outcomes of trying the kept grasps in MuJoCo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrialsInspection {
    /// Grasps that were tried.
    pub tried: u64,
    /// Tried grasps by verdict.
    pub verdicts: BTreeMap<String, u64>,
    /// Perturbed runs of them.
    pub perturbed: u64,
    /// Perturbed runs whose verdict, held or not, is another than that of the grasp itself.
    pub turned: u64,
    /// Hand in object when gravity came on, of those that held [m].
    pub closed_penetration: Spread,
    /// At most after that, likewise [m].
    pub shaken_penetration: Spread,
    /// Slip of the object in the hand during the lift, or the first direction of gravity, likewise [m].
    pub slip: Spread,
    /// Closings that used up their time before the hand came to rest.
    pub not_at_rest: u64,
    /// Probability of success of the grasps that were rolled out; `None` where none was.
    pub success: Option<Spread>,
    /// Calibration of that probability; `None` where no grasp was rolled out and perturbed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<Calibration>,
    /// Friction and gravity of the first sample.
    pub conditions: String,
}

impl TrialsInspection {
    /// Tried grasps that held.
    pub fn held(&self) -> u64 {
        self.verdicts.get(TrialVerdict::Held.name()).copied().unwrap_or(0)
    }

    /// One line with the counts.
    pub fn in_words(&self) -> String {
        let others = TrialVerdict::ALL.into_iter().skip(1).filter_map(|verdict| {
            let count = self.verdicts.get(verdict.name())?;
            Some(format!("{} {}", grouped(*count), verdict.name()))
        });
        let others: Vec<String> = others.collect();
        let others = if others.is_empty() { String::new() } else { format!(" ({})", others.join(", ")) };
        let share = percent(self.held() as f64 / self.tried.max(1) as f64);
        format!("{} grasps tried, {} of them held: {share}{others}", grouped(self.tried), grouped(self.held()))
    }
}

impl fmt::Display for TrialsInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\n{}; {}", self.in_words(), self.conditions)?;
        if self.perturbed > 0 {
            let share = percent(self.turned as f64 / self.perturbed as f64);
            writeln!(
                f,
                "  {} of {} perturbed runs end otherwise: {share}",
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
        Ok(())
    }
}

impl TrialsInspection {
    fn spreads(&self) -> [(&'static str, &Spread); 3] {
        [
            ("penetration when closed", &self.closed_penetration),
            ("penetration when shaken", &self.shaken_penetration),
            ("slip in the lift", &self.slip),
        ]
    }
}

/// Sums of one pass.
#[derive(Default)]
pub(crate) struct TrialSums {
    tried: u64,
    verdicts: BTreeMap<String, u64>,
    perturbed: u64,
    turned: u64,
    depths: [Vec<f64>; 2],
    slips: Vec<f64>,
    not_at_rest: u64,
    success: Vec<f64>,
    calibration: CalibrationSums,
    /// Tried grasps by where the mass of their object is from.
    masses: BTreeMap<String, u64>,
    method: Option<TrialMethod>,
}

impl TrialSums {
    pub fn add(&mut self, trials: &GraspTrials) {
        if self.method.is_none() {
            self.method = Some(trials.method.clone());
        }
        *self.masses.entry(trials.method.mass_from.clone()).or_default() += trials.trials.len() as u64;
        for trial in &trials.trials {
            let outcome = &trial.outcome;
            self.tried += 1;
            *self.verdicts.entry(outcome.verdict.name().to_owned()).or_default() += 1;
            self.perturbed += trial.perturbed.len() as u64;
            self.turned += trial.turned() as u64;
            self.success.extend(trial.success());
            self.calibration.add(trial);
            self.not_at_rest += u64::from(outcome.closing_time > 0.0 && !outcome.closed_at_rest);
            if outcome.verdict.is_held() {
                self.depths[0].push(outcome.penetration[1]);
                self.depths[1].push(outcome.penetration[2]);
                self.slips.extend(outcome.slips.first().map(|[moved, _]| *moved));
            }
        }
    }

    /// `None` where nothing was tried.
    pub fn finish(self) -> Option<TrialsInspection> {
        let method = self.method?;
        let masses: Vec<String> = match self.masses.len() {
            1 => self.masses.into_keys().collect(),
            _ => self.masses.iter().map(|(from, tried)| format!("{from} of {}", grouped(*tried))).collect(),
        };
        let [closed, shaken] = self.depths.map(Spread::of);
        let pull = if method.gravity == "six" { "gravity from six directions" } else { "lifted and shaken" };
        Some(TrialsInspection {
            tried: self.tried,
            verdicts: self.verdicts,
            perturbed: self.perturbed,
            turned: self.turned,
            closed_penetration: closed,
            shaken_penetration: shaken,
            slip: Spread::of(self.slips),
            not_at_rest: self.not_at_rest,
            success: (!self.success.is_empty()).then(|| Spread::of(self.success)),
            calibration: self.calibration.finish(),
            conditions: format!("friction {}, {pull}, mass by {}", method.friction, masses.join(", by ")),
        })
    }
}

/// Trials as the page's template takes them.
#[derive(Serialize)]
pub(crate) struct TrialsView {
    conditions: String,
    counts: String,
    perturbed: Option<PerturbedView>,
    /// Tried grasps by verdict.
    verdicts: Markup,
    /// Name, median, 95 % and largest value of depths and slips of grasps that held.
    spreads: Vec<[String; 4]>,
    success: Option<SuccessView>,
    calibration: Option<CalibrationView>,
}

/// Runs under conditions a little off.
#[derive(Serialize)]
struct PerturbedView {
    runs: String,
    /// Share that ends otherwise.
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
            conditions: trials.conditions.clone(),
            counts: trials.in_words(),
            perturbed: (trials.perturbed > 0).then(|| PerturbedView {
                runs: grouped(trials.perturbed),
                turned: percent(trials.turned as f64 / trials.perturbed as f64),
            }),
            verdicts: bar_chart("grasps by verdict of their trial", &bars.collect::<Vec<_>>()),
            spreads: spreads.into(),
            success,
            calibration: trials.calibration.as_ref().map(Calibration::view),
        }
    }
}
