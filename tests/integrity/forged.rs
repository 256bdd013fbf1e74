//! Forgeries behind corrected digests: content that the format forbids, in files whose checksums, names, ledgers,
//! manifest and roots are made to fit. `verify` finds it, or every reader accepts it unchanged; none crashes, hangs, or
//! takes memory without limit.

use std::{
    collections::BTreeMap,
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};

use graspmill::{
    files::Folder,
    format::{
        Channel, FactKind, check_record, checks_of,
        dataset::{DatasetHeader, DatasetReader, Fate, LedgerRow, Manifest, ShardName, finish_dataset, verify},
    },
    ids::{Digest, ShardId},
    seed::Stream,
    tables::ParquetIndex,
};
use serde_json::Value as Json;

use super::{
    forger::header_of,
    fuzz_corpus::{
        seeds::records,
        targets::{Chunk, ShardParts, record},
    },
    wire_tree::{Change, Value, change, encode, parse, pick},
};
use crate::support::{
    files::{FULL_CHECK, read_json, read_tree, repository_path},
    jobs::small_datasets,
    program::Program,
    workspace::Workspace,
};

/// Address space of a reader, at most: what a program or an interpreter takes for itself, and a chunk of 1 GiB.
const MEMORY: &str = "--as=6442450944";
/// Exit codes that a verb may end with, for any content of a dataset.
pub const CODES: [i32; 6] = [0, 1, 2, 3, 4, 74];
/// Folders that one call of Python reads.
const BATCH: usize = 40;
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;
const ATTACHMENT: u8 = 0x09;
const DATA_END: u8 = 0x0f;
/// Count of lies about the messages of a chunk.
const CHUNK_LIES: usize = 9;
/// Bytes of a message before its payload: channel, sequence, log time, publish time.
const MESSAGE_HEAD: usize = 22;

/// A dataset that is forged again and again, each time from its true files.
pub struct Original {
    pub name: &'static str,
    files: BTreeMap<PathBuf, Vec<u8>>,
    pub manifest: Manifest,
    header: DatasetHeader,
    shards: Vec<OriginalShard>,
}

/// A true shard.
struct OriginalShard {
    parts: ShardParts,
    rows: Vec<LedgerRow>,
    /// Channels by their number in the file.
    channels: BTreeMap<u16, Channel>,
}

/// A file of MCAP as its parts.
fn take_apart(bytes: &[u8]) -> ShardParts {
    let mut parts = ShardParts { head: Vec::new(), chunks: Vec::new(), attachments: Vec::new(), summary: Vec::new() };
    let text = |body: &[u8], at: &mut usize| {
        let length = u32::from_le_bytes(body[*at..*at + 4].try_into().expect("4 bytes")) as usize;
        *at += 4 + length;
        String::from_utf8(body[*at - length..*at].to_vec()).expect("text")
    };
    let number = |body: &[u8], at: usize| u64::from_le_bytes(body[at..at + 8].try_into().expect("8 bytes"));
    let mut is_head = true;
    for (opcode, body) in records(&bytes[8..bytes.len() - 8]) {
        match opcode {
            CHUNK => {
                is_head = false;
                let mut at = 28;
                text(&body, &mut at);
                let unpacked = zstd::bulk::decompress(&body[at + 8..], number(&body, 16) as usize).expect("zstd");
                parts.chunks.push(Chunk { records: unpacked, times: (number(&body, 0), number(&body, 8)) });
            }
            ATTACHMENT => {
                let mut at = 16;
                let (name, media_type) = (text(&body, &mut at), text(&body, &mut at));
                parts.attachments.push((name, media_type, body[at + 8..body.len() - 4].to_vec()));
            }
            // Schemas and channels are among the chunks, and again in the summary.
            SCHEMA | CHANNEL if !is_head => record(&mut parts.summary, opcode, &body),
            DATA_END => is_head = false,
            _ if is_head => record(&mut parts.head, opcode, &body),
            _ => {}
        }
    }
    parts
}

