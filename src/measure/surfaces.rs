//! Distances between the surfaces of two meshes, by points that are drawn evenly over each.

use kernel::{
    geom::{MeshQuery, NoSurface, TriMesh},
    seed::Stream,
};
use nalgebra::Point3;

use crate::inside::MeshInside;

/// Distance within which a point counts as found, as a share of the truth's longest side.
const SHARE_FOUND: f64 = 0.01;
/// Distance within which a point counts as found [m].
const METRES_FOUND: f64 = 0.005;

/// Rule by which surfaces are sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceRule {
    /// Points per mesh.
    pub samples: usize,
    /// Seed of the draws.
    pub seed: u64,
}

impl Default for SurfaceRule {
    fn default() -> Self {
        Self { samples: 10_000, seed: 0 }
    }
}

/// Distances of two surfaces. Directions are equally weighted, since both have equally many points.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SurfaceComparison {
    /// Mean of both directions' mean distances [m]: what tables of the thesis call Hausdorff.
    pub mean: f64,
    /// Mean distance from the found surface to the true one [m].
    pub found_to_truth: f64,
    /// Mean distance from the true surface to the found one [m].
    pub truth_to_found: f64,
    /// Mean signed distance of the found surface from the true one [m], positive outside: above 0 the completion is too fat.
    pub bias: f64,
    /// Root of the mean square over both directions [m].
    pub rms: f64,
    /// 95 % of all points are nearer than this [m].
    pub percentile_95: f64,
    /// The largest distance [m]: the Hausdorff distance of the points.
    pub maximum: f64,
    /// Sum of both directions' mean squares [m^2].
    pub chamfer: f64,
    /// Harmonic mean of the shares of points within 1 % of the truth's longest side of the other surface.
    pub f_score_percent: f64,
    /// Harmonic mean of the shares of points within 5 mm.
    pub f_score_5mm: f64,
    /// Volume of the found mesh as a share of the true one's.
    pub volume_ratio: f64,
    /// Longest side of the true mesh's box [m].
    pub longest_side: f64,
}

impl SurfaceComparison {
    /// Compares two closed meshes in one frame; `id` names the sample that they belong to.
    ///
    /// # Errors
    /// When one of them has no triangles.
    pub fn new(found: &TriMesh, truth: &TriMesh, rule: &SurfaceRule, id: &[u8]) -> Result<Self, NoSurface> {
        TrueSurface::new(truth, *rule, id)?.compare(found)
    }
}

/// A true surface, prepared for comparisons with several found ones.
pub struct TrueSurface<'a> {
    mesh: &'a TriMesh,
    rule: SurfaceRule,
    id: Vec<u8>,
    points: Vec<Point3<f64>>,
    query: MeshQuery,
    inside: MeshInside<'a>,
}

impl<'a> TrueSurface<'a> {
    /// Prepares a closed mesh; `id` names the sample that it belongs to.
    ///
    /// # Errors
    /// When it has no triangles.
    pub fn new(mesh: &'a TriMesh, rule: SurfaceRule, id: &[u8]) -> Result<Self, NoSurface> {
        let query = MeshQuery::new(mesh)?;
        let mut draw = Stream::of_job(rule.seed, id, "points of the true surface");
        let points = positions(surface_points(mesh, rule.samples, &mut draw));
        Ok(Self { mesh, rule, id: id.to_owned(), points, query, inside: MeshInside::new(mesh) })
    }

    /// Points of a found surface [m], those that are compared.
    ///
    /// # Panics
    /// When it has no triangles.
    pub fn points_of(&self, found: &TriMesh) -> Vec<Point3<f64>> {
        let mut draw = Stream::of_job(self.rule.seed, &self.id, "points of the found surface");
        positions(surface_points(found, self.rule.samples, &mut draw))
    }

