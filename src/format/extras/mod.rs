//! Files that only the datasets of some products have, with their checks, and readers that join several records of a sample.

mod field;
mod file_check;
mod resting;
mod shapes;
mod touched;
mod types;

pub use field::{read_field, write_field};
pub use file_check::{FileCheck, FileContext, RootPart};
pub use resting::{InvalidResting, add_resting};
pub use shapes::{Shapes, ShapesWriter};
pub use touched::TouchedPair;
pub use types::{read_types, write_types};

use crate::Product;

/// Checks of all extra files, one row each.
static FILES: [&FileCheck; 3] = [&field::CHECK, &shapes::CHECK, &types::CHECK];

/// Checks of the extra files of a product, in the order of its row.
///
/// # Panics
/// When the table lacks a file: a test compares it with the products.
pub(crate) fn files_of_product(product: Product) -> impl Iterator<Item = &'static FileCheck> {
    product.files.iter().map(|file| {
        let check = FILES.into_iter().find(|check| check.name == file.name);
        check.expect("every extra file has a check")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_extra_file_is_checked() {
        for product in Product::all() {
            let names = product.files.iter().map(|file| file.name);
            assert!(files_of_product(product).map(|check| check.name).eq(names), "{product}");
        }
    }
}
