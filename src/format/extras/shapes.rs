//! `shapes.mcap`: the hand's shapes and the objects' meshes, so that grasps can be drawn and replayed from the dataset alone.
//!
//! One chunk per message: the hand first, then the objects by content, and their `log_time` counts them. Datasets of products
//! without hands have only meshes. If grasps were tried in MuJoCo, two attachments define how the hand was compiled and driven.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};

use mcap::{
    Attachment, Compression, McapError, WriteOptions,
    records::{MessageHeader, Record, op},
};

use super::{FileCheck, FileContext};
use crate::{
    FORMAT_VERSION, HandShape, ObjectShape, Product, RecordError, TrialHand,
    products::grasps::{RUN_SCHEMAS, SHAPES},
    storage::{
        DatasetError,
        durable::TemporaryFile,
        error::REWRITE,
        shard::{LIBRARY, ZSTD_LEVEL},
        shard_file::{MESSAGE_HEADER, attachment, parse, read_at, read_summary, records, unpack},
    },
};
use kernel::{
    files::Folder,
    ids::{JobDigest, ObjectId},
};

/// Names of the attachments of trials, and their media types.
const TRIAL_HAND: [(&str, &str); 2] = [("trial_hand.xml", "application/xml"), ("trial_hand.json", "application/json")];

/// Writes the shapes of a dataset, one at a time.
pub struct ShapesWriter {
    writer: mcap::Writer<BufWriter<File>>,
    file: File,
    temporary: TemporaryFile,
    /// Channel of the objects.
    channel: u16,
    payload: Vec<u8>,
    next: u64,
    last: Option<ObjectId>,
}

impl ShapesWriter {
    /// Begins with the hand, of a product with one; the objects follow, sorted by content.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn create(folder: &Folder, job: &JobDigest, product: Product, hand: &HandShape) -> Result<Self, DatasetError> {
        let (file, temporary) = TemporaryFile::create(folder, SHAPES)?;
        let copy = file.try_clone().map_err(DatasetError::io("writing", &temporary.path()))?;
        let begun = begin(BufWriter::new(copy), job, product.name).and_then(|mut writer| {
            let channels = [
                add_channel(&mut writer, HandShape::SCHEMA, HandShape::TOPIC)?,
                add_channel(&mut writer, ObjectShape::SCHEMA, ObjectShape::TOPIC)?,
            ];
            Ok((writer, channels))
        });
        let (writer, [of_hand, channel]) = begun.map_err(DatasetError::mcap("writing", &temporary.path()))?;
        let mut payload = Vec::new();
        hand.encode(&mut payload);
        let mut shapes = Self { writer, file, temporary, channel, payload, next: 0, last: None };
        shapes.write(of_hand)?;
        Ok(shapes)
    }

    /// Begins a file of objects only, of a product without hands; they follow, sorted by content.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn of_objects(folder: &Folder, job: &JobDigest, product: Product) -> Result<Self, DatasetError> {
        let (file, temporary) = TemporaryFile::create(folder, SHAPES)?;
        let copy = file.try_clone().map_err(DatasetError::io("writing", &temporary.path()))?;
        let begun = begin(BufWriter::new(copy), job, product.name).and_then(|mut writer| {
            let channel = add_channel(&mut writer, ObjectShape::SCHEMA, ObjectShape::TOPIC)?;
            Ok((writer, channel))
        });
        let (writer, channel) = begun.map_err(DatasetError::mcap("writing", &temporary.path()))?;
        Ok(Self { writer, file, temporary, channel, payload: Vec::new(), next: 0, last: None })
    }

    /// Adds an object.
    ///
    /// # Errors
    /// When the file can't be written.
    ///
    /// # Panics
    /// When the objects are not sorted by content.
    pub fn object(&mut self, shape: &ObjectShape) -> Result<(), DatasetError> {
        assert!(self.last < Some(shape.object), "objects come sorted by content");
        self.last = Some(shape.object);
        self.payload.clear();
        shape.encode(&mut self.payload);
        self.write(self.channel)
    }

    fn write(&mut self, channel_id: u16) -> Result<(), DatasetError> {
        let header = MessageHeader { channel_id, sequence: 0, log_time: self.next, publish_time: self.next };
        self.next += 1;
        let written = self.writer.write_to_known_channel(&header, &self.payload).and_then(|()| self.writer.flush());
        written.map_err(DatasetError::mcap("writing", &self.temporary.path()))
    }

    /// Publishes the file, with the hand as trials had it. Returns its size [bytes].
    ///
    /// # Errors
    /// When it can't be written.
    pub fn finish(self, trial_hand: Option<&TrialHand>) -> Result<u64, DatasetError> {
        let Self { mut writer, file, temporary, next, .. } = self;
        let texts = trial_hand.map(|TrialHand { mjcf, drive }| [mjcf, drive]);
        let attach = |((name, media_type), text): ((&str, &str), &String)| {
            let data = text.as_bytes().into();
            let (name, media_type) = (name.to_owned(), media_type.to_owned());
            writer.attach(&Attachment { log_time: next, create_time: 0, name, media_type, data })
        };
        let attached = TRIAL_HAND.into_iter().zip(texts.into_iter().flatten()).try_for_each(attach);
        let finished = attached.and_then(|()| writer.finish().map(|_| ()));
        finished.map_err(DatasetError::mcap("writing", &temporary.path()))?;
        writer.into_inner().flush().map_err(DatasetError::io("writing", &temporary.path()))?;
        let bytes = file.metadata().map_err(DatasetError::io("measuring", &temporary.path()))?.len();
        temporary.publish(&file, SHAPES).map(|_| bytes)
    }
}

