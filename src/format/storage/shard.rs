//! Writing one shard.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, BufWriter, Seek, SeekFrom, Write},
    ops::Range,
    path::{Path, PathBuf},
};

use mcap::{Attachment, Compression, WriteOptions, records::MessageHeader};

use super::{
    DatasetError,
    durable::TemporaryFile,
    layout::ShardName,
    ledger::{FACTS_MESSAGE, Fate, LEDGER_MESSAGE, Ledger, LedgerBytes, LedgerRow},
};
use crate::{Channel, FORMAT_VERSION, Facts, Product};
use kernel::{
    files::Folder,
    ids::{Digest, JobDigest, SampleId, SampleIndex, ShardId},
};

/// Uncompressed bytes after which a chunk is closed, at the next end of a sample.
///
/// Chosen by `measure::chunk_sizes` (six scans, 242 views each, 40^3, processor time of one thread): with the pair alone
/// 64 KiB gives 1,433 bytes per sample and 22,000 samples/s at random; 128 KiB 1,370 bytes and 11,000/s; 256 KiB about 1,340
/// bytes and 5,000/s. Writing (28,000/s) and reading in order (80,000/s) hardly change. A training loader reads at random,
/// and 4 % of size is cheap.
pub const CHUNK_BYTES: usize = 64 << 10;
/// zstd level of the chunks: in the same measurement level 3 makes files 2.5 % smaller, writing with two channels a third
/// slower (12,000 instead of 18,000/s) and reading at random a fifth slower.
pub(crate) const ZSTD_LEVEL: u32 = 1;
/// Written into each shard's header instead of the MCAP crate's name and version, which would change bytes.
pub(crate) const LIBRARY: &str = "graspmill format 4";
/// Beginning of that text, without the number of the format.
pub(super) const LIBRARY_PREFIX: &str = "graspmill format ";
/// Names of the attachments that hold the ledger: identity and fate, facts, digests.
pub(super) const LEDGER: [&str; 3] = ["ledger", "facts", "digests"];

/// Facts of a shard before any sample is written.
#[derive(Clone, Debug, PartialEq)]
pub struct ShardHeader {
    /// Product of the shard; part of the file name.
    pub product: Product,
    /// The job.
    pub job: JobDigest,
    /// Which shard.
    pub shard: ShardId,
    /// Number of shards in all.
    pub shards: u32,
    /// The sample indices that it accounts for; not empty.
    pub samples: Range<u64>,
    /// Channels of every kept sample, in any order; all of the product, its leading one among them.
    pub channels: Vec<Channel>,
}

/// A finished shard on disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FinishedShard {
    /// Which shard.
    pub shard: ShardId,
    /// Path of the file.
    pub path: PathBuf,
    /// BLAKE3 of the file.
    pub digest: Digest,
    /// Size of the file [bytes].
    pub bytes: u64,
    /// Samples kept.
    pub kept: u64,
    /// Samples rejected.
    pub rejected: u64,
}

impl FinishedShard {
    /// Name of its file in the folder of the shards.
    pub fn file_name(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }
}

/// Writes one shard under a temporary name; [`ShardWriter::finish`] makes it appear.
///
/// Calls come in sample order: for each index of the range one [`ShardWriter::write`] per channel and then
/// [`ShardWriter::keep`], or [`ShardWriter::reject`] alone. A writer that is dropped leaves nothing behind. The bytes
/// depend on the header and the calls alone: one chunk holds whole samples; no clock, thread or crate version enters.
pub struct ShardWriter {
    header: ShardHeader,
    /// Final path without the digest, for messages.
    name: PathBuf,
    temporary: Option<TemporaryFile>,
    /// `None` once it is finished or given up.
    writer: Option<mcap::Writer<HashingFile>>,
    /// MCAP channel id of each of the header's channels.
    channel_ids: Vec<u16>,
    rows: Vec<LedgerRow>,
    /// Digests of the sample that is being written, an index per channel.
    pending: Vec<Option<Digest>>,
    chunk_bytes: usize,
    chunk_limit: usize,
    kept: u64,
}

