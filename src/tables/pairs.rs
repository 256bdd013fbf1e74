//! Completion pairs as a Parquet table: one row per sample, bits and what places them.

use std::{fs::File, path::PathBuf, sync::Arc};

use parquet::{
    basic::{Compression, ZstdLevel},
    column::writer::ColumnWriter,
    data_type::ByteArray,
    errors::ParquetError,
    file::{
        metadata::KeyValue,
        properties::{EnabledStatistics, WriterProperties},
        writer::SerializedFileWriter,
    },
    schema::{parser::parse_message_type, types::ColumnPath},
};

use super::index::into_io;
use format::VoxelPair;
use format::dataset::DatasetError;
use kernel::{geom::OccupancyGrid, ids::SampleIndex};

/// Rows of a row group: what a reader holds to shuffle, 4 MB of bits at 40^3.
const ROW_GROUP: usize = 256;

/// One row of the table.
pub struct PairRow<'a> {
    /// Index in the dataset.
    pub index: SampleIndex,
    /// The pair.
    pub pair: &'a VoxelPair,
    /// Cells that any kind of touch met, where the table has them.
    pub tactile: Option<&'a OccupancyGrid>,
    /// Name of the object.
    pub object: &'a str,
    /// Name of the split.
    pub split: &'a str,
}

/// Writes the table, a row group at a time.
///
/// Columns: `sample_index` (u64), `subject` (64 hexadecimal digits), `object`, `split` (text), `item`, `instance`, `camera`,
/// `resolution`, `partial_cells`, `complete_cells`, `both_cells` (u32), `solid_share`, `cell_size` \[m\], `centre_x`,
/// `centre_y`, `centre_z` \[m\], `fx`, `fy`, `cx`, `cy` \[px\] (f64), `camera_from_object`, `world_from_object`,
/// `world_from_camera` (lists of twelve f64), `partial`, `complete` and, with touch, `tactile` (bit planes as stored).
pub struct PairTableWriter {
    writer: SerializedFileWriter<File>,
    path: PathBuf,
    rows: Rows,
}

#[derive(Default)]
struct Rows {
    indices: Vec<i64>,
    words: [Vec<ByteArray>; 3],
    numbers: [Vec<i32>; 7],
    shares: [Vec<f64>; 9],
    poses: [Vec<f64>; 3],
    planes: Vec<Vec<ByteArray>>,
}

const WORDS: [&str; 3] = ["subject", "object", "split"];
const NUMBERS: [&str; 7] =
    ["item", "instance", "camera", "resolution", "partial_cells", "complete_cells", "both_cells"];
const SHARES: [&str; 9] = ["solid_share", "cell_size", "centre_x", "centre_y", "centre_z", "fx", "fy", "cx", "cy"];
const POSES: [&str; 3] = ["camera_from_object", "world_from_object", "world_from_camera"];
const PLANES: [&str; 3] = ["partial", "complete", "tactile"];

fn schema(planes: &[&str]) -> String {
    let words: String = WORDS.map(|name| format!("required binary {name} (string);\n")).concat();
    let numbers: String = NUMBERS.map(|name| format!("required int32 {name} (integer(32, false));\n")).concat();
    let shares: String = SHARES.map(|name| format!("required double {name};\n")).concat();
    let poses: String = POSES
        .map(|name| format!("required group {name} (list) {{ repeated group list {{ required double element; }} }}\n"))
        .concat();
    let planes: String = planes.iter().map(|name| format!("required binary {name};\n")).collect();
    format!(
        "message pair {{ required int64 sample_index (integer(64, false));\n{words}{numbers}{shares}{poses}{planes} }}"
    )
}

