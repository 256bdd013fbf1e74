//! Protobuf's wire format: fields of a message by number, without copies.
//!
//! Source: the encoding guide of Protocol Buffers. A field is a key (number and wire type as a variable-length integer) and its
//! value; lists of numbers are packed in one field or have one field per number.

use super::fault::Fault;

/// Value of a field.
#[derive(Clone, Copy, Debug)]
pub(super) enum Field<'a> {
    /// Wire type 0.
    Varint(u64),
    /// Wire type 5.
    Fixed32([u8; 4]),
    /// Wire type 1, which no supported field has.
    Fixed64,
    /// Wire type 2: text, bytes, a message or a packed list.
    Bytes(&'a [u8]),
}

/// Fields of a message, in the order of the file.
pub(super) struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    pub(super) fn of(message: &'a [u8]) -> Self {
        Self { rest: message }
    }

    /// The next field with its number; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<(u64, Field<'a>)>, Fault> {
        if self.rest.is_empty() {
            return Ok(None);
        }
        let key = self.varint()?;
        let field = match key & 7 {
            0 => Field::Varint(self.varint()?),
            1 => self.array::<8>().map(|_| Field::Fixed64)?,
            2 => {
                let length = self.varint()?;
                Field::Bytes(self.take(usize::try_from(length).map_err(|_| Fault::Cut)?)?)
            }
            5 => Field::Fixed32(self.array()?),
            kind => return Err(Fault::WireType(kind)),
        };
        Ok(Some((key >> 3, field)))
    }

    fn take(&mut self, length: usize) -> Result<&'a [u8], Fault> {
        let (part, rest) = self.rest.split_at_checked(length).ok_or(Fault::Cut)?;
        self.rest = rest;
        Ok(part)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        self.take(N)?.try_into().map_err(|_| Fault::Cut)
    }

    /// An integer of 7 bits per byte, the lowest first, at most 64 bits.
    fn varint(&mut self) -> Result<u64, Fault> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let [byte] = self.array()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err(Fault::Cut)
    }
}

impl<'a> Field<'a> {
    pub(super) fn bytes(self) -> Result<&'a [u8], Fault> {
        match self {
            Self::Bytes(bytes) => Ok(bytes),
            _ => Err(Fault::Kind),
        }
    }

    pub(super) fn text(self) -> Result<&'a str, Fault> {
        str::from_utf8(self.bytes()?).map_err(|_| Fault::Kind)
    }

    pub(super) fn integer(self) -> Result<i64, Fault> {
        match self {
            Self::Varint(value) => Ok(value as i64),
            _ => Err(Fault::Kind),
        }
    }

    pub(super) fn float(self) -> Result<f32, Fault> {
        match self {
            Self::Fixed32(bytes) => Ok(f32::from_le_bytes(bytes)),
            _ => Err(Fault::Kind),
        }
    }

    /// Appends the integers of a list field, packed or single, to a list of at most `most` entries.
    pub(super) fn push_integers(self, list: &mut Vec<i64>, most: usize) -> Result<(), Fault> {
        match self {
            Self::Varint(value) => push(list, value as i64, most),
            Self::Bytes(bytes) => {
                let mut packed = Fields { rest: bytes };
                while !packed.rest.is_empty() {
                    push(list, packed.varint()? as i64, most)?;
                }
                Ok(())
            }
            _ => Err(Fault::Kind),
        }
    }

    /// Appends the numbers of a list field, packed or single, to a list of at most `most` entries.
    pub(super) fn push_floats(self, list: &mut Vec<f32>, most: usize) -> Result<(), Fault> {
        match self {
            Self::Fixed32(bytes) => push(list, f32::from_le_bytes(bytes), most),
            Self::Bytes(bytes) => {
                let (numbers, []) = bytes.as_chunks::<4>() else { return Err(Fault::Cut) };
                numbers.iter().try_for_each(|bytes| push(list, f32::from_le_bytes(*bytes), most))
            }
            _ => Err(Fault::Kind),
        }
    }
}

/// Appends an entry to a list of at most `most` entries.
pub(super) fn push<T>(list: &mut Vec<T>, entry: T, most: usize) -> Result<(), Fault> {
    if list.len() == most {
        return Err(Fault::Long { most });
    }
    list.push(entry);
    Ok(())
}
