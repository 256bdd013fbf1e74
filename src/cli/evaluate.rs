//! `graspmill evaluate completion`: models and baselines on the samples of a dataset.

use std::fmt::Write as _;

use serde::Serialize;

use super::{
    completion_args::EvaluateCompletionArgs,
    exit::{Exit, Failure},
    machine,
    model::refused,
    parallel::in_parallel,
    printer::Printer,
    stored_samples::{StoredSample, choose_samples},
};
use kernel::geom::{OccupancyGrid, TriMesh};
use measure::{Baseline, GridOverlap, Interval, Scores, SurfaceComparison, SurfaceRule};
use runtime::completion::CompletionModel;
use surface::{CompletedMesh, CubeField, OBSTACLE_THRESHOLD};

/// Seed of samples on surfaces and of resamples.
const SEED: u64 = 0;

/// A way to complete samples.
enum Contender {
    Model { name: String, model: Box<CompletionModel> },
    Baseline(Baseline),
}

/// Scores of one sample.
struct Outcome {
    object: String,
    overlap: GridOverlap,
    /// `None` where nothing was completed.
    surfaces: Option<SurfaceComparison>,
}

/// Result of the comparison.
#[derive(Serialize)]
struct Report {
    /// Root digest of the dataset.
    dataset: String,
    split: String,
    samples: usize,
    /// Points per surface; 0: surfaces were not compared.
    surface_samples: u32,
    /// Surface that counts as the true one.
    truth: &'static str,
    rows: Vec<Row>,
}

/// One model or baseline. Means are those of objects, with 95 % intervals by bootstrap over objects.
#[derive(Serialize)]
struct Row {
    name: String,
    iou: Option<Interval>,
    /// Intersection over union of the cells without a seen point.
    unseen_iou: Option<Interval>,
    /// Mean distance between the surfaces, both directions [mm].
    surface_mm: Option<Interval>,
    /// Points within 1 % of the longest side, both directions.
    f_score_percent: Option<Interval>,
    /// Volume as a share of the true one's.
    volume_ratio: Option<Interval>,
    /// Samples of which nothing was completed.
    empty: usize,
    /// Intersection over union less that of the best baseline, paired by object; `None` for baselines.
    iou_over_baseline: Option<Interval>,
}

/// `graspmill evaluate completion`.
pub fn evaluate_completion(arguments: &EvaluateCompletionArgs, printer: &Printer) -> Result<Exit, Failure> {
    let contenders = contenders(arguments)?;
    let (reader, chosen) = choose_samples(&arguments.dir, Some(&arguments.split), arguments.limit)?;
    let has_coverage = StoredSample::read(&reader, chosen[0])?.coverage.is_some();
    let work = |index: usize| -> Result<Vec<Outcome>, Failure> {
        let sample = StoredSample::read(&reader, chosen[index])?;
        let truth = truth_mesh(&sample);
        contenders.iter().map(|contender| outcome(contender, &sample, &truth, arguments.surface_samples)).collect()
    };
    let results = in_parallel(chosen.len(), machine::threads(arguments.threads), work);
    let by_sample = results.into_iter().collect::<Result<Vec<_>, Failure>>()?;
    let scores = |index: usize, value: &dyn Fn(&Outcome) -> Option<f64>| {
        let mut scores = Scores::default();
        for outcome in by_sample.iter().map(|outcomes| &outcomes[index]) {
            if let Some(value) = value(outcome) {
                scores.add(&outcome.object, value);
            }
        }
        scores
    };
    let overlaps: Vec<Scores> = (0..contenders.len()).map(|index| scores(index, &|o| Some(o.overlap.iou))).collect();
    let mean_of = |scores: &Scores| scores.interval(SEED).map_or(0.0, |interval| interval.mean);
    let baselines = (0..contenders.len()).filter(|index| matches!(contenders[*index], Contender::Baseline(_)));
    let best = baselines.max_by(|a, b| mean_of(&overlaps[*a]).total_cmp(&mean_of(&overlaps[*b])));
    let row = |index: usize| {
        let interval = |value: &dyn Fn(&SurfaceComparison) -> f64| {
            scores(index, &|outcome| outcome.surfaces.as_ref().map(value)).interval(SEED)
        };
        Row {
            name: contenders[index].name(),
            iou: overlaps[index].interval(SEED),
            unseen_iou: scores(index, &|outcome| Some(outcome.overlap.unseen)).interval(SEED),
            surface_mm: interval(&|surfaces| 1e3 * surfaces.mean),
            f_score_percent: interval(&|surfaces| surfaces.f_score_percent),
            volume_ratio: interval(&|surfaces| surfaces.volume_ratio),
            empty: by_sample
                .iter()
                .filter(|outcomes| arguments.surface_samples > 0 && outcomes[index].surfaces.is_none())
                .count(),
            iou_over_baseline: best
                .filter(|_| matches!(contenders[index], Contender::Model { .. }))
                .and_then(|best| overlaps[index].paired_difference(&overlaps[best], SEED)),
        }
    };
    let report = Report {
        dataset: reader.manifest().root.hex(),
        split: arguments.split.clone(),
        samples: chosen.len(),
        surface_samples: arguments.surface_samples,
        truth: if has_coverage {
            "coverage of the dataset"
        } else {
            "occupied cells of the dataset, about .7 cell too large"
        },
        rows: (0..contenders.len()).map(row).collect(),
    };
    if arguments.json {
        printer.json(&report)?;
    } else {
        printer.result(&text(&report));
    }
    Ok(Exit::Complete)
}

