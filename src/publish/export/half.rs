//! Numbers in half precision.

/// Bits of the half-precision number (IEEE 754 binary16) nearest to a length from 0 to below 65,504, ties to even.
pub(super) fn half_precision(value: f64) -> u16 {
    if value < 2f64.powi(-14) {
        // Below the smallest normal number steps are 2^-24.
        return (value * 2f64.powi(24)).round_ties_even() as u16;
    }
    let exponent = (value.to_bits() >> 52) as i32 - 1023;
    // 1.0 to 2.0 in steps of 2^-10; rounding up to 2.0 carries into the exponent.
    let steps = (value / 2f64.powi(exponent - 10)).round_ties_even() as u16 - 1024;
    ((exponent + 15) as u16) * 1024 + steps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_those_of_the_standard() {
        // By numpy.float16(value).view(numpy.uint16).
        for (value, bits) in [
            (0.0, 0x0000),
            (6e-8, 0x0001),
            (1e-5, 0x00a8),
            (0.003_75, 0x1bae),
            (0.15, 0x30cd),
            (0.299_9, 0x34cc),
            (0.999_9, 0x3c00),
            (1.0, 0x3c00),
            (1.5, 0x3e00),
            (10.1, 0x490d),
        ] {
            assert_eq!(half_precision(value), bits, "{value}");
        }
    }
}
