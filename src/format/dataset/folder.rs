//! A dataset's folder while it is being filled: whose it is, and which shards are done.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    io::{self, Read},
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::{
    DatasetError,
    durable::{self, TEMPORARY},
    layout::{RUN, SHARDS, ShardName},
};
use crate::{FORMAT_VERSION, Product};
use kernel::ids::{Digest, JobDigest, ShardId};

/// Purpose of a folder: `run.json`, written before any shard.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunMark {
    /// Format on disk.
    pub format_version: u32,
    /// Product that the folder will hold.
    pub product: Product,
    /// The job.
    pub job: JobDigest,
    /// Sample indices of the plan.
    pub samples: u64,
    /// Shards of the plan.
    pub shards: u32,
    /// Sample indices per shard, at most; a shard is a run of consecutive indices.
    pub shard_samples: u32,
}

impl RunMark {
    /// The mark of this version's format.
    pub fn new(product: Product, job: JobDigest, samples: u64, shards: u32, shard_samples: u32) -> Self {
        Self { format_version: FORMAT_VERSION, product, job, samples, shards, shard_samples }
    }
}

/// Text of the file of a mark; equal marks have equal texts.
pub(super) fn mark_text(mark: &RunMark) -> String {
    serde_json::to_string_pretty(mark).expect("a run mark is plain data") + "\n"
}

/// Whether an error says that there is no such file, be it that its folder is none.
pub(super) fn is_absent(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory)
}

/// Where the shards of the dataset in `folder` stand.
pub fn shards_folder(folder: &Path) -> PathBuf {
    folder.join(SHARDS)
}

/// Reads the mark that states what a folder was begun for; `None` when it has no `run.json`.
///
/// # Errors
/// When the file can't be read, is no run mark, or is of another format version.
pub fn read_mark(folder: &Path) -> Result<Option<RunMark>, DatasetError> {
    #[derive(Deserialize)]
    struct Version {
        format_version: u32,
    }
    let path = folder.join(RUN);
    let text = match kernel::files::read(&path) {
        Ok(text) => text,
        Err(error) if is_absent(&error) => return Ok(None),
        Err(error) => return Err(DatasetError::io("reading", &path)(error)),
    };
    let invalid = |error: serde_json::Error| DatasetError::Invalid {
        path: path.clone(),
        problem: error.to_string(),
        remedy: "delete it and `run` the job again: finished shards are kept",
    };
    let Version { format_version: found } = serde_json::from_slice(&text).map_err(invalid)?;
    if found != FORMAT_VERSION {
        return Err(DatasetError::Version { path, found, expected: FORMAT_VERSION });
    }
    serde_json::from_slice(&text).map(Some).map_err(invalid)
}

/// Which shards of a folder are done.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShardScan {
    /// Shards whose file has the content that its name says, by number.
    pub done: BTreeMap<ShardId, DoneShard>,
    /// Files that must not stay: damaged, foreign, or a second one of a shard.
    pub bad: Vec<BadShard>,
    /// Temporary files that nobody is writing any more.
    pub leftovers: Vec<PathBuf>,
    /// Temporary files that somebody is writing.
    pub at_work: Vec<PathBuf>,
}

impl ShardScan {
    /// Numbers of the shards that are not done, of so many, in order.
    pub fn missing(&self, shards: u32) -> Vec<u32> {
        (0..shards).filter(|shard| !self.done.contains_key(&ShardId(*shard))).collect()
    }
}

/// A shard that is done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DoneShard {
    /// Path of the file.
    pub path: PathBuf,
    /// BLAKE3 of its content.
    pub digest: Digest,
    /// Size [bytes].
    pub bytes: u64,
}

/// A file among the shards that is no shard of this run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadShard {
    /// The file.
    pub path: PathBuf,
    /// Which shard it claims to be.
    pub shard: Option<ShardId>,
    /// Problem with the file, with numbers.
    pub problem: String,
}

/// Reads every file of the folder's `shards` (about 2 GB/s) and says which shards are done; changes nothing.
///
/// # Errors
/// When the folder or a file can't be read.
pub fn scan_shards(folder: &Path, mark: &RunMark) -> Result<ShardScan, DatasetError> {
    scan_some_shards(folder, mark, &|_| true)
}

