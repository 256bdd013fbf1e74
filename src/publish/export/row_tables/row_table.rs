//! A table of rows: its declaration, and the file that is being written.

use std::{fs::File, path::PathBuf};

use serde_json::{Map, Value as Json, json};

use super::column::RowColumn;
use crate::export::{error::ExportError, target::Target};
use format::{Channel, Product, dataset::DatasetReader};
use tables::{TableFormat, TableWriter};

/// A kind of rows: one table of an export, with its columns.
pub(super) trait TableRow: Sized {
    /// The table.
    const TABLE: TableName;

    /// Columns of datasets of a product that store every channel.
    fn columns(product: Product) -> Vec<RowColumn<Self>>;
}

/// A table of an export.
pub(super) struct TableName {
    /// Name of the file, without its ending.
    pub name: &'static str,
    /// Name of a row, in the schema.
    pub row: &'static str,
    /// Rows of a row group, which the writer keeps in memory and a reader decompresses at once.
    pub group: usize,
    /// Paragraph about one row and its use, for docs/tables.md.
    #[cfg_attr(not(test), expect(dead_code, reason = "docs/tables.md has it, and a test compares"))]
    pub meaning: &'static str,
}

/// A table of an export that is being written.
pub(super) struct RowTable {
    writer: TableWriter<File>,
    path: PathBuf,
    name: &'static str,
    product: Product,
    channels: Vec<Channel>,
    columns: Json,
    rows: u64,
}

/// The columns of datasets of a product that store these channels.
fn stored_columns<R: TableRow>(product: Product, channels: &[Channel]) -> Vec<RowColumn<R>> {
    R::columns(product).into_iter().filter(|column| column.is_stored(channels)).collect()
}

impl RowTable {
    /// Begins a table. The dataset's root digest goes into its metadata, with `facts`.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn create<R: TableRow>(
        reader: &DatasetReader,
        target: &mut Target,
        facts: &[(&str, Json)],
    ) -> Result<Self, ExportError> {
        let manifest = reader.manifest();
        let (product, channels) = (manifest.product, manifest.channels());
        let columns = stored_columns::<R>(product, &channels);
        let (file, path) = target.file(&format!("{}.parquet", R::TABLE.name))?;
        let root = ("graspmill.root".to_owned(), manifest.root.to_string());
        let facts = facts.iter().map(|(key, value)| (format!("graspmill.{key}"), value.to_string()));
        let format = TableFormat {
            name: R::TABLE.row,
            columns: columns.iter().map(RowColumn::format).collect(),
            group: R::TABLE.group,
            metadata: [root].into_iter().chain(facts).collect(),
        };
        let writer = TableWriter::begin(file, format).map_err(ExportError::io("writing", &path))?;
        let meaning = |column: &RowColumn<R>| json!({ "name": column.name, "meaning": column.meaning });
        let columns = columns.iter().map(meaning).collect();
        Ok(Self { writer, path, name: R::TABLE.name, product, channels, columns, rows: 0 })
    }

    /// Adds rows.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn extend<R: TableRow>(&mut self, rows: impl IntoIterator<Item = R>) -> Result<(), ExportError> {
        let columns = stored_columns::<R>(self.product, &self.channels);
        for row in rows {
            self.rows += 1;
            let values = columns.iter().map(|column| column.value(&row));
            self.writer.push(values).map_err(ExportError::io("writing", &self.path))?;
        }
        Ok(())
    }

    /// Writes the remaining rows and the footer.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn finish(self) -> Result<WrittenTable, ExportError> {
        let facts = json!({ "rows": self.rows, "columns": self.columns });
        self.writer.finish().map_err(ExportError::io("writing", &self.path))?;
        Ok(WrittenTable { file: format!("{}.parquet", self.name), rows: self.rows, facts })
    }
}

/// A complete table.
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
