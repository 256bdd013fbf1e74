//! Cost of computing the solid of an open surface, relative to a closed one.

use nalgebra::Vector3;

use super::{
    caps::Caps,
    columns::{Lattice, in_cells},
    rim::RimCaps,
};
use crate::geom::TriMesh;

/// About how many times as long the solid of a surface takes as that of a closed one of its size; 1 for a closed surface.
///
/// The solid of a closed surface takes milliseconds. Near the caps that close an open surface, cells are decided one by
/// one: the larger its holes and the longer its cracks, the more. The factors were fitted to surfaces with holes,
/// cracks and loose triangles of 500 to a million triangles; they are right within a factor of four.
pub fn solid_effort(mesh: &TriMesh) -> f64 {
    /// Per square of the side of a cell that caps cover.
    const PER_AREA: f64 = 0.008;
    /// Per cap.
    const PER_HOLE: f64 = 0.04;
    /// Per side of a cell along a crack.
    const PER_LENGTH: f64 = 0.0036;
    let Some(lattice) = Lattice::of(mesh) else { return 1.0 };
    let caps = RimCaps::of(&lattice.vertices(mesh), &mesh.triangles);
    let place = |corner| Vector3::from(in_cells(corner));
    let cracks: f64 = caps.strips.iter().map(|strip| (place(strip[1]) - place(strip[0])).norm()).sum();
    let area = |[a, b, c]: [Vector3<f64>; 3]| (b - a).cross(&(c - a)).norm() / 2.0;
    let holes: f64 = Caps::new(&caps.holes).triangles().map(area).sum();
    1.0 + PER_AREA * holes + PER_HOLE * caps.holes.len() as f64 + PER_LENGTH * cracks
}
