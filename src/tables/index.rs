//! `index.parquet`: the index of a dataset as a Parquet table.

use std::{io, sync::Arc};

use parquet::{
    basic::{Compression, ZstdLevel},
    column::writer::ColumnWriter,
    data_type::{ByteArray, FixedLenByteArray},
    errors::ParquetError,
    file::{
        properties::{EnabledStatistics, WriterProperties},
        writer::SerializedFileWriter,
    },
    schema::{parser::parse_message_type, types::ColumnPath},
};

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
        let writer = open(out, columns).map_err(into_io)?;
        let columns = columns.iter().map(|column| Values::new(column.kind, column.optional)).collect();
        Ok(Box::new(ParquetTable { writer, columns, rows: 0 }))
    }
}

/// A table that is being written.
struct ParquetTable<W: io::Write + Send> {
    writer: SerializedFileWriter<W>,
    /// Columns of the row group that is being filled.
    columns: Vec<Values>,
    rows: usize,
}

/// The values of one column in one row group; an optional column has a level per row: 1 with a value, 0 without.
struct Values {
    levels: Option<Vec<i16>>,
    values: Typed,
}

enum Typed {
    Text(Vec<ByteArray>),
    Boolean(Vec<bool>),
    U32(Vec<i32>),
    U64(Vec<i64>),
    F64(Vec<f64>),
    Digest(Vec<FixedLenByteArray>),
}

impl Values {
    fn new(kind: ColumnKind, optional: bool) -> Self {
        let values = match kind {
            ColumnKind::Text => Typed::Text(Vec::new()),
            ColumnKind::Boolean => Typed::Boolean(Vec::new()),
            ColumnKind::U32 => Typed::U32(Vec::new()),
            ColumnKind::U64 => Typed::U64(Vec::new()),
            ColumnKind::F64 => Typed::F64(Vec::new()),
            ColumnKind::Digest => Typed::Digest(Vec::new()),
        };
        Self { levels: optional.then(Vec::new), values }
    }

    /// Adds a cell; `false` when it is of another kind, or missing in a column that is not optional.
    fn push(&mut self, cell: Cell<'_>) -> bool {
        if let Some(levels) = &mut self.levels {
            levels.push(i16::from(cell != Cell::Empty));
            if cell == Cell::Empty {
                return true;
            }
        }
        match (&mut self.values, cell) {
            (Typed::Text(values), Cell::Text(text)) => values.push(text.into()),
            (Typed::Boolean(values), Cell::Boolean(value)) => values.push(value),
            (Typed::U32(values), Cell::U32(value)) => values.push(value as i32),
            (Typed::U64(values), Cell::U64(value)) => values.push(value as i64),
            (Typed::F64(values), Cell::F64(value)) => values.push(value),
            (Typed::Digest(values), Cell::Digest(digest)) => values.push(ByteArray::from(digest.0.to_vec()).into()),
            _ => return false,
        }
        true
    }

    fn write(&self, writer: &mut ColumnWriter<'_>) -> Result<usize, ParquetError> {
        let levels = self.levels.as_deref();
        match (writer, &self.values) {
            (ColumnWriter::ByteArrayColumnWriter(writer), Typed::Text(values)) => {
                writer.write_batch(values, levels, None)
            }
            (ColumnWriter::BoolColumnWriter(writer), Typed::Boolean(values)) => {
                writer.write_batch(values, levels, None)
            }
            (ColumnWriter::Int32ColumnWriter(writer), Typed::U32(values)) => writer.write_batch(values, levels, None),
            (ColumnWriter::Int64ColumnWriter(writer), Typed::U64(values)) => writer.write_batch(values, levels, None),
            (ColumnWriter::DoubleColumnWriter(writer), Typed::F64(values)) => writer.write_batch(values, levels, None),
            (ColumnWriter::FixedLenByteArrayColumnWriter(writer), Typed::Digest(values)) => {
                writer.write_batch(values, levels, None)
            }
            _ => Err(ParquetError::General("a column has another type than its schema".to_owned())),
        }
    }

    fn clear(&mut self) {
        self.levels.iter_mut().for_each(Vec::clear);
        match &mut self.values {
            Typed::Text(values) => values.clear(),
            Typed::Boolean(values) => values.clear(),
            Typed::U32(values) => values.clear(),
            Typed::U64(values) => values.clear(),
            Typed::F64(values) => values.clear(),
            Typed::Digest(values) => values.clear(),
        }
    }
}

