//! LZF, the compression of binary PCD files (Lehmann, liblzf): literal runs and references to what came before.

/// The plain bytes; `None` if the stream does not hold exactly `length` of them.
pub(super) fn decompress(packed: &[u8], length: usize) -> Option<Vec<u8>> {
    let mut plain: Vec<u8> = Vec::new();
    // A byte of a stream gives at most 264 / 3 bytes: no length that is claimed is believed further.
    plain.try_reserve_exact(length.min(packed.len().saturating_mul(88))).ok()?;
    let mut rest = packed;
    while let [control, tail @ ..] = rest {
        let control = usize::from(*control);
        if control < 32 {
            // A run of literals.
            let (run, tail) = tail.split_at_checked(control + 1)?;
            plain.extend(run);
            rest = tail;
        } else {
            // A reference: its length above the offset's high bits, or 7 and more in a byte of its own.
            let (extra, tail) = if control >> 5 == 7 {
                tail.split_first().map(|(byte, tail)| (usize::from(*byte), tail))?
            } else {
                (0, tail)
            };
            let (low, tail) = tail.split_first()?;
            let from = plain.len().checked_sub(((control & 31) << 8 | usize::from(*low)) + 1)?;
            for index in from..from + (control >> 5) + extra + 2 {
                plain.push(plain[index]);
            }
            rest = tail;
        }
        if plain.len() > length {
            return None;
        }
    }
    (plain.len() == length).then_some(plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_references_unpack() {
        assert_eq!(decompress(&[2, b'a', b'b', b'c'], 3).as_deref(), Some(&b"abc"[..]));
        // "ab", then four bytes from two back: references overlap what they write.
        assert_eq!(decompress(&[1, b'a', b'b', 2 << 5, 1], 6).as_deref(), Some(&b"ababab"[..]));
        // A long reference: 7 + 3 + 2 bytes from one back.
        assert_eq!(decompress(&[0, b'x', 7 << 5, 3, 0], 13).as_deref(), Some(&[b'x'; 13][..]));
        for (packed, length) in
            [(&[5, b'a'][..], 6), (&[0, b'x', 1 << 5, 1], 4), (&[0, b'x'], 2), (&[1, b'x', b'y'], 1), (&[7 << 5], 9)]
        {
            assert_eq!(decompress(packed, length), None, "{packed:?}");
        }
    }
}
