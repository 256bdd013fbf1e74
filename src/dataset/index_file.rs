//! `index.parquet` as the Parquet library is given it: somebody else's file, which may say anything.

use std::{
    fs::File,
    io::{self, BufReader, Read},
    panic::{AssertUnwindSafe, catch_unwind},
};

use bytes::Bytes;
use parquet::{
    bloom_filter::Sbbf,
    column::page::{Page, PageMetadata, PageReader},
    errors::ParquetError,
    file::{
        metadata::{ParquetMetaData, RowGroupMetaData},
        reader::{ChunkReader, FileReader, Length, RowGroupReader},
        serialized_reader::SerializedFileReader,
    },
    record::reader::RowIter,
    schema::types::Type,
};

/// Rows of a row group at most, and values of a page.
pub(super) const ROW_GROUP: usize = 32768;

/// A file that is an error past its end. Of a plain one the library goes on to read nothing, as often as a page's header asks
/// for, and takes memory for as many bytes as that says.
pub(super) struct IndexFile {
    file: File,
    length: u64,
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

/// An index whose pages hold no more values than a row group has rows: the library takes memory for as many as a page claims.
pub(super) struct IndexReader(SerializedFileReader<IndexFile>);

impl IndexReader {
    /// Reads a file's footer.
    pub fn new(file: File) -> Result<Self, ParquetError> {
        let length = file.metadata()?.len();
        guarded(|| SerializedFileReader::new(IndexFile { file, length })).map(Self)
    }
}

impl FileReader for IndexReader {
    fn metadata(&self) -> &ParquetMetaData {
        self.0.metadata()
    }

    fn num_row_groups(&self) -> usize {
        self.0.num_row_groups()
    }

    fn get_row_group(&self, place: usize) -> Result<Box<dyn RowGroupReader + '_>, ParquetError> {
        Ok(Box::new(IndexGroup(self.0.get_row_group(place)?)))
    }

    fn get_row_iter(&self, projection: Option<Type>) -> Result<RowIter<'_>, ParquetError> {
        RowIter::from_file(projection, self)
    }
}

struct IndexGroup<'a>(Box<dyn RowGroupReader + 'a>);

impl RowGroupReader for IndexGroup<'_> {
    fn metadata(&self) -> &RowGroupMetaData {
        self.0.metadata()
    }

    fn num_columns(&self) -> usize {
        self.0.num_columns()
    }

    fn get_column_page_reader(&self, column: usize) -> Result<Box<dyn PageReader>, ParquetError> {
        Ok(Box::new(IndexPages(self.0.get_column_page_reader(column)?)))
    }

    fn get_column_bloom_filter(&self, column: usize) -> Option<&Sbbf> {
        self.0.get_column_bloom_filter(column)
    }

    fn get_row_iter(&self, projection: Option<Type>) -> Result<RowIter<'_>, ParquetError> {
        RowIter::from_row_group(projection, self)
    }
}

struct IndexPages(Box<dyn PageReader>);

impl Iterator for IndexPages {
    type Item = Result<Page, ParquetError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}

impl PageReader for IndexPages {
    fn get_next_page(&mut self) -> Result<Option<Page>, ParquetError> {
        let page = self.0.get_next_page()?;
        match page.as_ref().map(|page| page.num_values() as usize) {
            Some(values) if values > ROW_GROUP => Err(ParquetError::General(format!(
                "a page says that it has {values} values, {ROW_GROUP} at most are written"
            ))),
            _ => Ok(page),
        }
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>, ParquetError> {
        self.0.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<(), ParquetError> {
        self.0.skip_next_page()
    }

    fn at_record_boundary(&mut self) -> Result<bool, ParquetError> {
        self.0.at_record_boundary()
    }
}

/// Calls the Parquet library, which panics over some pages that nobody writes by mistake; the panic becomes an error.
pub(super) fn guarded<T>(read: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    let broken = || ParquetError::General("a page of it is none that can be decoded".to_owned());
    catch_unwind(AssertUnwindSafe(read)).unwrap_or_else(|_| Err(broken()))
}