/// Records of a chunk, in order.
fn join_records(list: &[(u8, Vec<u8>)]) -> Vec<u8> {
    let mut out = Vec::new();
    list.iter().for_each(|(opcode, body)| record(&mut out, *opcode, body));
    out
}

fn time_of(message: &[u8]) -> u64 {
    u64::from_le_bytes(message[6..14].try_into().expect("8 bytes"))
}

impl Original {
    pub fn read(name: &'static str, folder: &Path) -> Self {
        let reader = DatasetReader::open(&Folder::at(folder)).expect("a dataset");
        let manifest = reader.manifest().clone();
        let shard = |number: usize| {
            let bytes = fs::read(manifest.shard_path(folder, number)).expect("a shard");
            let parts = take_apart(&bytes);
            let stored = records(&parts.summary).into_iter().filter(|(opcode, _)| *opcode == CHANNEL);
            let channel = |body: Vec<u8>| {
                let length = u32::from_le_bytes(body[4..8].try_into().expect("4 bytes")) as usize;
                let topic = str::from_utf8(&body[8..8 + length]).expect("text");
                (u16::from_le_bytes([body[0], body[1]]), Channel::from_topic(topic).expect("a topic"))
            };
            let channels = stored.map(|(_, body)| channel(body)).collect();
            OriginalShard { parts, rows: reader.ledger(number).expect("a ledger").rows, channels }
        };
        let shards = (0..manifest.shards.len()).map(shard).collect();
        Self { name, files: read_tree(folder), header: header_of(&reader), manifest: manifest.clone(), shards }
    }

    /// Writes the true files into a folder.
    fn write(&self, folder: &Path) {
        _ = fs::remove_dir_all(folder);
        for (path, content) in &self.files {
            let path = folder.join(path);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            fs::write(path, content).expect("a file");
        }
    }

    /// Writes the dataset with another shard, and all that follows from it, as far as a dataset can be closed over it.
    fn write_with_shard(&self, folder: &Path, shard: usize, parts: &ShardParts) {
        self.write(folder);
        let bytes = parts.bytes();
        let count = self.manifest.shards.len() as u32;
        let digest = Digest::hash(&bytes);
        let name = ShardName::new(self.manifest.product, ShardId(shard as u32), count, &digest).to_string();
        fs::remove_file(self.manifest.shard_path(folder, shard)).expect("the true shard goes");
        fs::write(folder.join("shards").join(&name), &bytes).expect("a shard");
        if finish_dataset(&Folder::at(folder), &self.header, &ParquetIndex).is_err() {
            mend_manifest(folder, |manifest| {
                let entry = &mut manifest["shards"][shard];
                entry["file"] = name.clone().into();
                entry["digest"] = digest.hex().into();
                entry["bytes"] = bytes.len().into();
            });
        }
    }

    /// Writes the dataset with another content of a file other than the shards.
    fn write_with_file(&self, folder: &Path, file: &str, content: &[u8]) {
        self.write(folder);
        fs::write(folder.join(file), content).expect("a file");
        if self.manifest.files.contains_key(file) {
            mend_manifest(folder, |manifest| {
                manifest["files"][file]["digest"] = Digest::hash(content).hex().into();
                manifest["files"][file]["bytes"] = content.len().into();
            });
        }
    }

    /// Writes the dataset with other facts of one kept sample of its first shard.
    pub fn write_with_facts(&self, folder: &Path, stated: &BTreeMap<usize, f64>) {
        let OriginalShard { parts, rows, .. } = &self.shards[0];
        let mut parts = parts.clone();
        let row = rows.iter().position(|row| matches!(row.fate, Fate::Kept(_))).expect("a kept sample");
        let facts = parts.attachments.iter_mut().find(|(name, ..)| name == "facts").expect("facts");
        facts.2 = with_facts(&facts.2, &self.manifest, row, stated);
        self.write_with_shard(folder, 0, &parts);
    }

