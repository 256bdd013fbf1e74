//! What people call the samples of a product.

use crate::ids::Product;

/// Samples, in the plural.
pub fn samples(product: Product) -> &'static str {
    match product {
        Product::Completion => "samples",
        Product::Reachability => "positions",
        Product::Grasps => "runs",
        Product::Patches => "grasps",
    }
}
