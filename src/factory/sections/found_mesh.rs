//! Meshes that a job names, before they are read.

use assets::{MeshSource, object::MadeOf};
use kernel::ids::ObjectId;

/// One mesh that a job names.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundMesh {
    /// Recipe to prepare it.
    pub source: MeshSource,
    /// The package that holds it, if one does.
    pub package: Option<PackageFile>,
    /// Data about the object other than its mesh.
    pub known: KnownObject,
    /// The content that it must have, when the job pins it.
    pub pinned: Option<ObjectId>,
}

/// Data of a job about an object other than its mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KnownObject {
    /// Mass.
    pub mass: Option<KnownMass>,
    /// Material and walls.
    pub made_of: Option<MadeOf>,
    /// Kind of thing that it is.
    pub category: Option<String>,
    /// Whether parts of it that nothing joins count as one body.
    pub joins_parts: bool,
}

/// Mass of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownMass {
    /// [kg].
    pub kilograms: f64,
    /// Source of the figure; may be empty.
    pub source: String,
}

/// A file of a package of meshes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PackageFile {
    /// The package's name.
    pub package: String,
    /// Path below the package's folder, with `/`.
    pub file: String,
}
