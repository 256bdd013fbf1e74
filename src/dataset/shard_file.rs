//! Reading one shard: its table of chunks, its ledger, its samples. Plain reads, no mapping of the file.

use std::{
    fs::File,
    io::{Read, Seek},
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

use mcap::{
    McapError,
    records::{AttachmentIndex, Record},
    sans_io::{SummaryReadEvent, SummaryReader, SummaryReaderOptions},
};

use super::{DatasetError, Ledger, error::REMAKE, shard::LEDGER};
use crate::{ids::SampleIndex, record::Channel};

/// Where a chunk stands and which samples it holds.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChunkPlace {
    /// First and last sample index.
    pub samples: (u64, u64),
    offset: u64,
    length: u64,
}

/// One message of a chunk.
#[derive(Clone, Debug)]
pub(super) struct StoredMessage {
    pub index: SampleIndex,
    pub channel: Channel,
    pub payload: Vec<u8>,
}

/// What is known of a shard after reading its summary. The file itself is opened for each read, so that a dataset of
/// any number of shards needs no more than one open file a thread.
pub(super) struct ShardFile {
    pub path: PathBuf,
    /// In order of their samples; chunks without messages left out.
    pub chunks: Vec<ChunkPlace>,
    /// Channel of each MCAP channel id.
    channels: Vec<(u16, Channel)>,
    ledger: AttachmentIndex,
}

impl ShardFile {
    pub fn open(path: &Path) -> Result<Self, DatasetError> {
        let mut file = open(path)?;
        let bytes = file.metadata().map_err(DatasetError::io("reading", path))?.len();
        let summary = read_summary(&mut file, bytes).map_err(|error| damaged(path, bytes, error))?;
        let refuse = |problem: &str| invalid(path, problem.to_owned());
        let mut channels = Vec::new();
        for (id, channel) in &summary.channels {
            let known = Channel::from_topic(&channel.topic)
                .ok_or_else(|| invalid(path, format!("unknown topic '{}'", channel.topic)))?;
            channels.push((*id, known));
        }
        channels.sort_unstable();
        let mut chunks: Vec<ChunkPlace> = (summary.chunk_indexes.iter())
            // A chunk that holds nothing but schemas has no message index.
            .filter(|chunk| !chunk.message_index_offsets.is_empty())
            .map(|chunk| ChunkPlace {
                samples: (chunk.message_start_time, chunk.message_end_time),
                offset: chunk.chunk_start_offset,
                length: chunk.chunk_length,
            })
            .collect();
        chunks.sort_unstable_by_key(|chunk| chunk.samples);
        if chunks.windows(2).any(|pair| pair[0].samples.1 >= pair[1].samples.0) {
            return Err(refuse("two chunks share a sample"));
        }
        let mut ledgers = summary.attachment_indexes.into_iter().filter(|attachment| attachment.name == LEDGER);
        let ledger = ledgers.next().ok_or_else(|| refuse("it has no ledger"))?;
        Ok(Self { path: path.to_owned(), chunks, channels, ledger })
    }

    /// The shard's ledger.
    pub fn ledger(&self) -> Result<Ledger, DatasetError> {
        let record = read_at(&self.path, self.ledger.offset, self.ledger.length)?;
        let index = AttachmentIndex { offset: 0, ..self.ledger.clone() };
        let attachment =
            mcap::read::attachment(&record, &index).map_err(|error| invalid(&self.path, format!("ledger: {error}")))?;
        Ledger::decode(&attachment.data).map_err(|problem| invalid(&self.path, problem))
    }

    /// Which chunk holds a sample; `None` when it is not stored.
    pub fn chunk_of(&self, index: SampleIndex) -> Option<usize> {
        let place = self.chunks.partition_point(|chunk| chunk.samples.1 < index.0);
        self.chunks.get(place).is_some_and(|chunk| chunk.samples.0 <= index.0).then_some(place)
    }

    /// The messages of a chunk, in order, after its CRC was checked.
    pub fn read_chunk(&self, chunk: usize) -> Result<Vec<StoredMessage>, DatasetError> {
        let place = self.chunks[chunk];
        let record = read_at(&self.path, place.offset, place.length)?;
        self.parse_chunk(&record).map_err(|error| {
            let (first, last) = place.samples;
            let at = place.offset;
            invalid(&self.path, format!("chunk {chunk} at byte {at} with samples {first} to {last}: {error}"))
        })
    }

    fn parse_chunk(&self, record: &[u8]) -> Result<Vec<StoredMessage>, McapError> {
        // Opcode and length of the record stand before its body.
        let body = record.get(9..).ok_or(McapError::UnexpectedEof)?;
        let Record::Chunk { header, data } = mcap::read::parse_record(record[0], body)? else {
            return Err(McapError::BadIndex);
        };
        let mut messages = Vec::new();
        for record in mcap::read::ChunkReader::new(header, &data)? {
            if let Record::Message { header, data } = record? {
                let place = self.channels.binary_search_by_key(&header.channel_id, |(id, _)| *id);
                let place = place.map_err(|_| McapError::UnknownChannel(header.sequence, header.channel_id))?;
                messages.push(StoredMessage {
                    index: SampleIndex(header.log_time),
                    channel: self.channels[place].1,
                    payload: data.into_owned(),
                });
            }
        }
        Ok(messages)
    }
}

fn open(path: &Path) -> Result<File, DatasetError> {
    File::open(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => invalid(path, "the file is missing".to_owned()),
        _ => DatasetError::io("reading", path)(error),
    })
}

fn read_at(path: &Path, offset: u64, length: u64) -> Result<Vec<u8>, DatasetError> {
    let file = open(path)?;
    let bytes = file.metadata().map_err(DatasetError::io("reading", path))?.len();
    if offset.checked_add(length).is_none_or(|end| end > bytes) {
        return Err(invalid(path, format!("it ends at byte {bytes}, bytes {offset} + {length} were asked for")));
    }
    let mut record = vec![0; length as usize];
    file.read_exact_at(&mut record, offset).map_err(DatasetError::io("reading", path))?;
    Ok(record)
}

fn read_summary(file: &mut File, bytes: u64) -> Result<mcap::Summary, McapError> {
    let mut reader = SummaryReader::new_with_options(SummaryReaderOptions::default().with_file_size(bytes));
    while let Some(event) = reader.next_event() {
        match event? {
            SummaryReadEvent::ReadRequest(wanted) => {
                let read = file.read(reader.insert(wanted))?;
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(target) => {
                let position = file.seek(target)?;
                reader.notify_seeked(position);
            }
        }
    }
    reader.finish().ok_or(McapError::BadFooter)
}

/// A shard whose summary can't be read: nearly always cut short.
fn damaged(path: &Path, bytes: u64, error: McapError) -> DatasetError {
    match error {
        McapError::Io(source) => DatasetError::io("reading", path)(source),
        error => {
            invalid(path, format!("its end can't be read ({error}); {bytes} bytes are there, it may be cut short"))
        }
    }
}

pub(super) fn invalid(path: &Path, problem: String) -> DatasetError {
    DatasetError::Invalid { path: path.to_owned(), problem, remedy: REMAKE }
}
