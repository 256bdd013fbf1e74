//! binvox files (Patrick Min's format, version 1): a text header, then runs of (value, count) bytes over the cells with x
//! slowest, then z, and y fastest. The lower corner of cell (i, j, k) is translate + scale * (i, j, k) / dim.

use nalgebra::Point3;

use crate::geom::{OccupancyGrid, SolidGrid};

/// Most cells along an axis that are read.
const MAX_SIDE: u32 = 1024;

/// A grid and where it lies.
#[derive(Clone, Debug, PartialEq)]
pub struct Binvox {
    /// The occupied cells.
    pub grid: OccupancyGrid,
    /// Lower corner of the grid, in the unit of the program that wrote the file (ours: metres).
    pub translate: [f64; 3],
    /// Length of the grid's side in that unit.
    pub scale: f64,
}

/// Why bytes are no binvox file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidBinvox {
    /// The first line is not `#binvox 1`.
    #[error("not a binvox file: it starts with '{found}' instead of '#binvox 1'")]
    Magic {
        /// The first line, at most 40 characters.
        found: String,
    },
    /// A header line is not understood, or comes twice.
    #[error("header line {line}, '{text}': {expected}")]
    Header {
        /// Number of the line, from 1.
        line: usize,
        /// The line, at most 40 characters.
        text: String,
        /// Expected text.
        expected: &'static str,
    },
    /// The header ends without one of its lines.
    #[error("the header has no '{0}' line; write the file again")]
    Missing(&'static str),
    /// Only cubes are read.
    #[error("dim {} x {} x {}: must be a cube of 1 to {MAX_SIDE} cells per side; run binvox with -d", .0[0], .0[1], .0[2])]
    Dim([u64; 3]),
    /// A run's value is neither 0 nor 1.
    #[error("byte {offset}: value {value} is neither 0 nor 1; the file is damaged")]
    Value {
        /// Offset in the file.
        offset: usize,
        /// The value.
        value: u8,
    },
    /// A run without cells.
    #[error("byte {offset}: a run of 0 cells; the file is damaged")]
    EmptyRun {
        /// Offset in the file.
        offset: usize,
    },
    /// The runs hold more or fewer cells than the header gives.
    #[error("the runs hold {found} cells, dim gives {expected}; the file is {}", if found < expected { "cut short: copy it again" } else { "damaged" })]
    Cells {
        /// Cells in the runs; of a file with too many, up to the run that goes too far.
        found: u64,
        /// Cells in the header.
        expected: u64,
    },
    /// The last run lacks its count, or bytes follow the last run.
    #[error("{extra} bytes after the last run, at byte {offset}; the file is damaged")]
    Trailing {
        /// Offset in the file.
        offset: usize,
        /// Bytes left.
        extra: usize,
    },
}

impl Binvox {
    /// The file's bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let n = self.grid.resolution();
        encode(n as usize, self.translate, self.scale, |x, y, z| self.grid.get([x as u32, y as u32, z as u32]))
    }

    /// Reads a file.
    ///
    /// # Errors If anything differs from the format; nothing is guessed.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, InvalidBinvox> {
        let (Header { side, translate, scale }, start) = read_header(bytes)?;
        let expected = u64::from(side).pow(3);
        let mut grid = OccupancyGrid::new(side);
        let mut cells = 0;
        let (runs, rest) = bytes[start..].as_chunks::<2>();
        for (run, [value, count]) in runs.iter().enumerate() {
            let offset = start + 2 * run;
            if cells == expected {
                return Err(InvalidBinvox::Trailing { offset, extra: bytes.len() - offset });
            }
            let end = cells + u64::from(*count);
            match (*value, *count) {
                (_, 0) => return Err(InvalidBinvox::EmptyRun { offset }),
                _ if end > expected => return Err(InvalidBinvox::Cells { found: end, expected }),
                (0, _) => {}
                (1, _) => (cells..end).for_each(|cell| {
                    let (x, z, y) = (cell as u32 / side / side, cell as u32 / side % side, cell as u32 % side);
                    grid.set([x, y, z]);
                }),
                (value, _) => return Err(InvalidBinvox::Value { offset, value }),
            }
            cells = end;
        }
        match rest.len() {
            _ if cells < expected => Err(InvalidBinvox::Cells { found: cells, expected }),
            0 => Ok(Self { grid, translate, scale }),
            extra => Err(InvalidBinvox::Trailing { offset: bytes.len() - extra, extra }),
        }
    }

    /// Converts to a solid grid; `None` unless it has 256 cells per side.
    pub fn to_solid(&self) -> Option<SolidGrid> {
        if self.grid.resolution() as usize != SolidGrid::SIDE {
            return None;
        }
        let mut solid = SolidGrid::new(Point3::from(self.translate), self.scale);
        // Both hold z fastest, then y, then x, lowest bit first.
        let (words, _) = self.grid.bytes().as_chunks::<8>();
        solid.words = words.iter().map(|word| u64::from_le_bytes(*word)).collect();
        Some(solid)
    }
}

