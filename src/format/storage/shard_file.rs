//! Reading one shard: its table of chunks, its ledger, its samples. Plain reads, no mapping of the file.

use std::{
    cell::RefCell,
    collections::BTreeMap,
    fs::File,
    io,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

use mcap::{
    McapError,
    records::{AttachmentIndex, Record, op},
};

use super::{
    DatasetError, Ledger,
    error::REMAKE,
    ledger::{InvalidLedger, LedgerBytes, LedgerOutline},
    shard::{LEDGER, LIBRARY_PREFIX},
};
use crate::{Channel, FORMAT_VERSION};
use kernel::{
    files::{Bound, Folder},
    ids::{Digest, SampleIndex},
};

/// Opcode, length, start of summary, start of its offsets, CRC, magic bytes.
const FOOTER_BYTES: u64 = 1 + 8 + 8 + 8 + 4 + 8;
/// Channel id, sequence, log time, publish time.
pub(crate) const MESSAGE_HEADER: usize = 2 + 4 + 8 + 8;
/// Largest chunk that graspmill writes: a larger stated size is damage, and must not become an allocation.
pub(crate) const MAX_CHUNK_BYTES: u64 = Bound::CHUNK.bytes;

thread_local! {
    /// One context per thread: creating one costs as much as unpacking half a chunk.
    static UNPACKER: RefCell<Option<zstd::bulk::Decompressor<'static>>> = const { RefCell::new(None) };
}

/// Location of a chunk, and the samples in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChunkEntry {
    /// First and last sample index.
    pub samples: (u64, u64),
    offset: u64,
    length: u64,
}

/// One message of a chunk.
#[derive(Clone, Debug)]
pub(crate) struct StoredMessage {
    pub index: SampleIndex,
    pub channel: Channel,
    pub payload: Vec<u8>,
}

/// Facts known of a shard after reading its summary. The file itself is opened for each read, so that a dataset of
/// any number of shards needs no more than one open file per thread.
pub(crate) struct ShardFile {
    /// The folder of the shards.
    folder: Folder,
    name: String,
    /// Both, for messages.
    pub path: PathBuf,
    /// In order of their samples; chunks without messages omitted.
    pub chunks: Vec<ChunkEntry>,
    /// Channel of each MCAP channel id.
    channels: Vec<(u16, Channel)>,
    /// The attachments of the ledger, in the order of their names.
    ledger: [AttachmentIndex; 3],
    /// Channels whose schema or encoding is not ours, in words.
    pub oddities: Vec<String>,
}

impl ShardFile {
    /// Opens a shard by its name in the folder of the shards.
    pub fn open(folder: &Folder, name: &str) -> Result<Self, DatasetError> {
        let path = &folder.path_of(name);
        let file = open(folder, name)?;
        let bytes = file.metadata().map_err(DatasetError::io("reading", path))?.len();
        let summary = read_summary(&file, bytes).map_err(|error| damaged(path, bytes, error))?;
        let refuse = |problem: &str| invalid(path, problem.to_owned());
        let (mut channels, mut schemas, mut uses) = (Vec::new(), BTreeMap::new(), Vec::new());
        let (mut chunk_indexes, mut ledger) = (Vec::new(), LEDGER.map(|_| None));
        for record in records(&summary) {
            match record.and_then(|(opcode, body)| parse(opcode, body)) {
                Ok(Record::Channel(channel)) => match Channel::from_topic(&channel.topic) {
                    Some(known) => {
                        channels.push((channel.id, known));
                        uses.push((known, channel.schema_id, channel.message_encoding));
                    }
                    None => return Err(refuse(&format!("unknown topic '{}'", channel.topic))),
                },
                Ok(Record::Schema { header, data }) => {
                    schemas.insert(header.id, (header.name, header.encoding, data.into_owned()));
                }
                Ok(Record::ChunkIndex(chunk)) => chunk_indexes.push(chunk),
                Ok(Record::AttachmentIndex(index)) => {
                    if let Some(part) = LEDGER.iter().position(|name| *name == index.name) {
                        ledger[part] = Some(index);
                    }
                }
                Ok(_) => {}
                Err(error) => return Err(damaged(path, bytes, error)),
            }
        }
        channels.sort_unstable();
        let mut chunks: Vec<ChunkEntry> = (chunk_indexes.iter())
            // A chunk that holds nothing but schemas has no message index.
            .filter(|chunk| !chunk.message_index_offsets.is_empty())
            .map(|chunk| ChunkEntry {
                samples: (chunk.message_start_time, chunk.message_end_time),
                offset: chunk.chunk_start_offset,
                length: chunk.chunk_length,
            })
            .collect();
        chunks.sort_unstable_by_key(|chunk| chunk.samples);
        if chunks.windows(2).any(|pair| pair[0].samples.1 >= pair[1].samples.0) {
            return Err(refuse("two chunks share a sample"));
        }
        let [Some(outline), Some(facts), Some(digests)] = ledger else {
            return Err(match written_version(&file) {
                Some(found) if found != FORMAT_VERSION => {
                    DatasetError::Version { path: path.to_owned(), found, expected: FORMAT_VERSION }
                }
                _ => refuse("it has no whole ledger"),
            });
        };
        let ledger = [outline, facts, digests];
        let oddities =
            uses.iter().filter_map(|(channel, id, encoding)| oddity(*channel, schemas.get(id), encoding)).collect();
        let (folder, name, path) = (folder.clone(), name.to_owned(), path.clone());
        Ok(Self { folder, name, path, chunks, channels, ledger, oddities })
    }

