//! What is asked of an agent, and what it answers.

use crate::env::JOINTS;

/// Which behaviour is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Task {
    /// Score against a swinging opponent.
    Hit,
    /// Stop an incoming puck.
    Defend,
    /// Free the puck from the rim.
    Prepare,
    /// Play a whole game.
    Tournament,
}

/// Positions, then velocities, of the seven joints (the protocol's interpolation 3).
pub type Action = [[f64; JOINTS]; 2];

/// A policy: everything between an observation and an action.
pub trait Policy {
    /// Starts a new episode or rally.
    fn reset(&mut self);

    /// The action for an observation of 20 or 23 numbers (robot base frame).
    ///
    /// # Errors
    /// If the observation has another length.
    fn act(&mut self, observation: &[f64]) -> Result<Action, WrongLength>;

    /// What it is doing, for a log.
    fn describe(&self) -> String;
}

/// An observation of a length that the protocol does not know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WrongLength(pub usize);

impl std::fmt::Display for WrongLength {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "expected an observation of 20 or 23 numbers, got {}",
            self.0
        )
    }
}

impl std::error::Error for WrongLength {}