/// Scans the wanted shards alone.
///
/// # Errors
/// When the folder or a file can't be read.
pub fn scan_some_shards(
    folder: &Path,
    mark: &RunMark,
    wanted: &dyn Fn(ShardId) -> bool,
) -> Result<ShardScan, DatasetError> {
    let shards = folder.join(SHARDS);
    let mut scan = ShardScan::default();
    let temporary = |path: &PathBuf| path.to_string_lossy().ends_with(TEMPORARY) && path.is_file();
    // A run that was killed while it marked or closed the folder leaves its temporary files beside the shards' folder.
    scan.leftovers
        .extend(sorted_entries(folder)?.into_iter().filter(|path| temporary(path) && durable::is_leftover(path)));
    for path in sorted_entries(&shards)? {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.ends_with(TEMPORARY) {
            if durable::is_leftover(&path) { &mut scan.leftovers } else { &mut scan.at_work }.push(path);
            continue;
        }
        if name.ends_with(".bad") {
            continue;
        }
        let parsed = ShardName::parse(&name);
        let shard = parsed.as_ref().map(|name| name.shard);
        if shard.is_some_and(|shard| !wanted(shard)) {
            continue;
        }
        let mut bad = |problem: String| scan.bad.push(BadShard { path: path.clone(), shard, problem });
        let Some(parsed) = parsed else {
            bad("its name is no shard's".to_owned());
            continue;
        };
        if (parsed.product, parsed.shards) != (mark.product, mark.shards) {
            bad(format!("this run makes {} shards of product {}", mark.shards, mark.product));
            continue;
        }
        let (digest, bytes) = hash_file(&path)?;
        if digest.short() != parsed.short {
            bad(format!("its name says digest {}, its {bytes} bytes have {}", parsed.short, digest.short()));
            continue;
        }
        if let Some(other) = scan.done.get(&parsed.shard) {
            bad(format!("a second file of shard {}, beside {}", parsed.shard, other.path.display()));
            continue;
        }
        scan.done.insert(parsed.shard, DoneShard { path, digest, bytes });
    }
    Ok(scan)
}

/// Numbers of the shards that have a file, by the files' names alone: quick, and no proof.
///
/// # Errors
/// When the folder can't be read.
pub fn listed_shards(folder: &Path) -> Result<BTreeSet<u32>, DatasetError> {
    let names = sorted_entries(&folder.join(SHARDS))?;
    let name = |path: &PathBuf| ShardName::parse(&path.file_name()?.to_string_lossy());
    Ok(names.iter().filter_map(name).map(|name| name.shard.0).collect())
}

/// Clears the way for a run: removes leftovers of killed writers and renames bad files to `<name>.bad`, so that nothing
/// of them is taken for a shard and nothing is lost. Returns the new names of the bad files.
///
/// # Errors
/// When a file can't be removed or renamed.
pub fn clear_away(scan: &ShardScan) -> Result<Vec<PathBuf>, DatasetError> {
    for path in &scan.leftovers {
        match fs::remove_file(path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(DatasetError::io("removing", path)(error));
            }
            _ => {}
        }
    }
    let aside = |bad: &BadShard| {
        let mut name = bad.path.clone().into_os_string();
        name.push(".bad");
        let name = PathBuf::from(name);
        fs::rename(&bad.path, &name).map_err(DatasetError::io("renaming", &bad.path))?;
        Ok(name)
    };
    scan.bad.iter().map(aside).collect()
}

/// The entries of a folder, sorted by name.
pub(super) fn sorted_entries(folder: &Path) -> Result<Vec<PathBuf>, DatasetError> {
    let entries = fs::read_dir(folder).map_err(DatasetError::io("reading", folder))?;
    let mut paths = entries
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<Vec<_>, _>>()
        .map_err(DatasetError::io("reading", folder))?;
    paths.sort();
    Ok(paths)
}

/// BLAKE3 and size of a file, read in pieces.
pub(super) fn hash_file(path: &Path) -> Result<(Digest, u64), DatasetError> {
    let mut file = kernel::files::open(path).map_err(DatasetError::io("reading", path))?;
    let mut hasher = blake3::Hasher::new();
    let mut buffer = vec![0; 256 << 10];
    let mut bytes = 0;
    loop {
        let read = match file.read(&mut buffer) {
            Ok(0) => break,
            Ok(read) => read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(DatasetError::io("reading", path)(error)),
        };
        hasher.update(&buffer[..read]);
        bytes += read as u64;
    }
    Ok((Digest(*hasher.finalize().as_bytes()), bytes))
}
