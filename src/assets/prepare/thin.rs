//! Meshes so thin that no cell of their solid is inside.

use super::length;
use crate::{MeshRefusal, MeshSource, Refuse};
use kernel::geom::{SolidGrid, TriMesh};

/// Mean thickness of a mesh that encloses `volume` [m^3]: that of a sheet of the same volume and area [m].
pub(crate) fn thickness(mesh: &TriMesh, volume: f64) -> f64 {
    let area = |face| {
        let [a, b, c] = mesh.corners(face);
        (b - a).cross(&(c - a)).norm() / 2.0
    };
    2.0 * volume / (0..mesh.triangles.len()).map(area).sum::<f64>()
}

/// Refusal of a mesh whose solid, with cells of side `cell` [m], has no cell inside: it has no mass and no inertia.
pub fn refuse_without_solid(source: &MeshSource, mesh: &TriMesh, volume: f64, cell: f64) -> MeshRefusal {
    let problem = format!("no solid inside: {}", words(mesh, volume, cell));
    let remedy = format!("make it at least {} thick, or `exclude` it from the job", length(cell));
    Refuse::new("no_solid", problem, remedy).about(&source.origin)
}

/// Text about such a mesh.
pub(crate) fn words(mesh: &TriMesh, volume: f64, cell: f64) -> String {
    let cells = SolidGrid::SIDE;
    format!(
        "it is about {} thick, and the centres of its cells of {} (1/{cells} of its longest side) all lie outside",
        length(thickness(mesh, volume)),
        length(cell)
    )
}
