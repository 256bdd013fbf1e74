//! Numbers in binary files.

/// Kind of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ScalarKind {
    Signed,
    Unsigned,
    Float,
}

/// A number's kind and bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Scalar {
    pub(super) kind: ScalarKind,
    /// Bytes: 1, 2, 4 or 8; of a float 4 or 8.
    pub(super) size: usize,
}

impl Scalar {
    /// The number at the beginning of some bytes, at least as many as it has.
    pub(super) fn read(self, bytes: &[u8], is_big_endian: bool) -> f64 {
        let mut eight = [0; 8];
        for (index, byte) in bytes[..self.size].iter().enumerate() {
            eight[if is_big_endian { self.size - 1 - index } else { index }] = *byte;
        }
        let unsigned = u64::from_le_bytes(eight);
        let bits = 8 * self.size as u32;
        match (self.kind, self.size) {
            (ScalarKind::Float, 4) => f64::from(f32::from_bits(unsigned as u32)),
            (ScalarKind::Float, _) => f64::from_bits(unsigned),
            // The sign comes in from above.
            (ScalarKind::Signed, _) => ((unsigned << (64 - bits)) as i64 >> (64 - bits)) as f64,
            (ScalarKind::Unsigned, _) => unsigned as f64,
        }
    }
}
