//! Corrects checksums, so that damage reaches the content behind them: a forger can compute checksums, too.

use std::io::Write;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
const FOOTER: u8 = 0x02;
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const CHUNK: u8 = 0x06;
const CHUNK_INDEX: u8 = 0x08;
const ATTACHMENT: u8 = 0x09;
const ATTACHMENT_INDEX: u8 = 0x0a;
const DATA_END: u8 = 0x0f;

/// Most bytes that a chunk is unpacked to for its checksum.
const MAX: usize = 1 << 24;

/// Returns the file with the right checksums of chunks, attachments and summary, as far as records can be told apart.
pub fn with_checksums(file: &[u8]) -> Vec<u8> {
    let mut file = file.to_vec();
    let mut at = MAGIC.len();
    while let Some(head) = file.get(at..at + 9) {
        let (opcode, length) = (head[0], u64::from_le_bytes(head[1..].try_into().expect("8 bytes")));
        let start = at + 9;
        let Some(end) = usize::try_from(length).ok().and_then(|length| start.checked_add(length)) else { break };
        if end > file.len() {
            break;
        }
        match opcode {
            CHUNK => {
                if let Some(crc) = chunk_checksum(&file[start..end]) {
                    file[start + 24..start + 28].copy_from_slice(&crc.to_le_bytes());
                }
            }
            ATTACHMENT if end - start >= 4 => {
                let crc = crc32fast::hash(&file[start..end - 4]);
                file[end - 4..end].copy_from_slice(&crc.to_le_bytes());
            }
            FOOTER if end - start == 20 => {
                let summary = u64::from_le_bytes(file[start..start + 8].try_into().expect("8 bytes")) as usize;
                if let Some(covered) = file.get(summary..start + 16) {
                    let crc = crc32fast::hash(covered);
                    file[start + 16..end].copy_from_slice(&crc.to_le_bytes());
                }
            }
            _ => {}
        }
        at = end;
    }
    file
}

fn chunk_checksum(body: &[u8]) -> Option<u32> {
    let size = u64::from_le_bytes(body.get(16..24)?.try_into().ok()?);
    let word = u32::from_le_bytes(body.get(28..32)?.try_into().ok()?) as usize;
    let records = body.get(32usize.checked_add(word)?.checked_add(8)?..)?;
    let size = usize::try_from(size).ok().filter(|size| *size <= MAX)?;
    let unpacked = zstd::bulk::decompress(records, size).ok()?;
    Some(crc32fast::hash(&unpacked))
}

/// Attachments of a shard's ledger, with their media types.
pub const LEDGER: [(&str, &str); 3] = [
    ("ledger", "application/x-protobuf; message=\"graspmill.Ledger\""),
    ("facts", "application/x-protobuf; message=\"graspmill.FactTable\""),
    ("digests", "application/octet-stream"),
];

/// An input of the target `shard_content`: the attachments of the ledger, each after its length, then records.
pub fn parts(ledger: [&[u8]; 3], records: &[u8]) -> Vec<u8> {
    let part = |bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat();
    [ledger.map(part).concat(), records.to_vec()].concat()
}

