//! Numbers as text: as many digits as bring the same 64-bit value back.

/// Numbers with spaces between them, as XML's attributes have them.
pub(super) fn spaced(numbers: &[f64]) -> String {
    let words: Vec<String> = numbers.iter().map(f64::to_string).collect();
    words.join(" ")
}

/// A number that came out of arithmetic on the model's, without the last digits' noise: rounded to 1e-12.
pub(super) fn tidy(number: f64) -> f64 {
    // The sum makes a zero of a negative zero.
    (number * 1e12).round() / 1e12 + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_as_they_were() {
        for number in [-2.897243e-7, 85.0_f64.to_radians(), 1e4, 0.0] {
            assert_eq!(spaced(&[number]).parse(), Ok(number));
        }
        assert_eq!(spaced(&[1.0, -0.5]), "1 -0.5");
        assert_eq!(spaced(&[tidy(0.974 + 0.045), tidy(-0.0)]), "1.019 0");
    }
}
