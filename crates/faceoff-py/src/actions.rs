//! What the numbers of an action mean.

use crate::errors::argument;
use faceoff_sim::{
    Interpolation, JOINTS, SUBSTEPS,
    model::{CONTROL_STEP_S, INITIAL_Q, LIMIT_FRACTION, LINKS},
};
use faceoff_types::ACTION_LIMIT;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

/// Acceleration limits are this many times the velocity limits, 1/s.
const ACCELERATION_PER_VELOCITY: f64 = 10.0;

/// What the numbers of an action mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ActionMode {
    /// Fractions, in [−1, 1]: of a position, how far from the last commanded one, where 1 is what 95 % of the
    /// joint's velocity limit reaches in the time; of a velocity, of 95 % of its limit; of an acceleration, of its
    /// limit. Positions stay within 95 % of the joint's range.
    Delta,
    /// Fractions, in [−1, 1]: a position of 0 is the start pose, ±1 are 95 % of the joint's range; the rest as
    /// above.
    Absolute,
    /// rad, rad/s and rad/s², as agents send them to the server.
    Raw,
}

/// How actions are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Actions {
    /// What their numbers mean.
    pub mode: ActionMode,
    /// How they become trajectories.
    pub interpolation: Interpolation,
    /// Bring numbers that are too large to their bounds.
    pub clip: bool,
}

/// What a row of an action holds.
#[derive(Clone, Copy)]
enum Quantity {
    /// After this fraction of the control step.
    Position(f64),
    Velocity,
    Acceleration,
}

impl Actions {
    /// Numbers in an action.
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

    /// Are all these numbers ones that an action may have? `place` names the action that is not.
    ///
    /// # Errors
    /// The first that is none.
    pub fn check(&self, actions: &[f64], place: impl Fn(usize) -> String) -> PyResult<()> {
        let limit = if self.clip { f64::MAX } else { self.limit() };
        // One pass without branches, since there is hardly ever anything to tell.
        if actions.iter().all(|x| x.abs() <= limit) {
            return Ok(());
        }
        let (at, number) = actions
            .iter()
            .enumerate()
            .find(|(_, x)| x.is_nan() || x.abs() > limit)
            .unwrap_or((0, &f64::NAN));
        let (of, index) = (place(at / self.len()), at % self.len());
        Err(if number.is_finite() {
            let hint = "clip it, or make the environment with clip_actions=True";
            argument(
                "action",
                format!("numbers from -{limit} to {limit}"),
                format!("{number} at index {index}{of}; {hint}"),
            )
        } else {
            argument(
                "action",
                "finite numbers",
                format!("{number} at index {index}{of}"),
            )
        })
    }

    /// Turns an action, checked before, into what is commanded, and remembers its last position in `commanded`, rad.
    pub fn command(&self, action: &[f64], commanded: &mut [f64; JOINTS], out: &mut [f64]) {
        let limit = self.limit();
        let bound = |x: f64| if self.clip { x.clamp(-limit, limit) } else { x };
        let from = *commanded;
        for (row, (given, command)) in action
            .chunks_exact(JOINTS)
            .zip(out.chunks_exact_mut(JOINTS))
            .enumerate()
        {
            let quantity = self.quantity(row);
            for joint in 0..JOINTS {
                let fraction = bound(given[joint]);
                command[joint] = match self.mode {
                    ActionMode::Raw => fraction,
                    ActionMode::Delta => scaled(quantity, joint, fraction, Some(from[joint])),
                    ActionMode::Absolute => scaled(quantity, joint, fraction, None),
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

/// What a fraction stands for; a position starts `from` somewhere, or else from the middle.
fn scaled(quantity: Quantity, joint: usize, fraction: f64, from: Option<f64>) -> f64 {
    let range = LIMIT_FRACTION * LINKS[joint].range_rad;
    let velocity = LINKS[joint].velocity_limit_rad_s;
    match (quantity, from) {
        (Quantity::Position(part), Some(from)) => {
            let reach = LIMIT_FRACTION * velocity * CONTROL_STEP_S * part;
            (from + fraction * reach).clamp(-range, range)
        }
        (Quantity::Position(_), None) => {
            let centre = INITIAL_Q[joint];
            let reach = if fraction < 0.0 {
                range + centre
            } else {
                range - centre
            };
            centre + fraction * reach
        }
        (Quantity::Velocity, _) => fraction * LIMIT_FRACTION * velocity,
        (Quantity::Acceleration, _) => fraction * ACCELERATION_PER_VELOCITY * velocity,
    }
}
