//! `graspmill evaluate completion`: models and baselines on the samples of a dataset.

use std::{collections::BTreeMap, fmt::Write as _};

use serde::Serialize;

use super::{
    completion_args::{DetailName, EvaluateCompletionArgs},
    completion_method::{CompletionMethod, mesh_of},
    exit::{Exit, Failure},
    machine,
    parallel::in_parallel,
    printer::Printer,
    stored_samples::{StoredSample, choose_samples},
    true_meshes::TrueMeshes,
};
use format::dataset::DatasetReader;
use kernel::geom::TriMesh;
use measure::{
    GridOverlap, Interval, Scores, SurfaceComparison, SurfaceRule, free_space_violation, mesh_overlap, sampled_surface,
};
use runtime::completion::{Answer, DepthFrame};
use surface::{CompletedMesh, CubeField, OBSTACLE_THRESHOLD};

/// Seed of samples on surfaces and of resamples.
const SEED: u64 = 0;

/// Share of the volume of an object's occupied cells that is solid, below which it counts as hollow or thin.
const SOLID_SHARE: f64 = 0.5;

/// Scores of one sample.
struct Outcome {
    object: String,
    overlap: GridOverlap,
    /// Solid volume in the grid and that of the occupied cells [cells]; `None` without stored coverage.
    filled: Option<[f64; 2]>,
    /// `None` where surfaces are not compared, or one of the two has no triangle.
    surfaces: Option<SurfaceScores>,
    /// Whether surfaces are compared, and there is nothing to compare.
    is_empty: bool,
}

/// Scores of one completed surface.
struct SurfaceScores {
    distances: SurfaceComparison,
    /// Intersection over union of the volumes.
    volumes: f64,
    /// Share of the surface's points more than a cell in front of what was seen around them; `None` without stored depth.
    free_space: Option<f64>,
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
    /// Way in which meshes are made of answers.
    detail: DetailName,
    iou: Option<Interval>,
    /// Intersection over union of the cells without a seen point.
    unseen_iou: Option<Interval>,
    /// Mean distance between the surfaces, both directions [mm].
    surface_mm: Option<Interval>,
    /// Mean signed distance from the true surface [mm], positive outside.
    bias_mm: Option<Interval>,
    /// Root of the mean square of the distances, both directions [mm].
    rms_mm: Option<Interval>,
    /// 95 % of the points are nearer than this [mm].
    percentile_95_mm: Option<Interval>,
    /// The largest distance [mm]: the Hausdorff distance.
    hausdorff_mm: Option<Interval>,
    /// Sum of both directions' mean squares [mm^2].
    chamfer_mm2: Option<Interval>,
    /// Points within 1 % of the longest side, both directions.
    f_score_percent: Option<Interval>,
    /// Points within 5 mm, both directions.
    f_score_5mm: Option<Interval>,
    /// Intersection over union of the meshes' volumes.
    mesh_iou: Option<Interval>,
    /// Volume as a share of the true one's.
    volume_ratio: Option<Interval>,
    /// Share of the surface more than a cell in front of what was seen around it; `None` without stored depth.
    free_space_violation: Option<Interval>,
    /// Intersection over union of objects of which at least half of the occupied cells' volume is solid.
    iou_of_solid: Option<Interval>,
    /// Intersection over union of hollow and thin objects; both are `None` without stored coverage.
    iou_of_hollow_or_thin: Option<Interval>,
    /// Samples of which nothing was completed.
    empty: usize,
    /// Mean distance between the surfaces less that of the method's first way of making meshes, paired by object [mm]; `None`
    /// for that first way itself.
    surface_over_first_mm: Option<Interval>,
    /// Intersection over union less that of the best baseline, paired by object; `None` for baselines.
    iou_over_baseline: Option<Interval>,
}

