//! Grasp types: numbers of eight digits.

/// Digits of a grasp type: spread, three proximal joints, three distal ones, and the roll of the wrist.
pub const TYPE_DIGITS: usize = 8;

/// Values of each digit.
pub const TYPE_BINS: u32 = 5;

/// The digits of a type, the first one lowest.
pub fn type_digits(kind: u32) -> [u32; TYPE_DIGITS] {
    std::array::from_fn(|place| kind / TYPE_BINS.pow(place as u32) % TYPE_BINS)
}
