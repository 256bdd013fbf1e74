//! Sizes of a dataset's tables, from a few of its samples, before the others are made.

use super::{
    DatasetHeader,
    finish::{reject_line, table_texts},
};
use crate::{
    Channel,
    storage::{
        DatasetError, IndexFormat, LedgerRow, ShardEntry,
        durable::json_text,
        index::{IndexRow, index_columns},
        layout::{INDEX, SPLITS},
        reader::checked_splits,
        shard_file::{ShardFile, invalid},
        subjects::asset_names,
    },
};
use kernel::{
    files::Folder,
    ids::{Digest, SampleIndex},
};

/// Bytes of a dataset in addition to its shards and the files that only its product has.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TableSizes {
    /// Bytes that do not depend on the samples: objects, splits, job, the head of the index.
    pub fixed: f64,
    /// Bytes per shard: its row in the manifest.
    pub per_shard: f64,
    /// Bytes per sample: its row in the index, and its line where it is rejected.
    pub per_sample: f64,
}

impl TableSizes {
    /// Writes the tables of these shards of a folder, of which each accounts for other samples, and measures them. `header` is
    /// that of the whole dataset.
    ///
    /// # Errors
    /// When a shard cannot be read, or a sample's subject is unknown.
    pub fn measure(
        folder: &Folder,
        shards: &[String],
        header: &DatasetHeader,
        format: &dyn IndexFormat,
    ) -> Result<Self, DatasetError> {
        let splits = header.splits.clone().filter(|_| header.product.has_splits);
        let splits = splits.map(|splits| checked_splits(splits, SPLITS.as_ref())).transpose()?;
        let texts = table_texts(header, splits.as_ref());
        let fixed = texts.iter().map(|(_, text)| text.len()).sum::<usize>() as f64;
        let Some(first) = shards.first() else { return Ok(Self { fixed, ..Self::default() }) };

        let mut rows: Vec<(u32, LedgerRow)> = Vec::new();
        let mut channels: Vec<Channel> = Vec::new();
        for (number, name) in (0..).zip(shards) {
            let ledger = ShardFile::open(folder, name)?.ledger()?;
            channels = ledger.channels;
            for row in ledger.rows {
                let index = SampleIndex(rows.len() as u64);
                rows.push((number, LedgerRow { index, ..row }));
            }
        }
        let subjects = asset_names(folder.path(), header.assets.iter().chain(&header.subjects))?;
        // Size of the index of the first rows.
        let index = |count: usize| {
            let mut bytes = Vec::new();
            let columns = index_columns(header.product, &channels);
            let failed = DatasetError::io("measuring", INDEX.as_ref());
            let written = (|| {
                let mut table = format.begin(Box::new(&mut bytes), &columns)?;
                for (shard, row) in &rows[..count] {
                    let Some((_, name, id)) = subjects.get(&row.sample.subject) else { continue };
                    let split = splits.as_ref().and_then(|splits| splits.split_of(&row.sample));
                    let cells = IndexRow { row, subject: [name, id], split, shard: *shard };
                    table.push(&cells.cells(header.product, &channels))?;
                }
                table.finish()
            })();
            written.map_err(failed)?;
            Ok::<_, DatasetError>(bytes.len() as f64)
        };
        if let Some((_, row)) = rows.iter().find(|(_, row)| !subjects.contains_key(&row.sample.subject)) {
            return Err(invalid(
                &folder.path_of(first),
                format!("sample {} is of a subject that the asset table lacks", row.sample),
            ));
        }
        // The first row also adds the head of each column; if it is the only row, its size serves for all rows.
        let head = index(rows.len().min(1))?;
        let per_row = match rows.len() {
            0 | 1 => head - index(0)?,
            count => (index(count)? - head) / (count - 1) as f64,
        };
        let lines: usize = rows.iter().filter_map(|(_, row)| reject_line(row)).map(|line| line.len() + 1).sum();
        let entry = ShardEntry {
            file: first.clone(),
            digest: Digest([0; 32]),
            bytes: 1 << 20,
            first_sample: rows.len() as u64,
            samples: rows.len() as u64,
            kept: rows.len() as u64,
        };
        Ok(Self {
            fixed: fixed + head,
            per_shard: json_text(&[entry]).len() as f64,
            per_sample: per_row + lines as f64 / rows.len().max(1) as f64,
        })
    }
}