/// `graspmill evaluate completion`.
pub fn evaluate_completion(arguments: &EvaluateCompletionArgs, printer: &Printer) -> Result<Exit, Failure> {
    let (reader, chosen) = choose_samples(&arguments.dir, Some(&arguments.split), arguments.limit)?;
    let methods = methods(arguments, &reader)?;
    let truths = arguments.truth.as_deref().map(|folder| TrueMeshes::new(folder, &reader, &chosen)).transpose()?;
    let has_coverage = StoredSample::read(&reader, chosen[0])?.coverage.is_some();
    let work = |index: usize| {
        let sample = StoredSample::read(&reader, chosen[index])?;
        let truth = match &truths {
            Some(truths) => truths.in_camera(&sample),
            None => truth_mesh(&sample),
        };
        outcomes(arguments, &methods, &sample, &truth)
    };
    let results = in_parallel(chosen.len(), machine::threads(arguments.threads), work);
    let by_sample = results.into_iter().collect::<Result<Vec<_>, Failure>>()?;
    let report = Report {
        dataset: reader.manifest().root.hex(),
        split: arguments.split.clone(),
        samples: chosen.len(),
        surface_samples: arguments.surface_samples,
        truth: if truths.is_some() {
            "the objects' meshes"
        } else if has_coverage {
            "coverage of the dataset"
        } else {
            "occupied cells of the dataset, about .7 cell too large"
        },
        rows: Comparison::new(&methods, &arguments.detail, &by_sample).rows(),
    };
    if arguments.json {
        printer.json(&report)?;
    } else {
        printer.result(&text(&report));
    }
    Ok(Exit::Complete)
}

/// Scores of a sample: a row per method and way of making meshes, those of one method together.
fn outcomes(
    arguments: &EvaluateCompletionArgs,
    methods: &[CompletionMethod],
    sample: &StoredSample,
    truth: &TriMesh,
) -> Result<Vec<Outcome>, Failure> {
    let mut outcomes = Vec::new();
    for method in methods {
        let answer = method.complete(sample)?;
        for detail in &arguments.detail {
            outcomes.push(outcome(&answer, *detail, sample, truth, arguments.surface_samples)?);
        }
    }
    Ok(outcomes)
}

/// Scores of all samples, by row.
struct Comparison<'a> {
    /// Method and way of making meshes of each row.
    contenders: Vec<(&'a CompletionMethod, DetailName)>,
    /// Ways of making meshes per method.
    details: usize,
    by_sample: &'a [Vec<Outcome>],
    /// Whether each object is hollow or thin.
    hollow: BTreeMap<String, bool>,
    /// Intersection over union of each row.
    overlaps: Vec<Scores>,
    /// Mean distance between the surfaces of each row [mm].
    surfaces: Vec<Scores>,
    /// Row of the best baseline.
    best: Option<usize>,
}

impl<'a> Comparison<'a> {
    fn new(methods: &'a [CompletionMethod], details: &[DetailName], by_sample: &'a [Vec<Outcome>]) -> Self {
        let contenders: Vec<(&CompletionMethod, DetailName)> =
            methods.iter().flat_map(|method| details.iter().map(move |detail| (method, *detail))).collect();
        let scores_of = |value: &dyn Fn(&Outcome) -> Option<f64>| -> Vec<Scores> {
            (0..contenders.len()).map(|row| scores(by_sample, row, value)).collect()
        };
        let overlaps = scores_of(&|outcome| Some(outcome.overlap.iou));
        let surfaces = scores_of(&|outcome| Some(1e3 * outcome.surfaces.as_ref()?.distances.mean));
        let mean_of = |scores: &Scores| scores.interval(SEED).map_or(0.0, |interval| interval.mean);
        let baselines = (0..contenders.len()).filter(|row| contenders[*row].0.is_baseline());
        let best = baselines.max_by(|a, b| mean_of(&overlaps[*a]).total_cmp(&mean_of(&overlaps[*b])));
        let hollow = hollow_objects(by_sample);
        Self { contenders, details: details.len(), by_sample, hollow, overlaps, surfaces, best }
    }

    fn rows(&self) -> Vec<Row> {
        (0..self.contenders.len()).map(|row| self.row(row)).collect()
    }

