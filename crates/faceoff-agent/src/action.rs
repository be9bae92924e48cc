//! Actions of an agent (joint commands for one control step of 20 ms) and the interpolation between them.

use crate::env::JOINTS;
use serde::{Serialize, Serializer};

/// The evaluator refuses actions with a number of a larger magnitude.
const MAX_MAGNITUDE: f64 = 1e4;

/// What the numbers of an action are, and how the evaluator interpolates between them. Each variant begins with its code in the
/// protocol (`docs/protocol.md`, "Actions").
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// 1: position, reached along a line.
    Linear,
    /// 2: position, quadratic from the present position and velocity.
    Quadratic,
    /// 3: position and velocity, cubic.
    Cubic,
    /// 4: position and velocity, quartic, continuing the present acceleration.
    Quartic,
    /// 5: position, velocity and acceleration, quintic.
    Quintic,
    /// −1: position and velocity, each along a line.
    LinearPositionAndVelocity,
    /// null: position, velocity and acceleration for each millisecond of the step.
    Trajectory,
}

impl Interpolation {
    /// The code in the protocol; `None` is `null`.
    const fn code(self) -> Option<i8> {
        match self {
            Self::Linear => Some(1),
            Self::Quadratic => Some(2),
            Self::Cubic => Some(3),
            Self::Quartic => Some(4),
            Self::Quintic => Some(5),
            Self::LinearPositionAndVelocity => Some(-1),
            Self::Trajectory => None,
        }
    }
}

impl Serialize for Interpolation {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.code().serialize(serializer)
    }
}

/// Command for the next control step: angles in rad, velocities in rad/s, accelerations in rad/s².
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Action {
    /// Joint positions at the end of the step.
    Position([f64; JOINTS]),
    /// Positions, velocities.
    PositionVelocity([[f64; JOINTS]; 2]),
    /// Positions, velocities, accelerations.
    PositionVelocityAcceleration([[f64; JOINTS]; 3]),
    /// Positions, velocities, accelerations for each of the step's 20 milliseconds.
    Trajectory(Box<[[[f64; JOINTS]; 3]; 20]>),
}

impl Action {
    /// Why the evaluator would refuse the action under `interpolation`; `None` if it is valid.
    pub(crate) fn refusal(&self, interpolation: Interpolation) -> Option<String> {
        use Interpolation as I;
        let has_shape = match self {
            Self::Position(_) => matches!(interpolation, I::Linear | I::Quadratic),
            Self::PositionVelocity(_) => {
                matches!(
                    interpolation,
                    I::Cubic | I::Quartic | I::LinearPositionAndVelocity
                )
            }
            Self::PositionVelocityAcceleration(_) => interpolation == I::Quintic,
            Self::Trajectory(_) => interpolation == I::Trajectory,
        };
        if !has_shape {
            return Some(format!(
                "the action {self:.60?} does not fit the interpolation {interpolation:?}"
            ));
        }
        let is_refused = |number: &f64| !number.is_finite() || number.abs() > MAX_MAGNITUDE;
        let (index, number) = self
            .numbers()
            .iter()
            .enumerate()
            .find(|(_, n)| is_refused(n))?;
        Some(format!(
            "expected numbers within ±{MAX_MAGNITUDE} in an action, got {number} for joint {} in row {}",
            index % JOINTS + 1,
            index / JOINTS + 1
        ))
    }

    /// All numbers, row by row; each row has one number per joint.
    fn numbers(&self) -> &[f64] {
        match self {
            Self::Position(numbers) => numbers,
            Self::PositionVelocity(rows) => rows.as_flattened(),
            Self::PositionVelocityAcceleration(rows) => rows.as_flattened(),
            Self::Trajectory(points) => points.as_flattened().as_flattened(),
        }
    }
}

impl From<[[f64; JOINTS]; 2]> for Action {
    fn from(rows: [[f64; JOINTS]; 2]) -> Self {
        Self::PositionVelocity(rows)
    }
}
