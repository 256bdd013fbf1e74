//! The table of checks: one row per product. They are separate from the rows of the format, which every dataset needs, because a
//! check reads whole datasets.

use super::{amodal, completion, grasps, heatmaps, patches, picks, reachability, scenes, views, volumes};
use crate::{Product, ProductChecks};

/// The checks of every product, in the order of [`PRODUCTS`](super::PRODUCTS).
pub static CHECKS: [&ProductChecks; 10] = [
    &completion::CHECKS,
    &reachability::CHECKS,
    &grasps::CHECKS,
    &patches::CHECKS,
    &scenes::CHECKS,
    &views::CHECKS,
    &amodal::CHECKS,
    &volumes::CHECKS,
    &picks::CHECKS,
    &heatmaps::CHECKS,
];

/// The checks of a product.
///
/// # Panics
/// When the table lacks the product: a test compares the tables.
pub fn checks_of(product: Product) -> &'static ProductChecks {
    CHECKS.iter().find(|checks| checks.product == product).expect("every product has checks")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_product_and_every_extra_file_is_checked() {
        assert!(CHECKS.iter().map(|checks| checks.product).eq(Product::all()));
        for checks in CHECKS {
            let files = checks.product.files.iter().map(|file| file.name);
            assert!(checks.files.iter().map(|file| file.name).eq(files), "{}", checks.product);
        }
    }
}
