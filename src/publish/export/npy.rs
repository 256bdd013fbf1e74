//! NumPy's array file (NEP 1, "A Simple File Format for NumPy Arrays", version 1.0).

use std::{
    fs::File,
    io::{BufWriter, Write},
    path::PathBuf,
};

use serde_json::{Map, Value};

use super::{
    error::ExportError,
    form::{ExportForm, ExportFormat},
    pair::PairSample,
    pairs::{PairStream, WritePairs, write_pairs},
    target::Target,
};
use format::{Noun, Product};
use kernel::geom::OccupancyGrid;

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

/// `partial.npy` and `complete.npy`, with touch also `tactile.npy`, one row per sample: packed bits of shape
/// (samples, resolution^3 / 8), or bool of shape (samples, n, n, n).
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "npy",
    summary: "NumPy arrays and a table of samples.",
    has_unpacked: true,
    forms: &[ExportForm {
        product: Product::COMPLETION,
        counted: Noun { one: "sample", many: "samples" },
        keys: &[],
        layout: |unpacked| match unpacked {
            false => {
                "partial.npy, complete.npy, with touch tactile.npy (cells that any kind of touch met): uint8 (samples, n^3 / 8), in \
                 the order of samples.csv; numpy.unpackbits(rows, axis=1, bitorder='little')[:, :n**3].reshape(-1, n, n, n) \
                 is indexed [sample, x, y, z]"
            }
            true => {
                "partial.npy, complete.npy, with touch tactile.npy (cells that any kind of touch met): bool (samples, n, n, n), \
                 indexed [sample, x, y, z], in the order of samples.csv"
            }
        },
        write: |reader, selection, target| {
            write_pairs(reader, selection, target, |stream| PairArrays { stream, open: None, row: Vec::new() })
        },
    }],
};

/// The arrays while they are written; started with the first sample, which determines the resolution and whether there is touch.
struct PairArrays {
    stream: PairStream,
    open: Option<OpenArrays>,
    row: Vec<u8>,
}

/// Arrays with a written header.
struct OpenArrays {
    resolution: u32,
    files: Vec<(BufWriter<File>, PathBuf)>,
}

impl OpenArrays {
    fn create(first: &PairSample<'_>, stream: &PairStream, target: &mut Target) -> Result<Self, ExportError> {
        let resolution = first.pair.grid.resolution;
        let n = u64::from(resolution);
        let head = match stream.unpacked {
            false => head("|u1", &[stream.samples, OccupancyGrid::bytes_for(resolution) as u64]),
            true => head("|b1", &[stream.samples, n, n, n]),
        };
        let mut create = |(name, _): (&str, _)| {
            let (mut file, path) = target.open(&format!("{name}.npy"))?;
            file.write_all(&head).map_err(ExportError::io("writing", &path))?;
            Ok((file, path))
        };
        let files = first.grids().map(&mut create).collect::<Result<_, ExportError>>()?;
        Ok(Self { resolution, files })
    }
}

impl WritePairs for PairArrays {
    const FILE_PER_SAMPLE: bool = false;

    fn write(&mut self, sample: &PairSample<'_>, target: &mut Target) -> Result<(), ExportError> {
        let arrays = match &mut self.open {
            Some(arrays) => arrays,
            None => self.open.insert(OpenArrays::create(sample, &self.stream, target)?),
        };
        let (found, expected) = (sample.pair.grid.resolution, arrays.resolution);
        if found != expected {
            return Err(ExportError::OtherResolution { index: sample.index(), found, expected });
        }
        for ((file, path), (_, grid)) in arrays.files.iter_mut().zip(sample.grids()) {
            let bytes = if self.stream.unpacked {
                let cells = (expected as usize).pow(3);
                self.row.clear();
                self.row.extend((0..cells).map(|bit| grid.bytes()[bit / 8] >> (bit % 8) & 1));
                &self.row
            } else {
                grid.bytes()
            };
            file.write_all(bytes).map_err(ExportError::io("writing", path))?;
        }
        Ok(())
    }

    fn finish(self, _: &mut Target) -> Result<Map<String, Value>, ExportError> {
        for (mut file, path) in self.open.into_iter().flat_map(|arrays| arrays.files) {
            file.flush().map_err(ExportError::io("writing", &path))?;
        }
        Ok(Map::new())
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