/// The writer, with the metadata of the file.
fn begin(out: BufWriter<File>, job: &JobDigest, product: &str) -> mcap::McapResult<mcap::Writer<BufWriter<File>>> {
    let mut writer = WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .compression_level(ZSTD_LEVEL)
        .compression_threads(0)
        .chunk_size(None)
        .library(LIBRARY)
        .profile("graspmill")
        .create(out)?;
    let facts =
        [("format_version", FORMAT_VERSION.to_string()), ("product", product.to_owned()), ("job", job.to_string())];
    writer.write_metadata(&mcap::records::Metadata {
        name: "graspmill".to_owned(),
        metadata: facts.into_iter().map(|(key, value)| (key.to_owned(), value)).collect(),
    })?;
    Ok(writer)
}

fn add_channel(writer: &mut mcap::Writer<BufWriter<File>>, schema: &str, topic: &str) -> mcap::McapResult<u16> {
    let schema = writer.add_schema(schema, "protobuf", RUN_SCHEMAS)?;
    writer.add_channel(schema, topic, "protobuf", &BTreeMap::new())
}

/// The shapes of a finished dataset, open for reading: one in memory at a time.
#[derive(Debug)]
pub struct Shapes {
    folder: Folder,
    /// Path of the file, for messages.
    path: PathBuf,
    /// Offset and length of each chunk, in order.
    chunks: Vec<(u64, u64)>,
    /// Whether the first chunk is a hand.
    has_hand: bool,
    /// Offset, length and size of the data of each attachment of trials.
    trial_hand: [Option<(u64, u64, u64)>; 2],
}

