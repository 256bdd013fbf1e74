//! `index.parquet`: the index of a dataset as a Parquet table.

use std::io;

use super::table::{ColumnType, TableColumn, TableFormat, TableWriter, Value};
use format::dataset::{Cell, ColumnKind, IndexColumn, IndexFormat, IndexWriter};

/// Rows per row group.
const ROW_GROUP: usize = 32768;

/// The index as a Parquet table: zstd level 3, 32,768 rows per row group. Its bytes depend on the rows and on the version
/// of the Parquet library, which a test pins.
#[derive(Clone, Copy, Debug)]
pub struct ParquetIndex;

impl IndexFormat for ParquetIndex {
    fn begin<'a>(
        &self,
        out: Box<dyn io::Write + Send + 'a>,
        columns: &[IndexColumn],
    ) -> io::Result<Box<dyn IndexWriter + 'a>> {
        Ok(Box::new(TableWriter::begin(out, index_table(columns))?))
    }
}

impl<W: io::Write + Send> IndexWriter for TableWriter<W> {
    fn push(&mut self, row: &[Cell<'_>]) -> io::Result<()> {
        TableWriter::push(self, row.iter().map(|cell| value(*cell)))
    }

    fn finish(self: Box<Self>) -> io::Result<()> {
        TableWriter::finish(*self)
    }
}

/// The table of an index with these columns.
fn index_table(columns: &[IndexColumn]) -> TableFormat {
    let column = |IndexColumn { name, kind, optional, .. }: &IndexColumn| {
        let kind = match kind {
            ColumnKind::Text => ColumnType::Text,
            ColumnKind::Boolean => ColumnType::Boolean,
            ColumnKind::U32 => ColumnType::U32,
            ColumnKind::U64 => ColumnType::U64,
            ColumnKind::F64 => ColumnType::F64,
            ColumnKind::Digest => ColumnType::Digest,
        };
        TableColumn { name: name.clone().into(), kind, optional: *optional }
    };
    let columns = columns.iter().map(column).collect();
    TableFormat { name: "sample", columns, group: ROW_GROUP, metadata: Vec::new() }
}

fn value(cell: Cell<'_>) -> Value<'_> {
    match cell {
        Cell::Empty => Value::Empty,
        Cell::Text(text) => Value::Text(text),
        Cell::Boolean(value) => Value::Boolean(value),
        Cell::U32(value) => Value::U32(value),
        Cell::U64(value) => Value::U64(value),
        Cell::F64(value) => Value::F64(value),
        Cell::Digest(digest) => Value::Bytes(&digest.0),
    }
}

#[cfg(test)]
mod tests {
    use parquet::schema::parser::parse_message_type;

    use super::*;
    use crate::table::schema;
    use format::{Channel, Product, dataset::index_columns};
    use kernel::ids::Digest;

    #[test]
    fn parquet_takes_the_columns_of_every_product() {
        for product in Product::all() {
            let columns = index_columns(product, &product.channels().collect::<Vec<Channel>>());
            let schema = parse_message_type(&schema(&index_table(&columns))).expect("a schema");
            let written = schema.get_fields().iter().map(|field| (field.name().to_owned(), field.is_optional()));
            let listed = columns.into_iter().map(|column| (column.name, column.optional));
            assert_eq!(written.collect::<Vec<_>>(), listed.collect::<Vec<_>>(), "{product}");
        }
    }

    #[test]
    fn equal_rows_give_the_bytes_of_this_version_of_the_library() {
        let column =
            |name: &str, kind, optional| IndexColumn { name: name.to_owned(), kind, optional, meaning: String::new() };
        let columns = [
            column("number", ColumnKind::U64, false),
            column("name", ColumnKind::Text, false),
            column("reason", ColumnKind::Text, true),
            column("share", ColumnKind::F64, false),
            column("digest", ColumnKind::Digest, true),
        ];
        let mut bytes = Vec::new();
        let mut table = ParquetIndex.begin(Box::new(&mut bytes), &columns).expect("a table");
        let digest = Digest([7; 32]);
        for number in 0..70_000 {
            let kept = number % 3 > 0;
            let (reason, digest) =
                if kept { (Cell::Empty, Cell::Digest(&digest)) } else { (Cell::Text("no"), Cell::Empty) };
            table.push(&[Cell::U64(number), Cell::Text("mug"), reason, Cell::F64(0.5), digest]).expect("a row");
        }
        table.finish().expect("an end");
        // Verification compares an index with one that is written again: another library may write other bytes, and then the
        // number of the format must change.
        assert_eq!(Digest::hash(&bytes).short(), "28649b641bfd4f89");
    }
}
