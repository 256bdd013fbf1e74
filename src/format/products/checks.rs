//! The table of checks of records: one row per product, separate from the rows of the format, which every dataset needs.

use super::{amodal, completion, grasps, heatmaps, patches, picks, reachability, scenes, suction, views, volumes};
use crate::{Product, ProductChecks};

/// The checks of every product, in the order of [`PRODUCTS`](super::PRODUCTS).
pub static CHECKS: [&ProductChecks; 11] = [
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
    &suction::CHECKS,
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
    fn every_product_is_checked() {
        assert!(CHECKS.iter().map(|checks| checks.product).eq(Product::all()));
    }
}
