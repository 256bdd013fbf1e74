//! A dataset's folder while it is being filled: the job that it belongs to, and which shards are done.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
};

use serde::{Deserialize, Serialize};

use super::{
    DatasetError,
    layout::{RUN, SHARDS, ShardName},
    shard_file::has_magic,
};
use crate::{FORMAT_VERSION, Product};
use kernel::{
    files::{self, Bound, FileRefusal, Folder},
    ids::{Digest, JobDigest, ShardId},
};

/// Ending of the names of files that were set aside.
pub(crate) const SET_ASIDE: &str = ".bad";

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
pub(crate) fn mark_text(mark: &RunMark) -> String {
    serde_json::to_string_pretty(mark).expect("a run mark is plain data") + "\n"
}

/// The names in a folder, sorted; none where there is no folder.
pub(super) fn present_names(folder: &Folder) -> Result<Vec<String>, DatasetError> {
    match sorted_names(folder) {
        Err(DatasetError::Io { source, .. }) if files::is_absent(&source) => Ok(Vec::new()),
        names => names,
    }
}

/// The name of a file before it was set aside.
pub(super) fn own_name(name: &str) -> &str {
    name.strip_suffix(SET_ASIDE).unwrap_or(name)
}

/// The folder of the shards of the dataset in `folder`.
pub fn shards_folder(folder: &Folder) -> Folder {
    folder.subfolder(SHARDS)
}

/// Reads the mark of the job that a folder belongs to; `None` when it has no `run.json`.
///
/// # Errors
/// When the file can't be read, is not a run mark, or is of another format version.
pub fn read_mark(folder: &Folder) -> Result<Option<RunMark>, DatasetError> {
    #[derive(Deserialize)]
    struct Version {
        format_version: u32,
    }
    let path = folder.path_of(RUN);
    let text = match folder.read(RUN, Bound::RUN) {
        Ok(text) => text,
        Err(error) if files::is_absent(&error) => return Ok(None),
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
    /// Shards whose file name matches the content, by number.
    pub done: BTreeMap<ShardId, DoneShard>,
    /// Entries with names of shards that must be set aside: damaged, foreign, a second file of a shard, or not a file.
    pub bad: Vec<BadShard>,
    /// Names among the shards that graspmill never uses. They are kept.
    pub strange: Vec<String>,
    /// Temporary files that no program writes any more, by their paths inside the dataset's folder.
    pub leftovers: Vec<String>,
    /// Temporary files that a program is writing, by their paths inside the dataset's folder.
    pub at_work: Vec<String>,
}

impl ShardScan {
    /// Numbers of the shards that are not done, out of `shards`, in order.
    pub fn missing(&self, shards: u32) -> Vec<u32> {
        (0..shards).filter(|shard| !self.done.contains_key(&ShardId(*shard))).collect()
    }
}

/// A shard that is done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DoneShard {
    /// Name of the file among the shards.
    pub name: String,
    /// BLAKE3 of its content.
    pub digest: Digest,
    /// Size [bytes].
    pub bytes: u64,
}

/// A file with the name of a shard that is not a shard of this run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadShard {
    /// Name of the file among the shards.
    pub name: String,
    /// Which shard it claims to be.
    pub shard: ShardId,
    /// Problem with the file, with numbers.
    pub problem: String,
}

impl fmt::Display for BadShard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{SHARDS}/{}: {}", self.name, self.problem)
    }
}

/// Reads every file of the folder's `shards` (about 2 GB/s) and returns which shards are done; changes nothing.
///
/// # Errors
/// When the folder or a file can't be read.
pub fn scan_shards(folder: &Folder, mark: &RunMark) -> Result<ShardScan, DatasetError> {
    scan_some_shards(folder, mark, &|_| true)
}

