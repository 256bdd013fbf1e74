//! Parquet tables: the index of a dataset, and completion pairs as an export. The one home of the Parquet library.
//!
//! Tables are written for pandas, DuckDB and dataset viewers; graspmill never reads one back.

mod index;
mod pairs;

pub use index::ParquetIndex;
pub use pairs::{PairRow, PairTableWriter};
