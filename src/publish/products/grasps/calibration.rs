//! Calibration of the probabilities of success: roll-outs of a grasp compared with its perturbed runs, which are drawn from the
//! same distribution with separate random streams.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use crate::{
    chart::{grouped, opening, percent},
    markup::Markup,
};
use format::GraspTrial;

/// Edges of the bins of predicted probabilities; the last bin contains only grasps that held in all their roll-outs.
const EDGES: [f64; 6] = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0];

/// Side and margin of the plot [px].
const SIDE: f64 = 240.0;
const MARGIN: f64 = 46.0;

/// Estimated probabilities of success against the outcomes of other runs of the same grasps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Grasps with roll-outs and perturbed runs.
    pub grasps: u64,
    /// Perturbed runs of these grasps, one prediction each.
    pub runs: u64,
    /// Mean of (predicted - outcome)^2 over these runs (Brier 1950).
    pub brier: f64,
    /// Brier score if the share of all runs that held is predicted for each.
    pub brier_of_share: f64,
    /// Brier score if the grasp's own trial is the prediction: 1 if it held, else 0.
    pub brier_of_verdict: f64,
    /// Bins by predicted probability, lowest first; only bins with runs.
    pub bins: Vec<ReliabilityBin>,
}

/// Grasps with about the same predicted probability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReliabilityBin {
    /// Mean predicted probability, over the runs.
    pub estimate: f64,
    /// Runs.
    pub runs: u64,
    /// Runs that held.
    pub held: u64,
}

impl ReliabilityBin {
    /// The share that held.
    fn share(&self) -> f64 {
        self.held as f64 / self.runs as f64
    }

    /// Interval that contains the true share for 95 % of such counts (Wilson 1927).
    fn interval(&self) -> [f64; 2] {
        const Z: f64 = 1.959_963_984_540_054;
        let (n, share) = (self.runs as f64, self.share());
        let middle = (share + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
        let half = Z / (1.0 + Z * Z / n) * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
        [middle - half, middle + half]
    }
}

/// Sums of one pass.
#[derive(Default)]
pub(crate) struct CalibrationSums {
    grasps: u64,
    squares: f64,
    squares_of_verdict: f64,
    /// By bin: sum of predicted probabilities, runs, and runs that held.
    bins: [(f64, u64, u64); EDGES.len()],
}

impl CalibrationSums {
    pub fn add(&mut self, trial: &GraspTrial) {
        let Some(estimate) = trial.success().filter(|_| !trial.perturbed.is_empty()) else { return };
        self.grasps += 1;
        let verdict = f64::from(u8::from(trial.outcome.verdict.is_held()));
        let bin = &mut self.bins[EDGES.iter().rposition(|edge| estimate >= *edge).unwrap_or(0)];
        for run in &trial.perturbed {
            let held = run.outcome.verdict.is_held();
            let came = f64::from(u8::from(held));
            self.squares += (estimate - came).powi(2);
            self.squares_of_verdict += (verdict - came).powi(2);
            *bin = (bin.0 + estimate, bin.1 + 1, bin.2 + u64::from(held));
        }
    }

    /// Result; `None` if no grasp has both.
    pub fn finish(self) -> Option<Calibration> {
        let (runs, held) = self.bins.iter().fold((0, 0), |(runs, held), bin| (runs + bin.1, held + bin.2));
        if runs == 0 {
            return None;
        }
        let share = held as f64 / runs as f64;
        let bins = self.bins.into_iter().filter(|bin| bin.1 > 0);
        let bins = bins.map(|(estimate, runs, held)| ReliabilityBin { estimate: estimate / runs as f64, runs, held });
        Some(Calibration {
            grasps: self.grasps,
            runs,
            brier: self.squares / runs as f64,
            brier_of_share: share * (1.0 - share),
            brier_of_verdict: self.squares_of_verdict / runs as f64,
            bins: bins.collect(),
        })
    }
}

/// Scores and plot as the page's template takes them.
#[derive(Serialize)]
pub(crate) struct CalibrationView {
    scores: String,
    plot: Markup,
    /// Estimated probability, runs, share that held, and its interval.
    bins: Vec<[String; 4]>,
}

impl Calibration {
    /// One line with the scores.
    pub fn in_words(&self) -> String {
        format!(
            "Brier score {:.4} over {} runs of {} grasps ({:.4} with the grasp's own verdict as prediction, {:.4} with the overall share)",
            self.brier,
            grouped(self.runs),
            grouped(self.grasps),
            self.brier_of_verdict,
            self.brier_of_share,
        )
    }

