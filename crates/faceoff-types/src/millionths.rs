//! Exact decimal numbers: at most six decimals, stored as a whole number of millionths.

use serde::{Deserialize, Serialize};
use std::fmt;

/// A number from 0 to 4294 with at most six decimals. It is stored exactly as written, so comparisons and sums
/// have no rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Millionths(u32);

/// A number out of range, or with more than six decimals.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("expected a number from 0 to 4294 with at most six decimals, got {0}")]
pub struct NotMillionths(pub f64);

const MILLIONTHS_PER_ONE: f64 = 1e6;

impl Millionths {
    /// 1.
    pub const ONE: Self = Self(1_000_000);

    /// From a count of millionths.
    #[must_use]
    pub const fn new(count: u32) -> Self {
        Self(count)
    }

    /// The number of millionths.
    #[must_use]
    pub const fn count(self) -> u32 {
        self.0
    }

    #[must_use]
    pub fn as_f64(self) -> f64 {
        f64::from(self.0) / MILLIONTHS_PER_ONE
    }
}

impl TryFrom<f64> for Millionths {
    type Error = NotMillionths;
    fn try_from(number: f64) -> Result<Self, NotMillionths> {
        let count = (number * MILLIONTHS_PER_ONE).round();
        // A number with six decimals equals `count / 1e6` to the last bit.
        if (0.0..=f64::from(u32::MAX)).contains(&count) && count / MILLIONTHS_PER_ONE == number {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a whole number within the bounds"
            )]
            Ok(Self(count as u32))
        } else {
            Err(NotMillionths(number))
        }
    }
}

impl From<Millionths> for f64 {
    fn from(number: Millionths) -> Self {
        number.as_f64()
    }
}

impl fmt::Display for Millionths {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.as_f64().fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_decimals_are_exact_and_more_are_refused() {
        for text in ["0", "0.4", "0.333333", "1.5", "4294.967295"] {
            let number: Millionths = serde_json::from_str(text).unwrap();
            assert_eq!(number.to_string(), text);
            let written = serde_json::to_string(&number).unwrap();
            assert_eq!(
                serde_json::from_str::<Millionths>(&written).unwrap(),
                number
            );
        }
        assert_eq!(Millionths::try_from(-0.0), Ok(Millionths::new(0)));
        for wrong in [
            -0.1,
            0.333_333_3,
            1.0 / 3.0,
            4295.0,
            f64::NAN,
            f64::INFINITY,
        ] {
            assert!(Millionths::try_from(wrong).is_err(), "{wrong}");
        }
    }
}