    /// Draws a forgery and writes it; what was done, in words, and which kind of change it was.
    fn forge(&self, folder: &Path, stream: &mut Stream) -> Option<(String, Change)> {
        let shard = pick(self.shards.len(), stream);
        match stream.below(12) {
            0..=5 => self.forge_payload(folder, shard, stream),
            6 => self.forge_attachment(folder, shard, stream),
            7 | 8 => {
                let lie = pick(CHUNK_LIES, stream);
                Some(self.forge_chunk(folder, shard, lie, stream))
            }
            9 | 10 => self.forge_table(folder, stream),
            _ => self.forge_beside(folder, stream),
        }
    }

    /// Changes a field of one message; digests and facts of the ledger follow.
    fn forge_payload(&self, folder: &Path, shard: usize, stream: &mut Stream) -> Option<(String, Change)> {
        let OriginalShard { parts, rows, channels } = &self.shards[shard];
        let mut parts = parts.clone();
        if parts.chunks.is_empty() {
            return None;
        }
        let place = pick(parts.chunks.len(), stream);
        let chunk = &mut parts.chunks[place];
        let mut list = records(&chunk.records);
        let messages: Vec<usize> = (0..list.len()).filter(|place| list[*place].0 == MESSAGE).collect();
        let message = messages[pick(messages.len(), stream)];
        let body = &mut list[message].1;
        let (forged, path, kind) = change(&body[MESSAGE_HEAD..], stream)?;
        if forged == body[MESSAGE_HEAD..] {
            return None;
        }
        body.truncate(MESSAGE_HEAD);
        body.extend(&forged);
        let (channel, time) = (channels[&u16::from_le_bytes([body[0], body[1]])], time_of(body));
        chunk.records = join_records(&list);

        // The ledger's digest of the message, and its facts where the message states other ones.
        let row = rows.iter().position(|row| row.index.0 == time).expect("a row");
        let before = rows[..row].iter().filter(|row| matches!(row.fate, Fate::Kept(_))).count();
        let of_channel = self.manifest.channels().iter().position(|own| *own == channel).expect("a channel");
        let at = 32 * (before * self.manifest.channels().len() + of_channel);
        let attachment = |parts: &mut ShardParts, name: &str| {
            parts.attachments.iter().position(|(own, ..)| own == name).expect("an attachment")
        };
        let digests = attachment(&mut parts, "digests");
        parts.attachments[digests].2[at..at + 32].copy_from_slice(&Digest::hash(&forged).0);
        let facts = attachment(&mut parts, "facts");
        if let Some(stated) = self.facts_of(&list, time, channels) {
            let table = with_facts(&parts.attachments[facts].2, &self.manifest, row, &stated);
            parts.attachments[facts].2 = table;
        }
        self.write_with_shard(folder, shard, &parts);
        Some((format!("{} field {path}", channel.topic), kind))
    }

    /// The facts that the messages of a sample state; `None` where one is no message.
    fn facts_of(
        &self,
        list: &[(u8, Vec<u8>)],
        time: u64,
        channels: &BTreeMap<u16, Channel>,
    ) -> Option<BTreeMap<usize, f64>> {
        let mut checker = (checks_of(self.manifest.product).samples)();
        let mut facts = BTreeMap::new();
        for (_, body) in list.iter().filter(|(opcode, body)| *opcode == MESSAGE && time_of(body) == time) {
            let channel = channels[&u16::from_le_bytes([body[0], body[1]])];
            facts.extend(check_record(checker.as_mut(), channel, &body[MESSAGE_HEAD..]).ok()?.facts);
        }
        Some(facts)
    }

    /// Changes a field of a ledger.
    fn forge_attachment(&self, folder: &Path, shard: usize, stream: &mut Stream) -> Option<(String, Change)> {
        let mut parts = self.shards[shard].parts.clone();
        let place = pick(2, stream);
        let (name, _, data) = &mut parts.attachments[place];
        let (forged, path, kind) = change(data, stream)?;
        if forged == *data {
            return None;
        }
        *data = forged;
        let words = format!("{name} field {path}");
        self.write_with_shard(folder, shard, &parts);
        Some((words, kind))
    }

