//! NPZ: NumPy's arrays in a ZIP archive, stored or deflated.
//!
//! ZIP by PKWARE's APPNOTE: the central directory at the end lists the name, method, sizes and offset of each member.

use std::{collections::BTreeMap, io::Read};

use flate2::read::DeflateDecoder;
use kernel::npy::NpyArray;

/// Maximum number of uncompressed bytes of all members: 64 samples of four arrays of 40^3 cells.
const MAX_UNPACKED: u64 = (1 << 26) + (1 << 20);
/// Maximum number of members.
const MAX_MEMBERS: usize = 16;
const END_OF_DIRECTORY: &[u8] = b"PK\x05\x06";
const ENTRY: &[u8] = b"PK\x01\x02";
const MEMBER: &[u8] = b"PK\x03\x04";

/// A single-precision array in C order.
pub(crate) struct Array {
    pub(crate) shape: Vec<usize>,
    pub(crate) values: Vec<f32>,
}

/// All arrays by name.
pub(crate) fn parse(bytes: &[u8]) -> Result<BTreeMap<String, Array>, &'static str> {
    let cut = "the archive is cut short";
    let u16_at = |at: usize| bytes.get(at..at + 2).map(|b| usize::from(u16::from_le_bytes([b[0], b[1]]))).ok_or(cut);
    let u32_at =
        |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize).ok_or(cut);
    let end = bytes.windows(4).rposition(|window| window == END_OF_DIRECTORY).ok_or("it is not a ZIP archive")?;
    let (count, mut at) = (u16_at(end + 10)?, u32_at(end + 16)?);
    if count > MAX_MEMBERS {
        return Err("it has more than 16 members");
    }
    let (mut arrays, mut left) = (BTreeMap::new(), MAX_UNPACKED);
    for _ in 0..count {
        if bytes.get(at..at.saturating_add(4)) != Some(ENTRY) {
            return Err("its directory is damaged");
        }
        let (method, packed, plain) = (u16_at(at + 10)?, u32_at(at + 20)?, u32_at(at + 24)?);
        let (name_length, extra, comment) = (u16_at(at + 28)?, u16_at(at + 30)?, u16_at(at + 32)?);
        let start = u32_at(at + 42)?;
        let name = bytes.get(at + 46..at + 46 + name_length).and_then(|name| str::from_utf8(name).ok()).ok_or(cut)?;
        if bytes.get(start..start.saturating_add(4)) != Some(MEMBER) {
            return Err("a member is not at the position in the directory");
        }
        let data = start + 30 + u16_at(start + 26)? + u16_at(start + 28)?;
        let packed = bytes.get(data..data.saturating_add(packed)).ok_or(cut)?;
        let name = name.strip_suffix(".npy").ok_or("a member is not an .npy file")?;
        if arrays.contains_key(name) {
            return Err("two members have the same name");
        }
        left = left.checked_sub(plain as u64).ok_or("its members are larger than 65 MiB together")?;
        arrays.insert(name.to_owned(), array_of(&unpack(method, packed, plain)?)?);
        at += 46 + name_length + extra + comment;
    }
    Ok(arrays)
}

fn unpack(method: usize, packed: &[u8], plain: usize) -> Result<Vec<u8>, &'static str> {
    match method {
        0 if packed.len() == plain => Ok(packed.to_vec()),
        0 => Err("a member is damaged"),
        8 => {
            let mut content = Vec::new();
            // One byte more than allowed, to detect a longer member.
            let read = DeflateDecoder::new(packed).take(plain as u64 + 1).read_to_end(&mut content);
            (read.is_ok() && content.len() == plain).then_some(content).ok_or("a member is damaged")
        }
        _ => Err("its compression method is not deflate"),
    }
}

fn array_of(content: &[u8]) -> Result<Array, &'static str> {
    let array = NpyArray::parse(content).map_err(|error| error.found())?;
    if array.kind != "<f4" {
        return Err("an array is not float32");
    }
    let values: Vec<f32> = array.data.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let count = array.shape.iter().try_fold(1_usize, |count, side| count.checked_mul(*side));
    if count != Some(values.len()) {
        return Err("the size of an array differs from its header");
    }
    Ok(Array { shape: array.shape, values })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// An archive with one member `a.npy` of two numbers, as `numpy.savez` or `numpy.savez_compressed` wrote it (NumPy 2.4).
    const STORED: &[u8] = include_bytes!("test_data/stored.npz");
    const DEFLATED: &[u8] = include_bytes!("test_data/deflated.npz");

    #[test]
    fn numpy_s_archives_are_read() {
        for bytes in [STORED, DEFLATED] {
            let arrays = parse(bytes).expect("an archive");
            let names: Vec<&String> = arrays.keys().collect();
            assert_eq!(names, ["a", "grid"]);
            assert_eq!((&arrays["a"].shape[..], &arrays["a"].values[..]), (&[2][..], &[1.5, -2.0][..]));
            let grid = &arrays["grid"];
            assert_eq!(grid.shape, [2, 3, 4]);
            assert_eq!(grid.values, (0..24).map(|value| value as f32).collect::<Vec<_>>());
        }
        assert!(parse(b"PK").is_err());
    }

    proptest! {
        #[test]
        fn damaged_archives_never_panic(
            is_stored in any::<bool>(),
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
            keep in any::<prop::sample::Index>(),
        ) {
            let mut bytes = if is_stored { STORED } else { DEFLATED }.to_vec();
            for (index, value) in changes {
                let index = index.index(bytes.len());
                bytes[index] = value;
            }
            let whole = parse(&bytes);
            prop_assert!(whole.is_ok_and(|arrays| arrays.len() <= 2) || parse(&bytes).is_err());
            bytes.truncate(keep.index(bytes.len()));
            prop_assert!(parse(&bytes).is_err() || bytes.len() >= 22);
        }
    }
}
