//! `index.parquet`: one row a sample index, kept or rejected.

use std::{fs::File, path::Path, sync::Arc};

use parquet::{
    basic::{Compression, ZstdLevel},
    column::{reader::ColumnReader, writer::ColumnWriter},
    data_type::{ByteArray, FixedLenByteArray},
    errors::ParquetError,
    file::{
        properties::{EnabledStatistics, WriterProperties},
        reader::FileReader,
        writer::SerializedFileWriter,
    },
    record::{Field, Row, reader::RowIter},
    schema::{parser::parse_message_type, types::ColumnPath},
};

use super::{
    DatasetError, Fate, LedgerRow, Split,
    durable::Temporary,
    index_file::{IndexReader, ROW_GROUP, guarded},
    layout::{INDEX, has_splits},
};
use crate::{
    geom::{PoseLabel, Proof},
    ids::{Digest, ObjectId, Product, SampleId, ViewId},
    record::{BlockFacts, Channel, GraspFacts, GraspVerdict, PairFacts, PatchFacts, SampleFacts, TrialFacts},
};

/// The remedy for an index that is damaged.
pub(super) const REMAKE_INDEX: &str = "delete it and manifest.json and `run` the job again: the shards are kept";

/// One row as it goes into the index.
pub(super) struct IndexRow<'a> {
    pub row: &'a LedgerRow,
    pub object: &'a ByteArray,
    pub subject: &'a ByteArray,
    /// Where the product has splits.
    pub split: Option<Split>,
    pub shard: u32,
}

/// Writes the index, a row group at a time.
pub(super) struct IndexWriter {
    writer: SerializedFileWriter<File>,
    file: File,
    temporary: Temporary,
    columns: Columns,
}

/// The columns of one row group, in schema order.
#[derive(Default)]
struct Columns {
    sample_index: Vec<i64>,
    /// subject, object, and split where the product has splits
    names: Vec<Vec<ByteArray>>,
    /// instance, view, camera, shard, and the product's counts
    numbers: Vec<Vec<i32>>,
    kept: Vec<bool>,
    /// reason, detail: of rejects only
    words: [Vec<ByteArray>; 2],
    /// the product's shares
    shares: Vec<Vec<f64>>,
    /// digests of each channel, of kept samples only
    digests: Vec<Vec<FixedLenByteArray>>,
}

/// Names of the columns with the facts of a product's samples: counts, then shares.
fn fact_columns(product: Product, channels: &[Channel]) -> (Vec<String>, Vec<String>) {
    let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    match product {
        Product::Completion => (owned(&["partial_cells", "complete_cells", "both_cells"]), owned(&["solid_share"])),
        Product::Reachability => {
            let labels = PoseLabel::ALL.into_iter().map(|label| label.name().to_owned());
            let proofs = Proof::ALL.into_iter().map(|proof| format!("by_{}", proof.name()));
            (labels.chain(proofs).collect(), Vec::new())
        }
        Product::Grasps => {
            let verdicts = GraspVerdict::ALL.into_iter().map(|verdict| format!("grasps_{}", verdict.name()));
            let trials: &[&str] = match channels.contains(&Channel::GraspTrials) {
                true => &["grasps_tried", "grasps_held", "grasps_refused"],
                false => &[],
            };
            let counts = verdicts.chain(["given_up".to_owned()]).chain(owned(trials));
            (counts.collect(), owned(&["best_energy", "best_epsilon"]))
        }
        Product::Patches => (owned(&["type", "type_index"]), owned(&["energy", "epsilon"])),
    }
}

/// The facts of a sample, in the order of [`fact_columns`]; counts of trials come last, and find no column without them.
fn facts_of(facts: &SampleFacts) -> (Vec<u32>, Vec<f64>) {
    match facts {
        SampleFacts::Pair(PairFacts { partial_cells, complete_cells, both_cells, solid_share }) => {
            (vec![*partial_cells, *complete_cells, *both_cells], vec![*solid_share])
        }
        SampleFacts::Block(BlockFacts { labels, proofs }) => (labels.iter().chain(proofs).copied().collect(), vec![]),
        SampleFacts::Grasps(GraspFacts { verdicts, best_energy, best_epsilon, given_up, trials }) => {
            let TrialFacts { tried, held, refused } = *trials;
            let counts = verdicts.iter().copied().chain([u32::from(*given_up), tried, held, refused]).collect();
            (counts, vec![*best_energy, *best_epsilon])
        }
        SampleFacts::Patches(PatchFacts { kind, type_index, energy, epsilon }) => {
            (vec![*kind, *type_index], vec![*energy, *epsilon])
        }
    }
}