impl Shapes {
    /// Opens the shapes of a dataset of grasps or picks, or the meshes of one of scenes or views.
    ///
    /// # Errors
    /// Without any, or when the file is damaged.
    pub fn open(folder: &Folder) -> Result<Self, DatasetError> {
        let path = folder.path_of(SHAPES);
        let file = folder.open(SHAPES).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => DatasetError::Invalid {
                path: path.clone(),
                problem: "the file is missing".to_owned(),
                remedy: "a finished dataset of grasps, picks, scenes or views has one: `run` its job again",
            },
            _ => DatasetError::io("reading", &path)(error),
        })?;
        let bytes = file.metadata().map_err(DatasetError::io("reading", &path))?.len();
        let summary = read_summary(&file, bytes).map_err(failed(&path))?;
        let (mut chunks, mut trial_hand, mut has_hand) = (Vec::new(), [None; 2], false);
        for record in records(&summary) {
            let record = record.and_then(|(opcode, body)| parse(opcode, body)).map_err(failed(&path))?;
            match record {
                Record::ChunkIndex(chunk) if !chunk.message_index_offsets.is_empty() => {
                    chunks.push((chunk.message_start_time, (chunk.chunk_start_offset, chunk.chunk_length)));
                }
                Record::Channel(channel) => has_hand |= channel.topic == HandShape::TOPIC,
                Record::AttachmentIndex(index) => {
                    if let Some(position) = TRIAL_HAND.iter().position(|(name, _)| *name == index.name) {
                        trial_hand[position] = Some((index.offset, index.length, index.data_size));
                    }
                }
                _ => {}
            }
        }
        chunks.sort_unstable();
        if chunks.iter().zip(0..).any(|((time, _), position)| *time != position) || chunks.is_empty() {
            return Err(damaged(&path, "its messages are not numbered from 0".to_owned()));
        }
        Ok(Self {
            folder: folder.clone(),
            path,
            chunks: chunks.into_iter().map(|(_, position)| position).collect(),
            has_hand,
            trial_hand,
        })
    }

    /// The hand.
    ///
    /// # Errors
    /// When it can't be read, or there is none.
    pub fn hand(&self) -> Result<HandShape, DatasetError> {
        if !self.has_hand {
            return Err(damaged(&self.path, "it has no hand".to_owned()));
        }
        HandShape::decode(&self.payload(0)?).map_err(|error| self.broken(&error))
    }

    /// The hand as trials had it; `None` if there were none, or if the hand could not be compiled without further files.
    ///
    /// # Errors
    /// When it can't be read.
    pub fn trial_hand(&self) -> Result<Option<TrialHand>, DatasetError> {
        let text = |(offset, length, size)| {
            let record = read_at(&self.folder, SHAPES, offset, length)?;
            let data = attachment(&record, size).map_err(failed(&self.path))?;
            String::from_utf8(data.to_vec()).map_err(|error| damaged(&self.path, error.to_string()))
        };
        let [Some(mjcf), Some(drive)] = self.trial_hand else { return Ok(None) };
        Ok(Some(TrialHand { mjcf: text(mjcf)?, drive: text(drive)? }))
    }

    /// Count of objects.
    pub fn objects(&self) -> usize {
        self.chunks.len() - usize::from(self.has_hand)
    }

    /// An object: they are sorted by content, as the rows of the asset table are.
    ///
    /// # Errors
    /// When it can't be read.
    ///
    /// # Panics
    /// When there are fewer objects.
    pub fn object(&self, index: usize) -> Result<ObjectShape, DatasetError> {
        ObjectShape::decode(&self.payload(index + usize::from(self.has_hand))?).map_err(|error| self.broken(&error))
    }

    /// Compares the shapes with the asset table: its hand, where it has one, and its objects in order of their content.
    fn check(&self, hand: Option<ObjectId>, objects: &[ObjectId]) -> Result<(), DatasetError> {
        let found = if self.has_hand { Some(self.hand()?.id) } else { None };
        if found != hand {
            let found = found.map_or_else(|| "missing".to_owned(), |found| found.0.short());
            return Err(damaged(&self.path, format!("its hand is {found}, not that of the asset table")));
        }
        if self.objects() != objects.len() {
            let what = format!("it has {} objects, the asset table {}", self.objects(), objects.len());
            return Err(damaged(&self.path, what));
        }
        for (index, expected) in objects.iter().enumerate() {
            let found = self.object(index)?.object;
            if found != *expected {
                let (found, expected) = (found.0.short(), expected.0.short());
                return Err(damaged(&self.path, format!("object {index} is {found}, the asset table has {expected}")));
            }
        }
        Ok(())
    }

    fn payload(&self, index: usize) -> Result<Vec<u8>, DatasetError> {
        let (offset, length) = self.chunks[index];
        let record = read_at(&self.folder, SHAPES, offset, length)?;
        let unpacked = unpack(&record).map_err(failed(&self.path))?;
        for record in records(&unpacked) {
            let (opcode, body) = record.map_err(failed(&self.path))?;
            if opcode == op::MESSAGE && body.len() >= MESSAGE_HEADER {
                return Ok(body[MESSAGE_HEADER..].to_vec());
            }
        }
        Err(damaged(&self.path, format!("chunk {index} holds no message")))
    }

    fn broken(&self, error: &RecordError) -> DatasetError {
        damaged(&self.path, error.to_string())
    }
}

/// The check of the shapes, of every product that has them.
pub(super) static CHECK: FileCheck = FileCheck { name: SHAPES, in_root: None, check: check_shapes };

/// Checks the shapes against the asset table.
fn check_shapes(context: &FileContext<'_>) -> Vec<String> {
    if !context.full {
        return Vec::new();
    }
    let mut objects: Vec<ObjectId> = context.objects.to_vec();
    objects.sort_unstable();
    let checked = Shapes::open(context.folder).and_then(|shapes| {
        shapes.check(context.hands.first().copied(), &objects)?;
        shapes.trial_hand()
    });
    match checked {
        Ok(_) => Vec::new(),
        Err(DatasetError::Invalid { problem, .. }) => vec![problem],
        Err(error) => vec![error.to_string()],
    }
}

fn failed(path: &Path) -> impl FnOnce(McapError) -> DatasetError {
    move |error| match error {
        McapError::Io(source) => DatasetError::io("reading", path)(source),
        error => damaged(path, error.to_string()),
    }
}

fn damaged(path: &Path, problem: String) -> DatasetError {
    DatasetError::Invalid { path: path.to_owned(), problem, remedy: REWRITE }
}
