//! `index.parquet`: one row per sample index, kept or rejected, for pandas and other readers of tables.
//!
//! Its columns follow from the tables of products and channels. Our own readers use the ledgers and never read it back. This
//! crate does not depend on Parquet: callers that close or verify a dataset pass an [`IndexFormat`].

use std::io;

use super::{Fate, LedgerRow};
use crate::{Channel, FactKind, Product};
use kernel::{ids::Digest, words::Split};

/// A column of a dataset's index.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IndexColumn {
    /// Name of the column.
    pub name: String,
    /// Kind of its cells.
    pub kind: ColumnKind,
    /// Whether cells can be missing: rejected rows have no digests, kept rows no reason.
    pub optional: bool,
    /// Meaning, a sentence.
    pub meaning: String,
}

/// Kind of the cells of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColumnKind {
    /// UTF-8 text.
    Text,
    /// True or false.
    Boolean,
    /// A whole number from 0 to 2^32 - 1.
    U32,
    /// A whole number from 0 to 2^64 - 1.
    U64,
    /// A double.
    F64,
    /// The 32 bytes of a BLAKE3 digest.
    Digest,
}

/// One cell of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell<'a> {
    /// Value of a text column.
    Text(&'a str),
    /// Value of a Boolean column.
    Boolean(bool),
    /// Value of a column of 32-bit numbers.
    U32(u32),
    /// Value of a column of 64-bit numbers.
    U64(u64),
    /// Value of a column of doubles.
    F64(f64),
    /// Value of a column of digests.
    Digest(&'a Digest),
    /// None, in an optional column.
    Empty,
}

/// A format of tables in which the index is written. Equal rows give equal bytes.
pub trait IndexFormat: Sync {
    /// Begins a table.
    ///
    /// # Errors
    /// When the columns cannot be expressed, or `out` cannot be written.
    fn begin<'a>(
        &self,
        out: Box<dyn io::Write + Send + 'a>,
        columns: &[IndexColumn],
    ) -> io::Result<Box<dyn IndexWriter + 'a>>;
}

/// A table that grows by rows.
pub trait IndexWriter {
    /// Adds a row: one cell per column.
    ///
    /// # Errors
    /// When the output cannot be written.
    fn push(&mut self, row: &[Cell<'_>]) -> io::Result<()>;

    /// Ends the table.
    ///
    /// # Errors
    /// When the output cannot be written.
    fn finish(self: Box<Self>) -> io::Result<()>;
}

/// The columns of the index of a dataset of this product with these channels, in order.
pub fn index_columns(product: Product, channels: &[Channel]) -> Vec<IndexColumn> {
    let column = |name: &str, kind, meaning: &str| IndexColumn {
        name: name.to_owned(),
        kind,
        optional: false,
        meaning: meaning.to_owned(),
    };
    let mut columns = vec![
        column("sample_index", ColumnKind::U64, "Index of the sample in the plan, from 0."),
        column("subject", ColumnKind::Text, product.subject_meaning),
        column("object", ColumnKind::Text, "Name of the subject."),
        column("item", ColumnKind::U32, product.item_meaning),
        column("instance", ColumnKind::U32, "Body of a scene, from 1; 0 for lone objects."),
        column("camera", ColumnKind::U32, "Number of the camera."),
    ];
    if product.has_splits {
        columns.push(column("split", ColumnKind::Text, "Part of the dataset that the sample belongs to."));
    }
    columns.extend([
        column("shard", ColumnKind::U32, "Number of the shard that accounts for the sample."),
        column("kept", ColumnKind::Boolean, "Whether the sample is stored."),
        IndexColumn { optional: true, ..column("reason", ColumnKind::Text, "Reason of a rejected sample.") },
        IndexColumn { optional: true, ..column("detail", ColumnKind::Text, "Numbers behind the reason.") },
    ]);
    columns.extend(product.facts_of(channels).map(|(_, fact)| {
        let kind = match fact.kind {
            FactKind::Number(_) => ColumnKind::F64,
            FactKind::Count | FactKind::Integer => ColumnKind::U32,
        };
        column(fact.name, kind, fact.meaning)
    }));
    columns.extend(channels.iter().map(|channel| {
        let name = channel.name();
        let meaning = format!("BLAKE3 of the stored {} message, 32 bytes.", name.replace('_', " "));
        IndexColumn { optional: true, ..column(&format!("digest_{name}"), ColumnKind::Digest, &meaning) }
    }));
    columns
}

/// One sample as it goes into the index.
pub(crate) struct IndexRow<'a> {
    pub row: &'a LedgerRow,
    /// Name and content id of the subject.
    pub subject: [&'a str; 2],
    /// Split, where the product has splits.
    pub split: Option<Split>,
    pub shard: u32,
}

impl IndexRow<'_> {
    /// The cells, in the order of [`index_columns`].
    pub fn cells(&self, product: Product, channels: &[Channel]) -> Vec<Cell<'_>> {
        let LedgerRow { index, sample, facts, fate } = self.row;
        let [name, id] = self.subject;
        let mut cells = vec![
            Cell::U64(index.0),
            Cell::Text(id),
            Cell::Text(name),
            Cell::U32(sample.item.0),
            Cell::U32(sample.instance),
            Cell::U32(sample.camera),
        ];
        if product.has_splits {
            cells.push(Cell::Text(self.split.map_or("", Split::name)));
        }
        cells.extend([Cell::U32(self.shard), Cell::Boolean(matches!(fate, Fate::Kept(_)))]);
        match fate {
            Fate::Kept(_) => cells.extend([Cell::Empty; 2]),
            Fate::Rejected { reason, detail } => cells.extend([Cell::Text(reason), Cell::Text(detail)]),
        }
        cells.extend(product.facts_of(channels).map(|(index, fact)| match fact.kind {
            FactKind::Number(_) => Cell::F64(facts.values()[index]),
            FactKind::Count | FactKind::Integer => Cell::U32(facts.integer(index)),
        }));
        match fate {
            Fate::Kept(digests) => cells.extend(digests.iter().map(Cell::Digest)),
            Fate::Rejected { .. } => cells.extend(channels.iter().map(|_| Cell::Empty)),
        }
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_column_of_every_product_has_a_name_of_its_own_and_a_meaning() {
        for product in Product::all() {
            let columns = index_columns(product, &product.channels().collect::<Vec<_>>());
            let names: std::collections::BTreeSet<&str> = columns.iter().map(|column| column.name.as_str()).collect();
            assert_eq!(names.len(), columns.len(), "{product}");
            for IndexColumn { name, meaning, .. } in &columns {
                assert!(meaning.ends_with('.') && meaning.len() > 10, "{product}: {name}: '{meaning}'");
            }
        }
    }
}
