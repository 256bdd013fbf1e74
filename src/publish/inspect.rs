//! The inspection of a dataset of any product.

use super::{inspection::Inspection, products::pages_of};
use format::dataset::{DatasetError, DatasetReader};
use kernel::files::Folder;

/// The facts of a finished dataset of any product: reads manifest, tables and the shards' ledgers, one at a time, and as many
/// samples as the product's facts need.
///
/// # Errors
/// When the dataset is not finished, or a file is missing or damaged.
pub fn inspect(folder: &Folder) -> Result<Inspection, DatasetError> {
    let reader = DatasetReader::open(folder)?;
    Ok((pages_of(reader.manifest().product).survey)(&reader)?.inspection())
}
