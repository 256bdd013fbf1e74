//! Parquet tables of rows, for pandas, DuckDB and dataset viewers: a table per kind of row. docs/tables.md lists their columns.

mod column;
mod grasps;
mod objects;
mod pairs;
mod patches;
mod poses;
mod series;
mod touch;
mod trials;

use super::form::{ExportForm, ExportFormat};
use format::{Noun, Product};

/// Tables of every product: pairs and their touch, grasps with contacts and trials, patches, each with their objects; poses of
/// a map.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "parquet",
    summary: "Parquet tables of pairs, touch, grasps, trials, patches, objects or poses, for pandas, DuckDB and dataset viewers.",
    has_unpacked: false,
    forms: &[
        ExportForm {
            product: Product::COMPLETION,
            counted: Noun { one: "sample", many: "samples" },
            keys: &[],
            layout: |_| pairs::LAYOUT,
            write: pairs::write,
        },
        ExportForm {
            product: Product::GRASPS,
            counted: Noun { one: "grasp", many: "grasps" },
            keys: &[],
            layout: |_| grasps::LAYOUT,
            write: grasps::write,
        },
        ExportForm {
            product: Product::PATCHES,
            counted: Noun { one: "sample", many: "samples" },
            keys: &[],
            layout: |_| patches::LAYOUT,
            write: patches::write,
        },
        ExportForm {
            product: Product::REACHABILITY,
            counted: Noun { one: "pose", many: "poses" },
            keys: &[],
            layout: |_| poses::LAYOUT,
            write: poses::write,
        },
    ],
};