    /// Compares a closed mesh in the frame of the true one with it.
    ///
    /// # Errors
    /// When it has no triangles.
    pub fn compare(&self, found: &TriMesh) -> Result<SurfaceComparison, NoSurface> {
        let found_query = MeshQuery::new(found)?;
        let found_points = self.points_of(found);
        let distances = |points: &[Point3<f64>], query: &MeshQuery| -> Vec<f64> {
            points.iter().map(|point| query.distance(point)).collect()
        };
        let (to_truth, to_found) = (distances(&found_points, &self.query), distances(&self.points, &found_query));
        let signed = found_points.iter().zip(&to_truth);
        let signed = signed.map(|(point, distance)| if self.inside.contains(point) { -distance } else { *distance });
        let bias = signed.sum::<f64>() / found_points.len().max(1) as f64;
        let longest_side = self.mesh.aabb().map_or(0.0, |bounds| bounds.longest_side());
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let mean_square =
            |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64;
        let within = |values: &[f64], bound: f64| {
            values.iter().filter(|value| **value <= bound).count() as f64 / values.len().max(1) as f64
        };
        let f_score = |bound: f64| {
            let (precision, recall) = (within(&to_truth, bound), within(&to_found, bound));
            if precision + recall > 0.0 { 2.0 * precision * recall / (precision + recall) } else { 0.0 }
        };
        let mut all = [to_truth.as_slice(), to_found.as_slice()].concat();
        all.sort_by(f64::total_cmp);
        Ok(SurfaceComparison {
            mean: (mean(&to_truth) + mean(&to_found)) / 2.0,
            found_to_truth: mean(&to_truth),
            truth_to_found: mean(&to_found),
            bias,
            rms: mean_square(&all).sqrt(),
            percentile_95: all.get(all.len() * 19 / 20).copied().unwrap_or(0.0),
            maximum: all.last().copied().unwrap_or(0.0),
            chamfer: mean_square(&to_truth) + mean_square(&to_found),
            f_score_percent: f_score(SHARE_FOUND * longest_side),
            f_score_5mm: f_score(METRES_FOUND),
            volume_ratio: found.signed_volume() / self.mesh.signed_volume(),
            longest_side,
        })
    }
}

/// A point of a surface.
pub(crate) struct SurfacePoint {
    /// Index of the triangle that it lies in.
    pub triangle: usize,
    /// [m].
    pub position: Point3<f64>,
}

fn positions(points: Vec<SurfacePoint>) -> Vec<Point3<f64>> {
    points.into_iter().map(|point| point.position).collect()
}

