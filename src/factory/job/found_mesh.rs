//! Meshes that a job names, before they are read.

use kernel::{assets::MeshSource, ids::ObjectId};

/// One mesh that a job names.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundMesh {
    /// Recipe to prepare it.
    pub source: MeshSource,
    /// The package that holds it, if one does.
    pub package: Option<PackageFile>,
    /// Mass, when the job knows it.
    pub mass: Option<KnownMass>,
    /// The content that it must have, when the job pins it.
    pub pinned: Option<ObjectId>,
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
