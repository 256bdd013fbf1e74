//! Columns of a table of rows, and the table while it grows.

use std::{borrow::Cow, fs::File, path::PathBuf};

use serde_json::{Map, Value as Json, json};

use crate::export::{error::ExportError, selected::SampleNames, target::Target};
use format::dataset::DatasetReader;
use kernel::geom::{Frame, Pose};
use tables::{ColumnType, TableColumn, TableFormat, TableWriter, Value};

/// A column of a table whose rows are made of records `R`.
pub(super) struct RowColumn<R> {
    /// Name of the column.
    pub name: &'static str,
    /// Type of its values.
    pub kind: ColumnType,
    /// Whether a value may be missing.
    pub optional: bool,
    /// Content in words, with unit and frame.
    pub meaning: &'static str,
    /// The value of a row.
    pub value: fn(&R) -> Value<'_>,
}

impl<R> RowColumn<R> {
    /// A column with a value in every row.
    pub fn new(name: &'static str, kind: ColumnType, meaning: &'static str, value: fn(&R) -> Value<'_>) -> Self {
        Self { name, kind, optional: false, meaning, value }
    }

    /// A column whose value may be missing.
    pub fn optional(name: &'static str, kind: ColumnType, meaning: &'static str, value: fn(&R) -> Value<'_>) -> Self {
        Self { name, kind, optional: true, meaning, value }
    }
}

/// A row of something in a sample.
pub(super) trait OfSample {
    /// Names of the sample.
    fn names(&self) -> &SampleNames<'_>;
}

/// Columns that say which sample a row is of.
pub(super) fn sample_columns<R: OfSample>() -> Vec<RowColumn<R>> {
    use ColumnType::{Text, U32, U64};
    vec![
        RowColumn::new("sample_index", U64, "index of the sample in the dataset", |row| {
            Value::U64(row.names().index.0)
        }),
        RowColumn::new("subject", Text, "the subject by content, 64 hexadecimal digits", |row| {
            Value::Text(&row.names().subject)
        }),
        RowColumn::new("object", Text, "name of the subject", |row| Value::Text(row.names().object)),
        RowColumn::new("split", Text, "split of the sample; empty where the product has none", |row| {
            Value::Text(row.names().split)
        }),
        RowColumn::new("item", U32, "number of the sample's item: view, run, position or grasp", |row| {
            Value::U32(row.names().id.item.0)
        }),
    ]
}

/// A pose as 16 numbers, 4 x 4 row-major.
pub(super) fn matrix<To: Frame, From: Frame>(pose: &Pose<To, From>) -> Value<'static> {
    Value::F64s(pose.to_rows().into_iter().chain([0.0, 0.0, 0.0, 1.0]).collect())
}

/// A list of numbers; none where there is no list.
pub(super) fn numbers(values: Option<&[f64]>) -> Value<'_> {
    values.map_or(Value::Empty, |values| Value::F64s(Cow::Borrowed(values)))
}

/// A table of an export that is being written.
pub(super) struct RowTable {
    writer: TableWriter<File>,
    path: PathBuf,
    name: &'static str,
    columns: Json,
    rows: u64,
}

impl RowTable {
    /// Begins the table `<name>.parquet` of rows called `row`, `group` of them per row group. The dataset's root digest goes
    /// into its metadata, with `facts`.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn create<R>(
        (name, row, group): (&'static str, &'static str, usize),
        columns: &[RowColumn<R>],
        (reader, target): (&DatasetReader, &mut Target),
        facts: &[(&str, Json)],
    ) -> Result<Self, ExportError> {
        let (file, path) = target.file(&format!("{name}.parquet"))?;
        let root = ("graspmill.root".to_owned(), reader.manifest().root.to_string());
        let facts = facts.iter().map(|(key, value)| (format!("graspmill.{key}"), value.to_string()));
        let column = |column: &RowColumn<R>| TableColumn {
            name: column.name.into(),
            kind: column.kind,
            optional: column.optional,
        };
        let format = TableFormat {
            name: row,
            columns: columns.iter().map(column).collect(),
            group,
            metadata: [root].into_iter().chain(facts).collect(),
        };
        let writer = TableWriter::begin(file, format).map_err(ExportError::io("writing", &path))?;
        let meaning = |column: &RowColumn<R>| json!({ "name": column.name, "meaning": column.meaning });
        Ok(Self { writer, path, name, columns: columns.iter().map(meaning).collect(), rows: 0 })
    }

    /// Adds a row.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn push<R>(&mut self, columns: &[RowColumn<R>], row: &R) -> Result<(), ExportError> {
        self.rows += 1;
        let values = columns.iter().map(|column| (column.value)(row));
        self.writer.push(values).map_err(ExportError::io("writing", &self.path))
    }

    /// Writes what is left, and the footer.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn finish(self) -> Result<WrittenTable, ExportError> {
        let facts = json!({ "rows": self.rows, "columns": self.columns });
        self.writer.finish().map_err(ExportError::io("writing", &self.path))?;
        Ok(WrittenTable { file: format!("{}.parquet", self.name), rows: self.rows, facts })
    }
}

/// A table that is complete.
pub(super) struct WrittenTable {
    file: String,
    /// Count of its rows.
    pub rows: u64,
    facts: Json,
}

/// Facts of the tables for `export.json`: rows and columns of each, by file.
pub(super) fn table_facts(tables: impl IntoIterator<Item = WrittenTable>) -> Map<String, Json> {
    let tables: Map<String, Json> = tables.into_iter().map(|table| (table.file, table.facts)).collect();
    [("tables".to_owned(), tables.into())].into_iter().collect()
}