impl ShardWriter {
    /// Opens a temporary file in `folder` (the dataset's `shards`).
    ///
    /// # Errors
    /// When the file can't be made or the header is invalid.
    pub fn create(folder: &Folder, header: &ShardHeader) -> Result<Self, DatasetError> {
        Self::create_packed(folder, header, CHUNK_BYTES, ZSTD_LEVEL)
    }

    pub(crate) fn create_packed(
        folder: &Folder,
        header: &ShardHeader,
        chunk_limit: usize,
        level: u32,
    ) -> Result<Self, DatasetError> {
        let mut header = header.clone();
        header.channels.sort_unstable();
        header.channels.dedup();
        let stem = ShardName::stem(header.product, header.shard, header.shards);
        let leading = header.product.leading();
        let own = header.channels.iter().all(|channel| channel.product() == header.product);
        if header.samples.is_empty() || !own || !header.channels.contains(&leading) || header.shard.0 >= header.shards {
            let topic = leading.topic;
            let expected = format!("samples, channels of {} with {topic} and a shard below the count", header.product);
            return Err(DatasetError::Sequence { shard: stem, expected, found: format!("{header:?}") });
        }
        let (file, temporary) = TemporaryFile::create(folder, &stem)?;
        let file =
            HashingFile { file: BufWriter::with_capacity(128 << 10, file), hasher: blake3::Hasher::new(), position: 0 };
        let mut shard = Self {
            pending: vec![None; header.channels.len()],
            rows: Vec::with_capacity((header.samples.end - header.samples.start) as usize),
            name: folder.path_of(stem),
            temporary: Some(temporary),
            writer: None,
            channel_ids: Vec::new(),
            chunk_bytes: 0,
            chunk_limit,
            kept: 0,
            header,
        };
        let begun = begin(file, &shard.header, level);
        let (writer, channel_ids) = begun.map_err(DatasetError::mcap("writing", &shard.name))?;
        shard.writer = Some(writer);
        shard.channel_ids = channel_ids;
        Ok(shard)
    }

    /// Writes one channel of a sample.
    ///
    /// # Errors
    /// When the file can't be written; a call out of order.
    pub fn write(
        &mut self,
        index: SampleIndex,
        sample: &SampleId,
        channel: Channel,
        payload: &[u8],
    ) -> Result<(), DatasetError> {
        self.expect(index)?;
        let position = self.header.channels.binary_search(&channel);
        let position = match position {
            Ok(position) if self.pending[position].is_none() => position,
            _ => {
                return Err(self.sequence("each channel of the header once", format!("{} of {sample}", channel.topic)));
            }
        };
        let header = MessageHeader {
            channel_id: self.channel_ids[position],
            sequence: 0,
            log_time: index.0,
            publish_time: index.0,
        };
        self.pending[position] = Some(Digest::hash(payload));
        self.chunk_bytes += payload.len();
        let name = &self.name;
        let writer = self.writer.as_mut().ok_or_else(|| gone(name))?;
        let written = writer.write_to_known_channel(&header, payload);
        self.checked(written)
    }

    /// Ends a sample whose channels are all written.
    ///
    /// # Errors
    /// When the file can't be written, or a channel is missing.
    pub fn keep(&mut self, index: SampleIndex, sample: &SampleId, facts: impl Into<Facts>) -> Result<(), DatasetError> {
        self.expect(index)?;
        let facts = self.checked_facts(facts.into())?;
        let Some(digests) = self.pending.iter().copied().collect::<Option<Vec<_>>>() else {
            return Err(self.sequence("every channel of the header before keep", format!("keep of {sample}")));
        };
        self.pending.fill(None);
        self.rows.push(LedgerRow { index, sample: *sample, facts, fate: Fate::Kept(digests) });
        self.kept += 1;
        if self.chunk_bytes >= self.chunk_limit {
            self.chunk_bytes = 0;
            let name = &self.name;
            let writer = self.writer.as_mut().ok_or_else(|| gone(name))?;
            let flushed = writer.flush();
            self.checked(flushed)?;
        }
        Ok(())
    }