    fn row(&self, row: usize) -> Row {
        let (method, detail) = self.contenders[row];
        let of_all = |value: &dyn Fn(&Outcome) -> Option<f64>| scores(self.by_sample, row, value).interval(SEED);
        let of_surfaces = |value: &dyn Fn(&SurfaceComparison) -> f64| {
            of_all(&|outcome| outcome.surfaces.as_ref().map(|scores| value(&scores.distances)))
        };
        let of_stratum = |is_hollow: bool| {
            let is_of = |outcome: &Outcome| self.hollow.get(&outcome.object) == Some(&is_hollow);
            of_all(&|outcome| is_of(outcome).then_some(outcome.overlap.iou))
        };
        let first = row - row % self.details;
        Row {
            name: match self.details {
                1 => method.name(),
                _ => format!("{}, {}", method.name(), detail.name()),
            },
            detail,
            surface_over_first_mm: (row != first)
                .then(|| self.surfaces[row].paired_difference(&self.surfaces[first], SEED))
                .flatten(),
            iou: self.overlaps[row].interval(SEED),
            unseen_iou: of_all(&|outcome| Some(outcome.overlap.unseen)),
            surface_mm: self.surfaces[row].interval(SEED),
            bias_mm: of_surfaces(&|surfaces| 1e3 * surfaces.bias),
            rms_mm: of_surfaces(&|surfaces| 1e3 * surfaces.rms),
            percentile_95_mm: of_surfaces(&|surfaces| 1e3 * surfaces.percentile_95),
            hausdorff_mm: of_surfaces(&|surfaces| 1e3 * surfaces.maximum),
            chamfer_mm2: of_surfaces(&|surfaces| 1e6 * surfaces.chamfer),
            f_score_percent: of_surfaces(&|surfaces| surfaces.f_score_percent),
            f_score_5mm: of_surfaces(&|surfaces| surfaces.f_score_5mm),
            mesh_iou: of_all(&|outcome| Some(outcome.surfaces.as_ref()?.volumes)),
            free_space_violation: of_all(&|outcome| outcome.surfaces.as_ref()?.free_space),
            iou_of_solid: of_stratum(false),
            iou_of_hollow_or_thin: of_stratum(true),
            volume_ratio: of_surfaces(&|surfaces| surfaces.volume_ratio),
            empty: self.by_sample.iter().filter(|outcomes| outcomes[row].is_empty).count(),
            iou_over_baseline: self
                .best
                .filter(|_| matches!(method, CompletionMethod::Model { .. }))
                .and_then(|best| self.overlaps[row].paired_difference(&self.overlaps[best], SEED)),
        }
    }
}

/// Scores of one row, by object; samples without the value are left out.
fn scores(by_sample: &[Vec<Outcome>], row: usize, value: &dyn Fn(&Outcome) -> Option<f64>) -> Scores {
    let mut scores = Scores::default();
    for outcome in by_sample.iter().map(|outcomes| &outcomes[row]) {
        if let Some(value) = value(outcome) {
            scores.add(&outcome.object, value);
        }
    }
    scores
}

fn methods(arguments: &EvaluateCompletionArgs, reader: &DatasetReader) -> Result<Vec<CompletionMethod>, Failure> {
    let models = arguments.model.iter().map(|folder| CompletionMethod::open(folder));
    let methods = arguments.method.iter().map(|name| CompletionMethod::by_name(name, reader));
    models.chain(methods).collect()
}

