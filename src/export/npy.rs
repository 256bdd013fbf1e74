//! NumPy's array file (NEP 1, "A Simple File Format for NumPy Arrays", version 1.0).

use std::{
    fs::File,
    io::{BufWriter, Write},
    path::PathBuf,
};

use super::{ExportError, target::Target};
use crate::{geom::OccupancyGrid, ids::SampleIndex, record::VoxelPair};

/// The head of an array file: magic, version, and a Python literal padded so that data begins at a multiple of 64.
pub(super) fn head(kind: &str, shape: &[u64]) -> Vec<u8> {
    let sides: String = shape.iter().map(|side| format!("{side}, ")).collect();
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}), }}", sides.trim_end());
    let before = 6 + 2 + 2;
    let whole = (before + text.len() + 1).next_multiple_of(64);
    text.extend(std::iter::repeat_n(' ', whole - before - text.len() - 1));
    text.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

/// `partial.npy` and `complete.npy`, and `tactile.npy` of touch, while they grow.
pub(super) struct PairArrays {
    resolution: u32,
    packed: bool,
    files: Vec<(BufWriter<File>, PathBuf)>,
    row: Vec<u8>,
}

impl PairArrays {
    pub fn create(
        target: &mut Target,
        samples: u64,
        resolution: u32,
        packed: bool,
        touched: bool,
    ) -> Result<Self, ExportError> {
        let n = u64::from(resolution);
        let head = match packed {
            true => head("|u1", &[samples, OccupancyGrid::bytes_for(resolution) as u64]),
            false => head("|b1", &[samples, n, n, n]),
        };
        let mut begun = |name: &str| {
            let (mut file, path) = target.open(name)?;
            file.write_all(&head).map_err(ExportError::io("writing", &path))?;
            Ok::<_, ExportError>((file, path))
        };
        let mut files = vec![begun("partial.npy")?, begun("complete.npy")?];
        if touched {
            files.push(begun("tactile.npy")?);
        }
        Ok(Self { resolution, packed, files, row: Vec::new() })
    }

    /// Adds a sample; `tactile` where the arrays were begun with touch.
    pub fn push(
        &mut self,
        index: SampleIndex,
        pair: &VoxelPair,
        tactile: Option<&OccupancyGrid>,
    ) -> Result<(), ExportError> {
        let (found, expected) = (pair.grid.resolution, self.resolution);
        if found != expected {
            return Err(ExportError::OtherResolution { index, found, expected });
        }
        for ((file, path), grid) in
            self.files.iter_mut().zip([&pair.partial, &pair.complete].into_iter().chain(tactile))
        {
            let bytes = if self.packed {
                grid.bytes()
            } else {
                let cells = (expected as usize).pow(3);
                self.row.clear();
                self.row.extend((0..cells).map(|bit| grid.bytes()[bit / 8] >> (bit % 8) & 1));
                &self.row
            };
            file.write_all(bytes).map_err(ExportError::io("writing", path))?;
        }
        Ok(())
    }

    pub fn finish(self) -> Result<(), ExportError> {
        for (mut file, path) in self.files {
            file.flush().map_err(ExportError::io("writing", &path))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_is_what_the_format_says() {
        for shape in [vec![3, 8000], vec![441_408, 40, 40, 40], vec![1]] {
            let head = head("|u1", &shape);
            assert_eq!(head.len() % 64, 0);
            assert_eq!(&head[..8], b"\x93NUMPY\x01\x00");
            assert_eq!(usize::from(u16::from_le_bytes([head[8], head[9]])), head.len() - 10);
            assert_eq!(head.last(), Some(&b'\n'));
        }
        // A tuple of one needs its comma.
        assert!(String::from_utf8_lossy(&head("|u1", &[1])).contains("'shape': (1,), }"));
    }
}
