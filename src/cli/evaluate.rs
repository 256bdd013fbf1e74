//! `graspmill evaluate completion`: models and baselines on the samples of a dataset.

use std::fmt::Write as _;

use serde::Serialize;

use super::{
    completion_args::{DetailName, EvaluateCompletionArgs},
    completion_method::CompletionMethod,
    exit::{Exit, Failure},
    machine,
    parallel::in_parallel,
    printer::Printer,
    stored_samples::{StoredSample, choose_samples},
    true_meshes::TrueMeshes,
};
use format::dataset::DatasetReader;
use kernel::geom::TriMesh;
use measure::{GridOverlap, Interval, Scores, SurfaceComparison, SurfaceRule};
use surface::{CompletedMesh, CubeField, OBSTACLE_THRESHOLD};

/// Seed of samples on surfaces and of resamples.
const SEED: u64 = 0;

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
    /// Way in which meshes are made of answers.
    detail: DetailName,
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
    let (reader, chosen) = choose_samples(&arguments.dir, Some(&arguments.split), arguments.limit)?;
    let contenders = contenders(arguments, &reader)?;
    let truths = arguments.truth.as_deref().map(|folder| TrueMeshes::new(folder, &reader, &chosen)).transpose()?;
    let has_coverage = StoredSample::read(&reader, chosen[0])?.coverage.is_some();
    let work = |index: usize| -> Result<Vec<Outcome>, Failure> {
        let sample = StoredSample::read(&reader, chosen[index])?;
        let truth = match &truths {
            Some(truths) => truths.in_camera(&sample),
            None => truth_mesh(&sample),
        };
        contenders.iter().map(|contender| outcome(contender, &sample, &truth, arguments)).collect()
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
    let baselines = (0..contenders.len()).filter(|index| contenders[*index].is_baseline());
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
                .filter(|_| matches!(contenders[index], CompletionMethod::Model { .. }))
                .and_then(|best| overlaps[index].paired_difference(&overlaps[best], SEED)),
        }
    };
    let report = Report {
        dataset: reader.manifest().root.hex(),
        split: arguments.split.clone(),
        samples: chosen.len(),
        surface_samples: arguments.surface_samples,
        detail: arguments.detail,
        truth: if truths.is_some() {
            "the objects' meshes"
        } else if has_coverage {
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

fn contenders(arguments: &EvaluateCompletionArgs, reader: &DatasetReader) -> Result<Vec<CompletionMethod>, Failure> {
    let models = arguments.model.iter().map(|folder| CompletionMethod::open(folder));
    let methods = arguments.method.iter().map(|name| CompletionMethod::by_name(name, reader));
    models.chain(methods).collect()
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

fn outcome(
    contender: &CompletionMethod,
    sample: &StoredSample,
    truth: &TriMesh,
    arguments: &EvaluateCompletionArgs,
) -> Result<Outcome, Failure> {
    let points = arguments.surface_samples;
    let answer = contender.complete(sample)?;
    let mesh = answer.mesh(sample, arguments.detail)?;
    let rule = SurfaceRule { samples: points as usize, seed: SEED };
    let surfaces = if points > 0 && !mesh.triangles.is_empty() && !truth.triangles.is_empty() {
        Some(SurfaceComparison::new(&mesh, truth, &rule, sample.name.as_bytes())?)
    } else {
        None
    };
    Ok(Outcome {
        object: sample.pair.sample.subject.to_string(),
        overlap: GridOverlap::new(&answer.cells, &sample.pair.complete, &sample.pair.partial),
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