/// A solid grid as a binvox file, in metres.
pub fn solid_to_binvox(grid: &SolidGrid) -> Vec<u8> {
    let scale = grid.pitch * SolidGrid::SIDE as f64;
    encode(SolidGrid::SIDE, grid.origin.into(), scale, |x, y, z| grid.get(x, y, z))
}

fn encode(side: usize, translate: [f64; 3], scale: f64, cell: impl Fn(usize, usize, usize) -> bool) -> Vec<u8> {
    let [x, y, z] = translate;
    let header = format!("#binvox 1\ndim {side} {side} {side}\ntranslate {x} {y} {z}\nscale {scale}\ndata\n");
    let mut bytes = header.into_bytes();
    let mut run = [u8::from(cell(0, 0, 0)), 0];
    for x in 0..side {
        for z in 0..side {
            for y in 0..side {
                let value = u8::from(cell(x, y, z));
                if value != run[0] || run[1] == u8::MAX {
                    bytes.extend(run);
                    run = [value, 0];
                }
                run[1] += 1;
            }
        }
    }
    bytes.extend(run);
    bytes
}

struct Header {
    side: u32,
    translate: [f64; 3],
    scale: f64,
}

/// The header and where the runs start.
fn read_header(bytes: &[u8]) -> Result<(Header, usize), InvalidBinvox> {
    let (mut dim, mut translate, mut scale) = (None, None, None);
    let (mut start, mut line) = (0, 0);
    loop {
        // A header line is short: what is longer is not text.
        let length = bytes[start..].iter().take(200).position(|byte| *byte == b'\n');
        let text = String::from_utf8_lossy(&bytes[start..start + length.unwrap_or((bytes.len() - start).min(200))]);
        let text = text.trim_end_matches('\r');
        line += 1;
        let short = || text.chars().take(40).collect::<String>();
        let wrong = |expected| InvalidBinvox::Header { line, text: short(), expected };
        let (key, values) = text.split_once(' ').unwrap_or((text, ""));
        if line == 1 && (key, values.trim()) != ("#binvox", "1") {
            return Err(InvalidBinvox::Magic { found: short() });
        }
        start += length.ok_or_else(|| wrong("the file ends inside its header; copy it again"))? + 1;
        match key {
            "#binvox" if line == 1 => {}
            "dim" if dim.is_none() => {
                dim = Some(numbers::<3, u64>(values).ok_or_else(|| wrong("three whole numbers required"))?)
            }
            "translate" if translate.is_none() => {
                let given = numbers::<3, f64>(values).filter(|values| values.iter().all(|value| value.is_finite()));
                translate = Some(given.ok_or_else(|| wrong("three finite numbers required"))?);
            }
            "scale" if scale.is_none() => {
                let given = numbers::<1, f64>(values).filter(|[value]| value.is_finite() && *value > 0.0);
                scale = Some(given.ok_or_else(|| wrong("one finite number above 0 required"))?[0]);
            }
            "data" => break,
            _ => return Err(wrong("must be one of dim, translate, scale, data, each once")),
        }
    }
    let dim = dim.ok_or(InvalidBinvox::Missing("dim"))?;
    if dim[0] != dim[1] || dim[0] != dim[2] || !(1..=u64::from(MAX_SIDE)).contains(&dim[0]) {
        return Err(InvalidBinvox::Dim(dim));
    }
    let translate = translate.ok_or(InvalidBinvox::Missing("translate"))?;
    let scale = scale.ok_or(InvalidBinvox::Missing("scale"))?;
    Ok((Header { side: dim[0] as u32, translate, scale }, start))
}

