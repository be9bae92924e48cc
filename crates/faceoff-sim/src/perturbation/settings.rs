//! Magnitudes of the perturbations, such as noise (`docs/rules.md`, "Perturbations"). The *plant* is the robot in the
//! evaluator's simulator, and the *nominal model* is the one that teams have.

use serde::{Deserialize, Serialize};

/// Magnitudes of all perturbations; the defaults are the ruleset's. The profile decides which of them are active. Their valid
/// ranges are those of the competition (`faceoff_airhockey::magnitudes`), which are checked before. The platform carries the same values
/// by group and name, as `faceoff_types::Magnitudes`; requests and files call them `perturbations`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PerturbationSettings {
    /// Deviation of the plant, which is drawn once per season, from the nominal model.
    pub model_mismatch: MismatchSettings,
    /// Noise on the observations.
    pub observation_noise: NoiseSettings,
    /// Air flow that pushes the puck.
    pub disturbance: DisturbanceSettings,
    /// Loss of the puck's tracking.
    pub tracking_loss: TrackingLossSettings,
    /// Delays, and tilt and friction of the table, as in a real laboratory.
    pub delay: DelaySettings,
}

/// Ranges of the plant's deviation from the nominal model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MismatchSettings {
    /// Range of the multiplier of each link's mass and inertia.
    pub mass: [f64; 2],
    /// Range of the multiplier of each joint's controller gains.
    pub gains: [f64; 2],
    /// Range of the multiplier of each joint's damping and dry friction.
    pub friction: [f64; 2],
    /// Accepted range of the largest distance between commanded and reached end-effector position at rest, over the table, in metres.
    /// Plants outside of it are drawn again.
    pub static_error_m: [f64; 2],
}

impl Default for MismatchSettings {
    fn default() -> Self {
        Self {
            mass: [0.8, 1.2],
            gains: [0.8, 1.2],
            friction: [0.5, 1.5],
            static_error_m: [0.005, 0.010],
        }
    }
}

/// Standard deviations of the observation noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NoiseSettings {
    /// Puck x and y, m.
    pub puck_position_m: f64,
    /// Puck yaw, rad.
    pub puck_yaw_rad: f64,
    /// Puck velocity, m/s.
    pub puck_velocity_m_s: f64,
    /// Puck yaw rate, rad/s.
    pub puck_yaw_rate_rad_s: f64,
    /// Joint positions, rad.
    pub joint_position_rad: f64,
    /// Joint velocities, rad/s.
    pub joint_velocity_rad_s: f64,
}

impl Default for NoiseSettings {
    fn default() -> Self {
        Self {
            puck_position_m: 0.001,
            puck_yaw_rad: 0.02,
            puck_velocity_m_s: 0.1,
            puck_yaw_rate_rad_s: 0.1,
            joint_position_rad: 1e-4,
            joint_velocity_rad_s: 1e-3,
        }
    }
}

/// The air flow's force on the puck, proportional to its speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DisturbanceSettings {
    /// Standard deviation of the force per axis, in N per m/s of the puck's speed.
    pub sigma_n_per_m_s: f64,
    /// Time constant with which the force changes, s.
    pub correlation_time_s: f64,
}

impl Default for DisturbanceSettings {
    fn default() -> Self {
        Self {
            sigma_n_per_m_s: 0.004,
            correlation_time_s: 0.2,
        }
    }
}

/// Interruptions of the puck's tracking.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackingLossSettings {
    /// Probability per control step that tracking loses the puck, while it is tracked.
    pub probability: f64,
    /// Shortest and longest loss, in control steps.
    pub steps: [u32; 2],
}

impl Default for TrackingLossSettings {
    fn default() -> Self {
        Self {
            probability: 0.03,
            steps: [5, 20],
        }
    }
}

/// Delays, and tilt and friction of the table, as in a real laboratory. Observations and actions are always one control step late.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DelaySettings {
    /// Probability that the puck is observed two control steps late instead of one.
    pub second_step_probability: f64,
    /// Standard deviation per axis of the puck's acceleration due to the table's tilt, m/s².
    pub tilt_m_s2: f64,
    /// Range of the decay rate of the puck's velocity, 1/s.
    pub puck_damping_per_s: [f64; 2],
}

impl Default for DelaySettings {
    fn default() -> Self {
        Self {
            second_step_probability: 0.2,
            tilt_m_s2: 0.03,
            puck_damping_per_s: [0.2, 0.5],
        }
    }
}