    /// Name of the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The shard's ledger.
    pub fn ledger(&self) -> Result<Ledger, DatasetError> {
        let [ledger, facts, digests] = [0, 1, 2].map(|part| self.ledger_part(part));
        let bytes = LedgerBytes { ledger: ledger?, facts: facts?, digests: digests? };
        Ledger::decode(&bytes).map_err(|error| self.no_ledger(&error))
    }

    /// Identity and fate of the shard's samples: a small part of the ledger.
    pub fn outline(&self) -> Result<LedgerOutline, DatasetError> {
        LedgerOutline::decode(&self.ledger_part(0)?).map_err(|error| self.no_ledger(&error))
    }

    fn ledger_part(&self, part: usize) -> Result<Vec<u8>, DatasetError> {
        let index = &self.ledger[part];
        let record = read_at(&self.folder, &self.name, index.offset, index.length)?;
        let data = attachment(&record, index.data_size)
            .map_err(|error| invalid(&self.path, format!("{}: {error}", LEDGER[part])))?;
        Ok(data.to_vec())
    }

    fn no_ledger(&self, error: &InvalidLedger) -> DatasetError {
        invalid(&self.path, error.to_string())
    }

    /// First and last sample of its chunks, by their index; `None` without chunks.
    pub fn samples(&self) -> Option<(u64, u64)> {
        Some((self.chunks.first()?.samples.0, self.chunks.last()?.samples.1))
    }

    /// Which chunk holds a sample; `None` when it is not stored.
    pub fn chunk_of(&self, index: SampleIndex) -> Option<usize> {
        let chunk = self.chunks.partition_point(|chunk| chunk.samples.1 < index.0);
        self.chunks.get(chunk).is_some_and(|entry| entry.samples.0 <= index.0).then_some(chunk)
    }

    /// The messages of a chunk, in order, after its CRC was checked.
    pub fn read_chunk(&self, chunk: usize) -> Result<Vec<StoredMessage>, DatasetError> {
        let entry = self.chunks[chunk];
        let record = read_at(&self.folder, &self.name, entry.offset, entry.length)?;
        self.parse_chunk(&record).map_err(|error| {
            let (first, last) = entry.samples;
            let at = entry.offset;
            invalid(&self.path, format!("chunk {chunk} at byte {at} with samples {first} to {last}: {error}"))
        })
    }

    fn parse_chunk(&self, record: &[u8]) -> Result<Vec<StoredMessage>, McapError> {
        let unpacked = unpack(record)?;
        let mut messages = Vec::new();
        for record in records(&unpacked) {
            let (opcode, body) = record?;
            if opcode != op::MESSAGE {
                continue;
            }
            let (header, payload) = body.split_at_checked(MESSAGE_HEADER).ok_or(McapError::UnexpectedEoc)?;
            let (id, sequence) = (u16_at(header, 0), u64_at(header, 2) as u32);
            let position = self.channels.binary_search_by_key(&id, |(id, _)| *id);
            let channel = self.channels[position.map_err(|_| McapError::UnknownChannel(sequence, id))?].1;
            messages.push(StoredMessage { index: SampleIndex(u64_at(header, 6)), channel, payload: payload.to_vec() });
        }
        Ok(messages)
    }
}

/// Name, encoding and text of a schema.
type Schema = (String, String, Vec<u8>);