    /// Moves, doubles or drops a message, or gives a wrong position for it; `lie` is below [`CHUNK_LIES`].
    fn forge_chunk(&self, folder: &Path, shard: usize, lie: usize, stream: &mut Stream) -> (String, Change) {
        let mut parts = self.shards[shard].parts.clone();
        let place = pick(parts.chunks.len(), stream);
        let chunk = &mut parts.chunks[place];
        let mut list = records(&chunk.records);
        let messages: Vec<usize> = (0..list.len()).filter(|place| list[*place].0 == MESSAGE).collect();
        let message = messages[pick(messages.len(), stream)];
        let (what, kind) = match lie {
            0 => {
                list.remove(message);
                ("a message is missing", Change::Missing)
            }
            1 => {
                list.insert(message, list[message].clone());
                ("a message occurs twice", Change::Twice)
            }
            2 => {
                // The first and the last message of a chunk are never the same.
                list.swap(messages[0], messages[messages.len() - 1]);
                ("messages are in another order", Change::Bits)
            }
            3 => {
                let time = time_of(&list[message].1) ^ [1, 7, 1 << 40, u64::MAX][pick(4, stream)];
                list[message].1[6..14].copy_from_slice(&time.to_le_bytes());
                ("a message is of another sample", Change::Number)
            }
            4 => {
                let other = [1, 2, 98][pick(3, stream)];
                list[message].1[0] ^= other;
                ("a message is of another channel", Change::Number)
            }
            5 => {
                let shorter = list[message].1.len().min(MESSAGE_HEAD - 1);
                list[message].1.truncate(shorter);
                ("a message has no whole head", Change::Length)
            }
            6 => {
                chunk.times = [(5, 1), (0, u64::MAX), (u64::MAX, u64::MAX), (0, 0)][pick(4, stream)];
                ("the index of a chunk lies about its samples", Change::Number)
            }
            7 => {
                // Its end is cut below.
                ("a chunk ends within a record", Change::Length)
            }
            _ => {
                list.retain(|(opcode, _)| *opcode != MESSAGE);
                ("a chunk without messages", Change::Missing)
            }
        };
        chunk.records = join_records(&list);
        if lie == 7 {
            chunk.records.truncate(chunk.records.len() - 3);
        }
        self.write_with_shard(folder, shard, &parts);
        (what.to_owned(), kind)
    }

    /// Changes a value in one of the tables, whose seal goes.
    fn forge_table(&self, folder: &Path, stream: &mut Stream) -> Option<(String, Change)> {
        let tables: Vec<&str> =
            self.files.keys().filter_map(|path| path.to_str()).filter(|path| path.ends_with(".json")).collect();
        let table = tables[pick(tables.len(), stream)];
        let mut value: Json = serde_json::from_slice(&self.files[Path::new(table)]).expect("JSON");
        if let Some(keys) = value.as_object_mut() {
            keys.remove("seal");
        }
        let (before, mut path) = (value.clone(), String::new());
        change_json(&mut value, &mut path, stream);
        if value == before || table == "notes.json" {
            return None;
        }
        let text = serde_json::to_string_pretty(&value).expect("JSON") + "\n";
        self.write_with_file(folder, table, text.as_bytes());
        Some((format!("{table}{path}"), Change::Bits))
    }

    /// Changes a field of a message outside the shards: the field of a map, or the shapes of hand and objects.
    fn forge_beside(&self, folder: &Path, stream: &mut Stream) -> Option<(String, Change)> {
        let file = ["field.mcap", "shapes.mcap"].into_iter().find(|file| self.files.contains_key(Path::new(file)))?;
        let mut parts = take_apart(&self.files[Path::new(file)]);
        let place = pick(parts.chunks.len(), stream);
        let mut list = records(&parts.chunks[place].records);
        let messages: Vec<usize> = (0..list.len()).filter(|place| list[*place].0 == MESSAGE).collect();
        let body = &mut list[messages[pick(messages.len(), stream)]].1;
        let (forged, path, kind) = change(&body[MESSAGE_HEAD..], stream)?;
        if forged == body[MESSAGE_HEAD..] {
            return None;
        }
        body.truncate(MESSAGE_HEAD);
        body.extend(&forged);
        parts.chunks[place].records = join_records(&list);
        self.write(folder);
        fs::write(folder.join(file), parts.bytes()).expect("a file");
        if finish_dataset(&Folder::at(folder), &self.header, &ParquetIndex).is_err() {
            self.write_with_file(folder, file, &parts.bytes());
        }
        Some((format!("{file} field {path}"), kind))
    }
}

