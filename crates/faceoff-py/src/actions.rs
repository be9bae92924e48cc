//! Converts actions, the numbers that a Python program passes to an environment, to commands: joint positions, velocities
//! and accelerations for one control step of 20 ms, as an agent sends them to the server.

use crate::errors::argument_error;
use faceoff_sim::{
    Interpolation, JOINTS, SUBSTEPS,
    model::{CONTROL_STEP_S, INITIAL_Q, LIMIT_FRACTION, LINKS},
};
use faceoff_types::ACTION_LIMIT;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

/// Acceleration limits of the robot's model are this many times the velocity limits, 1/s.
const ACCELERATION_PER_VELOCITY: f64 = 10.0;

/// Meaning of the numbers of an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ActionMode {
    /// Fractions in [−1, 1]. A position is a change from the last commanded one, where 1 is the change at 95 % of
    /// the joint's velocity limit. Velocities are relative to 95 % of their limit, accelerations to their limit.
    /// Positions stay within 95 % of the joint's range.
    Delta,
    /// Fractions in [−1, 1]. A position of 0 is the start pose, ±1 is 95 % of the joint's range; velocities and
    /// accelerations as for `Delta`.
    Absolute,
    /// rad, rad/s and rad/s², as agents send them to the server.
    Raw,
}

/// Format of the actions of a Gymnasium environment, which [`ActionFormat::command`] converts to those of an agent. The interpolation (the
/// rule by which an action becomes a trajectory of 20 ms) decides the layout of both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActionFormat {
    pub mode: ActionMode,
    pub interpolation: Interpolation,
    /// Clip numbers to their bounds.
    pub clip: bool,
}

/// Meaning of a row of an action: seven numbers, one for each joint.
#[derive(Clone, Copy)]
enum Quantity {
    /// Position after this fraction of the control step.
    Position(f64),
    Velocity,
    Acceleration,
}

impl ActionFormat {
    /// Count of numbers in an action.
    pub fn len(&self) -> usize {
        self.interpolation.len()
    }

    /// The largest magnitude of a number.
    pub fn limit(&self) -> f64 {
        match self.mode {
            ActionMode::Delta | ActionMode::Absolute => 1.0,
            ActionMode::Raw => ACTION_LIMIT,
        }
    }

    /// Checks the numbers of consecutive actions. `label` describes the action with this index in an error message.
    ///
    /// # Errors
    /// The first number that is not finite or is out of bounds.
    pub fn check(&self, actions: &[f64], label: impl Fn(usize) -> String) -> PyResult<()> {
        let limit = if self.clip { f64::MAX } else { self.limit() };
        // One pass without branches: errors are rare.
        if actions.iter().all(|x| x.abs() <= limit) {
            return Ok(());
        }
        let (position, number) = actions
            .iter()
            .enumerate()
            .find(|(_, x)| x.is_nan() || x.abs() > limit)
            .unwrap_or((0, &f64::NAN));
        let (label, index) = (label(position / self.len()), position % self.len());
        Err(if number.is_finite() {
            let hint = "clip it, or make the environment with clip_actions=True";
            argument_error(
                "action",
                format!("numbers from -{limit} to {limit}"),
                format!("{number} at index {index}{label}; {hint}"),
            )
        } else {
            argument_error(
                "action",
                "finite numbers",
                format!("{number} at index {index}{label}"),
            )
        })
    }

    /// Converts a checked action to a command, and stores its last position in `commanded`, rad.
    pub fn command(&self, action: &[f64], commanded: &mut [f64; JOINTS], out: &mut [f64]) {
        let limit = self.limit();
        let clipped = |x: f64| if self.clip { x.clamp(-limit, limit) } else { x };
        let previous = *commanded;
        for (row, (input, command)) in action
            .chunks_exact(JOINTS)
            .zip(out.chunks_exact_mut(JOINTS))
            .enumerate()
        {
            let quantity = self.quantity(row);
            for joint in 0..JOINTS {
                let number = clipped(input[joint]);
                command[joint] = match self.mode {
                    ActionMode::Raw => number,
                    ActionMode::Delta => scale(quantity, joint, number, Some(previous[joint])),
                    ActionMode::Absolute => scale(quantity, joint, number, None),
                };
            }
            if matches!(quantity, Quantity::Position(_)) {
                commanded.copy_from_slice(command);
            }
        }
    }

    fn quantity(&self, row: usize) -> Quantity {
        match (self.interpolation, row) {
            (Interpolation::Trajectory, row) => match row % 3 {
                0 => Quantity::Position((row / 3 + 1) as f64 / SUBSTEPS as f64),
                1 => Quantity::Velocity,
                _ => Quantity::Acceleration,
            },
            (_, 0) => Quantity::Position(1.0),
            (_, 1) => Quantity::Velocity,
            (_, _) => Quantity::Acceleration,
        }
    }
}

/// Converts a fraction to rad, rad/s or rad/s². A position is relative to `previous`, or else to the start pose.
fn scale(quantity: Quantity, joint: usize, fraction: f64, previous: Option<f64>) -> f64 {
    let range = LIMIT_FRACTION * LINKS[joint].range_rad;
    let velocity = LINKS[joint].velocity_limit_rad_s;
    match (quantity, previous) {
        (Quantity::Position(part), Some(previous)) => {
            let max_change = LIMIT_FRACTION * velocity * CONTROL_STEP_S * part;
            (previous + fraction * max_change).clamp(-range, range)
        }
        (Quantity::Position(_), None) => {
            let start = INITIAL_Q[joint];
            let distance_to_bound = if fraction < 0.0 {
                range + start
            } else {
                range - start
            };
            start + fraction * distance_to_bound
        }
        (Quantity::Velocity, _) => fraction * LIMIT_FRACTION * velocity,
        (Quantity::Acceleration, _) => fraction * ACCELERATION_PER_VELOCITY * velocity,
    }
}
