//! Numbers of the rounds of a tournament.

use serde::{Deserialize, Serialize};
use std::{fmt, num::NonZeroU32};

/// The number of a tournament round, 1 to [`RoundNumber::MAX`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct RoundNumber(NonZeroU32);

/// A round number out of range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected 1 to {max}, got {0}", max = RoundNumber::MAX)]
pub struct InvalidRoundNumber(u32);

impl RoundNumber {
    /// The highest number. It is bounded because standings list all rounds.
    pub const MAX: u32 = 100;
    pub const FIRST: Self = Self(NonZeroU32::MIN);
    pub const SECOND: Self = Self(NonZeroU32::MIN.saturating_add(1));

    /// The number, from 1.
    #[must_use]
    pub const fn get(self) -> u32 {
        self.0.get()
    }

    /// Index in lists of rounds, from 0.
    #[must_use]
    pub const fn index(self) -> usize {
        self.get() as usize - 1
    }
}

impl TryFrom<u32> for RoundNumber {
    type Error = InvalidRoundNumber;
    fn try_from(number: u32) -> Result<Self, InvalidRoundNumber> {
        NonZeroU32::new(number)
            .filter(|number| number.get() <= Self::MAX)
            .map(Self)
            .ok_or(InvalidRoundNumber(number))
    }
}

impl From<RoundNumber> for u32 {
    fn from(number: RoundNumber) -> Self {
        number.get()
    }
}

impl fmt::Display for RoundNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.get().fmt(f)
    }
}