/// Changes the manifest, and takes its seal away: a manifest without one is no fault.
fn mend_manifest(folder: &Path, mend: impl Fn(&mut Json)) {
    let path = folder.join("manifest.json");
    let mut manifest = read_json(&path);
    manifest.as_object_mut().expect("an object").remove("seal");
    mend(&mut manifest);
    fs::write(&path, manifest.to_string()).expect("a manifest");
}

/// A table of facts with other values in a row.
fn with_facts(table: &[u8], manifest: &Manifest, row: usize, stated: &BTreeMap<usize, f64>) -> Vec<u8> {
    let Some(mut columns) = parse(table) else { return table.to_vec() };
    for (column, (index, fact)) in columns.iter_mut().zip(manifest.product.facts_of(&manifest.channels())) {
        let (Some(value), (_, Value::Message(fields))) = (stated.get(&index), column) else { continue };
        for (_, list) in fields.iter_mut().filter(|(number, _)| *number > 1) {
            let bytes = match list {
                Value::Message(inner) => encode(inner),
                Value::Bytes(bytes) => bytes.clone(),
                _ => continue,
            };
            let mut numbers = match fact.kind {
                FactKind::Number(_) => bytes.chunks_exact(8).map(<[u8]>::to_vec).collect::<Vec<_>>(),
                FactKind::Count | FactKind::Integer => {
                    bytes.split_inclusive(|byte| *byte < 0x80).map(<[u8]>::to_vec).collect()
                }
            };
            numbers[row] = match fact.kind {
                FactKind::Number(_) => value.to_le_bytes().to_vec(),
                FactKind::Count | FactKind::Integer => encode(&[(1, Value::Number(*value as u64))])[1..].to_vec(),
            };
            *list = Value::Bytes(numbers.concat());
        }
    }
    encode(&columns)
}

/// Changes one value of a JSON table; the path to it is written down.
fn change_json(value: &mut Json, path: &mut String, stream: &mut Stream) {
    let stops = stream.below(6) == 0;
    match value {
        Json::Object(keys) if !keys.is_empty() && !stops => {
            let key = keys.keys().nth(pick(keys.len(), stream)).expect("a key").clone();
            _ = write!(path, " {key}");
            if stream.below(8) == 0 {
                keys.remove(&key);
            } else {
                change_json(&mut keys[&key], path, stream);
            }
        }
        Json::Array(list) if !list.is_empty() && !stops => {
            let place = pick(list.len(), stream);
            _ = write!(path, " {place}");
            if stream.below(8) == 0 {
                list.push(list[place].clone());
            } else {
                change_json(&mut list[place], path, stream);
            }
        }
        other => {
            let number = other.as_u64().unwrap_or_default();
            let all = [
                Json::Null,
                0.into(),
                (-1).into(),
                number.wrapping_add(1).into(),
                u64::MAX.into(),
                1e300.into(),
                "".into(),
                "../../../etc/passwd".into(),
                "\u{0}\n<script>".into(),
                true.into(),
                Json::Array(Vec::new()),
                Json::Object(serde_json::Map::new()),
            ];
            *other = all[pick(all.len(), stream)].clone();
        }
    }
}