/// Scans only the wanted shards.
///
/// # Errors
/// When the folder or a file can't be read.
pub fn scan_some_shards(
    folder: &Folder,
    mark: &RunMark,
    wanted: &dyn Fn(ShardId) -> bool,
) -> Result<ShardScan, DatasetError> {
    let shards = folder.subfolder(SHARDS);
    let mut scan = ShardScan::default();
    // A run that was killed while it marked or closed the folder leaves its temporary files next to the shards' folder.
    scan.leftovers.extend(sorted_names(folder)?.into_iter().filter(|name| files::is_leftover(folder, name)));
    for name in sorted_names(&shards)? {
        if files::is_temporary_name(&name) {
            let is_leftover = files::is_leftover(&shards, &name);
            if is_leftover { &mut scan.leftovers } else { &mut scan.at_work }.push(format!("{SHARDS}/{name}"));
            continue;
        }
        let Some(parsed) = ShardName::parse(&name) else {
            if ShardName::parse(own_name(&name)).is_none() {
                scan.strange.push(name);
            }
            continue;
        };
        let shard = parsed.shard;
        if !wanted(shard) {
            continue;
        }
        let mut bad = |problem: String| scan.bad.push(BadShard { name: name.clone(), shard, problem });
        if (parsed.product, parsed.shards) != (mark.product, mark.shards) {
            bad(format!("this run makes {} shards of product {}", mark.shards, mark.product));
            continue;
        }
        let (digest, bytes) = match hash_shard(&shards, &name) {
            Ok(Some(found)) => found,
            Ok(None) => {
                bad(format!("its name has digest {}, but it is not a complete MCAP file", parsed.short));
                continue;
            }
            // Only files can be shards.
            Err(DatasetError::Io { source, .. }) if FileRefusal::find_in(&source).is_some() => {
                bad(source.to_string());
                continue;
            }
            Err(error) => return Err(error),
        };
        if digest.short() != parsed.short {
            bad(format!("its name has digest {}, but its {bytes} bytes have {}", parsed.short, digest.short()));
            continue;
        }
        if let Some(other) = scan.done.get(&shard) {
            bad(format!("a second file of shard {shard}, in addition to {}", other.name));
            continue;
        }
        scan.done.insert(shard, DoneShard { name, digest, bytes });
    }
    Ok(scan)
}

/// Numbers of the shards that have a file, by the files' names only: fast, but not a proof.
///
/// # Errors
/// When the folder can't be read.
pub fn listed_shards(folder: &Folder) -> Result<BTreeSet<u32>, DatasetError> {
    let names = sorted_names(&folder.subfolder(SHARDS))?;
    Ok(names.iter().filter_map(|name| ShardName::parse(name)).map(|name| name.shard.0).collect())
}

/// Prepares the folder for a run: removes leftovers of killed writers and renames bad files to `<name>.bad`, so that they do not
/// count as shards and nothing is lost. Returns the new names of the bad files. Another run in the folder may have cleared some
/// of it away already.
///
/// # Errors
/// When a file can't be removed or renamed.
pub fn clear_away(folder: &Folder, scan: &ShardScan) -> Result<Vec<String>, DatasetError> {
    for path in &scan.leftovers {
        let (place, name) = match path.rsplit_once('/') {
            Some((below, name)) => (folder.subfolder(below), name),
            None => (folder.clone(), path.as_str()),
        };
        files::remove_leftover(&place, name).map_err(DatasetError::io("removing", &folder.path_of(path)))?;
    }
    let shards = folder.subfolder(SHARDS);
    let mut aside = Vec::new();
    for BadShard { name, .. } in &scan.bad {
        let new_name = format!("{name}{SET_ASIDE}");
        match shards.rename(name, &new_name) {
            Ok(()) => aside.push(new_name),
            Err(error) if files::is_absent(&error) => {}
            Err(error) => return Err(DatasetError::io("renaming", &shards.path_of(name))(error)),
        }
    }
    Ok(aside)
}

/// The names in a folder, sorted.
pub(crate) fn sorted_names(folder: &Folder) -> Result<Vec<String>, DatasetError> {
    let names = folder.names().map_err(DatasetError::io("reading", folder.path()))?;
    Ok(names.into_iter().map(|name| name.to_string_lossy().into_owned()).collect())
}

/// [`hash_file`] of a shard; `None` for a file that does not begin and end like an MCAP file, which is not read.
fn hash_shard(shards: &Folder, name: &str) -> Result<Option<(Digest, u64)>, DatasetError> {
    let file = shards.open(name).map_err(DatasetError::io("reading", &shards.path_of(name)))?;
    match has_magic(&file) {
        Ok(true) => hash_file(shards, name).map(Some),
        Ok(false) => Ok(None),
        Err(error) => Err(DatasetError::io("reading", &shards.path_of(name))(error)),
    }
}

/// A file that was compared with a size.
pub(crate) enum Hashed {
    /// Digest and size [bytes] of one that is not larger.
    Whole(Digest, u64),
    /// Size of a larger one [bytes], which was not read.
    Grown(u64),
}

/// Hashes a file that is not larger than it should be [bytes].
pub(crate) fn hash_grown(folder: &Folder, name: &str, expected: u64) -> Result<Hashed, DatasetError> {
    match folder.size(name).map_err(DatasetError::io("reading", &folder.path_of(name)))? {
        size if size > expected => Ok(Hashed::Grown(size)),
        _ => hash_file(folder, name).map(|(digest, bytes)| Hashed::Whole(digest, bytes)),
    }
}

/// BLAKE3 and size of a file, read in pieces.
pub(crate) fn hash_file(folder: &Folder, name: &str) -> Result<(Digest, u64), DatasetError> {
    let hashed = folder.open(name).and_then(Digest::hash_reader);
    hashed.map_err(DatasetError::io("reading", &folder.path_of(name)))
}