    /// Accounts for a sample that is not stored.
    ///
    /// `facts` are what was known when it was rejected, `detail` numbers for people (the same on every machine).
    ///
    /// # Errors
    /// A call out of order, or an empty reason.
    pub fn reject(
        &mut self,
        index: SampleIndex,
        sample: &SampleId,
        facts: impl Into<Facts>,
        reason: &str,
        detail: &str,
    ) -> Result<(), DatasetError> {
        self.expect(index)?;
        let facts = self.checked_facts(facts.into())?;
        if reason.is_empty() || self.pending.iter().any(Option::is_some) {
            return Err(self.sequence("a reason and no channel before reject", format!("reject of {sample}")));
        }
        let fate = Fate::Rejected { reason: reason.to_owned(), detail: detail.to_owned() };
        self.rows.push(LedgerRow { index, sample: *sample, facts, fate });
        Ok(())
    }

    /// Writes ledger and summary, syncs, and renames the file to the name that proves its content.
    ///
    /// # Errors
    /// When samples are missing or the file can't be written, synced or renamed.
    pub fn finish(mut self) -> Result<FinishedShard, DatasetError> {
        let expected = self.header.samples.end - self.header.samples.start;
        if self.rows.len() as u64 != expected || self.pending.iter().any(Option::is_some) {
            let found = format!("finish after {} of them", self.rows.len());
            return Err(self.sequence(&format!("{expected} samples"), found));
        }
        let ledger = Ledger {
            product: self.header.product,
            job: self.header.job,
            shard: self.header.shard,
            shards: self.header.shards,
            channels: self.header.channels.clone(),
            first: SampleIndex(self.header.samples.start),
            rows: std::mem::take(&mut self.rows),
        };
        let LedgerBytes { ledger, facts, digests } = ledger.encode();
        let message = |name: &str| format!("application/x-protobuf; messageType={name}");
        let media_types = [message(LEDGER_MESSAGE), message(FACTS_MESSAGE), "application/octet-stream".to_owned()];
        let parts = LEDGER.into_iter().zip(media_types).zip([ledger, facts, digests]);
        let log_time = self.header.samples.start;
        let mut attachments = parts.map(|((name, media_type), data)| {
            let (name, data) = (name.to_owned(), data.into());
            Attachment { log_time, create_time: 0, name, media_type, data }
        });
        let name = &self.name;
        let writer = self.writer.as_mut().ok_or_else(|| gone(name))?;
        let attached = attachments.try_for_each(|attachment| writer.attach(&attachment));
        let ended = attached.and_then(|()| writer.finish().map(|_| ()));
        self.checked(ended)?;
        let file = self.writer.take().ok_or_else(|| gone(&self.name))?.into_inner();
        let digest = Digest(*file.hasher.finalize().as_bytes());
        let bytes = file.position;
        let file =
            file.file.into_inner().map_err(|error| DatasetError::io("writing", &self.name)(error.into_error()))?;
        let temporary = self.temporary.take().ok_or_else(|| gone(&self.name))?;
        let name = ShardName::new(self.header.product, self.header.shard, self.header.shards, &digest);
        let path = temporary.publish(&file, &name.to_string())?;
        Ok(FinishedShard {
            shard: self.header.shard,
            path,
            digest,
            bytes,
            kept: self.kept,
            rejected: expected - self.kept,
        })
    }

    fn expect(&self, index: SampleIndex) -> Result<(), DatasetError> {
        let expected = self.header.samples.start + self.rows.len() as u64;
        if index.0 == expected && index.0 < self.header.samples.end {
            return Ok(());
        }
        let Range { start, end } = self.header.samples;
        Err(self.sequence(&format!("sample {expected} of {start}..{end}"), format!("sample {index}")))
    }