/// Points drawn evenly over a surface: one from each of `count` parts of equal area.
pub(crate) fn surface_points(mesh: &TriMesh, count: usize, draw: &mut Stream) -> Vec<SurfacePoint> {
    let mut ends = Vec::with_capacity(mesh.triangles.len());
    let mut total = 0.0;
    for index in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(index);
        total += (b - a).cross(&(c - a)).norm();
        ends.push(total);
    }
    let mut points = Vec::with_capacity(count);
    for part in 0..count {
        let at = (part as f64 + draw.unit()) / count as f64 * total;
        let triangle = ends.partition_point(|end| *end <= at).min(ends.len() - 1);
        let [a, b, c] = mesh.corners(triangle);
        // Uniform in a triangle by a square root (Osada et al. 2002, "Shape distributions").
        let (root, share) = (draw.unit().sqrt(), draw.unit());
        let position = a + (b - a) * (root * (1.0 - share)) + (c - a) * (root * share);
        points.push(SurfacePoint { triangle, position });
    }
    points
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A closed box from a corner [m] with these sides, each face of two triangles.
    pub(crate) fn cuboid(low: [f64; 3], sides: [f64; 3]) -> TriMesh {
        let corner =
            |index: usize| std::array::from_fn(|axis| (low[axis] + sides[axis] * (index >> axis & 1) as f64) as f32);
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        TriMesh { vertices: (0..8).map(corner).collect(), triangles }
    }

    #[test]
    fn boxes_have_distances_in_closed_form() {
        let truth = cuboid([0.0; 3], [0.1, 0.1, 0.1]);
        assert!(truth.signed_volume() > 0.0);
        let rule = SurfaceRule::default();
        let same = SurfaceComparison::new(&truth, &truth, &rule, b"same").expect("surfaces");
        assert!(same.maximum < 1e-8 && same.f_score_percent == 1.0 && same.volume_ratio == 1.0, "{same:?}");
        // A box inside, 5 mm from each face: its points are 5 mm from the truth.
        let inner = cuboid([0.005; 3], [0.09, 0.09, 0.09]);
        let found = SurfaceComparison::new(&inner, &truth, &rule, b"inner").expect("surfaces");
        assert!((found.found_to_truth - 0.005).abs() < 1e-6, "{found:?}");
        assert!((found.volume_ratio - 0.729).abs() < 1e-6);
        // All of it is inside, where distances count below 0; the other way round the bias is that of the truth's samples.
        assert!((found.bias + 0.005).abs() < 1e-6, "{found:?}");
        let outer = SurfaceComparison::new(&truth, &inner, &rule, b"inner").expect("surfaces");
        assert!((outer.bias - outer.found_to_truth).abs() < 1e-9 && outer.bias > 0.005, "{outer:?}");
        // A point of a face at (x, y) is sqrt(25 + dx^2 + dy^2) mm away, where dx and dy are how far it lies beyond the
        // inner box: 81 % of each face sees 5 mm exactly.
        let steps = 2000;
        let beyond = |index: usize| {
            let x = (f64::from(index as u32) + 0.5) / f64::from(steps) * 0.1;
            (0.005 - x).max(x - 0.095).max(0.0)
        };
        let mut sum = 0.0;
        for x in 0..steps as usize {
            for y in (0..steps as usize).step_by(10) {
                sum += (0.005_f64.powi(2) + beyond(x).powi(2) + beyond(y).powi(2)).sqrt();
            }
        }
        let wanted = sum / f64::from(steps) / f64::from(steps / 10);
        assert!((found.truth_to_found - wanted).abs() < 2e-5, "{found:?}, {wanted}");
        assert!(found.maximum > 0.0080 && found.maximum < 0.00867, "the corner is 8.66 mm away: {found:?}");
        assert!((found.mean - (found.found_to_truth + found.truth_to_found) / 2.0).abs() < 1e-15);
        assert_eq!(found.f_score_percent, 0.0, "nothing is within 1 mm");
        // All of a box 4 mm inside is within 5 mm, and what sees it from beyond its edges by up to 3 mm; nothing of one 6 mm inside.
        let within = |gap: f64| {
            let inner = cuboid([gap; 3], [0.1 - 2.0 * gap; 3]);
            SurfaceComparison::new(&inner, &truth, &rule, b"inner").expect("surfaces").f_score_5mm
        };
        assert!((0.97..1.0).contains(&within(0.004)) && within(0.006) == 0.0, "{} {}", within(0.004), within(0.006));
        // The parts of a face that see the inner box straight, at 5 mm, and those beside it, in metres squared.
        let square = found.found_to_truth.powi(2);
        assert!(found.chamfer > 2.0 * square && found.chamfer < 2.0 * square + 0.19 * 5e-5, "{found:?}");
        assert!((2.0 * found.rms.powi(2) - found.chamfer).abs() < 1e-12, "equally many points on both: {found:?}");
        assert!((found.longest_side - 0.1).abs() < 1e-8);
        // Both orders are alike, but for what is relative to the truth.
        let back = SurfaceComparison::new(&truth, &inner, &rule, b"inner").expect("surfaces");
        assert!((back.mean - found.mean).abs() < 2e-5);
    }

    #[test]
    fn a_shifted_box_and_an_empty_mesh() {
        let truth = cuboid([0.0; 3], [0.2, 0.1, 0.05]);
        let shifted = cuboid([0.004, 0.0, 0.0], [0.2, 0.1, 0.05]);
        let rule = SurfaceRule { samples: 4000, seed: 3 };
        let found = SurfaceComparison::new(&shifted, &truth, &rule, b"a").expect("surfaces");
        // Only the end faces lie apart, 4 mm; the rest lies on the other's faces but for a strip at the end.
        assert!(found.maximum <= 0.004 + 1e-8 && found.mean < 0.001, "{found:?}");
        assert_eq!(found.f_score_5mm, 1.0);
        assert!(found.f_score_percent == 0.0 || found.f_score_percent < 1.0);
        assert_eq!(SurfaceComparison::new(&shifted, &truth, &rule, b"a").expect("surfaces"), found);
        assert_ne!(SurfaceComparison::new(&shifted, &truth, &rule, b"b").expect("surfaces"), found);
        assert!(SurfaceComparison::new(&TriMesh::default(), &truth, &rule, b"a").is_err());
    }
}