/// The verbs that read a dataset of a product, with an output each.
pub fn verbs(product: &str) -> Vec<Vec<&'static str>> {
    let export = |to| vec!["export", "--to", to, "--out"];
    let mut verbs = vec![vec!["inspect"], vec!["report", "--out"], vec!["status"], vec!["digest"], vec!["verify"]];
    let has_tables = ["completion", "reachability", "grasps", "patches"].contains(&product);
    verbs.extend(has_tables.then(|| export("parquet")));
    match product {
        "completion" => verbs.extend(["npy", "webdataset", "binvox", "pcd"].map(export)),
        "reachability" => {
            verbs.push(export("graspit"));
            verbs.push(vec!["query", "reach", "--pose", "0.6,0.1,0.8,0,0.5,0.2"]);
        }
        "grasps" | "scenes" => verbs.push(export("mujoco")),
        "volumes" => verbs.push(export("vgn")),
        "views" => verbs.push(export("bop")),
        "suction" => verbs.push(export("suctionnet")),
        _ => {}
    }
    verbs
}

/// Runs a verb on a dataset, under a limit of memory: its exit code and its output.
pub fn observe(verb: &[&str], data: &Path, out: &Path) -> (Option<i32>, String) {
    _ = fs::remove_dir_all(out);
    _ = fs::remove_file(out);
    let words = if verb[0] == "query" { 2 } else { 1 };
    let program = Program::of_system("prlimit").args([MEMORY, env!("CARGO_BIN_EXE_graspmill")]);
    let program = program.args(&verb[..words]).arg(data).args(&verb[words..]);
    let program = if verb.last() == Some(&"--out") { program.arg(out) } else { program };
    let outcome = program.finish();
    (outcome.code, outcome.text())
}

/// Figures of the forgeries of one dataset.
#[derive(Default)]
pub struct Tally {
    pub tried: u32,
    /// Count of forgeries that `verify` found.
    pub found: u32,
    /// Forgeries that `verify` took, by place and kind of change: another content that is as good as the true one.
    taken: BTreeMap<(String, Change), u32>,
    pub failures: Vec<String>,
}

impl Tally {
    /// Forges a dataset in a folder, and lets `verify` and one more verb read it; what was done, in words.
    fn forge(&mut self, original: &Original, data: &Path, out: &Path, stream: &mut Stream) -> Option<String> {
        let (what, kind) = original.forge(data, stream)?;
        let is_found = verify(&Folder::at(data), FULL_CHECK, |_| {}).map_or(true, |report| !report.is_intact());
        let verbs = verbs(original.name);
        let verb = &verbs[pick(verbs.len(), stream)];
        let (code, said) = observe(verb, data, out);
        let label = format!("{}, {what}, {kind:?}: {}", original.name, verb.join(" "));
        let is_clear = code.is_some_and(|code| CODES.contains(&code)) && !said.contains("panicked");
        if !is_clear || said.trim().is_empty() {
            self.failures.push(format!("{label} ended with {code:?}: {said}"));
        }
        if is_found {
            self.found += 1;
            return Some(label);
        }
        // What is intact can be read; some formats are not for every dataset.
        if code != Some(0) && !(code == Some(2) && verb[0] == "export") {
            self.failures.push(format!("intact, and {label} ended with {code:?}: {said}"));
        }
        *self.taken.entry((what, kind)).or_default() += 1;
        Some(label)
    }

    /// Lets the Python package read forged datasets, each with what was done to it.
    pub fn read_by_python(&mut self, batch: &[(PathBuf, String)]) {
        let python = Program::of_system("prlimit").arg(MEMORY).arg(repository_path(".deps/venv/bin/python"));
        let python = python.arg("tests/peers/read_all.py").args(batch.iter().map(|(data, _)| data));
        let outcome = python.env("PYTHONPATH", repository_path("python")).finish();
        let lines: Vec<&str> = outcome.stdout.lines().collect();
        if let Some((_, label)) = batch.get(lines.len()) {
            self.failures.push(format!("Python ended at {label}: {:?} {}", outcome.code, outcome.stderr));
        }
        for ((_, label), line) in batch.iter().zip(lines).filter(|(_, line)| line.starts_with("broken")) {
            self.failures.push(format!("Python, {label}: {line}"));
        }
    }

