use clap::ValueEnum;

/// What a new agent can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Example {
    /// Stops incoming pucks (task defend)
    Defender,
    /// Strikes pucks at the goal (task hit)
    Hitter,
}

impl Example {
    /// The task that it plays.
    pub const fn task(self) -> &'static str {
        match self {
            Self::Defender => "defend",
            Self::Hitter => "hit",
        }
    }
}
