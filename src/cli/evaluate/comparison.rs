//! Comparison of completions: one row per completion method and meshing method.

use std::collections::BTreeMap;

use serde::Serialize;

use super::outcome::{Outcome, SEED};
use crate::{completion_args::DetailName, completion_method::CompletionMethod};
use measure::{Interval, Scores, SurfaceComparison, VertexComparison};

/// Solid share of the volume of an object's occupied cells below which the object counts as hollow or thin.
const SOLID_SHARE: f64 = 0.5;

/// Result of the comparison.
#[derive(Serialize)]
pub(super) struct Report {
    /// Root digest of the dataset.
    pub dataset: String,
    pub split: String,
    pub samples: usize,
    /// Points per surface; 0 if surfaces were not compared.
    pub surface_samples: u32,
    /// Surface that serves as the true one.
    pub truth: &'static str,
    /// Whether the table has additional columns by the thesis's rules.
    #[serde(skip)]
    pub has_thesis_rules: bool,
    pub rows: Vec<Row>,
}

/// One model or baseline. Means are those of objects, with 95 % intervals by bootstrap over objects.
#[derive(Serialize)]
pub(super) struct Row {
    pub name: String,
    /// Meshing method.
    pub detail: DetailName,
    pub iou: Option<Interval>,
    /// Intersection over union of the cells without an observed point.
    pub unseen_iou: Option<Interval>,
    /// Mean distance between the surfaces, both directions [mm].
    pub surface_mm: Option<Interval>,
    /// Mean signed distance from the true surface [mm], positive outside.
    pub bias_mm: Option<Interval>,
    /// Root of the mean square of the distances, both directions [mm].
    pub rms_mm: Option<Interval>,
    /// 95th percentile of the distances [mm].
    pub percentile_95_mm: Option<Interval>,
    /// The largest distance [mm]: the Hausdorff distance.
    pub hausdorff_mm: Option<Interval>,
    /// Sum of both directions' mean squares [mm^2].
    pub chamfer_mm2: Option<Interval>,
    /// Points within 1 % of the longest side, both directions.
    pub f_score_percent: Option<Interval>,
    /// Points within 5 mm, both directions.
    pub f_score_5mm: Option<Interval>,
    /// Intersection over union of the meshes' volumes.
    pub mesh_iou: Option<Interval>,
    /// Volume as a share of the true volume.
    pub volume_ratio: Option<Interval>,
    /// Share of the surface more than 8 mm in front of every depth within 3 pixels; `None` without stored depth.
    pub free_space_violation: Option<Interval>,
    /// Samples whose mesh has disconnected bodies.
    pub in_bodies: usize,
    /// Share of the area outside the largest body.
    pub loose_area: Option<Interval>,
    /// Share of the volume outside the largest body.
    pub loose_volume: Option<Interval>,
    /// Divergence between the mean geodesic distances on the surface and on the true one; `None` if it was not requested.
    pub geodesic_divergence: Option<Interval>,
    /// Divergence between two samplings of the true surface: a difference below this value is not significant.
    pub geodesic_floor: Option<Interval>,
    /// Intersection over union of the meshes' volumes by the thesis's rule: only in the box of the true mesh, counting surface
    /// cells. `None` without these rules, as are the next two.
    pub thesis_mesh_iou: Option<Interval>,
    /// Mean distance of the vertices of both meshes from the other surface [mm], with MeshLab's defaults.
    pub thesis_surface_mm: Option<Interval>,
    /// The largest of these distances [mm].
    pub thesis_hausdorff_mm: Option<Interval>,
    /// Intersection over union of objects of which at least half of the occupied cells' volume is solid.
    pub iou_of_solid: Option<Interval>,
    /// Intersection over union of hollow and thin objects; both are `None` without stored coverage.
    pub iou_of_hollow_or_thin: Option<Interval>,
    /// Samples for which nothing was completed.
    pub empty: usize,
    /// Mean distance between the surfaces minus that of the first meshing method, paired by object [mm]; `None` for the first
    /// meshing method itself.
    pub surface_over_first_mm: Option<Interval>,
    /// Intersection over union minus that of the best baseline, paired by object; `None` for baselines.
    pub iou_over_baseline: Option<Interval>,
}

/// Scores of all samples, by row.
pub(super) struct Comparison<'a> {
    /// Completion method and meshing method of each row.
    contenders: Vec<(&'a CompletionMethod, DetailName)>,
    /// Meshing methods per completion method.
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
    pub fn new(methods: &'a [CompletionMethod], details: &[DetailName], by_sample: &'a [Vec<Outcome>]) -> Self {
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

    pub fn rows(&self) -> Vec<Row> {
        (0..self.contenders.len()).map(|row| self.row(row)).collect()
    }

    fn row(&self, row: usize) -> Row {
        let (method, detail) = self.contenders[row];
        let of_all = |value: &dyn Fn(&Outcome) -> Option<f64>| scores(self.by_sample, row, value).interval(SEED);
        let of_surfaces = |value: &dyn Fn(&SurfaceComparison) -> f64| {
            of_all(&|outcome| outcome.surfaces.as_ref().map(|scores| value(&scores.distances)))
        };
        let of_vertices = |value: &dyn Fn(&VertexComparison) -> f64| {
            of_all(&|outcome| Some(value(outcome.surfaces.as_ref()?.thesis.as_ref()?.vertices.as_ref()?)))
        };
        let of_geodesics = |which: usize| of_all(&|outcome| Some(outcome.surfaces.as_ref()?.geodesics?[which]));
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
            in_bodies: self.by_sample.iter().filter(|outcomes| is_in_bodies(&outcomes[row])).count(),
            loose_area: of_all(&|outcome| Some(outcome.surfaces.as_ref()?.bodies.loose_area)),
            loose_volume: of_all(&|outcome| Some(outcome.surfaces.as_ref()?.bodies.loose_volume)),
            geodesic_divergence: of_geodesics(0),
            geodesic_floor: of_geodesics(1),
            thesis_mesh_iou: of_all(&|outcome| Some(outcome.surfaces.as_ref()?.thesis.as_ref()?.volumes)),
            thesis_surface_mm: of_vertices(&|vertices| 1e3 * vertices.mean),
            thesis_hausdorff_mm: of_vertices(&|vertices| 1e3 * vertices.maximum),
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

/// Whether the mesh of a sample has disconnected bodies.
fn is_in_bodies(outcome: &Outcome) -> bool {
    outcome.surfaces.as_ref().is_some_and(|surfaces| surfaces.bodies.bodies > 1)
}

/// Scores of one row by object, without samples that lack the value.
fn scores(by_sample: &[Vec<Outcome>], row: usize, value: &dyn Fn(&Outcome) -> Option<f64>) -> Scores {
    let mut scores = Scores::default();
    for outcome in by_sample.iter().map(|outcomes| &outcomes[row]) {
        if let Some(value) = value(outcome) {
            scores.add(&outcome.object, value);
        }
    }
    scores
}

/// Whether each object is hollow or thin; empty without stored coverage.
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
