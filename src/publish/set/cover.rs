//! A picture from a file as the first one of a page.

use std::{
    io::{self, Cursor},
    path::Path,
};

use kernel::files::{self, Bound};

/// A picture to show first on the page of a set, with its caption.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cover {
    /// Text below the picture.
    pub caption: String,
    /// The file.
    png: Vec<u8>,
    /// Width and height [px].
    size: [u32; 2],
}

impl Cover {
    /// Reads a PNG file.
    ///
    /// # Errors
    /// When the file cannot be read, is larger than [`Bound::COVER`], or is not a PNG ([`io::ErrorKind::InvalidData`]).
    pub fn read(path: &Path, caption: String) -> io::Result<Self> {
        let png = files::read(path, Bound::COVER)?;
        let wrong = |error| io::Error::new(io::ErrorKind::InvalidData, error);
        let mut reader = png::Decoder::new(Cursor::new(&png)).read_info().map_err(wrong)?;
        let size = [reader.info().width, reader.info().height];
        // Every row, so that a damaged file is refused here.
        while reader.next_row().map_err(wrong)?.is_some() {}
        Ok(Self { caption, png, size })
    }

    pub(super) fn png(&self) -> &[u8] {
        &self.png
    }

    pub(super) fn size(&self) -> [u32; 2] {
        self.size
    }
}