/// A column of a dataset's index.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IndexColumn {
    /// Its name.
    pub name: String,
    /// What its cells are.
    pub kind: ColumnKind,
    /// Whether some rows have no cell: rejected ones no digests, kept ones no reason.
    pub optional: bool,
}

/// What the cells of a column are.
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

/// The columns of the index of a dataset of this product with these channels, in order.
pub fn index_columns(product: Product, channels: &[Channel]) -> Vec<IndexColumn> {
    let (counts, shares) = fact_columns(product, channels);
    let split = has_splits(product).then_some(("split", ColumnKind::Text));
    let before = [
        ("sample_index", ColumnKind::U64),
        ("subject", ColumnKind::Text),
        ("object", ColumnKind::Text),
        ("instance", ColumnKind::U32),
        ("view", ColumnKind::U32),
        ("camera", ColumnKind::U32),
    ];
    let after = [
        ("shard", ColumnKind::U32),
        ("kept", ColumnKind::Boolean),
        ("reason", ColumnKind::Text),
        ("detail", ColumnKind::Text),
    ];
    let named = before.into_iter().chain(split).chain(after).map(|(name, kind)| (name.to_owned(), kind));
    let facts = (counts.into_iter().map(|name| (name, ColumnKind::U32)))
        .chain(shares.into_iter().map(|name| (name, ColumnKind::F64)));
    let digests = channels.iter().map(|channel| (format!("digest_{}", channel.name()), ColumnKind::Digest));
    let column = |(name, kind): (String, _)| {
        let optional = kind == ColumnKind::Digest || ["reason", "detail"].contains(&name.as_str());
        IndexColumn { name, kind, optional }
    };
    named.chain(facts).chain(digests).map(column).collect()
}