fn contenders(arguments: &EvaluateCompletionArgs) -> Result<Vec<Contender>, Failure> {
    let mut contenders = Vec::new();
    for folder in &arguments.model {
        let model = CompletionModel::open(folder).map_err(refused)?;
        contenders.push(Contender::Model { name: folder.display().to_string(), model: Box::new(model) });
    }
    for name in &arguments.method {
        let baseline = Baseline::from_name(name).ok_or_else(|| {
            let known = Baseline::ALL.map(Baseline::name).join(", ");
            Failure::message(Exit::BadSpec, format!("--method {name}: no such baseline; one of {known}"))
        })?;
        contenders.push(Contender::Baseline(baseline));
    }
    Ok(contenders)
}

impl Contender {
    fn name(&self) -> String {
        match self {
            Self::Model { name, .. } => name.clone(),
            Self::Baseline(baseline) => baseline.to_string(),
        }
    }

    /// Occupied cells and the mesh.
    fn complete(&self, sample: &StoredSample) -> Result<(OccupancyGrid, TriMesh), Failure> {
        let placement = &sample.pair.grid;
        Ok(match self {
            Self::Model { model, .. } => {
                let answer = sample.complete(model)?;
                let thresholds = model.facts().thresholds;
                let mesh =
                    CompletedMesh::surface_at(&answer.coverage, &answer.occupancy, placement, thresholds.coverage).mesh;
                (answer.occupancy.grid_above(thresholds.occupancy), mesh)
            }
            Self::Baseline(baseline) => {
                let grid = baseline.complete(&sample.pair.partial, placement);
                let mesh = CompletedMesh::obstacle(&CubeField::from_grid(&grid), placement, OBSTACLE_THRESHOLD).mesh;
                (grid, mesh)
            }
        })
    }
}

/// The surface that counts as the true one: that of coverage, or of the occupied cells where no coverage is stored.
fn truth_mesh(sample: &StoredSample) -> TriMesh {
    let occupied = CubeField::from_grid(&sample.pair.complete);
    let placement = &sample.pair.grid;
    match &sample.coverage {
        Some(coverage) => CompletedMesh::surface(coverage, &occupied, placement).mesh,
        None => CompletedMesh::obstacle(&occupied, placement, OBSTACLE_THRESHOLD).mesh,
    }
}

fn outcome(contender: &Contender, sample: &StoredSample, truth: &TriMesh, points: u32) -> Result<Outcome, Failure> {
    let (grid, mesh) = contender.complete(sample)?;
    let rule = SurfaceRule { samples: points as usize, seed: SEED };
    let surfaces = if points > 0 && !mesh.triangles.is_empty() && !truth.triangles.is_empty() {
        Some(SurfaceComparison::new(&mesh, truth, &rule, sample.name.as_bytes())?)
    } else {
        None
    };
    Ok(Outcome {
        object: sample.pair.sample.subject.to_string(),
        overlap: GridOverlap::new(&grid, &sample.pair.complete, &sample.pair.partial),
        surfaces,
    })
}

fn text(report: &Report) -> String {
    let objects = report.rows.first().and_then(|row| row.iou).map_or(0, |interval| interval.objects);
    let mut text = format!(
        "{} samples of {objects} objects, split {}; means of objects with 95 % intervals over objects\n",
        report.samples, report.split
    );
    let width = report.rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0).max(10);
    _ = writeln!(
        text,
        "{:width$}  {:19}  {:19}  {:19}  {:6}  {:6}",
        "", "IoU", "IoU, unseen", "surface [mm]", "F, 1 %", "volume"
    );
    let three = |interval: &Option<Interval>| {
        interval.map_or("-".to_owned(), |found| format!("{:.3} [{:.3}, {:.3}]", found.mean, found.low, found.high))
    };
    let two = |interval: &Option<Interval>| {
        interval.map_or("-".to_owned(), |found| format!("{:.2} [{:.2}, {:.2}]", found.mean, found.low, found.high))
    };
    let one = |interval: &Option<Interval>| interval.map_or("-".to_owned(), |found| format!("{:.3}", found.mean));
    for row in &report.rows {
        let Row { name, iou, unseen_iou, surface_mm, f_score_percent, volume_ratio, .. } = row;
        let (iou, unseen, surface) = (three(iou), three(unseen_iou), two(surface_mm));
        let (f_score, volume) = (one(f_score_percent), one(volume_ratio));
        _ = writeln!(text, "{name:width$}  {iou:19}  {unseen:19}  {surface:19}  {f_score:6}  {volume:6}");
    }
    for Row { name, iou_over_baseline, empty, .. } in &report.rows {
        if let Some(Interval { mean, low, high, .. }) = iou_over_baseline {
            let claim = if *low > 0.0 || *high < 0.0 { "" } else { ": no difference is shown" };
            _ = writeln!(
                text,
                "{name}: IoU less the best baseline's {mean:+.3} [{low:+.3}, {high:+.3}], paired by object{claim}"
            );
        }
        if *empty > 0 {
            _ = writeln!(text, "{name}: nothing was completed in {empty} samples");
        }
    }
    if report.surface_samples > 0 {
        _ = write!(text, "surfaces: {} points per mesh; truth: {}", report.surface_samples, report.truth);
    }
    text
}