fn numbers<const N: usize, T: std::str::FromStr>(text: &str) -> Option<[T; N]> {
    let numbers: Option<Vec<T>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
    numbers?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Binvox {
        let mut grid = OccupancyGrid::new(12);
        for cell in [[0, 0, 0], [0, 1, 0], [3, 7, 11], [11, 11, 11]] {
            grid.set(cell);
        }
        Binvox { grid, translate: [-0.1, 1e-9, 2.5], scale: 0.1 + 0.2 }
    }

    #[test]
    fn written_by_hand() {
        let mut grid = OccupancyGrid::new(2);
        grid.set([0, 1, 0]);
        grid.set([1, 0, 1]);
        let file = Binvox { grid, translate: [0.0, -0.5, 1.0], scale: 2.0 };
        // y fastest, then z: 0 1 0 0 | 0 0 1 0.
        let mut expected = b"#binvox 1\ndim 2 2 2\ntranslate 0 -0.5 1\nscale 2\ndata\n".to_vec();
        expected.extend([0, 1, 1, 1, 0, 4, 1, 1, 0, 1]);
        assert_eq!(file.to_bytes(), expected);
    }

    #[test]
    fn round_trip() {
        assert_eq!(Binvox::from_bytes(&sample().to_bytes()), Ok(sample()));
        let mut solid = SolidGrid::new(Point3::new(0.5, 0.25, -3.0), 0.3);
        solid.words[4 * 256 * 7 + 5] = 0b1011 << 30;
        let read = Binvox::from_bytes(&solid_to_binvox(&solid)).unwrap().to_solid().unwrap();
        assert_eq!(read, solid);
        assert_eq!(sample().to_solid(), None);
    }

    #[test]
    fn damage_is_told() {
        let good = sample().to_bytes();
        let start = good.windows(5).position(|window| window == b"data\n").unwrap() + 5;
        let broken = |change: &dyn Fn(&mut Vec<u8>)| {
            let mut bytes = good.clone();
            change(&mut bytes);
            Binvox::from_bytes(&bytes).unwrap_err()
        };
        let text = |from: &str, to: &str| {
            let header = String::from_utf8(good[..start].to_vec()).unwrap().replace(from, to);
            Binvox::from_bytes(&[header.as_bytes(), &good[start..]].concat()).unwrap_err().to_string()
        };
        assert_eq!(Binvox::from_bytes(b"").unwrap_err(), InvalidBinvox::Magic { found: String::new() });
        assert!(matches!(Binvox::from_bytes(&[0xff; 300]).unwrap_err(), InvalidBinvox::Magic { .. }));
        assert!(text("#binvox 1", "#binvox 2").contains("'#binvox 2'"));
        assert!(text("dim 12 12 12", "dim 12 12").contains("header line 2, 'dim 12 12': three whole numbers"));
        assert!(text("dim 12 12 12", "dim 12 12 13").contains("12 x 12 x 13"));
        assert!(text("dim 12 12 12", "dim 9999 9999 9999").contains("1 to 1024"));
        assert!(text("dim 12 12 12", "dim 13 13 13").contains("hold 1728 cells, dim gives 2197"));
        assert!(text("dim 12 12 12", "dim 11 11 11").contains("dim gives 1331; the file is damaged"));
        assert!(text("scale 0.30000000000000004", "scale -1").contains("above 0"));
        assert!(text("translate -0.1 0.000000001 2.5\n", "").contains("no 'translate' line"));
        assert!(text("dim 12 12 12", "dim 12 12 12\ndim 12 12 12").contains("line 3"));
        assert_eq!(broken(&|bytes| bytes[start] = 7), InvalidBinvox::Value { offset: start, value: 7 });
        assert_eq!(broken(&|bytes| bytes[start + 1] = 0), InvalidBinvox::EmptyRun { offset: start });
        assert_eq!(
            broken(&|bytes| bytes.truncate(bytes.len() - 2)),
            InvalidBinvox::Cells { found: 1727, expected: 1728 }
        );
        assert_eq!(broken(&|bytes| bytes.push(1)), InvalidBinvox::Trailing { offset: good.len(), extra: 1 });
        assert_eq!(broken(&|bytes| bytes.extend([1, 5, 9])), InvalidBinvox::Trailing { offset: good.len(), extra: 3 });
        for length in 0..good.len() {
            assert!(Binvox::from_bytes(&good[..length]).is_err(), "cut to {length} bytes");
        }
    }
}
