//! The products, one folder each: keys of their jobs, producers, and their row in the table. What several of them share stands
//! beside them: how a pair of grids is made, what surrounds the bodies of a scene, lights and colours, and how a dataset is read that a job is
//! about, among them one of settled scenes, one of views and one of picks.

pub mod amodal;
pub mod appearance;
pub mod completion;
pub mod grasps;
pub mod heatmaps;
pub mod input;
pub mod listed_pose;
pub mod pair;
pub mod patches;
pub mod picked;
pub mod picks;
pub mod reachability;
pub mod scenes;
pub mod settled;
pub mod surroundings;
pub mod viewed;
pub mod views;
pub mod volumes;

use super::product::ProductFactory;
use format::Product;

/// Every product; a job that names none is of the first.
pub static PRODUCTS: [&ProductFactory; 10] = [
    &completion::FACTORY,
    &reachability::FACTORY,
    &grasps::FACTORY,
    &patches::FACTORY,
    &scenes::FACTORY,
    &views::FACTORY,
    &amodal::FACTORY,
    &volumes::FACTORY,
    &picks::FACTORY,
    &heatmaps::FACTORY,
];

/// The row of a product.
///
/// # Panics
/// When the factory does not make the product: a test compares the tables.
pub fn factory_of(product: Product) -> &'static ProductFactory {
    PRODUCTS.iter().find(|factory| factory.product == product).expect("the factory makes every product of the format")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_product_of_the_format_is_made() {
        assert!(PRODUCTS.iter().map(|factory| factory.product).eq(Product::all()));
    }
}