/// The columns in Parquet's words.
fn schema(product: Product, channels: &[Channel]) -> String {
    let field = |IndexColumn { name, kind, optional }: IndexColumn| {
        let presence = if optional { "optional" } else { "required" };
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
    let fields: String = index_columns(product, channels).into_iter().map(field).collect();
    format!("message sample {{\n{fields}}}")
}

impl IndexWriter {
    pub fn create(folder: &Path, product: Product, channels: &[Channel]) -> Result<Self, DatasetError> {
        let (file, temporary) = Temporary::create(folder, INDEX)?;
        let writer = Self::open(&file, product, channels).map_err(|error| unwritten(temporary.path(), error))?;
        let (counts, shares) = fact_columns(product, channels);
        let columns = Columns {
            names: vec![Vec::new(); if has_splits(product) { 3 } else { 2 }],
            numbers: vec![Vec::new(); 4 + counts.len()],
            shares: vec![Vec::new(); shares.len()],
            digests: vec![Vec::new(); channels.len()],
            ..Columns::default()
        };
        Ok(Self { writer, file, temporary, columns })
    }

    fn open(file: &File, product: Product, channels: &[Channel]) -> Result<SerializedFileWriter<File>, ParquetError> {
        let mut properties = WriterProperties::builder()
            // The default holds the crate's version, which would move bytes.
            .set_created_by("graspmill format 1".to_owned())
            .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
            .set_statistics_enabled(EnabledStatistics::Chunk);
        for channel in channels {
            // Digests neither repeat nor shrink.
            let path = ColumnPath::from(format!("digest_{}", channel.name()));
            properties = properties
                .set_column_dictionary_enabled(path.clone(), false)
                .set_column_compression(path.clone(), Compression::UNCOMPRESSED)
                .set_column_statistics_enabled(path, EnabledStatistics::None);
        }
        let schema = Arc::new(parse_message_type(&schema(product, channels))?);
        SerializedFileWriter::new(file.try_clone()?, schema, Arc::new(properties.build()))
    }

    pub fn push(&mut self, row: &IndexRow) -> Result<(), DatasetError> {
        let columns = &mut self.columns;
        let LedgerRow { index, sample, facts, fate } = row.row;
        columns.sample_index.push(index.0 as i64);
        let split = row.split.map_or_else(ByteArray::new, |split| ByteArray::from(split.name()));
        for (column, name) in columns.names.iter_mut().zip([row.subject.clone(), row.object.clone(), split]) {
            column.push(name);
        }
        let (counts, shares) = facts_of(facts);
        let numbers = [sample.instance, sample.view.0, sample.camera, row.shard].into_iter().chain(counts);
        for (column, number) in columns.numbers.iter_mut().zip(numbers) {
            column.push(number as i32);
        }
        for (column, share) in columns.shares.iter_mut().zip(shares) {
            column.push(share);
        }
        columns.kept.push(matches!(fate, Fate::Kept(_)));
        match fate {
            Fate::Kept(digests) => {
                for (column, digest) in columns.digests.iter_mut().zip(digests) {
                    column.push(ByteArray::from(digest.0.to_vec()).into());
                }
            }
            Fate::Rejected { reason, detail } => {
                columns.words[0].push(reason.as_str().into());
                columns.words[1].push(detail.as_str().into());
            }
        }
        if columns.kept.len() == ROW_GROUP { self.flush() } else { Ok(()) }
    }

    fn flush(&mut self) -> Result<(), DatasetError> {
        let written = write_row_group(&mut self.writer, &self.columns);
        self.columns.clear();
        written.map_err(|error| unwritten(self.temporary.path(), error))
    }

    pub fn finish(mut self, folder: &Path) -> Result<(), DatasetError> {
        if !self.columns.kept.is_empty() {
            self.flush()?;
        }
        let Self { writer, file, temporary, .. } = self;
        writer.close().map_err(|error| unwritten(temporary.path(), error))?;
        temporary.publish(&file, folder, INDEX).map(|_| ())
    }
}

impl Columns {
    fn clear(&mut self) {
        self.sample_index.clear();
        self.names.iter_mut().chain(&mut self.words).for_each(Vec::clear);
        self.numbers.iter_mut().for_each(Vec::clear);
        self.kept.clear();
        self.shares.iter_mut().for_each(Vec::clear);
        self.digests.iter_mut().for_each(Vec::clear);
    }
}

fn write_row_group(writer: &mut SerializedFileWriter<File>, columns: &Columns) -> Result<(), ParquetError> {
    let of_kept: Vec<i16> = columns.kept.iter().map(|kept| i16::from(*kept)).collect();
    let of_rejected: Vec<i16> = columns.kept.iter().map(|kept| i16::from(!*kept)).collect();
    let mut names = columns.names.iter();
    let mut numbers = columns.numbers.iter();
    let mut words = columns.words.iter();
    let mut shares = columns.shares.iter();
    let mut digests = columns.digests.iter();
    let short = || ParquetError::General("the schema has more columns than the rows".to_owned());
    let mut group = writer.next_row_group()?;
    while let Some(mut column) = group.next_column()? {
        match column.untyped() {
            ColumnWriter::Int64ColumnWriter(writer) => writer.write_batch(&columns.sample_index, None, None)?,
            ColumnWriter::Int32ColumnWriter(writer) => {
                writer.write_batch(numbers.next().ok_or_else(short)?, None, None)?
            }
            ColumnWriter::BoolColumnWriter(writer) => writer.write_batch(&columns.kept, None, None)?,
            ColumnWriter::DoubleColumnWriter(writer) => {
                writer.write_batch(shares.next().ok_or_else(short)?, None, None)?
            }
            ColumnWriter::ByteArrayColumnWriter(writer) => match names.next() {
                Some(values) => writer.write_batch(values, None, None)?,
                None => writer.write_batch(words.next().ok_or_else(short)?, Some(&of_rejected), None)?,
            },
            ColumnWriter::FixedLenByteArrayColumnWriter(writer) => {
                writer.write_batch(digests.next().ok_or_else(short)?, Some(&of_kept), None)?
            }
            _ => return Err(short()),
        };
        column.close()?;
    }
    group.close().map(|_| ())
}

pub(super) fn unwritten(path: &Path, error: ParquetError) -> DatasetError {
    match error {
        ParquetError::External(source) => match source.downcast::<std::io::Error>() {
            Ok(source) => DatasetError::Io { action: "writing", path: path.to_owned(), source: *source },
            Err(source) => parquet_io(path, &source.to_string()),
        },
        other => parquet_io(path, &other.to_string()),
    }
}

fn parquet_io(path: &Path, problem: &str) -> DatasetError {
    DatasetError::Io { action: "writing", path: path.to_owned(), source: std::io::Error::other(problem.to_owned()) }
}

/// What the reader needs of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct IndexEntry {
    pub sample: SampleId,
    /// Where the product has splits.
    pub split: Option<Split>,
    pub kept: bool,
}

