//! `field.mcap`: labels and signed distances of a whole grid of poses, made of the shards' blocks.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{BufWriter, Write},
    path::Path,
};

use mcap::{
    Compression, McapError, WriteOptions,
    records::{MessageHeader, Record},
};

use super::{FileCheck, FileContext, RootPart};
use crate::{
    FORMAT_VERSION, FieldHeader, ReachabilityBlock, ReachabilityField,
    products::reachability::{FIELD, FORMAT, SCHEMAS},
    storage::{
        DatasetError,
        durable::TemporaryFile,
        error::{REMAKE, REWRITE},
        shard::{LIBRARY, ZSTD_LEVEL},
        shard_file::{
            MAX_CHUNK_BYTES, MESSAGE_HEADER, ShardFile, invalid, parse, read_at, read_summary, records, unpack,
        },
        shards_folder,
    },
};
use kernel::{
    files::Folder,
    geom::{PoseGrid, PoseLabel},
    ids::{Digest, JobDigest},
};

/// Reads the field of a finished reachability dataset. Its checksum and its own rules are checked; `verify` compares it with the
/// manifest.
///
/// # Errors
/// When the dataset has no field, or it is damaged.
pub fn read_field(folder: &Folder) -> Result<ReachabilityField, DatasetError> {
    let payload = read_payload(folder)?;
    ReachabilityField::decode(&payload).map_err(|error| damaged(&folder.path_of(FIELD), error.to_string()))
}

/// Digest of the field's payload, which enters the root digest.
fn payload_digest(folder: &Folder) -> Result<Digest, DatasetError> {
    Ok(Digest::hash(&read_payload(folder)?))
}

/// Computes the distances of all labels and writes the field. `shards` are the names of all shards' files, in order; each
/// position of the grid is one sample of them. The whole field is in memory: 14 bytes per cell.
///
/// # Errors
/// When a shard is damaged, the shards do not hold every position once, or the file cannot be written.
pub fn write_field(
    folder: &Folder,
    job: &JobDigest,
    header: &FieldHeader,
    shards: &[String],
) -> Result<(), DatasetError> {
    let labels = labels_of(folder, shards, header)?;
    let distances = header.distances(&labels);
    let field = ReachabilityField { header: header.clone(), labels, distances };
    let mut payload = Vec::new();
    field.encode(&mut payload);
    drop(field);
    let (file, temporary) = TemporaryFile::create(folder, FIELD)?;
    if payload.len() as u64 > MAX_CHUNK_BYTES / 2 {
        let problem = format!("a field of {} bytes, {} at most", payload.len(), MAX_CHUNK_BYTES / 2);
        return Err(DatasetError::Invalid { path: folder.path_of(FIELD), problem, remedy: "take larger steps" });
    }
    let mut buffer = BufWriter::new(&file);
    write_mcap(&mut buffer, job, header, &payload).map_err(DatasetError::mcap("writing", &temporary.path()))?;
    buffer.flush().map_err(DatasetError::io("writing", &temporary.path()))?;
    drop(buffer);
    temporary.publish(&file, FIELD)?;
    Ok(())
}

fn write_mcap(
    file: &mut BufWriter<&File>,
    job: &JobDigest,
    header: &FieldHeader,
    payload: &[u8],
) -> mcap::McapResult<()> {
    let mut writer = WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .compression_level(ZSTD_LEVEL)
        .compression_threads(0)
        .chunk_size(None)
        .library(LIBRARY)
        .profile("graspmill")
        .create(file)?;
    let mut facts = vec![
        ("format_version", FORMAT_VERSION.to_string()),
        ("product", FORMAT.name.to_owned()),
        ("job", job.to_string()),
    ];
    if let PoseGrid::Sphere(grid) = &header.grid {
        facts.push(("directions", format!("healpix {}", grid.directions().nside())));
        facts.push(("covering_radius", format!("{} rad", grid.covering_radius())));
    }
    writer.write_metadata(&mcap::records::Metadata {
        name: "graspmill".to_owned(),
        metadata: facts.into_iter().map(|(key, value)| (key.to_owned(), value)).collect(),
    })?;
    let schema = writer.add_schema(ReachabilityField::SCHEMA, "protobuf", SCHEMAS)?;
    let channel_id = writer.add_channel(schema, ReachabilityField::TOPIC, "protobuf", &BTreeMap::new())?;
    let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
    writer.write_to_known_channel(&header, payload)?;
    writer.finish().map(|_| ())
}

