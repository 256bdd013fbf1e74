//! Triangles of a mesh file as they stand in it.

/// Triangles as found, before any scaling, merging or checking of shape.
#[derive(Debug, Default, PartialEq)]
pub(in crate::assets) struct RawMesh {
    /// Positions in the file's unit.
    pub(in crate::assets) positions: Vec<[f64; 3]>,
    /// Corner indices, all below `positions.len()`.
    pub(in crate::assets) faces: Vec<[u32; 3]>,
    /// Equal positions are merged already, and every coordinate is an `f32`.
    pub(in crate::assets) welded: bool,
    /// Positions that are NaN or infinite, with their location in the file.
    pub(in crate::assets) not_finite: Vec<(u32, String)>,
    /// Oddities of the file that do no harm but should be known.
    pub(in crate::assets) notes: Vec<String>,
}

/// Remedy for a format that is not read here.
pub(super) const CONVERT: &str = "convert it: pip install trimesh pycollada, then python3 -c \"import trimesh; \
                                  trimesh.load_mesh('IN').export('OUT.ply')\"";