/// Hands every row of an index to `take`, in order.
pub(super) fn read_index(
    path: &Path,
    product: Product,
    mut take: impl FnMut(u64, IndexEntry),
) -> Result<(), DatasetError> {
    let file = File::open(path).map_err(DatasetError::io("reading", path))?;
    read_rows(file, product, &mut take).map_err(|error| DatasetError::Invalid {
        path: path.to_owned(),
        problem: error.to_string(),
        remedy: REMAKE_INDEX,
    })
}

fn read_rows(file: File, product: Product, take: &mut impl FnMut(u64, IndexEntry)) -> Result<(), ParquetError> {
    const COLUMNS: [&str; 7] = ["sample_index", "subject", "instance", "view", "camera", "kept", "split"];
    let columns = if has_splits(product) { &COLUMNS[..] } else { &COLUMNS[..6] };
    let unfit = |what: &str| ParquetError::General(what.to_owned());
    let reader = IndexReader::new(file)?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let mut places = [0; COLUMNS.len()];
    for (place, name) in places.iter_mut().zip(columns) {
        let mut known = schema.columns().iter();
        *place = known.position(|column| column.name() == *name).ok_or_else(|| unfit("a column is missing"))?;
    }
    for number in 0..reader.num_row_groups() {
        let group = reader.get_row_group(number)?;
        let rows = group.metadata().num_rows();
        let rows = usize::try_from(rows).ok().filter(|rows| *rows <= ROW_GROUP).ok_or_else(|| {
            unfit(&format!("a row group says that it has {rows} rows, {ROW_GROUP} at most are written"))
        })?;
        let mut text = [Vec::new(), Vec::new()];
        let mut numbers = [Vec::new(), Vec::new(), Vec::new()];
        let (mut indices, mut kept) = (Vec::new(), Vec::new());
        for (name, place) in columns.iter().copied().zip(places) {
            let (read, values, _) = guarded(|| match (group.get_column_reader(place)?, name) {
                (ColumnReader::Int64ColumnReader(mut reader), _) => reader.read_records(rows, None, None, &mut indices),
                (ColumnReader::BoolColumnReader(mut reader), _) => reader.read_records(rows, None, None, &mut kept),
                (ColumnReader::ByteArrayColumnReader(mut reader), _) => {
                    reader.read_records(rows, None, None, &mut text[usize::from(name == "split")])
                }
                (ColumnReader::Int32ColumnReader(mut reader), _) => {
                    let place = ["instance", "view", "camera"].iter().position(|column| *column == name);
                    reader.read_records(rows, None, None, &mut numbers[place.ok_or_else(|| unfit(name))?])
                }
                _ => Err(unfit("a column has another type")),
            })?;
            if (read, values) != (rows, rows) {
                return Err(unfit("a column is short"));
            }
        }
        for row in 0..rows {
            let word = |column: &Vec<ByteArray>| column[row].as_utf8().map(str::to_owned);
            let subject = Digest::from_hex(&word(&text[0])?).ok_or_else(|| unfit("a subject is no digest"))?;
            let sample = SampleId {
                subject: ObjectId(subject),
                instance: numbers[0][row] as u32,
                view: ViewId(numbers[1][row] as u32),
                camera: numbers[2][row] as u32,
            };
            let split = match text[1].is_empty() {
                true => None,
                false => Some(Split::from_name(&word(&text[1])?).ok_or_else(|| unfit("unknown split"))?),
            };
            take(indices[row] as u64, IndexEntry { sample, split, kept: kept[row] });
        }
    }
    Ok(())
}

