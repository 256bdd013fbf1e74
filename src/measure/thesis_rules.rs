//! Measures by the rules of the tools that the thesis used (section 5.4): binvox for overlaps of meshes, MeshLab for distances.
//!
//! Tables for comparison with the thesis show them next to the measures of `standard`. They are less accurate: parts of a
//! completion outside the truth's box are not counted, and surfaces are weighted by their vertices.

use kernel::{
    geom::{MeshQuery, NoSurface, TriMesh},
    voxel::cells_met,
};
use nalgebra::Point3;

/// Cells along the longest side of the truth's box.
const CELLS: u32 = 80;
/// Vertices farther from the other surface than this share of the diagonal of their own mesh's box are not counted.
const FARTHEST: f64 = 0.5;

/// Intersection over union of the volumes of two closed meshes by a cube of 80^3 cells from the lower corner of the box of the truth
/// alone, along the longest side of that box. A cell is occupied when its centre is inside or the surface passes through it; nothing outside of
/// the grid is counted, so that the order matters. 1 where the truth has no triangle, nor the found mesh; 0 where one of both
/// has none.
pub fn mesh_overlap_by_thesis(found: &TriMesh, truth: &TriMesh) -> f64 {
    let Some(bounds) = truth.aabb() else { return if found.triangles.is_empty() { 1.0 } else { 0.0 } };
    let cell = bounds.longest_side() / f64::from(CELLS);
    if cell <= 0.0 {
        return 0.0;
    }
    let [found, truth] = [found, truth].map(|mesh| cells_met(mesh, &bounds.min, cell, CELLS));
    let both = found.count_both(&truth);
    match found.count() + truth.count() - both {
        0 => 0.0,
        either => f64::from(both) / f64::from(either),
    }
}

/// Distances of two surfaces from each other's vertices, as MeshLab's filter gives them by default.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct VertexComparison {
    /// Mean distance of the vertices of both meshes from the other surface [m]: what tables of the thesis call Hausdorff.
    pub mean: f64,
    /// Mean distance of the found mesh's vertices from the true surface [m].
    pub found_to_truth: f64,
    /// Mean distance of the true mesh's vertices from the found surface [m].
    pub truth_to_found: f64,
    /// The largest distance [m].
    pub maximum: f64,
    /// Count of vertices that are farther away than half the diagonal of their own mesh's box, which no number counts.
    pub ignored: usize,
}

impl VertexComparison {
    /// Compares two meshes in one frame; `None` if every vertex of a mesh is too far away to count.
    ///
    /// # Errors
    /// When one of them has no triangles.
    pub fn new(found: &TriMesh, truth: &TriMesh) -> Result<Option<Self>, NoSurface> {
        let [to_truth, to_found] = [(found, truth), (truth, found)].map(|(mesh, other)| distances(mesh, other));
        let (to_truth, to_found) = (to_truth?, to_found?);
        if to_truth.is_empty() || to_found.is_empty() {
            return Ok(None);
        }
        let counted = to_truth.len() + to_found.len();
        let sum = |values: &[f64]| values.iter().sum::<f64>();
        let maximum = to_truth.iter().chain(&to_found).copied().fold(0.0, f64::max);
        Ok(Some(Self {
            mean: (sum(&to_truth) + sum(&to_found)) / counted as f64,
            found_to_truth: sum(&to_truth) / to_truth.len() as f64,
            truth_to_found: sum(&to_found) / to_found.len() as f64,
            maximum,
            ignored: found.vertices.len() + truth.vertices.len() - counted,
        }))
    }
}

