//! Scores of one sample: its completions compared with the truth.

use crate::{
    completion_args::{EvaluateCompletionArgs, RulesName},
    completion_method::CompletionMethod,
    exit::Failure,
    stored_samples::StoredSample,
};
use kernel::geom::TriMesh;
use measure::{
    GridOverlap, SurfaceComparison, SurfaceRule, TrueGeodesics, TrueSurface, VertexComparison, free_space_violation,
    mesh_overlap, mesh_overlap_by_thesis,
};
use surface::{CompletedMesh, CubeField, LooseBodies, OBSTACLE_THRESHOLD};

/// Seed of samples on surfaces and of resamples.
pub(super) const SEED: u64 = 0;

/// Scores of one sample.
pub(super) struct Outcome {
    pub object: String,
    pub overlap: GridOverlap,
    /// Solid volume in the grid and volume of the occupied cells [cells]; `None` without stored coverage.
    pub filled: Option<[f64; 2]>,
    /// `None` if surfaces are not compared, or one of the two has no triangle.
    pub surfaces: Option<SurfaceScores>,
    /// Whether surfaces are compared but the completion has none.
    pub is_empty: bool,
}

/// Scores of one completed surface.
pub(super) struct SurfaceScores {
    pub distances: SurfaceComparison,
    /// Intersection over union of the volumes.
    pub volumes: f64,
    /// Share of the surface in observed free space; `None` without stored depth.
    pub free_space: Option<f64>,
    /// Disconnected bodies of the mesh, and their shares.
    pub bodies: LooseBodies,
    /// Divergence between the geodesic distances and the true ones, and between two samplings of the true surface; `None` if not
    /// requested.
    pub geodesics: Option<[f64; 2]>,
    /// Scores by the rules of the thesis's tools; `None` if not requested.
    pub thesis: Option<ThesisScores>,
}

/// Scores of one completed surface by the rules of the thesis's tools.
pub(super) struct ThesisScores {
    /// Intersection over union of the volumes, only in the box of the true mesh.
    pub volumes: f64,
    /// Distances of vertices; `None` if every vertex of a mesh is too far away.
    pub vertices: Option<VertexComparison>,
}

/// The true surface of a sample, prepared for comparisons.
struct Truth<'a> {
    mesh: &'a TriMesh,
    surface: TrueSurface<'a>,
    geodesics: Option<TrueGeodesics>,
    rules: RulesName,
    /// Whether a pixel without a return shows that nothing is there.
    is_perfect_sensor: bool,
}

/// Scores of a sample: one row per completion method and meshing method, grouped by completion method.
pub(super) fn outcomes(
    arguments: &EvaluateCompletionArgs,
    methods: &[CompletionMethod],
    sample: &StoredSample,
    (truth, is_perfect_sensor): (&TriMesh, bool),
) -> Result<Vec<Outcome>, Failure> {
    let rule = SurfaceRule { samples: arguments.surface_samples as usize, seed: SEED };
    let is_compared = rule.samples > 0 && !truth.triangles.is_empty();
    let id = sample.name.as_bytes();
    let prepared = || {
        let geodesics = arguments.geodesics.then(|| TrueGeodesics::new(truth, rule, id)).transpose()?;
        let surface = TrueSurface::new(truth, rule, id)?;
        Ok::<_, Failure>(Truth { mesh: truth, surface, geodesics, rules: arguments.rules, is_perfect_sensor })
    };
    let truth = is_compared.then(prepared).transpose()?;
    let mut outcomes = Vec::new();
    for method in methods {
        let answer = method.complete(sample)?;
        for detail in &arguments.detail {
            let surfaces = match &truth {
                Some(truth) => surface_scores(&method.mesh(&answer, sample, *detail)?, truth, sample)?,
                None => None,
            };
            outcomes.push(Outcome {
                object: sample.object.to_string(),
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

/// Surface that serves as the true one: that of coverage, or of the occupied cells if no coverage is stored.
pub(super) fn truth_mesh(sample: &StoredSample) -> TriMesh {
    let occupied = CubeField::from_grid(&sample.pair.complete);
    let placement = &sample.pair.grid;
    match &sample.coverage {
        Some(coverage) => CompletedMesh::surface(coverage, &occupied, placement).mesh,
        None => CompletedMesh::obstacle(&occupied, placement, OBSTACLE_THRESHOLD).mesh,
    }
}

/// Scores of a completed mesh; `None` if it has no triangle.
fn surface_scores(mesh: &TriMesh, truth: &Truth, sample: &StoredSample) -> Result<Option<SurfaceScores>, Failure> {
    if mesh.triangles.is_empty() {
        return Ok(None);
    }
    let free_space =
        sample.seen_depths(truth.is_perfect_sensor).map(|(camera, depth)| free_space_violation(mesh, &camera, depth));
    let geodesics = truth.geodesics.as_ref().map(|truth| Ok::<_, Failure>([truth.divergence(mesh)?, truth.floor()]));
    let by_thesis = || {
        let vertices = VertexComparison::new(mesh, truth.mesh)?;
        Ok::<_, Failure>(ThesisScores { volumes: mesh_overlap_by_thesis(mesh, truth.mesh), vertices })
    };
    Ok(Some(SurfaceScores {
        distances: truth.surface.compare(mesh)?,
        volumes: mesh_overlap(mesh, truth.mesh),
        free_space,
        bodies: LooseBodies::from_mesh(mesh),
        geodesics: geodesics.transpose()?,
        thesis: (truth.rules == RulesName::Thesis).then(by_thesis).transpose()?,
    }))
}
