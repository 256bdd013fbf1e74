//! A line at the end of a JSON table that holds the digest of the rest: a reader detects any changed bit of the table.
//!
//! The seal is the table's last key, `"seal": "<64 hex digits>"`. Its digest is that of the file without that line and
//! without the comma before it. Tables written before there were seals have none.

use kernel::ids::Digest;

/// Between the other keys and the seal's digits.
const HEAD: &str = ",\n  \"seal\": \"";
/// After the digits.
const TAIL: &str = "\"\n}\n";
/// End of a table without a seal, as it is written.
const END: &str = "\n}\n";

/// A table, as pretty JSON with a line end, with its seal.
pub(crate) fn sealed(text: &str) -> String {
    let keys = text.strip_suffix(END).unwrap_or(text);
    format!("{keys}{HEAD}{}{TAIL}", Digest::hash(text.as_bytes()))
}

/// The table without its seal; `Err` describes what is wrong with it. A table without a seal is returned unchanged.
pub(crate) fn unsealed(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let split = bytes.strip_suffix(TAIL.as_bytes()).and_then(|rest| rest.split_last_chunk::<64>());
    let Some((keys, digits)) = split.and_then(|(keys, digits)| Some((keys.strip_suffix(HEAD.as_bytes())?, digits)))
    else {
        return Ok(bytes.to_vec());
    };
    let text = [keys, END.as_bytes()].concat();
    let calculated = Digest::hash(&text);
    if calculated.hex().as_bytes() != digits {
        let saved = String::from_utf8_lossy(&digits[..16]).into_owned();
        return Err(format!("it has changed: its seal has {saved}, calculated {}", calculated.short()));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seal_knows_every_bit_of_its_table() {
        let text = "{\n  \"a\": 1,\n  \"b\": [\n    2\n  ]\n}\n";
        let whole = sealed(text);
        assert_eq!(unsealed(whole.as_bytes()), Ok(text.as_bytes().to_vec()));
        assert!(serde_json::from_str::<serde_json::Value>(&whole).is_ok(), "{whole}");
        assert_eq!(unsealed(text.as_bytes()), Ok(text.as_bytes().to_vec()), "none is no fault");
        for bit in 0..8 * whole.len() {
            let mut bytes = whole.clone().into_bytes();
            bytes[bit / 8] ^= 1 << (bit % 8);
            // A damaged seal is a key that no table has.
            let seen = match unsealed(&bytes) {
                Err(_) => true,
                Ok(rest) => rest == bytes,
            };
            assert!(seen, "bit {bit}");
        }
    }
}
