//! A Parquet table of any columns, written one row group at a time.

use std::{borrow::Cow, io, sync::Arc};

use parquet::{
    basic::{Compression, ZstdLevel},
    column::writer::ColumnWriter,
    data_type::{ByteArray, FixedLenByteArray},
    errors::ParquetError,
    file::{
        metadata::KeyValue,
        properties::{EnabledStatistics, WriterProperties},
        writer::SerializedFileWriter,
    },
    schema::{parser::parse_message_type, types::ColumnPath},
};

/// Type of the values of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColumnType {
    /// UTF-8.
    Text,
    /// Truth value.
    Boolean,
    /// Unsigned 32-bit integer.
    U32,
    /// Unsigned 64-bit integer.
    U64,
    /// Double.
    F64,
    /// Bytes that rarely repeat, such as bit planes; written without dictionary and statistics.
    Bytes,
    /// Thirty-two bytes of a digest, which do not repeat or compress.
    Digest,
    /// List of doubles.
    F64s,
    /// List of UTF-8 texts.
    Texts,
}

/// A column of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TableColumn {
    /// Name of the column.
    pub name: Cow<'static, str>,
    /// Type of its values.
    pub kind: ColumnType,
    /// Whether a value may be missing.
    pub optional: bool,
}

/// One value of a row.
#[derive(Clone, Debug, PartialEq)]
pub enum Value<'a> {
    /// No value, in an optional column.
    Empty,
    /// Value of a column of [`ColumnType::Text`].
    Text(&'a str),
    /// Value of a column of [`ColumnType::Boolean`].
    Boolean(bool),
    /// Value of a column of [`ColumnType::U32`].
    U32(u32),
    /// Value of a column of [`ColumnType::U64`].
    U64(u64),
    /// Value of a column of [`ColumnType::F64`].
    F64(f64),
    /// Value of a column of [`ColumnType::Bytes`] or [`ColumnType::Digest`].
    Bytes(&'a [u8]),
    /// Value of a column of [`ColumnType::F64s`].
    F64s(Cow<'a, [f64]>),
    /// Value of a column of [`ColumnType::Texts`].
    Texts(Vec<&'a str>),
}

/// Facts of a whole table.
#[derive(Clone, Debug)]
pub struct TableFormat {
    /// Name of the schema.
    pub name: &'static str,
    /// Columns, in order.
    pub columns: Vec<TableColumn>,
    /// Rows of a row group: the writer holds them in memory, and a reader unpacks them at once.
    pub group: usize,
    /// Keys and values of the table's own metadata.
    pub metadata: Vec<(String, String)>,
}

/// A table that is being written: zstd level 3, at most one row group in memory. Its bytes depend on the rows and on the
/// version of the Parquet library.
pub struct TableWriter<W: io::Write + Send> {
    writer: SerializedFileWriter<W>,
    /// Columns of the row group that is being filled.
    columns: Vec<Values>,
    rows: usize,
    group: usize,
}

impl<W: io::Write + Send> TableWriter<W> {
    /// Begins a table.
    ///
    /// # Errors
    /// When the output cannot be written.
    pub fn begin(out: W, format: TableFormat) -> io::Result<Self> {
        let columns = format.columns.iter().map(|column| Values::new(column.kind, column.optional)).collect();
        Ok(Self { writer: open(out, &format).map_err(into_io)?, columns, rows: 0, group: format.group })
    }

    /// Adds a row: one value per column, in their order.
    ///
    /// # Errors
    /// When the output cannot be written, or the values do not fit the columns.
    pub fn push<'a>(&mut self, row: impl IntoIterator<Item = Value<'a>>) -> io::Result<()> {
        let (mut values, mut fits) = (row.into_iter(), true);
        for column in &mut self.columns {
            fits &= values.next().is_some_and(|value| column.push(value));
        }
        if !fits || values.next().is_some() {
            return Err(io::Error::other(format!("a row that does not fit {} columns", self.columns.len())));
        }
        self.rows += 1;
        if self.rows == self.group { self.flush() } else { Ok(()) }
    }

    /// Writes what is left, and the footer.
    ///
    /// # Errors
    /// When the output cannot be written.
    pub fn finish(mut self) -> io::Result<()> {
        if self.rows > 0 {
            self.flush()?;
        }
        let mut out = self.writer.into_inner().map_err(into_io)?;
        out.flush()
    }

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

/// The values of one column in one row group, with the levels of Dremel's encoding where there are any.
struct Values {
    optional: bool,
    /// Definition levels: how much of the path to a value is present, in optional columns and lists.
    definition: Vec<i16>,
    /// Repetition levels: 0 where a row begins, 1 where its list continues.
    repetition: Vec<i16>,
    values: Typed,
}

enum Typed {
    Text(Vec<ByteArray>),
    Boolean(Vec<bool>),
    U32(Vec<i32>),
    U64(Vec<i64>),
    F64(Vec<f64>),
    Bytes(Vec<ByteArray>),
    Digest(Vec<FixedLenByteArray>),
    F64s(Vec<f64>),
    Texts(Vec<ByteArray>),
}

impl Values {
    fn new(kind: ColumnType, optional: bool) -> Self {
        let values = match kind {
            ColumnType::Text => Typed::Text(Vec::new()),
            ColumnType::Boolean => Typed::Boolean(Vec::new()),
            ColumnType::U32 => Typed::U32(Vec::new()),
            ColumnType::U64 => Typed::U64(Vec::new()),
            ColumnType::F64 => Typed::F64(Vec::new()),
            ColumnType::Bytes => Typed::Bytes(Vec::new()),
            ColumnType::Digest => Typed::Digest(Vec::new()),
            ColumnType::F64s => Typed::F64s(Vec::new()),
            ColumnType::Texts => Typed::Texts(Vec::new()),
        };
        Self { optional, definition: Vec::new(), repetition: Vec::new(), values }
    }

    /// Adds a value; `false` when it is of another type, or missing in a column that is not optional.
    fn push(&mut self, value: Value<'_>) -> bool {
        let is_list = matches!(self.values, Typed::F64s(_) | Typed::Texts(_));
        let there = i16::from(self.optional);
        if value == Value::Empty {
            self.definition.push(0);
            self.repetition.extend(is_list.then_some(0));
            return self.optional;
        }
        match (&mut self.values, &value) {
            (Typed::F64s(values), Value::F64s(list)) => {
                values.extend_from_slice(list);
                self.push_list(list.len());
                return true;
            }
            (Typed::Texts(values), Value::Texts(list)) => {
                values.extend(list.iter().map(|text| ByteArray::from(*text)));
                self.push_list(list.len());
                return true;
            }
            _ => {}
        }
        self.definition.push(there);
        match (&mut self.values, value) {
            (Typed::Text(values), Value::Text(text)) => values.push(text.into()),
            (Typed::Boolean(values), Value::Boolean(value)) => values.push(value),
            (Typed::U32(values), Value::U32(value)) => values.push(value as i32),
            (Typed::U64(values), Value::U64(value)) => values.push(value as i64),
            (Typed::F64(values), Value::F64(value)) => values.push(value),
            (Typed::Bytes(values), Value::Bytes(bytes)) => values.push(ByteArray::from(bytes.to_vec())),
            (Typed::Digest(values), Value::Bytes(bytes)) if bytes.len() == 32 => {
                values.push(ByteArray::from(bytes.to_vec()).into())
            }
            _ => return false,
        }
        true
    }

    /// Adds the levels of a list.
    fn push_list(&mut self, length: usize) {
        // An empty list is present, but has no element.
        let level = i16::from(self.optional) + i16::from(length > 0);
        self.definition.extend(std::iter::repeat_n(level, length.max(1)));
        self.repetition.extend((0..length.max(1)).map(|index| i16::from(index > 0)));
    }

    fn write(&self, writer: &mut ColumnWriter<'_>) -> Result<usize, ParquetError> {
        let levels = self.optional.then_some(self.definition.as_slice());
        match (writer, &self.values) {
            (ColumnWriter::ByteArrayColumnWriter(writer), Typed::Text(values) | Typed::Bytes(values)) => {
                writer.write_batch(values, levels, None)
            }
            (ColumnWriter::BoolColumnWriter(writer), Typed::Boolean(values)) => {
                writer.write_batch(values, levels, None)
            }
            (ColumnWriter::Int32ColumnWriter(writer), Typed::U32(values)) => writer.write_batch(values, levels, None),
            (ColumnWriter::Int64ColumnWriter(writer), Typed::U64(values)) => writer.write_batch(values, levels, None),
            (ColumnWriter::DoubleColumnWriter(writer), Typed::F64(values)) => writer.write_batch(values, levels, None),
            (ColumnWriter::DoubleColumnWriter(writer), Typed::F64s(values)) => {
                writer.write_batch(values, Some(&self.definition), Some(&self.repetition))
            }
            (ColumnWriter::ByteArrayColumnWriter(writer), Typed::Texts(values)) => {
                writer.write_batch(values, Some(&self.definition), Some(&self.repetition))
            }
            (ColumnWriter::FixedLenByteArrayColumnWriter(writer), Typed::Digest(values)) => {
                writer.write_batch(values, levels, None)
            }
            _ => Err(ParquetError::General("a column has another type than its schema".to_owned())),
        }
    }

    fn clear(&mut self) {
        self.definition.clear();
        self.repetition.clear();
        match &mut self.values {
            Typed::Text(values) | Typed::Bytes(values) | Typed::Texts(values) => values.clear(),
            Typed::Boolean(values) => values.clear(),
            Typed::U32(values) => values.clear(),
            Typed::U64(values) => values.clear(),
            Typed::F64(values) | Typed::F64s(values) => values.clear(),
            Typed::Digest(values) => values.clear(),
        }
    }
}

fn open<W: io::Write + Send>(out: W, format: &TableFormat) -> Result<SerializedFileWriter<W>, ParquetError> {
    let metadata = format.metadata.iter().map(|(key, value)| KeyValue::new(key.clone(), value.clone()));
    let mut properties = WriterProperties::builder()
        // The default contains the library's version, which would change bytes.
        .set_created_by("graspmill format 4".to_owned())
        .set_key_value_metadata((!format.metadata.is_empty()).then(|| metadata.collect()))
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
        .set_statistics_enabled(EnabledStatistics::Chunk);
    for TableColumn { name, kind, .. } in &format.columns {
        let path = ColumnPath::from(name.as_ref());
        if matches!(kind, ColumnType::Bytes | ColumnType::Digest) {
            properties = properties
                .set_column_dictionary_enabled(path.clone(), false)
                .set_column_statistics_enabled(path.clone(), EnabledStatistics::None);
        }
        if *kind == ColumnType::Digest {
            properties = properties.set_column_compression(path, Compression::UNCOMPRESSED);
        }
    }
    SerializedFileWriter::new(out, Arc::new(parse_message_type(&schema(format))?), Arc::new(properties.build()))
}

/// The columns in Parquet's words.
pub(super) fn schema(format: &TableFormat) -> String {
    let field = |TableColumn { name, kind, optional }: &TableColumn| {
        let presence = if *optional { "optional" } else { "required" };
        let (kind, annotation) = match kind {
            ColumnType::Text => ("binary", " (string)"),
            ColumnType::Boolean => ("boolean", ""),
            ColumnType::U32 => ("int32", " (integer(32, false))"),
            ColumnType::U64 => ("int64", " (integer(64, false))"),
            ColumnType::F64 => ("double", ""),
            ColumnType::Bytes => ("binary", ""),
            ColumnType::Digest => ("fixed_len_byte_array(32)", ""),
            ColumnType::F64s => return list_of(presence, name, "double element"),
            ColumnType::Texts => return list_of(presence, name, "binary element (string)"),
        };
        format!("{presence} {kind} {name}{annotation};\n")
    };
    format!("message {} {{\n{}}}", format.name, format.columns.iter().map(field).collect::<String>())
}

/// A column of lists in Parquet's words.
fn list_of(presence: &str, name: &str, element: &str) -> String {
    format!("{presence} group {name} (list) {{ repeated group list {{ required {element}; }} }}\n")
}

/// Returns an error of the output unchanged.
fn into_io(error: ParquetError) -> io::Error {
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

    fn format(kind: ColumnType, optional: bool) -> TableFormat {
        let columns = vec![TableColumn { name: "n".into(), kind, optional }];
        TableFormat { name: "row", columns, group: 2, metadata: Vec::new() }
    }

    #[test]
    fn a_row_that_does_not_fit_is_an_error() {
        let mut table = TableWriter::begin(Vec::new(), format(ColumnType::U32, false)).expect("a table");
        assert!(table.push([Value::Empty]).is_err() && table.push([]).is_err());
        assert!(table.push([Value::U32(1), Value::U32(2)]).is_err());
        let mut digests = TableWriter::begin(Vec::new(), format(ColumnType::Digest, false)).expect("a table");
        assert!(digests.push([Value::Bytes(&[0; 31])]).is_err());
    }

    #[test]
    fn lists_have_the_levels_of_dremels_encoding() {
        let mut values = Values::new(ColumnType::F64s, true);
        for list in [Value::F64s(vec![1.0, 2.0].into()), Value::Empty, Value::F64s(Vec::new().into())] {
            assert!(values.push(list));
        }
        assert_eq!((&values.definition[..], &values.repetition[..]), (&[2, 2, 0, 1][..], &[0, 1, 0, 0][..]));
        let mut required = Values::new(ColumnType::F64s, false);
        assert!(required.push(Value::F64s(vec![3.0].into())) && required.push(Value::F64s(Vec::new().into())));
        assert_eq!((&required.definition[..], &required.repetition[..]), (&[1, 0][..], &[0, 0][..]));
        assert!(!required.push(Value::Empty));
        let mut texts = Values::new(ColumnType::Texts, false);
        assert!(texts.push(Value::Texts(vec!["a", ""])) && texts.push(Value::Texts(Vec::new())));
        assert!(!texts.push(Value::F64s(vec![1.0].into())));
        let Typed::Texts(values) = &texts.values else { panic!("another type") };
        assert_eq!((values.len(), &texts.repetition[..3]), (2, &[0, 1, 0][..]));
    }
}
