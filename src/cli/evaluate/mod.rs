//! `graspmill evaluate completion`: models and baselines on the samples of a dataset.

mod comparison;
mod shown;
mod words;

use self::{
    comparison::{Comparison, Report},
    shown::samples_to_show,
    words::{evaluation, text},
};
use super::{
    completion_args::EvaluateCompletionArgs,
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
    GridOverlap, SurfaceComparison, SurfaceRule, TrueGeodesics, TrueSurface, free_space_violation, mesh_overlap,
};
use runtime::completion::DepthFrame;
use surface::{CompletedMesh, CubeField, OBSTACLE_THRESHOLD};

/// Seed of samples on surfaces and of resamples.
const SEED: u64 = 0;

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
    /// Divergence of the geodesic distances from the truth's, and of the truth's from themselves; `None` where nobody asked.
    geodesics: Option<[f64; 2]>,
}

/// The true surface of a sample, prepared for comparisons.
struct Truth<'a> {
    mesh: &'a TriMesh,
    surface: TrueSurface<'a>,
    geodesics: Option<TrueGeodesics>,
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
    if let Some(path) = &arguments.out {
        let shown = samples_to_show(&methods, arguments.detail.len(), &by_sample, (&reader, &chosen))?;
        evaluation(&report, &reader, shown)?.write(path)?;
    }
    if arguments.json {
        printer.json(&report)?;
    } else {
        printer.result(&text(&report));
        if let Some(path) = &arguments.out {
            printer.result(&format!("page: {}", path.display()));
        }
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
    let rule = SurfaceRule { samples: arguments.surface_samples as usize, seed: SEED };
    let is_compared = rule.samples > 0 && !truth.triangles.is_empty();
    let id = sample.name.as_bytes();
    let prepared = || {
        let geodesics = arguments.geodesics.then(|| TrueGeodesics::new(truth, rule, id)).transpose()?;
        Ok::<_, Failure>(Truth { mesh: truth, surface: TrueSurface::new(truth, rule, id)?, geodesics })
    };
    let truth = is_compared.then(prepared).transpose()?;
    let mut outcomes = Vec::new();
    for method in methods {
        let answer = method.complete(sample)?;
        for detail in &arguments.detail {
            let surfaces = match &truth {
                Some(truth) => surface_scores(&mesh_of(&answer, sample, *detail)?, truth, sample)?,
                None => None,
            };
            outcomes.push(Outcome {
                object: sample.pair.sample.subject.to_string(),
                filled: sample.coverage.as_ref().map(|coverage| {
                    let solid = coverage.values().iter().map(|share| f64::from(*share)).sum();
                    [solid, f64::from(sample.pair.complete.count())]
                }),
                overlap: GridOverlap::new(&answer.cells(), &sample.pair.complete, &sample.pair.partial),
                is_empty: rule.samples > 0 && surfaces.is_none(),
                surfaces,
            });
        }
    }
    Ok(outcomes)
}

fn methods(arguments: &EvaluateCompletionArgs, reader: &DatasetReader) -> Result<Vec<CompletionMethod>, Failure> {
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

/// Scores of a completed mesh; `None` where it has no triangle.
fn surface_scores(mesh: &TriMesh, truth: &Truth, sample: &StoredSample) -> Result<Option<SurfaceScores>, Failure> {
    if mesh.triangles.is_empty() {
        return Ok(None);
    }
    let points = truth.surface.points_of(mesh);
    let free_space = sample
        .picture()
        .map(|DepthFrame { camera, depth }| free_space_violation(&points, camera, depth, sample.pair.grid.cell_size));
    let geodesics = truth.geodesics.as_ref().map(|truth| Ok::<_, Failure>([truth.divergence(mesh)?, truth.floor()]));
    Ok(Some(SurfaceScores {
        distances: truth.surface.compare(mesh)?,
        volumes: mesh_overlap(mesh, truth.mesh),
        free_space,
        geodesics: geodesics.transpose()?,
    }))
}