/// Whether each object is hollow or thin; without stored coverage nothing is known of it.
fn hollow_objects(by_sample: &[Vec<Outcome>]) -> BTreeMap<String, bool> {
    let mut sums: BTreeMap<String, [f64; 2]> = BTreeMap::new();
    for outcome in by_sample.iter().filter_map(|outcomes| outcomes.first()) {
        if let Some([solid, occupied]) = outcome.filled {
            let sum = sums.entry(outcome.object.clone()).or_default();
            (sum[0], sum[1]) = (sum[0] + solid, sum[1] + occupied);
        }
    }
    sums.into_iter().map(|(object, [solid, occupied])| (object, solid < SOLID_SHARE * occupied)).collect()
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
    answer: &Answer,
    detail: DetailName,
    sample: &StoredSample,
    truth: &TriMesh,
    points: u32,
) -> Result<Outcome, Failure> {
    let mesh = mesh_of(answer, sample, detail)?;
    let rule = SurfaceRule { samples: points as usize, seed: SEED };
    let surfaces = if points > 0 && !mesh.triangles.is_empty() && !truth.triangles.is_empty() {
        let id = sample.name.as_bytes();
        let free_space = sample.picture().map(|DepthFrame { camera, depth }| {
            free_space_violation(&sampled_surface(&mesh, &rule, id), camera, depth, sample.pair.grid.cell_size)
        });
        let distances = SurfaceComparison::new(&mesh, truth, &rule, id)?;
        Some(SurfaceScores { distances, volumes: mesh_overlap(&mesh, truth), free_space })
    } else {
        None
    };
    Ok(Outcome {
        object: sample.pair.sample.subject.to_string(),
        filled: sample.coverage.as_ref().map(|coverage| {
            let solid = coverage.values().iter().map(|share| f64::from(*share)).sum();
            [solid, f64::from(sample.pair.complete.count())]
        }),
        overlap: GridOverlap::new(&answer.cells(), &sample.pair.complete, &sample.pair.partial),
        is_empty: points > 0 && surfaces.is_none(),
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
        "{:width$}  {:20}  {:20}  {:20}  {:6}  {:8}  {:6}  {:6}  {:6}",
        "", "IoU", "IoU, unseen", "surface [mm]", "F, 1 %", "mesh IoU", "volume", "bias", "free"
    );
    let three = |interval: &Option<Interval>| {
        interval.map_or("-".to_owned(), |found| format!("{:.3} [{:.3}, {:.3}]", found.mean, found.low, found.high))
    };
    let two = |interval: &Option<Interval>| {
        interval.map_or("-".to_owned(), |found| format!("{:.2} [{:.2}, {:.2}]", found.mean, found.low, found.high))
    };
    let one = |interval: &Option<Interval>| interval.map_or("-".to_owned(), |found| format!("{:.3}", found.mean));
    let signed = |interval: &Option<Interval>| interval.map_or("-".to_owned(), |found| format!("{:+.2}", found.mean));
    let percent =
        |interval: &Option<Interval>| interval.map_or("-".to_owned(), |found| format!("{:.1} %", 100.0 * found.mean));
    for row in &report.rows {
        let (iou, unseen, surface) = (three(&row.iou), three(&row.unseen_iou), two(&row.surface_mm));
        let (f_score, meshes, volume) = (one(&row.f_score_percent), one(&row.mesh_iou), one(&row.volume_ratio));
        let (name, bias, free) = (&row.name, signed(&row.bias_mm), percent(&row.free_space_violation));
        _ = writeln!(
            text,
            "{name:width$}  {iou:20}  {unseen:20}  {surface:20}  {f_score:6}  {meshes:8}  {volume:6}  {bias:6}  {free:6}"
        );
    }
    for Row { name, iou_of_solid, iou_of_hollow_or_thin, .. } in &report.rows {
        if let (Some(solid), Some(hollow)) = (iou_of_solid, iou_of_hollow_or_thin) {
            _ = writeln!(
                text,
                "{name}: IoU {:.3} [{:.3}, {:.3}] of {} solid objects, {:.3} [{:.3}, {:.3}] of {} hollow or thin ones",
                solid.mean, solid.low, solid.high, solid.objects, hollow.mean, hollow.low, hollow.high, hollow.objects
            );
        }
    }
    for Row { name, surface_over_first_mm, .. } in &report.rows {
        if let Some(Interval { mean, low, high, .. }) = surface_over_first_mm {
            let claim = if *low > 0.0 || *high < 0.0 { "" } else { ": no difference is shown" };
            _ = writeln!(
                text,
                "{name}: surface less that of the first --detail {mean:+.2} [{low:+.2}, {high:+.2}] mm, paired by object{claim}"
            );
        }
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