    /// Scores and plot for the page.
    pub(crate) fn view(&self) -> CalibrationView {
        let bin = |bin: &ReliabilityBin| {
            let [low, high] = bin.interval().map(percent);
            [format!("{:.2}", bin.estimate), grouped(bin.runs), percent(bin.share()), format!("{low} to {high}")]
        };
        CalibrationView { scores: self.in_words(), plot: self.plot(), bins: self.bins.iter().map(bin).collect() }
    }

    fn plot(&self) -> Markup {
        let end = SIDE - 12.0;
        let x = |value: f64| MARGIN + value * (end - MARGIN);
        let y = |value: f64| SIDE - MARGIN - value * (SIDE - MARGIN - 12.0);
        let mut svg = opening("probability of success: predicted and observed", SIDE, SIDE);
        for tick in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let _ = write!(
                svg,
                concat!(
                    r#"<path class="{}" d="M{:.1} {:.1}H{:.1}"/><text x="{:.1}" y="{:.1}" text-anchor="end">{}</text>"#,
                    r#"<path class="tick" d="M{:.1} {:.1}v4"/><text x="{:.1}" y="{:.1}" text-anchor="middle">{}</text>"#
                ),
                if tick == 0.0 { "axis" } else { "grid" },
                x(0.0),
                y(tick),
                x(1.0),
                x(0.0) - 6.0,
                y(tick) + 4.0,
                tick,
                x(tick),
                y(0.0),
                x(tick),
                y(0.0) + 16.0,
                tick,
            );
        }
        let _ = write!(svg, r#"<path class="mark" d="M{:.1} {:.1}L{:.1} {:.1}"/>"#, x(0.0), y(0.0), x(1.0), y(1.0));
        for bin in &self.bins {
            let ([low, high], at) = (bin.interval(), x(bin.estimate));
            let _ = write!(
                svg,
                concat!(
                    r#"<path class="axis" d="M{0:.1} {1:.1}V{2:.1}"/><circle class="ink-partial" cx="{0:.1}" cy="{3:.1}" r="4">"#,
                    "<title>predicted {4:.2}: {5} of {6} runs held</title></circle>"
                ),
                at,
                y(low),
                y(high),
                y(bin.share()),
                bin.estimate,
                grouped(bin.held),
                grouped(bin.runs),
            );
        }
        let _ = write!(
            svg,
            concat!(
                r#"<text class="quiet" x="{:.1}" y="{:.1}" text-anchor="middle">predicted</text>"#,
                r#"<text class="quiet" transform="translate(11 {:.1}) rotate(-90)" text-anchor="middle">held</text></svg>"#
            ),
            x(0.5),
            SIDE - 8.0,
            y(0.5),
        );
        Markup(svg)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sums(bins: &[(f64, u64, u64)]) -> CalibrationSums {
        let mut sums = CalibrationSums::default();
        for (index, bin) in bins.iter().enumerate() {
            sums.bins[index] = *bin;
        }
        sums
    }

    #[test]
    fn intervals_are_wilsons() {
        // Newcombe 1998, table I: 81 of 263, and 0 of 20.
        let bin = ReliabilityBin { estimate: 0.3, runs: 263, held: 81 };
        let [low, high] = bin.interval();
        assert!((low - 0.2553).abs() < 5e-5 && (high - 0.3662).abs() < 5e-5, "{low} {high}");
        let [low, high] = ReliabilityBin { estimate: 0.0, runs: 20, held: 0 }.interval();
        assert!(low.abs() < 1e-12 && (high - 0.1611).abs() < 5e-5, "{low} {high}");
    }

    #[test]
    fn nothing_is_said_of_nothing() {
        assert_eq!(sums(&[]).finish(), None);
        let found = sums(&[(1.0, 10, 1), (3.0, 10, 3)]).finish().expect("runs");
        assert_eq!(found.bins.iter().map(|bin| (bin.estimate, bin.held)).collect::<Vec<_>>(), [(0.1, 1), (0.3, 3)]);
        assert!((found.brier_of_share - 0.16).abs() < 1e-12);
        assert!(found.plot().0.contains("predicted 0.30: 3 of 10 runs held"));
    }
}