/// A well-formed shard with the attachments of a ledger and a chunk of records; channel k is topic k.
pub fn shard_of(input: &[u8], topics: &[&str]) -> Option<Vec<u8>> {
    let (mut ledger, mut records) = (Vec::new(), input);
    for _ in LEDGER {
        let (length, rest) = records.split_first_chunk::<4>()?;
        let (part, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        ledger.push(part.to_vec());
        records = rest;
    }
    let mut summary = Vec::new();
    record(&mut summary, SCHEMA, &[&1u16.to_le_bytes()[..], &text("any"), &text("protobuf"), &[0; 4]].concat());
    for (id, topic) in (0u16..).zip(topics) {
        let body = [&id.to_le_bytes()[..], &1u16.to_le_bytes(), &text(topic), &text("protobuf"), &[0; 4]].concat();
        record(&mut summary, CHANNEL, &body);
    }
    let mut head = Vec::new();
    record(&mut head, 0x01, &[text("graspmill"), text("graspmill format 2")].concat());
    let chunks = vec![Chunk { times: times(records), records: records.to_vec() }];
    let ledger = LEDGER.into_iter().zip(ledger).map(|((name, kind), data)| (name.to_owned(), kind.to_owned(), data));
    Some(ShardParts { head, chunks, attachments: ledger.collect(), summary }.bytes())
}

/// A chunk: its records, and the first and last sample of its index.
#[derive(Clone, Debug)]
pub struct Chunk {
    pub records: Vec<u8>,
    pub times: (u64, u64),
}

/// Parts of a shard. Offsets, lengths and checksums follow from them.
#[derive(Clone, Debug)]
pub struct ShardParts {
    /// Records before the first chunk.
    pub head: Vec<u8>,
    pub chunks: Vec<Chunk>,
    /// Name, media type and data of each attachment.
    pub attachments: Vec<(String, String, Vec<u8>)>,
    /// Schemas and channels, as the summary repeats them.
    pub summary: Vec<u8>,
}

impl ShardParts {
    /// The file.
    pub fn bytes(&self) -> Vec<u8> {
        let mut file = [MAGIC, &self.head].concat();
        let mut indexes = Vec::new();
        for Chunk { records, times: (first, last) } in &self.chunks {
            let (start, packed) = (file.len(), packed(records));
            let mut body = [*first, *last, records.len() as u64].map(u64::to_le_bytes).concat();
            body.extend(crc32fast::hash(records).to_le_bytes());
            body.extend(text("zstd"));
            body.extend((packed.len() as u64).to_le_bytes());
            body.extend(&packed);
            record(&mut file, CHUNK, &body);
            let end = file.len();
            let mut body = [*first, *last, start as u64, (end - start) as u64].map(u64::to_le_bytes).concat();
            // One entry of message indexes, at any offset, shows that the chunk has messages.
            body.extend([&10u32.to_le_bytes()[..], &0u16.to_le_bytes(), &(end as u64).to_le_bytes(), &[0; 8]].concat());
            body.extend(text("zstd"));
            body.extend([packed.len() as u64, records.len() as u64].map(u64::to_le_bytes).concat());
            record(&mut indexes, CHUNK_INDEX, &body);
        }
        for (name, media_type, data) in &self.attachments {
            let start = file.len();
            let mut body = vec![0; 16];
            body.extend([text(name), text(media_type)].concat());
            body.extend((data.len() as u64).to_le_bytes());
            body.extend(data);
            body.extend(crc32fast::hash(&body).to_le_bytes());
            record(&mut file, ATTACHMENT, &body);
            let numbers = [start as u64, (file.len() - start) as u64, 0, 0, data.len() as u64];
            let index = [numbers.map(u64::to_le_bytes).concat(), text(name), text(media_type)].concat();
            record(&mut indexes, ATTACHMENT_INDEX, &index);
        }
        record(&mut file, DATA_END, &[0; 4]);
        let summary = file.len();
        file.extend([&self.summary[..], &indexes].concat());
        let footer = [summary as u64, 0].map(u64::to_le_bytes).concat();
        record(&mut file, FOOTER, &[footer, vec![0; 4]].concat());
        file.extend(MAGIC);
        with_checksums(&file)
    }
}

/// First and last log time of the messages among records; 0 without any.
fn times(mut records: &[u8]) -> (u64, u64) {
    let mut times = Vec::new();
    while let Some((head, rest)) = records.split_at_checked(9) {
        let length = u64::from_le_bytes(head[1..].try_into().expect("8 bytes"));
        let Some((body, rest)) = usize::try_from(length).ok().and_then(|length| rest.split_at_checked(length)) else {
            break;
        };
        if let (0x05, Some(time)) = (head[0], body.get(6..14)) {
            times.push(u64::from_le_bytes(time.try_into().expect("8 bytes")));
        }
        records = rest;
    }
    (times.iter().min().copied().unwrap_or(0), times.iter().max().copied().unwrap_or(0))
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = zstd::Encoder::new(Vec::new(), 1).expect("an encoder");
    encoder.write_all(bytes).expect("memory");
    encoder.finish().expect("memory")
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

/// Appends a record.
pub fn record(file: &mut Vec<u8>, opcode: u8, body: &[u8]) {
    file.push(opcode);
    file.extend((body.len() as u64).to_le_bytes());
    file.extend(body);
}
