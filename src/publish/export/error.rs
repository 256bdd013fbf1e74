//! Errors of exports.

use std::{
    io,
    path::{Path, PathBuf},
};

use format::{Product, dataset::DatasetError};
use kernel::{ids::SampleIndex, remedy, words::Show};

/// Error of an export.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The dataset can't be read, or the output folder is none that can be filled.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The dataset is of a product that has no such form.
    #[error("a dataset of {product}: only datasets of {} have the form {format}; {}", of.join(" and "), listed_forms(forms))]
    OtherProduct {
        /// Product of the dataset.
        product: Product,
        /// Format that was asked for.
        format: &'static str,
        /// Names of the products that have it.
        of: Vec<&'static str>,
        /// Formats of its product.
        forms: Vec<&'static str>,
    },
    /// Bytes per cell in a format that has packed bits alone.
    #[error("{format} holds packed bits alone; leave out --unpacked")]
    AlwaysPacked {
        /// The format.
        format: &'static str,
    },
    /// A number that the form does not need.
    #[error("{format} of a dataset of {product} has no number {key}; it {}", known_keys(known))]
    UnknownKey {
        /// The format.
        format: &'static str,
        /// Product of the dataset.
        product: Product,
        /// The key.
        key: String,
        /// Keys that it has.
        known: Vec<&'static str>,
    },
    /// A number that no length can be.
    #[error("{key} = {value}: must be positive and finite")]
    BadNumber {
        /// The key.
        key: String,
        /// The number.
        value: f64,
    },
    /// Images of several cameras in a format that has one.
    #[error(
        "vgn has one camera for all images, and view {view} has another than the first one; make the views by a job with one camera"
    )]
    OtherCamera {
        /// The view.
        view: SampleIndex,
    },
    /// A depth that the file's 16 bits do not hold.
    #[error(
        "view {view} has a depth of {depth:.3} m, and its images hold depths up to {farthest:.3} m; give --to parquet, which holds any \
         depth"
    )]
    TooFar {
        /// The view.
        view: SampleIndex,
        /// The depth [m].
        depth: f64,
        /// The largest depth that fits [m].
        farthest: f64,
    },
    /// A view with neither depth nor colours.
    #[error(
        "view {view} has neither depth nor colours; give --to parquet, which holds masks and poses without an image"
    )]
    NoImages {
        /// The view.
        view: SampleIndex,
    },
    /// Cubes of several sizes in a format that has one.
    #[error(
        "vgn has one size for all volumes, and sample {index} has another than the first one; `verify` the dataset"
    )]
    OtherCube {
        /// The volume.
        index: SampleIndex,
    },
    /// A map is written as a whole.
    #[error("graspit writes the whole grid of poses; leave out --split, --object and --limit")]
    WholeGrid,
    /// A map over directions in files that know six axes only.
    #[error(
        "graspit's files hold six axes, and this map has directions in place of pitch and yaw; export a map whose job gives \
         `roll`, `pitch` and `yaw`, or read field.mcap"
    )]
    Directions,
    /// Grasps that were not tried.
    #[error("this dataset has no trials; run its job with [physics] in it")]
    NoTrials,
    /// A hand that cannot be described without further files.
    #[error(
        "shapes.mcap has no hand for plain MuJoCo: its description names mesh files, and a body of it has no name; name its \
         bodies"
    )]
    NoPlainHand,
    /// A hand that ACRONYM's layout has no words for.
    #[error(
        "acronym's layout is for parallel-jaw grippers, whose pads one motor slides along a line across the approach; {hand} is \
         none: give --to parquet, which holds the grasps of any hand"
    )]
    NoParallelGripper {
        /// Name of the hand.
        hand: String,
    },
    /// Grasps of an object that the library can't lay out.
    #[error("the grasps of {name} can't be written as HDF5: {source}; export fewer by --limit")]
    Hdf5 {
        /// The object.
        name: String,
        /// Why not.
        source: Box<hdf5_pure::Error>,
    },
    /// An object without inside.
    #[error("{name} has no solid inside to be weighed")]
    NoSolid {
        /// The object.
        name: String,
    },
    /// A row of the asset table that does not say how the object's inside was found.
    #[error("assets.json: `inside` of {name} is {}, expected winding_number or crossings; `verify` the dataset", found.as_deref().unwrap_or("missing"))]
    NoInside {
        /// The object.
        name: String,
        /// Text that stands there.
        found: Option<String>,
    },
    /// The dataset has no object, or scene where samples are of scenes, of that name.
    #[error("no {what} is called '{name}'; the dataset has {}", listed(known))]
    UnknownObject {
        /// Kind of what is selected: object, scene, ...
        what: &'static str,
        /// The name asked for.
        name: String,
        /// The names there are.
        known: Vec<String>,
    },
    /// No sample passes the selection.
    #[error("no sample is selected, of {kept} in the dataset; leave out or change --split, --object or --limit")]
    NothingSelected {
        /// Stored samples of the dataset.
        kept: u64,
    },
    /// Arrays need grids of one size.
    #[error("sample {index} has {found} cells a side, the first one {expected}; `verify` the dataset")]
    OtherResolution {
        /// The sample.
        index: SampleIndex,
        /// Resolution of the grid.
        found: u32,
        /// The array's.
        expected: u32,
    },
    /// A block of poses that is none of the field's grid.
    #[error("sample {index} holds no position of the grid of field.mcap; `verify` the dataset")]
    OtherGrid {
        /// The sample.
        index: SampleIndex,
    },
    /// The operating system refused a read or write.
    #[error("{action} {}: {source}; {}", path.shown(), io_remedy(source))]
    Io {
        /// Action that failed: "writing", "creating", ...
        action: &'static str,
        /// On which file.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
}

impl ExportError {
    /// Wraps an I/O error with what was tried on which file.
    pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { action, path: path.to_owned(), source }
    }
}

fn io_remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "make room, then export again",
        io::ErrorKind::ReadOnlyFilesystem => "give a folder that can be written",
        _ => remedy::for_reading(error),
    }
}

/// The formats of a product, as a remedy.
fn listed_forms(names: &[&str]) -> String {
    match names {
        [others @ .., last] if !others.is_empty() => format!("give --to {} or {last}", others.join(", ")),
        _ => format!("give --to {}", names.concat()),
    }
}

/// The numbers that a form needs.
fn known_keys(known: &[&'static str]) -> String {
    if known.is_empty() { "has none at all".to_owned() } else { format!("has {}", known.join(", ")) }
}

/// A few names, and how many more.
fn listed(names: &[String]) -> String {
    const SHOWN: usize = 12;
    let mut sorted: Vec<&str> = names.iter().map(String::as_str).collect();
    sorted.sort_unstable();
    let head = sorted.iter().take(SHOWN).copied().collect::<Vec<_>>().join(", ");
    match sorted.len().checked_sub(SHOWN) {
        Some(more) if more > 0 => format!("{head} and {more} more (assets.json of the dataset has all)"),
        _ => head,
    }
}