/// Distances of a mesh's vertices from another surface [m], of those that count.
fn distances(mesh: &TriMesh, other: &TriMesh) -> Result<Vec<f64>, NoSurface> {
    let query = MeshQuery::new(other)?;
    let farthest = mesh.aabb().map_or(0.0, |bounds| FARTHEST * (bounds.max - bounds.min).norm());
    let distances = mesh.vertices.iter().map(|vertex| query.distance(&Point3::from(vertex.map(f64::from))));
    Ok(distances.filter(|distance| *distance < farthest).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{mesh_overlap::mesh_overlap, surfaces::tests::cuboid};

    #[test]
    fn cells_of_the_truth_s_box_alone_are_compared() {
        // Cells have 1.25 mm; no face but those of the truth's ends along x lies on a border.
        let sides = [0.1, 0.0805, 0.0605];
        let truth = cuboid([0.0; 3], sides);
        assert_eq!(mesh_overlap_by_thesis(&truth, &truth), 1.0);
        // Shifted by 16.4 cells: 64 of 80 layers are left, that of the surface among them, and what sticks out is free.
        let shifted = cuboid([0.0205, 0.0, 0.0], sides);
        assert_eq!(mesh_overlap_by_thesis(&shifted, &truth), 64.0 / 80.0);
        assert!(mesh_overlap(&shifted, &truth) < 0.67);
        // A box that is twice as large fills the whole cube, of which the truth has 80 x 65 x 49 cells; of that box's own cells,
        // which are larger, it has as many, and the truth 40 x 33 x 25.
        let around = cuboid([0.0; 3], sides.map(|side| 2.0 * side));
        assert_eq!(mesh_overlap_by_thesis(&around, &truth), 80.0 * 65.0 * 49.0 / 80.0_f64.powi(3));
        let back = mesh_overlap_by_thesis(&truth, &around);
        let least = 40.0 * 33.0 * 25.0 / (80.0 * 65.0 * 49.0);
        // The middle layer of 80 may be met or not: the face lies on its border.
        assert!(back >= least && back <= least * 41.0 / 40.0, "{back} {least}");
        assert_eq!(mesh_overlap_by_thesis(&TriMesh::default(), &TriMesh::default()), 1.0);
        assert_eq!(mesh_overlap_by_thesis(&TriMesh::default(), &truth), 0.0);
        assert_eq!(mesh_overlap_by_thesis(&truth, &TriMesh::default()), 0.0);
    }

    #[test]
    fn vertices_count_alike_whatever_they_stand_for() {
        let truth = cuboid([0.0; 3], [0.1; 3]);
        // Corners of a box inside, 5 mm from each face; those of the box around it are sqrt(3) times as far away.
        let inner = cuboid([0.005; 3], [0.09; 3]);
        let found = VertexComparison::new(&inner, &truth).expect("surfaces").expect("vertices");
        let root = 3.0_f64.sqrt();
        for (value, wanted) in [
            (found.found_to_truth, 0.005),
            (found.truth_to_found, 0.005 * root),
            (found.mean, 0.0025 * (1.0 + root)),
            (found.maximum, 0.005 * root),
        ] {
            assert!((value - wanted).abs() < 1e-8, "{found:?}");
        }
        assert_eq!(found.ignored, 0);
        // A vertex in the middle of a face changes the mean and not the surface.
        let mut finer = truth.clone();
        let [a, b, c] = finer.triangles[0];
        let middle: [f32; 3] = std::array::from_fn(|axis| {
            [a, b, c].iter().map(|at| finer.vertices[*at as usize][axis]).sum::<f32>() / 3.0
        });
        finer.vertices.push(middle);
        finer.triangles[0] = [a, b, 8];
        finer.triangles.extend([[b, c, 8], [c, a, 8]]);
        let finer = VertexComparison::new(&inner, &finer).expect("surfaces").expect("vertices");
        assert!((finer.truth_to_found - (8.0 * 0.005 * root + 0.005) / 9.0).abs() < 1e-8, "{finer:?}");
        // Farther away than half the diagonal of the own box: not counted. The truth's diagonal is 173 mm, that of a box of
        // 10 mm is 17 mm.
        let small = cuboid([0.15, 0.0, 0.0], [0.01; 3]);
        assert_eq!(VertexComparison::new(&small, &truth).expect("surfaces"), None);
        let near = cuboid([0.105, 0.0, 0.0], [0.01; 3]);
        let near = VertexComparison::new(&near, &truth).expect("surfaces").expect("vertices");
        // Four corners of the near box are 5 mm away, and four 15 mm, which is too far; one corner of the truth is 5 mm away
        // and none of the others nearer than 90 mm, where half the diagonal has 86.6 mm.
        assert!((near.mean - 0.005).abs() < 1e-8 && (near.maximum - 0.005).abs() < 1e-8, "{near:?}");
        assert_eq!(near.ignored, 4 + 7);
        assert!(VertexComparison::new(&TriMesh::default(), &truth).is_err());
    }
}