/// The labels of all positions, from the blocks, one chunk of a shard in memory at a time. Blocks are of the header's planning
/// group and of its grid.
fn labels_of(folder: &Folder, shards: &[String], header: &FieldHeader) -> Result<Vec<PoseLabel>, DatasetError> {
    let folder = shards_folder(folder);
    let (cells, positions) = (header.grid.cells(), header.grid.positions() as u64);
    let mut labels = Vec::with_capacity(cells);
    let mut next = 0;
    for name in shards {
        let shard = ShardFile::open(&folder, name)?;
        for chunk in 0..shard.chunks.len() {
            for message in shard.read_chunk(chunk)? {
                let index = message.index;
                let block = ReachabilityBlock::decode(&message.payload).map_err(|source| DatasetError::Record {
                    path: shard.path.clone(),
                    index,
                    source,
                })?;
                if (index.0, u64::from(block.sample.item.0)) != (next, next)
                    || block.labels.len() as u64 * positions != cells as u64
                {
                    let (item, found) = (block.sample.item, block.labels.len());
                    let problem = format!(
                        "sample {index} is position {item} with {found} cells, expected position {next} of {positions} \
                         with {cells} cells in all"
                    );
                    return Err(invalid(&shard.path, problem));
                }
                if block.joints as usize != header.joints.len() {
                    let (found, expected) = (block.joints, header.joints.len());
                    let problem = format!("sample {index} has witnesses of {found} joints, the field names {expected}");
                    return Err(invalid(&shard.path, problem));
                }
                labels.extend_from_slice(&block.labels);
                next += 1;
            }
        }
    }
    if next != positions {
        let problem = format!("the shards hold {next} of {positions} positions");
        return Err(DatasetError::Invalid { path: folder.path().to_owned(), problem, remedy: REMAKE });
    }
    Ok(labels)
}

fn read_payload(folder: &Folder) -> Result<Vec<u8>, DatasetError> {
    let path = &folder.path_of(FIELD);
    let file = folder.open(FIELD).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => DatasetError::Invalid {
            path: path.to_owned(),
            problem: "the file is missing".to_owned(),
            remedy: "only a finished reachability dataset has one: `run` its job again",
        },
        _ => DatasetError::io("reading", path)(error),
    })?;
    let bytes = file.metadata().map_err(DatasetError::io("reading", path))?.len();
    let failed = |error: McapError| match error {
        McapError::Io(source) => DatasetError::io("reading", path)(source),
        error => damaged(path, error.to_string()),
    };
    let summary = read_summary(&file, bytes).map_err(failed)?;
    let (mut only, mut topic) = (None, None);
    for record in records(&summary) {
        match record.and_then(|(opcode, body)| parse(opcode, body)).map_err(failed)? {
            Record::ChunkIndex(chunk) if !chunk.message_index_offsets.is_empty() => only = Some(chunk),
            Record::Channel(channel) => topic = Some(channel.topic),
            _ => {}
        }
    }
    let chunk = only.filter(|_| topic.as_deref() == Some(ReachabilityField::TOPIC));
    let chunk = chunk.ok_or_else(|| damaged(path, format!("it has no message on {}", ReachabilityField::TOPIC)))?;
    let record = read_at(folder, FIELD, chunk.chunk_start_offset, chunk.chunk_length)?;
    let unpacked = unpack(&record).map_err(failed)?;
    drop(record);
    for record in records(&unpacked) {
        let (opcode, body) = record.map_err(failed)?;
        if opcode == mcap::records::op::MESSAGE && body.len() > MESSAGE_HEADER {
            return Ok(body[MESSAGE_HEADER..].to_vec());
        }
    }
    Err(damaged(path, "its chunk holds no message".to_owned()))
}

fn damaged(path: &Path, problem: String) -> DatasetError {
    DatasetError::Invalid { path: path.to_owned(), problem, remedy: REWRITE }
}

/// The check of the field.
pub(super) static CHECK: FileCheck =
    FileCheck { name: FIELD, in_root: Some(RootPart { word: "field", digest: payload_digest }), check: check_field };

/// Checks the field against the shards' blocks and against itself.
fn check_field(context: &FileContext<'_>) -> Vec<String> {
    let words = |error: DatasetError| match error {
        DatasetError::Invalid { problem, .. } => problem,
        other => other.to_string(),
    };
    let field = match read_field(context.folder) {
        Ok(field) => field,
        Err(error) => return vec![words(error)],
    };
    // The blocks' labels are known only where every shard is intact.
    if !context.full || !context.shards_intact {
        return Vec::new();
    }
    match labels_of(context.folder, &context.manifest.shard_names(), &field.header) {
        Ok(labels) => compare_field(&field, &labels).into_iter().collect(),
        Err(error) => vec![error.to_string()],
    }
}

/// Labels against the blocks', distances against recomputed ones.
fn compare_field(field: &ReachabilityField, labels: &[PoseLabel]) -> Option<String> {
    let others = field.labels.iter().zip(labels).filter(|(field, block)| field != block).count();
    if others > 0 {
        return Some(format!("{others} of {} labels are not those of the shards", labels.len()));
    }
    let distances = field.header.distances(labels);
    let bits = |distance: &f32| distance.to_bits();
    let others = field.distances.iter().zip(&distances).filter(|(a, b)| bits(a) != bits(b)).count();
    (others > 0).then(|| format!("{others} of {} distances are not those of its labels", distances.len()))
}