impl PairTableWriter {
    /// Begins a table in an empty file, with a tactile column where `touched`; `path` is for errors, `root` the digest of
    /// the dataset, which goes into the table's metadata.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn create(file: File, path: PathBuf, touched: bool, root: &str) -> Result<Self, DatasetError> {
        let planes = &PLANES[..if touched { 3 } else { 2 }];
        let open = || {
            let root = KeyValue::new("graspmill.root".to_owned(), root.to_owned());
            let mut properties = WriterProperties::builder()
                // The default holds the crate's version, which would move bytes.
                .set_created_by("graspmill format 2".to_owned())
                .set_key_value_metadata(Some(vec![root]))
                .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
                .set_statistics_enabled(EnabledStatistics::Chunk);
            for name in planes {
                // Grids hardly repeat, and their least and greatest mean nothing.
                properties = properties
                    .set_column_dictionary_enabled(ColumnPath::from(*name), false)
                    .set_column_statistics_enabled(ColumnPath::from(*name), EnabledStatistics::None);
            }
            let schema = Arc::new(parse_message_type(&schema(planes))?);
            SerializedFileWriter::new(file, schema, Arc::new(properties.build()))
        };
        let writer = open().map_err(|error| DatasetError::io("writing", &path)(into_io(error)))?;
        Ok(Self { writer, path, rows: Rows { planes: vec![Vec::new(); planes.len()], ..Rows::default() } })
    }

    /// Adds a row; `tactile` where the table was begun with touch.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn push(&mut self, row: &PairRow) -> Result<(), DatasetError> {
        self.rows.push(row);
        if self.rows.indices.len() == ROW_GROUP { self.flush() } else { Ok(()) }
    }

    fn flush(&mut self) -> Result<(), DatasetError> {
        let planes = vec![Vec::new(); self.rows.planes.len()];
        let rows = std::mem::replace(&mut self.rows, Rows { planes, ..Rows::default() });
        write_row_group(&mut self.writer, &rows)
            .map_err(|error| DatasetError::io("writing", &self.path)(into_io(error)))
    }

    /// Writes what is left, and the footer.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn finish(mut self) -> Result<(), DatasetError> {
        if !self.rows.indices.is_empty() {
            self.flush()?;
        }
        self.writer.close().map(|_| ()).map_err(|error| DatasetError::io("writing", &self.path)(into_io(error)))
    }
}

impl Rows {
    fn push(&mut self, row: &PairRow) {
        let PairRow { index, pair, tactile, object, split } = *row;
        let (id, grid, camera) = (pair.sample, pair.grid, pair.camera);
        self.indices.push(index.0 as i64);
        for (column, word) in self.words.iter_mut().zip([id.subject.to_string().as_str(), object, split]) {
            column.push(word.into());
        }
        let numbers = [
            id.item.0,
            id.instance,
            id.camera,
            grid.resolution,
            pair.partial_cells,
            pair.complete_cells,
            pair.both_cells,
        ];
        for (column, number) in self.numbers.iter_mut().zip(numbers) {
            column.push(number as i32);
        }
        let [x, y, z] = [grid.centre.x, grid.centre.y, grid.centre.z];
        let shares = [pair.solid_share, grid.cell_size, x, y, z, camera.fx, camera.fy, camera.cx, camera.cy];
        for (column, share) in self.shares.iter_mut().zip(shares) {
            column.push(share);
        }
        let poses =
            [pair.camera_from_object.to_rows(), pair.world_from_object.to_rows(), pair.world_from_camera.to_rows()];
        for (column, pose) in self.poses.iter_mut().zip(poses) {
            column.extend(pose);
        }
        let planes = [Some(&pair.partial), Some(&pair.complete), tactile];
        for (column, plane) in self.planes.iter_mut().zip(planes.into_iter().flatten()) {
            column.push(ByteArray::from(plane.bytes().to_vec()));
        }
    }
}

fn write_row_group(writer: &mut SerializedFileWriter<File>, rows: &Rows) -> Result<(), ParquetError> {
    let short = || ParquetError::General("the schema has more columns than the rows".to_owned());
    let mut words = rows.words.iter().chain(&rows.planes);
    let mut numbers = rows.numbers.iter();
    let mut shares = rows.shares.iter();
    let mut poses = rows.poses.iter();
    // Of lists of twelve that are all there: every element is defined, and all but the first go on with a list.
    let defined = vec![1; 12 * rows.indices.len()];
    let repeated: Vec<i16> = (0..defined.len()).map(|index| i16::from(index % 12 != 0)).collect();
    let mut group = writer.next_row_group()?;
    while let Some(mut column) = group.next_column()? {
        match column.untyped() {
            ColumnWriter::Int64ColumnWriter(writer) => writer.write_batch(&rows.indices, None, None)?,
            ColumnWriter::Int32ColumnWriter(writer) => {
                writer.write_batch(numbers.next().ok_or_else(short)?, None, None)?
            }
            ColumnWriter::DoubleColumnWriter(writer) => match shares.next() {
                Some(values) => writer.write_batch(values, None, None)?,
                None => writer.write_batch(poses.next().ok_or_else(short)?, Some(&defined), Some(&repeated))?,
            },
            ColumnWriter::ByteArrayColumnWriter(writer) => {
                writer.write_batch(words.next().ok_or_else(short)?, None, None)?
            }
            _ => return Err(short()),
        };
        column.close()?;
    }
    group.close().map(|_| ())
}
