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
    /// The dataset can't be read, or the output folder can't be filled.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The format does not support the product of the dataset.
    #[error("{format} does not support datasets of {product}, only of {}; {}", of.join(" and "), listed_forms(forms))]
    OtherProduct {
        /// Product of the dataset.
        product: Product,
        /// Requested format.
        format: &'static str,
        /// Names of the products that the format supports.
        of: Vec<&'static str>,
        /// Formats of its product.
        forms: Vec<&'static str>,
    },
    /// One byte per cell was requested from a format that stores only packed bits.
    #[error("{format} stores only packed bits; leave out --unpacked")]
    AlwaysPacked {
        /// The format.
        format: &'static str,
    },
    /// A number that the form does not use.
    #[error("{format} of a dataset of {product} does not use {key}; it {}", known_keys(known))]
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
    /// A number that is not a length.
    #[error("{key} = {value}: must be positive and finite")]
    BadNumber {
        /// The key.
        key: String,
        /// The number.
        value: f64,
    },
    /// Images of several cameras for a format that allows one.
    #[error(
        "vgn requires one camera for all images, but view {view} has a different one than the first; make the views with a job that has one camera"
    )]
    OtherCamera {
        /// The view.
        view: SampleIndex,
    },
    /// A depth beyond the range of the file's 16 bits.
    #[error(
        "view {view} has a depth of {depth:.3} m, but the images store depths up to {farthest:.3} m; use --to parquet, which stores any depth"
    )]
    TooFar {
        /// The view.
        view: SampleIndex,
        /// The depth [m].
        depth: f64,
        /// The largest depth that fits [m].
        farthest: f64,
    },
    /// A view without depth and colours.
    #[error(
        "view {view} has neither depth nor colours; use --to parquet, which stores masks and poses without an image"
    )]
    NoImages {
        /// The view.
        view: SampleIndex,
    },
    /// Cubes of several sizes for a format that allows one.
    #[error(
        "vgn requires one size for all volumes, but sample {index} has a different one than the first; `verify` the dataset"
    )]
    OtherCube {
        /// The volume.
        index: SampleIndex,
    },
    /// A selection for a map, which is written as a whole.
    #[error("graspit writes the whole grid of poses; leave out --split, --object and --limit")]
    WholeGrid,
    /// A map over directions for files that support only six axes.
    #[error(
        "graspit's files require six axes, but this map has directions instead of pitch and yaw; export a map whose job sets `roll`, `pitch` and `yaw`, or read field.mcap"
    )]
    Directions,
    /// Grasps without trials.
    #[error("this dataset has no trials; add [physics] to its job and run it")]
    NoTrials,
    /// A hand that cannot be described without further files.
    #[error(
        "shapes.mcap has no hand for plain MuJoCo, because the hand's description uses mesh files and has a body without a name; give all bodies names"
    )]
    NoPlainHand,
    /// A hand that ACRONYM's layout cannot describe.
    #[error(
        "acronym supports only parallel-jaw grippers, whose pads one motor slides along a line across the approach, and {hand} is not one; use --to parquet, which stores the grasps of any hand"
    )]
    NoParallelGripper {
        /// Name of the hand.
        hand: String,
    },
    /// Grasps of an object that the library can't write.
    #[error("the grasps of {name} can't be written as HDF5: {source}; export fewer with --limit")]
    Hdf5 {
        /// The object.
        name: String,
        /// Cause.
        source: Box<hdf5_pure::Error>,
    },
    /// An object without a solid inside.
    #[error("{name} has no solid inside, so its mass cannot be computed")]
    NoSolid {
        /// The object.
        name: String,
    },
    /// A row of the asset table without a valid method for the object's inside.
    #[error("assets.json: `inside` of {name} is {}, expected winding_number or crossings; `verify` the dataset", found.as_deref().unwrap_or("missing"))]
    NoInside {
        /// The object.
        name: String,
        /// Text in the table.
        found: Option<String>,
    },
    /// The dataset has no object of that name, or no scene for products made from scenes.
    #[error("no {what} has the name '{name}'; the dataset has {}", listed(known))]
    UnknownObject {
        /// Kind of selected item: object, scene, ...
        what: &'static str,
        /// Requested name.
        name: String,
        /// Names in the dataset.
        known: Vec<String>,
    },
    /// The selection contains no sample.
    #[error("none of the dataset's {kept} samples is selected; leave out or change --split, --object or --limit")]
    NothingSelected {
        /// Stored samples of the dataset.
        kept: u64,
    },
    /// Grids of several sizes for an array.
    #[error("sample {index} has {found} cells per side, but the first one {expected}; `verify` the dataset")]
    OtherResolution {
        /// The sample.
        index: SampleIndex,
        /// Resolution of the grid.
        found: u32,
        /// Resolution of the array.
        expected: u32,
    },
    /// A block of poses that is not in the field's grid.
    #[error("the position of sample {index} is not in the grid of field.mcap; `verify` the dataset")]
    OtherGrid {
        /// The sample.
        index: SampleIndex,
    },
    /// The operating system refused a read or write.
    #[error("{action} {}: {source}; {}", path.shown(), io_remedy(source))]
    Io {
        /// Action that failed: "writing", "creating", ...
        action: &'static str,
        /// File of the action.
        path: PathBuf,
        /// Cause.
        source: io::Error,
    },
}

impl ExportError {
    /// Wraps an I/O error with the action and the file.
    pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { action, path: path.to_owned(), source }
    }
}

fn io_remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "free disk space, then export again",
        io::ErrorKind::ReadOnlyFilesystem => "choose a writable folder",
        _ => remedy::for_reading(error),
    }
}

/// Formats of a product, as a remedy.
fn listed_forms(names: &[&str]) -> String {
    match names {
        [others @ .., last] if !others.is_empty() => format!("use --to {} or {last}", others.join(", ")),
        _ => format!("use --to {}", names.concat()),
    }
}

/// Numbers that a form uses.
fn known_keys(known: &[&'static str]) -> String {
    if known.is_empty() { "uses none".to_owned() } else { format!("uses {}", known.join(", ")) }
}

/// A few names, and the number of further ones.
fn listed(names: &[String]) -> String {
    const SHOWN: usize = 12;
    let mut sorted: Vec<&str> = names.iter().map(String::as_str).collect();
    sorted.sort_unstable();
    let head = sorted.iter().take(SHOWN).copied().collect::<Vec<_>>().join(", ");
    match sorted.len().checked_sub(SHOWN) {
        Some(more) if more > 0 => format!("{head} and {more} more (all are in assets.json of the dataset)"),
        _ => head,
    }
}