impl<W: io::Write + Send> ParquetTable<W> {
    fn flush(&mut self) -> io::Result<()> {
        let mut columns = self.columns.iter();
        let written = (|| {
            let mut group = self.writer.next_row_group()?;
            while let Some(mut column) = group.next_column()? {
                let values = columns.next().ok_or_else(|| ParquetError::General("too many columns".to_owned()))?;
                values.write(column.untyped())?;
                column.close()?;
            }
            group.close().map(|_| ())
        })();
        self.columns.iter_mut().for_each(Values::clear);
        self.rows = 0;
        written.map_err(into_io)
    }
}

impl<W: io::Write + Send> IndexWriter for ParquetTable<W> {
    fn push(&mut self, row: &[Cell<'_>]) -> io::Result<()> {
        let fits = row.len() == self.columns.len()
            && self.columns.iter_mut().zip(row).all(|(column, cell)| column.push(*cell));
        if !fits {
            return Err(io::Error::other(format!("a row of {} cells for {} columns", row.len(), self.columns.len())));
        }
        self.rows += 1;
        if self.rows == ROW_GROUP { self.flush() } else { Ok(()) }
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        if self.rows > 0 {
            self.flush()?;
        }
        let mut out = self.writer.into_inner().map_err(into_io)?;
        out.flush()
    }
}

fn open<W: io::Write + Send>(out: W, columns: &[IndexColumn]) -> Result<SerializedFileWriter<W>, ParquetError> {
    let mut properties = WriterProperties::builder()
        // The default holds the library's version, which would move bytes.
        .set_created_by("graspmill format 2".to_owned())
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
        .set_statistics_enabled(EnabledStatistics::Chunk);
    for column in columns.iter().filter(|column| column.kind == ColumnKind::Digest) {
        // Digests neither repeat nor shrink.
        let path = ColumnPath::from(column.name.as_str());
        properties = properties
            .set_column_dictionary_enabled(path.clone(), false)
            .set_column_compression(path.clone(), Compression::UNCOMPRESSED)
            .set_column_statistics_enabled(path, EnabledStatistics::None);
    }
    SerializedFileWriter::new(out, Arc::new(parse_message_type(&schema(columns))?), Arc::new(properties.build()))
}

/// The columns in Parquet's words.
fn schema(columns: &[IndexColumn]) -> String {
    let field = |IndexColumn { name, kind, optional, .. }: &IndexColumn| {
        let presence = if *optional { "optional" } else { "required" };
        let (kind, annotation) = match kind {
            ColumnKind::Text => ("binary", " (string)"),
            ColumnKind::Boolean => ("boolean", ""),
            ColumnKind::U32 => ("int32", " (integer(32, false))"),
            ColumnKind::U64 => ("int64", " (integer(64, false))"),
            ColumnKind::F64 => ("double", ""),
            ColumnKind::Digest => ("fixed_len_byte_array(32)", ""),
        };
        format!("{presence} {kind} {name}{annotation};\n")
    };
    format!("message sample {{\n{}}}", columns.iter().map(field).collect::<String>())
}

/// An error of the output comes back as it was.
pub(super) fn into_io(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(source) => match source.downcast::<io::Error>() {
            Ok(source) => *source,
            Err(source) => io::Error::other(source.to_string()),
        },
        other => io::Error::other(other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use format::{Channel, Product, dataset::index_columns};
    use kernel::ids::Digest;

    #[test]
    fn parquet_takes_the_columns_of_every_product() {
        for product in Product::all() {
            let columns = index_columns(product, &product.channels().collect::<Vec<Channel>>());
            let schema = parse_message_type(&schema(&columns)).expect("a schema");
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
        // Verification compares an index with one that is written again: another library may write other bytes, and
        // then the number of the format has to change.
        assert_eq!(Digest::of(&bytes).short(), "f3d4240a8e37a785");
    }

    #[test]
    fn a_row_that_does_not_fit_is_an_error() {
        let columns =
            [IndexColumn { name: "n".to_owned(), kind: ColumnKind::U32, optional: false, meaning: String::new() }];
        let mut table = ParquetIndex.begin(Box::new(Vec::new()), &columns).expect("a table");
        assert!(table.push(&[Cell::Empty]).is_err() && table.push(&[]).is_err());
    }
}
