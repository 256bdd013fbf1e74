//! NumPy's archive of arrays, as `numpy.savez_compressed` writes it: a ZIP file of array files (APPNOTE 6.3, section 4.3), the same
//! bytes for the same arrays.

use std::io::Write;

use flate2::{Compression, write::DeflateEncoder};

use super::npy::head;

/// Arrays by name, packed.
#[derive(Default)]
pub(super) struct Npz {
    file: Vec<u8>,
    /// Entries of the directory at the end.
    directory: Vec<u8>,
    entries: u16,
}

/// Version 2.0 of the format, in which entries are deflated.
const VERSION: u16 = 20;

/// Compression method of the entries: deflate.
const DEFLATED: u16 = 8;

/// The first date of the format, 1 January 1980, at midnight, so that archives do not depend on the time of writing.
const TIME_AND_DATE: [u16; 2] = [0, 1 << 5 | 1];

impl Npz {
    /// Adds an array of this kind and shape, from its numbers in row-major order, little-endian.
    pub fn add(&mut self, name: &str, kind: &str, shape: &[u64], data: &[u8]) {
        let mut array = head(kind, shape);
        array.extend_from_slice(data);
        let mut packer = DeflateEncoder::new(Vec::new(), Compression::new(6));
        let packed = packer.write_all(&array).and_then(|()| packer.finish()).expect("memory takes every byte");
        let name = format!("{name}.npy");
        // Fields that the entry and the directory share: compression, time, checksum, sizes, lengths of name and extra field.
        let mut facts = Vec::new();
        for number in [VERSION, 0, DEFLATED].into_iter().chain(TIME_AND_DATE) {
            facts.extend(number.to_le_bytes());
        }
        for number in [crc32fast::hash(&array), packed.len() as u32, array.len() as u32] {
            facts.extend(number.to_le_bytes());
        }
        facts.extend([name.len() as u16, 0].into_iter().flat_map(u16::to_le_bytes));
        let start = self.file.len() as u32;
        self.directory.extend(b"PK\x01\x02");
        self.directory.extend(VERSION.to_le_bytes());
        self.directory.extend(&facts);
        // No comment, on the first disk, no attributes.
        self.directory.extend([0; 10]);
        self.directory.extend(start.to_le_bytes());
        self.directory.extend(name.as_bytes());
        self.file.extend(b"PK\x03\x04");
        self.file.extend(&facts);
        self.file.extend(name.as_bytes());
        self.file.extend(&packed);
        self.entries += 1;
    }

    /// The archive; arrays and archive are below 4 GiB.
    pub fn finish(self) -> Vec<u8> {
        let Self { mut file, directory, entries } = self;
        let start = file.len() as u32;
        file.extend(&directory);
        file.extend(b"PK\x05\x06\0\0\0\0");
        file.extend([entries, entries].into_iter().flat_map(u16::to_le_bytes));
        file.extend([directory.len() as u32, start].into_iter().flat_map(u32::to_le_bytes));
        file.extend([0; 2]);
        file
    }
}
