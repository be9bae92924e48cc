//! Interpolations: how the numbers of an agent's action become a trajectory of the robot's joints.

use faceoff_types::ActionLayout;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Driven joints of an arm: the innermost length of every action.
pub const JOINTS: usize = 7;

/// Physics steps of a control step: the outermost length of a whole-trajectory action.
pub const SUBSTEPS: usize = 20;

/// Numbers in the longest action, a whole trajectory.
pub const MAX_ACTION_LEN: usize = SUBSTEPS * 3 * JOINTS;

/// How an agent's actions become a trajectory (`docs/protocol.md`, "Actions"). The protocol's code for it is 1, 2, 3, 4, 5,
/// −1 or null. Polynomials start at the end of the previous commanded trajectory, at reset at the
/// initial position with zero velocity and acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "Option<i64>", into = "Option<i64>")]
pub enum Interpolation {
    /// 1: position, linear; shape `[7]`.
    Linear,
    /// 2: position, quadratic; shape `[7]`.
    Quadratic,
    /// 3: position and velocity, cubic; shape `[2][7]`.
    Cubic,
    /// 4: position and velocity, quartic; shape `[2][7]`.
    Quartic,
    /// 5: position, velocity and acceleration, quintic; shape `[3][7]`.
    Quintic,
    /// −1: position and velocity, each linear; shape `[2][7]`.
    LinearPositionAndVelocity,
    /// null: position, velocity and acceleration at every millisecond; shape `[20][3][7]`.
    Trajectory,
}

/// A number that is not an interpolation code of the protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("unknown interpolation {0}: expected 1, 2, 3, 4, 5, -1 or null")]
pub struct UnknownInterpolation(pub i64);

impl Interpolation {
    /// All interpolations, in the order of error messages.
    pub const ALL: [Self; 7] = [
        Self::Linear,
        Self::Quadratic,
        Self::Cubic,
        Self::Quartic,
        Self::Quintic,
        Self::LinearPositionAndVelocity,
        Self::Trajectory,
    ];

    /// The interpolation of a code; `None` is the protocol's null.
    ///
    /// # Errors
    /// If the protocol has no such code.
    pub const fn from_code(code: Option<i64>) -> Result<Self, UnknownInterpolation> {
        Ok(match code {
            Some(1) => Self::Linear,
            Some(2) => Self::Quadratic,
            Some(3) => Self::Cubic,
            Some(4) => Self::Quartic,
            Some(5) => Self::Quintic,
            Some(-1) => Self::LinearPositionAndVelocity,
            None => Self::Trajectory,
            Some(unknown) => return Err(UnknownInterpolation(unknown)),
        })
    }

    /// The code; `None` is the protocol's null.
    #[must_use]
    pub const fn code(self) -> Option<i64> {
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

    /// Lengths of an action's nested arrays, outermost first.
    #[must_use]
    pub const fn shape(self) -> &'static [usize] {
        match self {
            Self::Linear | Self::Quadratic => &[JOINTS],
            Self::Cubic | Self::Quartic | Self::LinearPositionAndVelocity => &[2, JOINTS],
            Self::Quintic => &[3, JOINTS],
            Self::Trajectory => &[SUBSTEPS, 3, JOINTS],
        }
    }

    /// Numbers in an action: the product of its shape.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "an action is never empty")]
    pub const fn len(self) -> usize {
        match self {
            Self::Linear | Self::Quadratic => JOINTS,
            Self::Cubic | Self::Quartic | Self::LinearPositionAndVelocity => 2 * JOINTS,
            Self::Quintic => 3 * JOINTS,
            Self::Trajectory => MAX_ACTION_LEN,
        }
    }

    /// The action that holds a joint position (rad) at rest, in the first [`Interpolation::len`] elements.
    #[must_use]
    pub fn hold_position(self, position: &[f64; JOINTS]) -> [f64; MAX_ACTION_LEN] {
        let mut action = [0.0; MAX_ACTION_LEN];
        // A trajectory has one point per substep; all other actions consist of a single one. A point begins with the position.
        let point_len = match self {
            Self::Trajectory => 3 * JOINTS,
            _ => MAX_ACTION_LEN,
        };
        for point in action.chunks_mut(point_len) {
            point[..JOINTS].copy_from_slice(position);
        }
        action
    }
}

impl From<Interpolation> for ActionLayout {
    fn from(interpolation: Interpolation) -> Self {
        Self::new(interpolation.code(), interpolation.shape())
    }
}

impl TryFrom<Option<i64>> for Interpolation {
    type Error = UnknownInterpolation;
    fn try_from(code: Option<i64>) -> Result<Self, Self::Error> {
        Self::from_code(code)
    }
}

impl From<Interpolation> for Option<i64> {
    fn from(interpolation: Interpolation) -> Self {
        interpolation.code()
    }
}

impl fmt::Display for Interpolation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.code() {
            Some(code) => code.fmt(f),
            None => f.write_str("null"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn protocol_has_seven_interpolation_codes() {
        // The seventh is null.
        let known: Vec<i64> = (-300..300)
            .filter(|code| Interpolation::from_code(Some(*code)).is_ok())
            .collect();
        assert_eq!(known, [-1, 1, 2, 3, 4, 5]);
        assert_eq!(
            Interpolation::from_code(Some(i64::MAX)),
            Err(UnknownInterpolation(i64::MAX))
        );
    }

    #[test]
    fn interpolation_shapes_match_the_protocol() {
        for (code, len) in [
            (Some(1), 7),
            (Some(2), 7),
            (Some(3), 14),
            (Some(4), 14),
            (Some(5), 21),
            (Some(-1), 14),
            (None, 420),
        ] {
            let interpolation = Interpolation::from_code(code).unwrap();
            assert_eq!(interpolation.code(), code);
            assert_eq!(interpolation.len(), len, "{interpolation}");
            assert_eq!(interpolation.shape().iter().product::<usize>(), len);
        }
    }

    #[test]
    fn interpolation_null_reads_as_trajectory() {
        let null: Interpolation = serde_json::from_str("null").unwrap();
        assert_eq!(null, Interpolation::Trajectory);
        assert_eq!(serde_json::to_string(&null).unwrap(), "null");
        assert!(serde_json::from_str::<Interpolation>("6").is_err());
    }
}