/// Difference between a channel's schema in the file and ours, in words.
fn oddity(channel: Channel, schema: Option<&Schema>, encoding: &str) -> Option<String> {
    let topic = channel.topic;
    let Some((name, kind, text)) = schema else { return Some(format!("{topic} has no schema")) };
    if (encoding, kind.as_str(), name.as_str()) != ("protobuf", "protobuf", channel.message) {
        return Some(format!("{topic} has {encoding} messages of the {kind} schema {name}"));
    }
    (text != channel.descriptors).then(|| {
        let (found, ours) = (Digest::hash(text).short(), Digest::hash(channel.descriptors).short());
        format!("the schema of {topic} has another text ({found}) than this program's ({ours})")
    })
}

/// Content of a chunk record, after its CRC was checked.
pub(crate) fn unpack(record: &[u8]) -> Result<Vec<u8>, McapError> {
    let (opcode, body) = records(record).next().ok_or(McapError::UnexpectedEof)??;
    let Record::Chunk { header, data } = parse(opcode, body)? else {
        return Err(McapError::BadIndex);
    };
    if header.uncompressed_size > MAX_CHUNK_BYTES {
        return Err(McapError::ChunkTooLarge(header.uncompressed_size));
    }
    if header.compression != "zstd" {
        return Err(McapError::UnsupportedCompression(header.compression));
    }
    let unpacked = UNPACKER
        .with_borrow_mut(|unpacker| {
            if unpacker.is_none() {
                *unpacker = Some(zstd::bulk::Decompressor::new()?);
            }
            let unpacker = unpacker.as_mut().ok_or(std::io::ErrorKind::Other)?;
            unpacker.decompress(&data, header.uncompressed_size as usize)
        })
        .map_err(|error| McapError::DecompressionError(error.to_string()))?;
    let (saved, calculated) = (header.uncompressed_crc, crc32fast::hash(&unpacked));
    if saved != calculated {
        return Err(McapError::BadChunkCrc { saved, calculated });
    }
    Ok(unpacked)
}

fn u16_at(bytes: &[u8], offset: usize) -> u16 {
    u16::from_le_bytes([bytes[offset], bytes[offset + 1]])
}

fn u64_at(bytes: &[u8], offset: usize) -> u64 {
    u64::from_le_bytes(std::array::from_fn(|byte| bytes[offset + byte]))
}

/// The records of a run of MCAP records: opcode and body; a length that does not fit ends with an error.
pub(crate) fn records(mut bytes: &[u8]) -> impl Iterator<Item = Result<(u8, &[u8]), McapError>> {
    std::iter::from_fn(move || {
        if bytes.is_empty() {
            return None;
        }
        let split = bytes.split_at_checked(9).and_then(|(head, rest)| {
            let length = usize::try_from(u64_at(head, 1)).ok()?;
            rest.split_at_checked(length).map(|(body, rest)| (head[0], body, rest))
        });
        match split {
            Some((opcode, body, rest)) => {
                bytes = rest;
                Some(Ok((opcode, body)))
            }
            None => {
                bytes = &[];
                Some(Err(McapError::UnexpectedEof))
            }
        }
    })
}

/// Parses a record after checking that the lengths inside it fit: the library allocates memory for a text before it checks
/// whether the text is present, up to 4 GiB for a length of four bytes.
pub(crate) fn parse(opcode: u8, body: &[u8]) -> Result<Record<'_>, McapError> {
    // Bytes before the first length, then what follows: texts (or other runs of bytes) and bytes between them.
    let (first, lengths): (usize, &[usize]) = match opcode {
        op::SCHEMA => (2, &[0, 0, 0]),
        op::CHANNEL => (4, &[0, 0]),
        op::CHUNK => (28, &[0]),
        op::CHUNK_INDEX => (32, &[8, 0]),
        op::ATTACHMENT_INDEX => (40, &[0, 0]),
        op::METADATA_INDEX => (16, &[0]),
        op::STATISTICS => (42, &[0]),
        op::FOOTER | op::SUMMARY_OFFSET => (0, &[]),
        // Records of other writers are skipped.
        other if other > op::DATA_END => (0, &[]),
        // A summary has no other records.
        _ => return Err(McapError::BadIndex),
    };
    let mut rest = body.get(first..).ok_or(McapError::UnexpectedEoc)?;
    for between in lengths {
        rest = after_text(rest)?.get(*between..).ok_or(McapError::UnexpectedEoc)?;
    }
    if opcode == op::CHANNEL {
        // A map: its length, then texts in pairs.
        let inside = after_text(rest)?.len();
        let mut texts = &rest[4..rest.len() - inside];
        while !texts.is_empty() {
            texts = after_text(texts)?;
        }
    }
    mcap::parse_record(opcode, body)
}

/// Bytes after a text and its length.
fn after_text(bytes: &[u8]) -> Result<&[u8], McapError> {
    let (length, rest) = bytes.split_first_chunk::<4>().ok_or(McapError::UnexpectedEoc)?;
    rest.get(u32::from_le_bytes(*length) as usize..).ok_or(McapError::UnexpectedEoc)
}

