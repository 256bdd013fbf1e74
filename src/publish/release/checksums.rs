//! Digests of a release's files, and the list that `sha256sum -c` reads.

use std::{collections::BTreeMap, io::Read};

use sha2::{Digest as _, Sha256};

use format::dataset::DatasetError;
use kernel::{files::Folder, ids::Digest};

/// The list of digests: a line per file, `<64 hexadecimal digits>  <path>`, sorted by path.
pub(crate) const CHECKSUMS: &str = "manifest-sha256.txt";

/// Digests and size of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FileDigests {
    /// SHA-256, 64 hexadecimal digits.
    pub sha256: String,
    /// BLAKE3, as in manifests.
    pub blake3: Digest,
    /// Size [bytes].
    pub bytes: u64,
}

/// Reads a file of a folder once, in chunks.
pub(crate) fn digests_of(folder: &Folder, name: &str) -> Result<FileDigests, DatasetError> {
    let failed = |source| DatasetError::Io { action: "reading", path: folder.path_of(name), source };
    let mut file = folder.open(name).map_err(failed)?;
    let (mut sha256, mut blake3) = (Sha256::new(), blake3::Hasher::new());
    let (mut buffer, mut bytes) = (vec![0; 256 << 10], 0);
    loop {
        let read = match file.read(&mut buffer) {
            Ok(0) => break,
            Ok(read) => read,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(failed(error)),
        };
        sha256.update(&buffer[..read]);
        blake3.update(&buffer[..read]);
        bytes += read as u64;
    }
    let sha256 = sha256.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(FileDigests { sha256, blake3: Digest(*blake3.finalize().as_bytes()), bytes })
}

/// Text of the list of files by path.
pub(super) fn list(files: &BTreeMap<String, FileDigests>) -> String {
    files.iter().map(|(path, file)| format!("{}  {path}\n", file.sha256)).collect()
}

/// A line that is not a digest and a path.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {number}: `{line}` is not a digest and a path")]
pub(crate) struct BadChecksumLine {
    /// Number of the line, from 1.
    pub number: usize,
    /// The line.
    pub line: String,
}

/// SHA-256 by path.
///
/// # Errors
/// The first invalid line.
pub(crate) fn parsed(text: &str) -> Result<BTreeMap<String, String>, BadChecksumLine> {
    let line = |(index, line): (usize, &str)| {
        let parts = line.split_once("  ").filter(|(digest, path)| {
            digest.len() == 64
                && digest.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
                && is_inside(path)
        });
        let (digest, path) = parts.ok_or_else(|| BadChecksumLine { number: index + 1, line: line.to_owned() })?;
        Ok((path.to_owned(), digest.to_owned()))
    };
    text.lines().enumerate().map(line).collect()
}

/// Whether a path stays inside the folder.
fn is_inside(path: &str) -> bool {
    !path.is_empty() && path.split('/').all(|part| !part.is_empty() && part != "." && part != "..")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second vector of FIPS 180-4's examples, and the empty message.
    #[test]
    fn digests_are_those_of_the_standard() {
        let folder = tempfile::tempdir().expect("a scratch folder");
        let path = folder.path().join("x");
        for (text, sha256) in [
            ("", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"),
            (
                "abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
                "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1",
            ),
        ] {
            std::fs::write(&path, text).expect("written");
            let found = digests_of(&Folder::at(folder.path()), "x").expect("read");
            assert_eq!((found.sha256.as_str(), found.bytes), (sha256, text.len() as u64));
            assert_eq!(found.blake3, Digest::hash(text.as_bytes()));
            let files = BTreeMap::from([("a b/x".to_owned(), found)]);
            assert_eq!(parsed(&list(&files)), Ok(BTreeMap::from([("a b/x".to_owned(), sha256.to_owned())])));
        }
        for wrong in ["", "abc  x", &format!("{}  ../x", "0".repeat(64)), &format!("{} x", "0".repeat(64))] {
            assert!(parsed(&format!("{wrong}\n")).is_err(), "{wrong}");
        }
    }
}
