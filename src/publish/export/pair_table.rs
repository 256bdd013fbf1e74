//! One Parquet table of pairs, for pandas, DuckDB and dataset viewers.

use super::{
    error::ExportError,
    form::ExportFormat,
    pair::PairSample,
    pairs::{PairStream, WritePairs, write_pairs},
    target::Target,
};
use format::{Noun, Product};
use tables::{PairRow, PairTableWriter};

/// `pairs.parquet`, one row per sample: bits, ids, grid, camera and poses ([`PairTableWriter`]).
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "parquet",
    summary: "One Parquet table of samples, for pandas, DuckDB and dataset viewers.",
    product: Product::COMPLETION,
    counted: Noun { one: "sample", many: "samples" },
    has_unpacked: false,
    layout: |_| {
        "pairs.parquet: one row per sample in row groups of 256, in the order of samples.csv; partial, complete, with \
         touch tactile (cells that any kind of touch met) are n^3 / 8 bytes, for numpy.unpackbits(..., \
         bitorder='little')[:n**3].reshape(n, n, n), indexed [x, y, z]; poses are the top three rows of 4 x 4, row-major"
    },
    write: |reader, selection, target| {
        write_pairs(reader, selection, target, |stream| PairTable { stream, rows: None })
    },
};

/// The table while it grows; begun with the first sample, which says whether there is touch.
struct PairTable {
    stream: PairStream,
    rows: Option<PairTableWriter>,
}

impl WritePairs for PairTable {
    const FILE_PER_SAMPLE: bool = false;

    fn write(&mut self, sample: &PairSample<'_>, target: &mut Target) -> Result<(), ExportError> {
        let tactile = sample.tactile();
        let rows = match &mut self.rows {
            Some(rows) => rows,
            None => {
                let (file, path) = target.file("pairs.parquet")?;
                self.rows.insert(PairTableWriter::create(file, path, tactile.is_some(), &self.stream.root)?)
            }
        };
        let PairSample { pair, object, split, .. } = *sample;
        Ok(rows.push(&PairRow { index: sample.index(), pair, tactile, object, split })?)
    }

    fn finish(self) -> Result<(), ExportError> {
        self.rows.map_or(Ok(()), |rows| Ok(rows.finish()?))
    }
}
