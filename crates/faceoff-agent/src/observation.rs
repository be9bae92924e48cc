//! The observation in a `step` message: puck, own joints and, if there is one, the opponent's mallet.

use crate::env::JOINTS;
use serde::Deserialize;

/// Length of an observation without an opponent on the table: 6 numbers of the puck, positions and velocities of 7 joints.
const LEN_ALONE: usize = 20;
/// Length of an observation with an opponent on the table, whose x, y, z come last.
const LEN_WITH_OPPONENT: usize = 23;

/// Observation of a control step in the robot's base frame: 20 numbers, 23 with an opponent on the table.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "Vec<f64>")]
pub struct Observation(Vec<f64>);

impl Observation {
    /// The puck's x, y (m), yaw (rad) and their rates (m/s, rad/s).
    #[must_use]
    pub fn puck(&self) -> [f64; 6] {
        self.numbers(0)
    }

    /// Joint angles, rad.
    #[must_use]
    pub fn joint_positions(&self) -> [f64; JOINTS] {
        self.numbers(6)
    }

    /// Joint velocities, rad/s, low-pass filtered.
    #[must_use]
    pub fn joint_velocities(&self) -> [f64; JOINTS] {
        self.numbers(6 + JOINTS)
    }

    /// x, y, z of the opponent's mallet, m; `None` without an opponent on the table.
    #[must_use]
    pub fn opponent(&self) -> Option<[f64; 3]> {
        (self.0.len() == LEN_WITH_OPPONENT).then(|| self.numbers(LEN_ALONE))
    }

    /// All numbers, in the protocol's order.
    #[must_use]
    pub fn as_slice(&self) -> &[f64] {
        &self.0
    }

    fn numbers<const N: usize>(&self, start: usize) -> [f64; N] {
        std::array::from_fn(|i| self.0[start + i])
    }
}

impl TryFrom<Vec<f64>> for Observation {
    type Error = WrongLength;

    fn try_from(numbers: Vec<f64>) -> Result<Self, WrongLength> {
        match numbers.len() {
            LEN_ALONE | LEN_WITH_OPPONENT => Ok(Self(numbers)),
            length => Err(WrongLength(length)),
        }
    }
}

/// An observation whose length is not one of the protocol's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected an observation of 20 or 23 numbers, got {0}")]
pub struct WrongLength(pub usize);
