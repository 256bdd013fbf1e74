//! An object's mesh as a file, and its solid.

use std::io::{self, Write};

use super::{error::ExportError, target::Target};
use format::dataset::AssetRow;
use kernel::{
    geom::{MassProperties, TOUCHED_EDGE, TriMesh},
    voxel::{InsideTest, solid_occupancy},
};

/// Maximum number of triangles of a mesh whose edges are halved; MuJoCo reads this number in a second.
const MAX_TOUCHED: usize = 1 << 16;

/// Writes a mesh [m] as the Wavefront OBJ of a name; numbers are the shortest that read back the same.
///
/// # Errors
/// When the file can't be written.
pub(super) fn write_mesh(target: &mut Target, name: &str, mesh: &TriMesh) -> Result<(), ExportError> {
    let (mut file, path) = target.open(name)?;
    write_obj(&mut file, mesh).and_then(|()| file.flush()).map_err(ExportError::io("writing", &path))
}

/// Writes a mesh for MuJoCo's triangle contacts: its long edges are halved, and all original vertices come first.
///
/// # Errors
/// When the file can't be written.
pub(super) fn write_touched_mesh(target: &mut Target, name: &str, mesh: &TriMesh) -> Result<(), ExportError> {
    write_mesh(target, name, &mesh.with_short_edges(TOUCHED_EDGE, MAX_TOUCHED))
}

fn write_obj(out: &mut impl Write, mesh: &TriMesh) -> io::Result<()> {
    for [x, y, z] in &mesh.vertices {
        writeln!(out, "v {x} {y} {z}")?;
    }
    for [a, b, c] in mesh.triangles.iter().copied() {
        writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1)?;
    }
    Ok(())
}

/// Volume, centre of mass and inertia of an object's solid, as in its trials.
///
/// # Errors
/// When the object has no inside, or its row does not state how it was determined.
pub(super) fn mass_properties(row: &AssetRow, mesh: &TriMesh) -> Result<MassProperties, ExportError> {
    let solid = solid_occupancy(mesh, inside_test(row)?, false);
    MassProperties::of_solid(&solid).ok_or_else(|| ExportError::NoSolid { name: row.name.clone() })
}

/// Inside test of the trials, from the asset table.
fn inside_test(row: &AssetRow) -> Result<InsideTest, ExportError> {
    match row.facts.get("inside").and_then(|inside| inside.as_str()) {
        Some("winding_number") => Ok(InsideTest::WindingNumber),
        Some("crossings") => Ok(InsideTest::Crossings),
        found => Err(ExportError::NoInside { name: row.name.clone(), found: found.map(str::to_owned) }),
    }
}