/// The data of an attachment record: its last bytes but for the CRC of everything before.
pub(crate) fn attachment(record: &[u8], data_size: u64) -> Result<&[u8], McapError> {
    let (opcode, body) = records(record).next().ok_or(McapError::UnexpectedEof)??;
    if opcode != op::ATTACHMENT {
        return Err(McapError::BadIndex);
    }
    let (content, crc) = body.split_last_chunk::<4>().ok_or(McapError::UnexpectedEof)?;
    let (saved, calculated) = (u32::from_le_bytes(*crc), crc32fast::hash(content));
    if saved != calculated {
        return Err(McapError::BadAttachmentCrc { saved, calculated });
    }
    let start = (content.len() as u64).checked_sub(data_size).ok_or(McapError::UnexpectedEof)?;
    Ok(&content[start as usize..])
}

fn open(folder: &Folder, name: &str) -> Result<File, DatasetError> {
    let path = folder.path_of(name);
    folder.open(name).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => invalid(&path, "the file is missing".to_owned()),
        _ => DatasetError::io("reading", &path)(error),
    })
}

/// Bytes of a file of a dataset.
pub(crate) fn read_at(folder: &Folder, name: &str, offset: u64, length: u64) -> Result<Vec<u8>, DatasetError> {
    let (file, path) = (open(folder, name)?, &folder.path_of(name));
    let bytes = file.metadata().map_err(DatasetError::io("reading", path))?.len();
    if offset.checked_add(length).is_none_or(|end| end > bytes) {
        return Err(invalid(path, format!("it ends at byte {bytes}, before the end of bytes {offset} + {length}")));
    }
    if length > Bound::CHUNK.bytes {
        let problem = format!("a part of it has {length} bytes, at most {} are read", Bound::CHUNK.bytes);
        return Err(invalid(path, problem));
    }
    let mut record = vec![0; length as usize];
    file.read_exact_at(&mut record, offset).map_err(DatasetError::io("reading", path))?;
    Ok(record)
}

/// Whether a file begins and ends with the magic bytes of MCAP.
pub(super) fn has_magic(file: &File) -> io::Result<bool> {
    let magic = mcap::MAGIC.len() as u64;
    let Some(end) = file.metadata()?.len().checked_sub(magic) else { return Ok(false) };
    for at in [0, end] {
        let mut found = vec![0; mcap::MAGIC.len()];
        file.read_exact_at(&mut found, at)?;
        if found != mcap::MAGIC {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Format version that a shard names in the library of its header; `None` when it names none.
fn written_version(file: &File) -> Option<u32> {
    let mut head = [0; 128];
    file.read_exact_at(&mut head, 0).ok()?;
    // Magic bytes, then the header: opcode, length, profile, library.
    let library = after_text(head.get(mcap::MAGIC.len() + 9..)?).ok()?;
    let length = library.len() - after_text(library).ok()?.len();
    let text = std::str::from_utf8(&library[4..length]).ok()?;
    text.strip_prefix(LIBRARY_PREFIX)?.parse().ok()
}

/// The records of the summary section, after its CRC was checked.
pub(crate) fn read_summary(file: &File, bytes: u64) -> Result<Vec<u8>, McapError> {
    let end = bytes.checked_sub(FOOTER_BYTES).ok_or(McapError::UnexpectedEof)?;
    let mut footer = [0; FOOTER_BYTES as usize];
    file.read_exact_at(&mut footer, end)?;
    if !footer.ends_with(mcap::MAGIC) {
        return Err(McapError::BadMagic);
    }
    let start = u64_at(&footer, 9);
    if footer[0] != op::FOOTER || start == 0 || start > end {
        return Err(McapError::BadFooter);
    }
    if end - start > Bound::CHUNK.bytes {
        return Err(McapError::ChunkTooLarge(end - start));
    }
    let mut summary = vec![0; (end - start) as usize];
    file.read_exact_at(&mut summary, start)?;
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&summary);
    // The CRC covers the footer up to itself.
    hasher.update(&footer[..25]);
    let (saved, calculated) = (u64_at(&footer, 21) >> 32, hasher.finalize());
    if saved as u32 != calculated {
        return Err(McapError::BadSummaryCrc { saved: saved as u32, calculated });
    }
    Ok(summary)
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

pub(crate) fn invalid(path: &Path, problem: String) -> DatasetError {
    DatasetError::Invalid { path: path.to_owned(), problem, remedy: REMAKE }
}
