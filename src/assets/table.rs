//! The asset table: source, facts and repairs of each mesh.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use crate::LooseParts;
use kernel::{
    geom::TriMesh,
    ids::{Digest, ObjectId},
    voxel::InsideTest,
    words::Show,
};

/// Source of a mesh and scale of its numbers to metres; everything needed to prepare it again.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshSource {
    /// Unique name inside the job: the file's stem, the table's name or the built-in shape's name.
    pub name: String,
    /// File or built-in shape.
    pub origin: MeshOrigin,
    /// Rule that converts the file's numbers to metres.
    pub scale: ScaleRule,
    /// Which sizes pass.
    pub size: SizeRule,
    /// SPDX expression or name of the licence, where known.
    pub licence: Option<String>,
    /// Citation of the mesh, where known.
    pub citation: Option<String>,
    /// Category or family, for splits by group.
    pub group: Option<String>,
}

impl fmt::Display for MeshOrigin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => f.write_str(&path.to_string_lossy()),
            Self::BuiltIn(name) => f.write_str(name),
        }
    }
}

impl MeshSource {
    /// A file in metres, of any accepted size, without other metadata.
    pub fn of_file(name: impl Into<String>, path: &Path) -> Self {
        Self {
            name: name.into(),
            origin: MeshOrigin::File(path.to_owned()),
            scale: ScaleRule::MetresPerUnit(1.0),
            size: SizeRule::default(),
            licence: None,
            citation: None,
            group: None,
        }
    }
}

/// Source of the triangles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MeshOrigin {
    /// A mesh file.
    File(PathBuf),
    /// A shape of the built-in set, by name (see `assets::built_in_names`).
    BuiltIn(String),
}

/// Rule that converts a file's numbers to metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScaleRule {
    /// One unit of the file is this many metres.
    MetresPerUnit(f64),
    /// The longest side becomes this long [m].
    LongestSide(f64),
}

/// Accepted longest sides, after scaling [m]; 5 mm to 2 m by default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeRule {
    /// Shortest accepted longest side [m].
    pub min: f64,
    /// Longest accepted longest side [m].
    pub max: f64,
}

impl Default for SizeRule {
    fn default() -> Self {
        Self { min: 0.005, max: 2.0 }
    }
}

/// A mesh ready for work.
#[derive(Clone, Debug, PartialEq)]
pub struct PreparedMesh {
    /// Metres, equal positions merged, repaired; the frame is the file's own.
    pub mesh: TriMesh,
    /// Row of the mesh in the asset table.
    pub record: AssetRecord,
}

/// One row of the asset table. Readers ignore further values of a dataset about its objects, such as masses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AssetRecord {
    /// Name inside the job.
    pub name: String,
    /// Digest of the prepared mesh (positions and faces, unchanged): the subject of its samples.
    pub object: ObjectId,
    /// Digest of the triangles in any order and with any first corner: equal for equal geometry in two files.
    pub geometry: Digest,
    /// Digest of the file as found; `None` for a built-in shape.
    pub file: Option<Digest>,
    /// Triangles after repair.
    pub triangles: u32,
    /// Vertices after merging equal positions.
    pub vertices: u32,
    /// Connected bodies (by shared vertices).
    pub bodies: u32,
    /// Parts that nothing joins; `None` where all bodies touch, nearly touch or lie in one another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loose: Option<LooseParts>,
    /// Vertices - edges + faces.
    pub euler: i64,
    /// Every edge has exactly two faces, in opposite directions.
    pub watertight: bool,
    /// Orientation of the faces, after repair.
    pub winding: Winding,
    /// Enclosed volume [m^3]; meaningful when watertight.
    pub volume: f64,
    /// Lower corner of the box [m].
    pub lower: [f64; 3],
    /// Side lengths of the box [m].
    pub extents: [f64; 3],
    /// Factor that the file's numbers were multiplied by.
    pub scale: f64,
    /// Repairs made to the mesh.
    pub repairs: Vec<Repair>,
    /// Method that separates solid cells from empty ones.
    pub inside: InsideMethod,
    /// About how many times as long its solid takes to make as that of a closed mesh; `None` below a hundred times.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solid_effort: Option<u32>,
    /// Remarks for the user.
    pub warnings: Vec<String>,
    /// Licence, where known.
    pub licence: Option<String>,
    /// Citation, where known.
    pub citation: Option<String>,
    /// Category or family, where known.
    pub group: Option<String>,
}

