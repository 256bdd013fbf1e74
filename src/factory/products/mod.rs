//! The products, one folder each: keys of their jobs, producers, and their row in the table. Code that several of them
//! share is next to them: making a pair of grids, the surroundings of the bodies of a scene, lights and colours, and
//! reading the datasets of scenes, views and picks that other jobs need.

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
pub mod suction;
pub mod surroundings;
pub mod viewed;
pub mod views;
pub mod volumes;

use super::product::ProductFactory;
use format::Product;

/// Every product; a job that names none is of the first.
pub static PRODUCTS: [&ProductFactory; 11] = [
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
    &suction::FACTORY,
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
