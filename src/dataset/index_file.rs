//! `index.parquet` as the Parquet library is given it: somebody else's file, which may say anything.

use std::{
    fs::File,
    io::{self, BufReader, Read},
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
};

use bytes::Bytes;
use parquet::{
    errors::ParquetError,
    file::{
        reader::{ChunkReader, Length},
        serialized_reader::SerializedFileReader,
    },
};

/// A file that is an error past its end. Of a plain one the library goes on to read nothing, as often as a page's header asks
/// for, and takes memory for as many bytes as that says.
pub(super) struct IndexFile {
    file: File,
    length: u64,
}

impl IndexFile {
    /// Opens a file and reads its footer.
    pub fn open(path: &Path) -> Result<SerializedFileReader<Self>, ParquetError> {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        guarded(|| SerializedFileReader::new(Self { file, length }))
    }
}

impl Length for IndexFile {
    fn len(&self) -> u64 {
        self.length
    }
}

impl ChunkReader for IndexFile {
    type T = ToTheEnd;

    fn get_read(&self, start: u64) -> Result<Self::T, ParquetError> {
        self.file.get_read(start).map(ToTheEnd)
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ParquetError> {
        match start.checked_add(length as u64) {
            Some(end) if end <= self.length => self.file.get_bytes(start, length),
            _ => Err(ParquetError::EOF(format!("{length} bytes at {start} of {}", self.length))),
        }
    }
}

/// Reads up to the end of a file; more is an error.
pub(super) struct ToTheEnd(BufReader<File>);

impl Read for ToTheEnd {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.0.read(buffer)? {
            0 if !buffer.is_empty() => Err(io::ErrorKind::UnexpectedEof.into()),
            read => Ok(read),
        }
    }
}

/// Calls the Parquet library, which panics over some pages that nobody writes by mistake; the panic becomes an error.
pub(super) fn guarded<T>(read: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    let broken = || ParquetError::General("a page of it is none that can be decoded".to_owned());
    catch_unwind(AssertUnwindSafe(read)).unwrap_or_else(|_| Err(broken()))
}
