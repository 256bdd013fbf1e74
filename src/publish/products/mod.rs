//! Table of the publication of products, one row per product. A new product adds a row here and a folder next to this file.

pub mod amodal;
pub mod completion;
pub mod grasps;
pub mod heatmaps;
pub mod patches;
pub mod picks;
pub mod reachability;
mod scene_shapes;
pub mod scenes;
pub mod suction;
pub mod views;
pub mod volumes;

use super::product::ProductPages;
use format::Product;

/// Every product.
pub static PRODUCTS: [&ProductPages; 11] = [
    &completion::PAGES,
    &reachability::PAGES,
    &grasps::PAGES,
    &patches::PAGES,
    &scenes::PAGES,
    &views::PAGES,
    &amodal::PAGES,
    &volumes::PAGES,
    &picks::PAGES,
    &heatmaps::PAGES,
    &suction::PAGES,
];

/// The row of a product.
///
/// # Panics
/// When the table does not have the product: a test compares the tables.
pub fn pages_of(product: Product) -> &'static ProductPages {
    PRODUCTS.iter().find(|pages| pages.product == product).expect("every product of the format has pages")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_product_of_the_format_has_pages_and_words_for_its_files() {
        assert!(PRODUCTS.iter().map(|pages| pages.product).eq(Product::all()));
        for pages in PRODUCTS {
            let files: Vec<&str> = pages.product.files.iter().map(|file| file.name).collect();
            let named = pages.assets.shape_files.iter().chain(pages.assets.data_files);
            assert!(named.into_iter().all(|name| files.contains(name)), "{}", pages.product);
            assert!(pages.templates.own[0].0.ends_with(".html"), "{}", pages.product);
        }
    }
}
