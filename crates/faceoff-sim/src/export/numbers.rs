//! Numbers as text, with enough digits to parse to the same 64-bit value.

/// Numbers separated by spaces, for XML attributes.
pub(super) fn spaced(numbers: &[f64]) -> String {
    let texts: Vec<String> = numbers.iter().map(f64::to_string).collect();
    texts.join(" ")
}

/// Removes rounding noise of arithmetic: rounds to 1e-12.
pub(super) fn tidy(number: f64) -> f64 {
    // The sum turns −0 into 0.
    (number * 1e12).round() / 1e12 + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_numbers_parse_to_the_same_bits() {
        for number in [-2.897243e-7, 85.0_f64.to_radians(), 1e4, 0.0] {
            assert_eq!(spaced(&[number]).parse(), Ok(number));
        }
        assert_eq!(spaced(&[1.0, -0.5]), "1 -0.5");
        assert_eq!(spaced(&[tidy(0.974 + 0.045), tidy(-0.0)]), "1.019 0");
    }
}