/// Orientation of the faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Winding {
    /// Counter-clockwise seen from outside, everywhere.
    Outward,
    /// Neighbouring faces disagree and could not be repaired.
    Mixed,
}

/// Method that finds the solid of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InsideMethod {
    /// Signed crossings along columns: exact when every shell is closed, whether bodies overlap or lie in one another.
    Crossings,
    /// Generalised winding number: for meshes with holes, soups and mixed winding.
    WindingNumber,
}

impl InsideMethod {
    /// The test of cells that this method is.
    pub fn test(self) -> InsideTest {
        match self {
            Self::Crossings => InsideTest::Crossings,
            Self::WindingNumber => InsideTest::WindingNumber,
        }
    }
}

/// One kind of repair, with the number of its elements.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "repair")]
pub enum Repair {
    /// Vertices along open edges joined with others within rounding.
    JoinedVertices {
        /// Vertices that became one with another.
        count: u32,
    },
    /// Faces whose outline crosses itself left out.
    CrossingFaces {
        /// Faces left out.
        count: u32,
    },
    /// Faces on the same three vertices dropped (a pair of opposite faces goes whole).
    DuplicateFaces {
        /// Faces dropped.
        count: u32,
    },
    /// Faces without area dropped.
    ZeroAreaFaces {
        /// Faces dropped.
        count: u32,
    },
    /// All faces of a body that was inside out, reversed.
    InsideOut {
        /// Faces reversed.
        count: u32,
    },
    /// Faces that disagreed with their neighbours, reversed.
    FlippedFaces {
        /// Faces reversed.
        count: u32,
    },
    /// Vertices that no face uses dropped.
    UnusedVertices {
        /// Vertices dropped.
        count: u32,
    },
    /// The second sheet of a two-sided shell dropped.
    TwoSidedShell {
        /// Faces dropped.
        count: u32,
    },
}

impl fmt::Display for Repair {
    /// Like "6 duplicate faces dropped".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, one, what) = match *self {
            Self::JoinedVertices { count } => {
                (count, "vertex at a seam", "joined with another within a millionth of its longest side")
            }
            Self::CrossingFaces { count } => (count, "face without an inside", "left out"),
            Self::DuplicateFaces { count } => (count, "face on the same vertices", "dropped"),
            Self::ZeroAreaFaces { count } => (count, "face without area", "dropped"),
            Self::InsideOut { count } => (count, "face inside out", "reversed"),
            Self::FlippedFaces { count } => (count, "face against its neighbours", "reversed"),
            Self::UnusedVertices { count } => (count, "unused vertex", "dropped"),
            Self::TwoSidedShell { count } => (count, "face of a second sheet", "dropped"),
        };
        let many = match one.split_once(' ') {
            _ if count == 1 => one.to_owned(),
            Some(("face", rest)) => format!("faces {rest}"),
            Some(("vertex", rest)) => format!("vertices {rest}"),
            _ => "unused vertices".to_owned(),
        };
        write!(f, "{count} {many} {what}")
    }
}

/// A mesh that cannot be used: the file, the location and the remedy.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[error("{}: {problem}{}; {remedy}", file.shown(), location.as_ref().map(|location| format!(" ({location})")).unwrap_or_default())]
pub struct MeshRefusal {
    /// File or built-in name.
    pub file: String,
    /// Short stable name of the reason, for counting: `truncated`, `not_finite`, `too_large`, ...
    pub reason: String,
    /// Problem, with numbers.
    pub problem: String,
    /// Where in the file: byte, line, face or vertex.
    pub location: Option<String>,
    /// Remedy for the problem.
    pub remedy: String,
}
