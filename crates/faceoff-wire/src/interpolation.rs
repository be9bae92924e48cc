use crate::{JOINTS, SUBSTEPS};
use serde::{Deserialize, Serialize};
use std::fmt;

/// How an agent's actions become a trajectory, as the protocol writes it: 1, 2, 3, 4, 5, −1 or
/// null.
///
/// | code | shape of an action | meaning |
/// |---|---|---|
/// | 1 | `[7]` | position, linear |
/// | 2 | `[7]` | position, quadratic |
/// | 3 | `[2][7]` | position and velocity, cubic |
/// | 4 | `[2][7]` | position and velocity, quartic |
/// | 5 | `[3][7]` | position, velocity and acceleration, quintic |
/// | −1 | `[2][7]` | position and velocity, each linear |
/// | null | `[20][3][7]` | position, velocity and acceleration at each substep |
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "Option<i64>", into = "Option<i64>")]
pub struct InterpolationCode(Option<i8>);

/// A number that is no interpolation of the protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("unknown interpolation {0}: expected 1, 2, 3, 4, 5, -1 or null")]
pub struct UnknownInterpolation(pub i64);

impl InterpolationCode {
    /// The interpolation of a code; `None` is the protocol's null.
    ///
    /// # Errors
    /// The number is none of the protocol's.
    pub fn new(code: Option<i64>) -> Result<Self, UnknownInterpolation> {
        match code {
            None => Ok(Self(None)),
            Some(code) => match i8::try_from(code) {
                Ok(small @ (-1 | 1..=5)) => Ok(Self(Some(small))),
                _ => Err(UnknownInterpolation(code)),
            },
        }
    }

    /// The code; `None` is the protocol's null.
    #[must_use]
    pub fn code(self) -> Option<i64> {
        self.0.map(i64::from)
    }

    /// Lengths of an action's nested arrays, outermost first.
    #[must_use]
    pub const fn shape(self) -> &'static [usize] {
        match self.0 {
            Some(1 | 2) => &[JOINTS],
            Some(5) => &[3, JOINTS],
            Some(_) => &[2, JOINTS],
            None => &[SUBSTEPS, 3, JOINTS],
        }
    }

    /// How many numbers an action holds.
    #[must_use]
    pub fn action_len(self) -> usize {
        self.shape().iter().product()
    }
}

impl TryFrom<Option<i64>> for InterpolationCode {
    type Error = UnknownInterpolation;
    fn try_from(code: Option<i64>) -> Result<Self, Self::Error> {
        Self::new(code)
    }
}

impl From<InterpolationCode> for Option<i64> {
    fn from(code: InterpolationCode) -> Self {
        code.code()
    }
}

impl fmt::Display for InterpolationCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(code) => code.fmt(f),
            None => f.write_str("null"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_protocol_knows_seven_interpolations() {
        let known: Vec<i64> = (-300..300)
            .filter(|code| InterpolationCode::new(Some(*code)).is_ok())
            .collect();
        assert_eq!(known, [-1, 1, 2, 3, 4, 5]);
        assert_eq!(
            InterpolationCode::new(Some(i64::MAX)),
            Err(UnknownInterpolation(i64::MAX))
        );
    }

    #[test]
    fn shapes_are_those_of_the_protocol() {
        let len = |code| InterpolationCode::new(code).map(InterpolationCode::action_len);
        assert_eq!(
            [1, 2, 3, 4, 5, -1].map(|code| len(Some(code))),
            [7, 7, 14, 14, 21, 14].map(Ok)
        );
        assert_eq!(len(None), Ok(420));
    }

    #[test]
    fn null_is_a_code_in_json() {
        let null: InterpolationCode = serde_json::from_str("null").unwrap();
        assert_eq!(null.code(), None);
        assert_eq!(serde_json::to_string(&null).unwrap(), "null");
        assert!(serde_json::from_str::<InterpolationCode>("6").is_err());
    }
}
