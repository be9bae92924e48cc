//! The behaviours that `faceoff new` offers for an agent.

use clap::ValueEnum;

/// Behaviour of a new agent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Example {
    /// Stops incoming pucks (task: defend)
    Defender,
    /// Shoots pucks at the goal (task: hit)
    Hitter,
}

impl Example {
    pub const fn task(self) -> &'static str {
        match self {
            Self::Defender => "defend",
            Self::Hitter => "hit",
        }
    }
}
