//! Parquet tables: the index of a dataset, and rows of exports. Only this crate uses the Parquet library.
//!
//! Tables are written for pandas, DuckDB and dataset viewers; graspmill never reads one back.

mod index;
mod table;

pub use index::ParquetIndex;
pub use table::{ColumnType, TableColumn, TableFormat, TableWriter, Value};