    #[expect(clippy::print_stdout, reason = "the figures that the test checks")]
    pub fn print(&self, name: &str) {
        let Self { tried, found, taken, failures } = self;
        let passed = tried.saturating_sub(failures.len() as u32);
        println!("forged {name:13} tried {tried:4} passed {passed:4}, found by verify {found}");
        for ((what, kind), count) in taken {
            println!("    taken: {what}, {kind:?}, {count}");
        }
        for failure in failures {
            println!("    FAILED: {}", failure.chars().take(600).collect::<String>());
        }
    }
}

/// Forges datasets of every product so often, each time another field, and lets every reader read them.
fn storm(count: u32, seed: u64) {
    let workspace = Workspace::new();
    let originals: Vec<Original> = small_datasets().iter().map(|(name, folder)| Original::read(name, folder)).collect();
    let (mut stream, mut failed) = (Stream::of_job(seed, b"", "forgeries"), 0);
    let out = workspace.path("out");
    for original in &originals {
        let mut tally = Tally::default();
        while tally.tried < count {
            // Python starts once per batch of datasets.
            let mut batch = Vec::new();
            while batch.len() < BATCH.min((count - tally.tried) as usize) {
                let data = workspace.path(format!("forged-{}", batch.len()));
                batch.extend(tally.forge(original, &data, &out, &mut stream).map(|label| (data, label)));
            }
            tally.read_by_python(&batch);
            tally.tried += batch.len() as u32;
        }
        tally.print(original.name);
        failed += tally.failures.len();
    }
    assert_eq!(failed, 0, "forgeries that somebody stumbled over; they are listed above");
}

#[test]
fn lies_about_where_messages_stand_are_found_and_read_by_nobody() {
    let workspace = Workspace::new();
    let mut stream = Stream::of_job(3, b"", "lies");
    let (data, out) = (workspace.path("forged"), workspace.path("out"));
    let mut tried = 0;
    for (name, folder) in small_datasets() {
        let original = Original::read(name, folder);
        for lie in 0..CHUNK_LIES {
            let (what, _) = original.forge_chunk(&data, 0, lie, &mut stream);
            let label = format!("{name}: {what}");
            let found = verify(&Folder::at(&data), FULL_CHECK, |_| {}).is_ok_and(|report| !report.is_intact());
            assert!(found, "{label}: verify takes it");
            // A product with one message in a shard has none to change places with.
            let (code, said) = observe(&["export", "--to", "parquet", "--out"], &data, &out);
            assert!(code == Some(1) && said.contains("shards/"), "{label}: {code:?} {said}");
            tried += 1;
        }
    }
    assert_eq!(tried, 4 * CHUNK_LIES);
}

#[test]
fn manifests_that_claim_too_much_are_refused() {
    let workspace = Workspace::new();
    let (name, folder) = &small_datasets()[0];
    let original = Original::read(name, folder);
    let data = workspace.path("forged");
    type Claim = (&'static str, fn(&mut Json));
    let claims: [Claim; 4] = [
        ("too few for", |manifest| manifest["shards"][0]["samples"] = (1u64 << 24).into()),
        ("too few for", |manifest| {
            manifest["shards"][0]["samples"] = 1000.into();
            manifest["shards"][0]["kept"] = 1000.into();
        }),
        // Their sum would be 0 in 64 bits.
        ("kept and rejected samples", |manifest| {
            manifest["counts"]["rejected"] = serde_json::json!({ "a": 1u64 << 63, "b": 1u64 << 63 });
        }),
        ("kept samples of the splits", |manifest| {
            manifest["counts"]["splits"] = serde_json::json!({ "training": u64::MAX, "test": 4 });
        }),
    ];
    for (word, claim) in claims {
        original.write(&data);
        mend_manifest(&data, claim);
        for verb in ["verify", "inspect"] {
            let said = Program::on(verb, &data).fail().stderr;
            assert!(said.contains(word) && said.contains("manifest.json"), "{verb}: {said}");
        }
    }
}

#[test]
fn forgeries_are_found_or_read_as_they_stand() {
    storm(16, 1);
}

#[test]
#[ignore = "minutes: `make test-all`"]
fn a_thousand_forgeries_are_found_or_read_as_they_stand() {
    storm(250, 2);
}
