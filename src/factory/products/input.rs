//! A finished dataset that a job takes its samples from.

use std::path::{Path as FilePath, PathBuf};

use crate::sections::tidy;
use form::Checker;
use format::{
    Product,
    dataset::{DatasetError, DatasetReader, Manifest},
};
use kernel::{
    files::Folder,
    ids::Digest,
    words::{NumberClass, Show},
};

/// Reason why a folder is no dataset that a job can be about.
#[derive(Debug, thiserror::Error)]
pub enum InvalidInput {
    /// The dataset cannot be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The dataset's product is another one.
    #[error("{} is a dataset of {found}, not of {wanted}", folder.shown())]
    Product {
        /// Folder of the dataset.
        folder: PathBuf,
        /// Product of the dataset.
        found: Product,
        /// Product of the job.
        wanted: Product,
    },
    /// The dataset has no digest of a class of numbers.
    #[error("{} has no {}", folder.shown(), numbers_in_words(*class))]
    NoNumbers {
        /// Folder of the dataset.
        folder: PathBuf,
        /// The class.
        class: NumberClass,
    },
}

fn numbers_in_words(class: NumberClass) -> String {
    if class == NumberClass::Exact { "exact numbers".to_owned() } else { format!("numbers of {}", class.name()) }
}

/// The digest of a class of numbers of a finished dataset of a product.
///
/// # Errors
/// When the folder holds none.
pub fn root_of_input(folder: &FilePath, wanted: Product, class: NumberClass) -> Result<Digest, InvalidInput> {
    let manifest = Manifest::read(&Folder::at(folder))?;
    if manifest.product != wanted {
        return Err(InvalidInput::Product { folder: folder.to_owned(), found: manifest.product, wanted });
    }
    let none = || InvalidInput::NoNumbers { folder: folder.to_owned(), class };
    manifest.classes.get(&class).copied().ok_or_else(none)
}

/// A finished dataset of a product, and the digest of a class of its numbers.
///
/// # Errors
/// When the folder holds none.
pub fn open_input(
    folder: &FilePath,
    wanted: Product,
    class: NumberClass,
) -> Result<(DatasetReader, Digest), InvalidInput> {
    let root = root_of_input(folder, wanted, class)?;
    Ok((DatasetReader::open(&Folder::at(folder))?, root))
}

/// Section of a job that names a dataset.
#[derive(Clone, Copy)]
pub struct InputSection {
    /// The section, which is the word for what the dataset holds.
    pub name: &'static str,
    /// Remedy if the dataset is missing.
    pub make: &'static str,
}

impl InputSection {
    /// The folder of the dataset; `None` when the job names none, which is reported.
    pub fn folder(&self, checker: &mut Checker, named: Option<&PathBuf>, folder: &FilePath) -> Option<PathBuf> {
        let Self { name, make } = self;
        if named.is_none() {
            let what = format!("the folder of a finished dataset of {name}");
            checker.missing(format!("{name}.dataset").as_str(), what).help(*make);
        }
        named.map(|dataset| tidy(&folder.join(dataset)))
    }

    /// The result of a search in the dataset; `None` when nothing was found, which is reported.
    pub fn found<T>(&self, checker: &mut Checker, found: Result<T, impl std::fmt::Display>) -> Option<T> {
        let Self { name, make } = self;
        let key = format!("{name}.dataset");
        let report = |error| {
            checker.not_found(key.as_str(), format!("dataset of {name}"), format!("{error}")).help(*make);
        };
        found.map_err(report).ok()
    }

    /// Whether the dataset has the root that the job pins, if it pins one; another root is reported.
    pub fn has_root(&self, checker: &mut Checker, pinned: Option<&str>, root: Digest, dataset: &FilePath) -> bool {
        let Self { name, .. } = self;
        let Some(pinned) = pinned.and_then(Digest::from_hex).filter(|pinned| *pinned != root) else { return true };
        let seen = format!("{}: {} holds others", root.short(), dataset.shown());
        let report =
            checker.invalid(format!("{name}.root").as_str(), format!("{name} of root {}", pinned.short()), seen);
        report.help("restore the dataset, or remove `root` from the job for a new dataset");
        false
    }

    /// Whether the dataset has the trials that the job pins, if it pins some and reads some; others are reported.
    pub fn has_trials_root(
        &self,
        checker: &mut Checker,
        pinned: Option<&str>,
        trials: Option<Digest>,
        dataset: &FilePath,
    ) -> bool {
        let pinned = pinned.and_then(Digest::from_hex);
        let Some((pinned, trials)) = pinned.zip(trials).filter(|(pinned, trials)| pinned != trials) else {
            return true;
        };
        let seen = format!("{}: {} holds others", trials.short(), dataset.shown());
        let key = format!("{}.trials_root", self.name);
        let report = checker.invalid(key.as_str(), format!("trials of root {}", pinned.short()), seen);
        report.help("restore the dataset, or remove `trials_root` from the job for new trials");
        false
    }
}
