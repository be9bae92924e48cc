//! The two sides of a game.

/// One side of a game, the index of pairs `[home, away]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Side {
    /// The team named first.
    Home,
    /// The team named second.
    Away,
}

impl Side {
    /// Both sides in the sequence of pairs.
    pub const BOTH: [Self; 2] = [Self::Home, Self::Away];

    /// The opponent's side.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Home => Self::Away,
            Self::Away => Self::Home,
        }
    }
}