    /// The facts, if they are of the shard's product; those of channels that are not stored become 0.
    fn checked_facts(&self, mut facts: Facts) -> Result<Facts, DatasetError> {
        let product = self.header.product;
        let fits = |(fact, value): (&crate::FactFormat, &f64)| fact.kind.holds(*value);
        if facts.values().len() != product.facts.len() || !product.facts.iter().zip(facts.values()).all(fits) {
            return Err(self.sequence(&format!("facts of {product}"), format!("{facts:?}")));
        }
        for (index, fact) in product.facts.iter().enumerate() {
            let stored = |topic: &str| self.header.channels.iter().any(|channel| channel.topic == topic);
            if fact.topic.is_some_and(|topic| !stored(topic)) {
                facts.set(index, 0.0);
            }
        }
        Ok(facts)
    }

    fn sequence(&self, expected: &str, found: String) -> DatasetError {
        let shard = ShardName::stem(self.header.product, self.header.shard, self.header.shards);
        DatasetError::Sequence { shard, expected: expected.to_owned(), found }
    }

    fn checked(&self, result: mcap::McapResult<()>) -> Result<(), DatasetError> {
        result.map_err(DatasetError::mcap("writing", &self.name))
    }
}

impl Drop for ShardWriter {
    fn drop(&mut self) {
        if let Some(writer) = self.writer.take() {
            // `into_inner` ends the MCAP writer without the summary that its own drop would write.
            drop(writer.into_inner());
        }
    }
}

fn gone(name: &Path) -> DatasetError {
    DatasetError::Mcap { path: name.to_owned(), source: mcap::McapError::AttemptedWriteAfterFailure }
}

/// MCAP header, metadata, schemas and channels.
fn begin(
    file: HashingFile,
    header: &ShardHeader,
    level: u32,
) -> mcap::McapResult<(mcap::Writer<HashingFile>, Vec<u16>)> {
    let mut writer = WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .compression_level(level)
        // 0, not the default of all cores: worker threads give other bytes.
        .compression_threads(0)
        .chunk_size(None)
        .disable_seeking(true)
        .library(LIBRARY)
        .profile("graspmill")
        .create(file)?;
    let facts = [
        ("format_version", FORMAT_VERSION.to_string()),
        ("product", header.product.to_string()),
        ("job", header.job.to_string()),
        ("shard", header.shard.to_string()),
        ("shards", header.shards.to_string()),
        ("first_sample", header.samples.start.to_string()),
        ("samples", (header.samples.end - header.samples.start).to_string()),
    ];
    writer.write_metadata(&mcap::records::Metadata {
        name: "graspmill".to_owned(),
        metadata: facts.map(|(key, value)| (key.to_owned(), value)).into(),
    })?;
    let mut channel_ids = Vec::new();
    for channel in &header.channels {
        let schema = writer.add_schema(channel.message, "protobuf", channel.descriptors)?;
        channel_ids.push(writer.add_channel(schema, channel.topic, "protobuf", &BTreeMap::new())?);
    }
    Ok((writer, channel_ids))
}

/// A file whose BLAKE3 grows as it is written, so that it is never read back to be named.
struct HashingFile {
    file: BufWriter<File>,
    hasher: blake3::Hasher,
    position: u64,
}

impl Write for HashingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.hasher.update(&bytes[..written]);
        self.position += written as u64;
        Ok(written)
    }

    /// Does nothing: the MCAP writer flushes after each chunk, but the file is synced once, at the end.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for HashingFile {
    /// Only reports the position: a byte that was hashed is never written again.
    fn seek(&mut self, target: SeekFrom) -> io::Result<u64> {
        match target {
            SeekFrom::Current(0) => Ok(self.position),
            _ => Err(io::ErrorKind::Unsupported.into()),
        }
    }
}