/// An index row by row with all its columns, to be held against ledgers.
pub(super) struct IndexRows {
    rows: RowIter<'static>,
    product: Product,
    channels: Vec<Channel>,
}

impl IndexRows {
    /// Opens an index; `Err` says in words why its columns are not those of a dataset of such channels.
    pub fn open(path: &Path, product: Product, channels: &[Channel]) -> Result<Self, String> {
        let words = |error: ParquetError| error.to_string();
        let file = File::open(path).map_err(|error| error.to_string())?;
        let reader = IndexReader::new(file).map_err(words)?;
        let expected = parse_message_type(&schema(product, channels)).map_err(words)?;
        if *reader.metadata().file_metadata().schema() != expected {
            return Err("its columns are not those of the manifest's product and topics".to_owned());
        }
        let rows = guarded(|| Ok(RowIter::from_file_into(Box::new(reader)))).map_err(words)?;
        Ok(Self { rows, product, channels: channels.to_vec() })
    }

    /// Passes over rows.
    pub fn skip(&mut self, rows: u64) {
        (0..rows).for_each(|_| drop(self.next()));
    }

    fn next(&mut self) -> Result<Option<Row>, ParquetError> {
        guarded(|| self.rows.next().transpose())
    }

    /// Holds the next row against a ledger's; `Err` says in words what differs.
    pub fn compare(&mut self, row: &IndexRow) -> Result<(), String> {
        let found = self.next().map_err(|error| error.to_string())?.ok_or("the row is missing")?;
        let expected = fields_of(row, self.product, &self.channels);
        for ((name, found), expected) in found.get_column_iter().zip(&expected) {
            let same = match (found, expected) {
                (Field::Double(found), Field::Double(expected)) => found.to_bits() == expected.to_bits(),
                _ => found == expected,
            };
            if !same {
                return Err(format!("{name} is {found}, the ledger says {expected}"));
            }
        }
        Ok(())
    }
}

/// What a row says, in the order of the schema.
fn fields_of(row: &IndexRow, product: Product, channels: &[Channel]) -> Vec<Field> {
    let LedgerRow { index, sample, facts, fate } = row.row;
    let text = |bytes: &ByteArray| Field::Str(String::from_utf8_lossy(bytes.data()).into_owned());
    let mut fields = vec![Field::ULong(index.0), text(row.subject), text(row.object)];
    fields.extend([sample.instance, sample.view.0, sample.camera].map(Field::UInt));
    if has_splits(product) {
        fields.push(Field::Str(row.split.map_or_else(String::new, |split| split.name().to_owned())));
    }
    fields.extend([Field::UInt(row.shard), Field::Bool(matches!(fate, Fate::Kept(_)))]);
    match fate {
        Fate::Kept(_) => fields.extend([Field::Null, Field::Null]),
        Fate::Rejected { reason, detail } => fields.extend([reason, detail].map(|word| Field::Str(word.clone()))),
    }
    let (counts, shares) = facts_of(facts);
    let (names, _) = fact_columns(product, channels);
    fields.extend(counts.into_iter().take(names.len()).map(Field::UInt));
    fields.extend(shares.into_iter().map(Field::Double));
    match fate {
        Fate::Kept(digests) => {
            fields.extend(digests.iter().map(|digest| Field::Bytes(ByteArray::from(digest.0.to_vec()))));
        }
        Fate::Rejected { .. } => fields.extend(channels.iter().map(|_| Field::Null)),
    }
    fields
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parquet_takes_the_columns_of_every_product() {
        for product in Product::ALL {
            let channels: Vec<Channel> = Channel::ALL.into_iter().filter(|each| each.product() == product).collect();
            let schema = parse_message_type(&schema(product, &channels)).expect("a schema");
            let written = schema.get_fields().iter().map(|field| (field.name().to_owned(), field.is_optional()));
            let listed = index_columns(product, &channels).into_iter().map(|column| (column.name, column.optional));
            assert_eq!(written.collect::<Vec<_>>(), listed.collect::<Vec<_>>(), "{product}");
        }
    }
}
