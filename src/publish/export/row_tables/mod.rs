//! Parquet tables of rows, for pandas, DuckDB and dataset viewers: a table per kind of row. docs/tables.md lists their columns; it is
//! generated from the declarations here.

mod bodies;
mod column;
mod grasps;
mod heatmaps;
mod ladder;
mod objects;
mod pairs;
mod patches;
mod pick_trials;
mod picks;
mod poses;
mod row_table;
mod scenes;
mod series;
mod suction;
mod touch;
mod trials;
mod views;
mod volumes;

#[cfg(test)]
mod reference;

use super::{
    error::ExportError,
    form::{ExportForm, ExportFormat, ExportSelection, Written},
    target::Target,
};
use format::{Noun, Product, dataset::DatasetReader};

/// Writes the tables of a dataset.
type WriteTables = fn(&DatasetReader, &ExportSelection, &mut Target) -> Result<Written, ExportError>;

/// The form of a product.
const fn tables(product: Product, counted: Noun, layout: fn(bool) -> &'static str, write: WriteTables) -> ExportForm {
    ExportForm { product, counted, keys: &[], layout, write }
}

/// Tables of every product: one row per sample with its facts, and tables of the parts of samples.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "parquet",
    summary: "Parquet tables of any dataset, for pandas, DuckDB and dataset viewers.",
    has_unpacked: false,
    forms: &[
        tables(Product::COMPLETION, Noun { one: "sample", many: "samples" }, |_| pairs::LAYOUT, pairs::write),
        tables(Product::GRASPS, Noun { one: "grasp", many: "grasps" }, |_| grasps::LAYOUT, grasps::write),
        tables(Product::PATCHES, Noun { one: "sample", many: "samples" }, |_| patches::LAYOUT, patches::write),
        tables(Product::REACHABILITY, Noun { one: "pose", many: "poses" }, |_| poses::LAYOUT, poses::write),
        tables(Product::SCENES, Noun { one: "scene", many: "scenes" }, |_| scenes::LAYOUT, scenes::write),
        tables(Product::VIEWS, Noun { one: "view", many: "views" }, |_| views::LAYOUT, views::write),
        tables(Product::AMODAL, Noun { one: "pair", many: "pairs" }, |_| pairs::LAYOUT, pairs::write),
        tables(Product::VOLUMES, Noun { one: "volume", many: "volumes" }, |_| volumes::LAYOUT, volumes::write),
        tables(Product::PICKS, Noun { one: "body", many: "bodies" }, |_| picks::LAYOUT, picks::write),
        tables(Product::HEATMAPS, Noun { one: "image", many: "images" }, |_| heatmaps::LAYOUT, heatmaps::write),
        tables(Product::SUCTION, Noun { one: "body", many: "bodies" }, |_| suction::LAYOUT, suction::write),
    ],
};
