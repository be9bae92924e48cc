//! Interface of a policy, the part of an agent that chooses actions: task, observation, action and errors.

use crate::env::JOINTS;
pub use faceoff_agent::{Task, WrongLength};

/// Positions (radians), then velocities (rad/s), of the seven joints at the end of the control step: interpolation 3 of the protocol.
pub type Action = [[f64; JOINTS]; 2];

/// A policy: everything between an observation and an action.
pub trait Policy {
    /// Starts a new episode or rally.
    fn reset(&mut self);

    /// The action for an observation in the robot's base frame: 20 numbers, or 23 with an opponent on the table.
    ///
    /// # Errors
    /// If the observation has another length.
    fn act(&mut self, observation: &[f64]) -> Result<Action, WrongLength>;

    /// The policy's internal state as text, for development logs.
    fn describe(&self) -> String;
}
