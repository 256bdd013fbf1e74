//! Arrays as NumPy saves them (NEP 1): magic, version, length of the head, the head as a Python dictionary, the numbers.

use std::fmt;

/// An array in C order, its numbers as bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NpyArray<'a> {
    /// NumPy's name of the numbers' type, as `<f4`.
    pub kind: String,
    /// Sides, the slowest first.
    pub shape: Vec<usize>,
    /// The bytes after the header; the caller must check that their number matches the shape.
    pub data: &'a [u8],
}

/// Why bytes are no array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NpyError {
    /// The magic is missing.
    Magic,
    /// A version that NumPy had not in 2026.
    Version,
    /// The header is shorter than its stated length, or not text.
    Head,
    /// The array is stored column by column.
    FortranOrder,
    /// The head has no shape of whole numbers.
    Shape,
}

impl fmt::Display for NpyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.found())
    }
}

impl std::error::Error for NpyError {}

impl NpyError {
    /// Description of the fault.
    pub fn found(self) -> &'static str {
        match self {
            Self::Magic => "no NPY file",
            Self::Version => "an unknown version",
            Self::Head => "a head cut short",
            Self::FortranOrder => "an array in Fortran order",
            Self::Shape => "a head without a shape",
        }
    }
}

impl<'a> NpyArray<'a> {
    /// Reads the head.
    ///
    /// # Errors
    /// When the bytes are no array in C order.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, NpyError> {
        let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or(NpyError::Magic)?;
        let (length, start): (usize, usize) = match rest {
            [1, _, a, b, ..] => (usize::from(u16::from_le_bytes([*a, *b])), 4),
            [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, 6),
            _ => return Err(NpyError::Version),
        };
        let end = start.saturating_add(length);
        let head = rest.get(start..end).and_then(|head| str::from_utf8(head).ok()).ok_or(NpyError::Head)?;
        let after = |key: &str| {
            let at = head.find(&format!("'{key}'"))?;
            head[at + key.len() + 2..].trim_start().strip_prefix(':').map(str::trim_start)
        };
        if !after("fortran_order").is_some_and(|value| value.starts_with("False")) {
            return Err(NpyError::FortranOrder);
        }
        let shape = after("shape").and_then(|value| value.strip_prefix('(')?.split_once(')')).map(|(shape, _)| shape);
        let sides = shape.map(|shape| shape.split(',').map(str::trim).filter(|side| !side.is_empty()));
        let sides: Option<Vec<usize>> = sides.and_then(|sides| sides.map(|side| side.parse().ok()).collect());
        let kind = after("descr").map(|value| value.chars().skip(1).take(3).collect::<String>()).unwrap_or_default();
        Ok(Self { kind, shape: sides.ok_or(NpyError::Shape)?, data: &rest[end..] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes_of(head: &str) -> Vec<u8> {
        [b"\x93NUMPY\x01\x00", &(head.len() as u16).to_le_bytes()[..], head.as_bytes(), b"data"].concat()
    }

    #[test]
    fn heads_are_read_and_other_bytes_refused() {
        let bytes = bytes_of("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }\n");
        let array = NpyArray::parse(&bytes).expect("an array");
        assert_eq!((array.kind.as_str(), &array.shape[..], array.data), ("<f4", &[2, 3][..], &b"data"[..]));
        let scalar = bytes_of("{'descr': '<u2', 'fortran_order': False, 'shape': ()}");
        assert!(NpyArray::parse(&scalar).expect("a scalar").shape.is_empty());
        for (bytes, error) in [
            (b"text".to_vec(), NpyError::Magic),
            (b"\x93NUMPY\x09\x00\x00\x00".to_vec(), NpyError::Version),
            (bytes[..30].to_vec(), NpyError::Head),
            (bytes_of("{'descr': '<f4', 'fortran_order': True, 'shape': (2,)}"), NpyError::FortranOrder),
            (bytes_of("{'descr': '<f4', 'fortran_order': False, 'shape': (x,)}"), NpyError::Shape),
        ] {
            assert_eq!(NpyArray::parse(&bytes), Err(error));
            assert_eq!(error.to_string(), error.found());
        }
    }
}
