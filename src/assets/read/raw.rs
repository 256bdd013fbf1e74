//! Triangles of a mesh file, unchanged.

use crate::Refuse;

/// Triangles as found, before any scaling or checking of shape.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct RawMesh {
    /// Positions in the file's unit.
    pub(crate) positions: Vec<[f64; 3]>,
    /// Corner indices, all below `positions.len()`.
    pub(crate) faces: Vec<[u32; 3]>,
    /// Equal positions are merged already, and every coordinate is an `f32`.
    pub(crate) welded: bool,
    /// Vertices that faces named in the file and name no more, because they are one with another.
    pub(crate) merged: usize,
    /// Merged vertices that were within rounding of the other, not at the same position.
    pub(crate) joined: usize,
    /// Faces that triangles cannot represent.
    pub(crate) left_out: Option<LeftOut>,
    /// Positions that are NaN or infinite, with their location in the file.
    pub(crate) not_finite: Vec<(u32, String)>,
    /// Oddities of the file that do no harm but should be known.
    pub(crate) notes: Vec<String>,
}

/// Faces that triangles cannot represent.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LeftOut {
    pub(crate) count: u32,
    /// Location of the first one.
    pub(crate) location: String,
    /// Fault of the first one.
    pub(crate) problem: String,
}

impl LeftOut {
    /// The refusal of a mesh that needs all of its faces.
    pub(crate) fn refusal(&self) -> Refuse {
        let problem = match self.count {
            1 => format!("a face has no inside: {}", self.problem),
            count => format!("{count} faces have no inside; the first one: {}", self.problem),
        };
        Refuse::new("crossing_face", problem, REMEDY).at(&self.location)
    }

    /// A note about a mesh that does without them.
    pub(crate) fn note(&self) -> String {
        let Self { count, location, problem } = self;
        let faces = if *count == 1 { "1 face is".to_owned() } else { format!("{count} faces are") };
        format!("{faces} left out, the first one at {location}: {problem}; {REMEDY}")
    }
}

/// Remedy for a face whose outline crosses itself.
const REMEDY: &str = "cut it into triangles in the program that made it, and export it again";

/// Remedy for a format that is not read here.
pub(super) const CONVERT: &str = "convert it: pip install trimesh pycollada, then python3 -c \"import trimesh; \
                                  trimesh.load_mesh('IN').export('OUT.ply')\"";
