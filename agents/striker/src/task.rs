//! Interface of a policy: task, action and errors.

use crate::env::JOINTS;
pub use faceoff_agent::{Task, WrongLength};

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

    /// The policy's internal state as text, for development logs.
    fn describe(&self) -> String;
}
