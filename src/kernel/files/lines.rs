//! Lines of a file, each up to a bound.

use std::{
    fs::File,
    io::{self, BufRead, BufReader, Read},
};

use super::{Bound, FileRefusal};

/// The lines of a file, without their ends. One longer than the bound ends them with an error.
#[derive(Debug)]
pub struct BoundedLines {
    file: BufReader<File>,
    bound: Bound,
}

impl BoundedLines {
    /// Lines of a file, from its current position.
    pub fn new(file: File, bound: Bound) -> Self {
        Self { file: BufReader::new(file), bound }
    }
}

impl Iterator for BoundedLines {
    type Item = io::Result<Vec<u8>>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut line = Vec::new();
        let limit = self.bound.bytes + 1;
        match (&mut self.file).take(limit).read_until(b'\n', &mut line) {
            Ok(0) => return None,
            Ok(_) => {}
            Err(error) => return Some(Err(error)),
        }
        if line.last() == Some(&b'\n') {
            line.pop();
        } else if line.len() as u64 == limit {
            return Some(Err(FileRefusal::TooLarge { size: limit, bound: self.bound }.into()));
        }
        Some(Ok(line))
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Seek, Write};

    use super::*;

    #[test]
    fn lines_end_at_their_bound() {
        let bound = Bound { kind: "a line", bytes: 4 };
        let lines = |text: &str| {
            let mut file = tempfile::tempfile().expect("a file");
            file.write_all(text.as_bytes()).expect("written");
            file.rewind().expect("rewound");
            BoundedLines::new(file, bound).collect::<io::Result<Vec<_>>>()
        };
        let texts = lines("1234\n\n5\n67").expect("lines");
        assert_eq!(texts, [&b"1234"[..], b"", b"5", b"67"]);
        assert_eq!(lines("").expect("none"), Vec::<Vec<u8>>::new());
        let error = lines("1\n12345\n").expect_err("a long line");
        assert!(FileRefusal::find_in(&error).is_some(), "{error}");
    }
}
