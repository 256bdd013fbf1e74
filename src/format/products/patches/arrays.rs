//! Arrays of patches on disk: depths, and zeros and ones.

use crate::codec::{RecordError, fields::ranged};

/// Depths [m] on disk, each positive or NaN.
pub(crate) fn depths(message: &'static str, field: &'static str, bytes: &[u8]) -> Result<Vec<f32>, RecordError> {
    let depths: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let wild = depths.iter().find(|depth| !(depth.is_nan() || **depth > 0.0 && depth.is_finite()));
    let value = f64::from(wild.copied().unwrap_or_default());
    ranged(message, field, value, wild.is_none(), "positive, or NaN for no return")?;
    Ok(depths)
}

/// Whether two depths are the same: bit for bit, or both without a return.
pub(crate) fn is_same_depth(one: f32, other: f32) -> bool {
    one.to_bits() == other.to_bits() || one.is_nan() && other.is_nan()
}

/// Zeros and ones on disk.
pub(crate) fn flags(message: &'static str, field: &'static str, bytes: &[u8]) -> Result<Vec<bool>, RecordError> {
    let other = bytes.iter().find(|byte| **byte > 1);
    ranged(message, field, f64::from(other.copied().unwrap_or_default()), other.is_none(), "0 or 1")?;
    Ok(bytes.iter().map(|byte| *byte == 1).collect())
}
