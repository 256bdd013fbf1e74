//! Protobuf messages as trees without their schemas, and changes of one field that leave a well-formed message.

use graspmill::seed::Stream;

/// A field: its number and its value.
pub type Field = (u64, Value);

/// Value of a field, as the wire has it.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Number(u64),
    Eight([u8; 8]),
    Four([u8; 4]),
    Bytes(Vec<u8>),
    /// Bytes that are a message as well.
    Message(Vec<Field>),
}

/// Kinds of changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Change {
    /// A number becomes another one: 0, a neighbour, or the largest.
    Number,
    /// A double becomes NaN, infinite, negative, zero or huge.
    Double,
    /// Bytes lose or gain some at their end.
    Length,
    /// Numbers inside bytes become NaN or infinite, of four or eight bytes.
    NotFinite,
    /// Bits inside bytes flip.
    Bits,
    /// The field is not there.
    Missing,
    /// The field occurs twice.
    Twice,
}

/// Parses a message; `None` if the bytes are not a message.
pub fn parse(mut bytes: &[u8]) -> Option<Vec<Field>> {
    let mut fields = Vec::new();
    while !bytes.is_empty() {
        let key = take_number(&mut bytes)?;
        let value = match key & 7 {
            0 => Value::Number(take_number(&mut bytes)?),
            1 => Value::Eight(take(&mut bytes, 8)?.try_into().ok()?),
            5 => Value::Four(take(&mut bytes, 4)?.try_into().ok()?),
            2 => {
                let length = usize::try_from(take_number(&mut bytes)?).ok()?;
                let part = take(&mut bytes, length)?;
                // No field of ours has a number beyond 60: random bytes are rarely taken for messages.
                let inner =
                    parse(part).filter(|inner| !inner.is_empty() && inner.iter().all(|(number, _)| *number < 60));
                inner.map_or_else(|| Value::Bytes(part.to_vec()), Value::Message)
            }
            _ => return None,
        };
        if key >> 3 == 0 {
            return None;
        }
        fields.push((key >> 3, value));
    }
    Some(fields)
}

/// Writes a message.
pub fn encode(fields: &[Field]) -> Vec<u8> {
    let mut out = Vec::new();
    for (number, value) in fields {
        let mut key = |wire: u64| push_number(&mut out, number << 3 | wire);
        match value {
            Value::Number(value) => {
                key(0);
                push_number(&mut out, *value);
            }
            Value::Eight(bytes) => {
                key(1);
                out.extend(bytes);
            }
            Value::Four(bytes) => {
                key(5);
                out.extend(bytes);
            }
            Value::Bytes(bytes) => {
                key(2);
                push_number(&mut out, bytes.len() as u64);
                out.extend(bytes);
            }
            Value::Message(fields) => {
                key(2);
                let bytes = encode(fields);
                push_number(&mut out, bytes.len() as u64);
                out.extend(bytes);
            }
        }
    }
    out
}

/// Changes one field of a message that the stream draws; the message, the path of field numbers to it, and what was done.
pub fn change(bytes: &[u8], stream: &mut Stream) -> Option<(Vec<u8>, String, Change)> {
    let mut fields = parse(bytes).filter(|fields| !fields.is_empty())?;
    let mut path = Vec::new();
    let kind = change_one(&mut fields, &mut path, stream);
    let path: Vec<String> = path.iter().map(u64::to_string).collect();
    Some((encode(&fields), path.join("."), kind))
}

fn change_one(fields: &mut Vec<Field>, path: &mut Vec<u64>, stream: &mut Stream) -> Change {
    let place = pick(fields.len(), stream);
    path.push(fields[place].0);
    // Sometimes the whole field, else its content.
    match stream.below(8) {
        0 => {
            fields.remove(place);
            return Change::Missing;
        }
        1 => {
            let twin = fields[place].clone();
            fields.insert(place, twin);
            return Change::Twice;
        }
        _ => {}
    }
    let as_bytes = stream.below(4) == 0;
    let value = &mut fields[place].1;
    if let Value::Message(inner) = value {
        if !as_bytes {
            return change_one(inner, path, stream);
        }
        *value = Value::Bytes(encode(inner));
    }
    match value {
        Value::Number(number) => {
            let others = [0, number.wrapping_add(1), number.wrapping_sub(1), u64::from(u32::MAX), u64::MAX, 1 << 31];
            *number = others[pick(others.len(), stream)];
            Change::Number
        }
        Value::Eight(bytes) => {
            let double = f64::from_le_bytes(*bytes);
            let others = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -double, 0.0, 1e300];
            *bytes = others[pick(others.len(), stream)].to_le_bytes();
            Change::Double
        }
        Value::Four(bytes) => {
            *bytes = f32::NAN.to_le_bytes();
            Change::NotFinite
        }
        Value::Bytes(bytes) => change_bytes(bytes, stream),
        Value::Message(_) => unreachable!("it was taken as bytes"),
    }
}

fn change_bytes(bytes: &mut Vec<u8>, stream: &mut Stream) -> Change {
    let before = bytes.len();
    match stream.below(3) {
        0 => {
            match stream.below(5) {
                0 => bytes.truncate(before.saturating_sub(1)),
                1 => bytes.truncate(before / 2),
                2 => bytes.clear(),
                3 => bytes.push(0),
                _ => bytes.extend_from_within(..),
            }
            Change::Length
        }
        1 if before >= 8 => {
            let wide = stream.below(2) == 0;
            let width = if wide { 8 } else { 4 };
            let start = pick(before / width, stream) * width;
            let number = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][pick(3, stream)];
            match wide {
                true => bytes[start..start + 8].copy_from_slice(&number.to_le_bytes()),
                false => bytes[start..start + 4].copy_from_slice(&(number as f32).to_le_bytes()),
            }
            Change::NotFinite
        }
        _ => {
            for _ in 0..=stream.below(3) {
                if before > 0 {
                    bytes[pick(before, stream)] ^= 1 << stream.below(8);
                }
            }
            Change::Bits
        }
    }
}

/// A place below a count, which is not 0.
pub fn pick(count: usize, stream: &mut Stream) -> usize {
    stream.below(count as u64) as usize
}

fn take<'b>(bytes: &mut &'b [u8], count: usize) -> Option<&'b [u8]> {
    let (part, rest) = bytes.split_at_checked(count)?;
    *bytes = rest;
    Some(part)
}

fn take_number(bytes: &mut &[u8]) -> Option<u64> {
    let mut number = 0;
    for shift in (0..64).step_by(7) {
        let byte = *take(bytes, 1)?.first()?;
        number |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(number);
        }
    }
    None
}

fn push_number(out: &mut Vec<u8>, mut number: u64) {
    while number >= 0x80 {
        out.push(number as u8 | 0x80);
        number >>= 7;
    }
    out.push(number as u8);
}

#[test]
fn a_message_comes_back_and_each_change_changes_it() {
    let inner = vec![(1, Value::Number(300)), (2, Value::Eight(1.5f64.to_le_bytes()))];
    let fields = vec![(1, Value::Message(inner)), (7, Value::Bytes(vec![0xff; 24])), (9, Value::Number(0))];
    let bytes = encode(&fields);
    assert_eq!(parse(&bytes), Some(fields));
    let mut stream = Stream::of_job(1, b"", "changes");
    let changed = (0..200).filter(|_| change(&bytes, &mut stream).is_some_and(|(found, ..)| found != bytes)).count();
    // A zero that becomes zero changes nothing.
    assert!(changed > 180, "{changed}");
}
