//! Magnitudes of the perturbation factors, such as noise (RULES, "Perturbation profiles"). The *plant* is the robot in the
//! evaluator's simulator, and the *nominal model* is the one that teams have.

use serde::{Deserialize, Serialize};

/// Magnitudes of all factors; the defaults are the ruleset's. The profile decides which factors are active.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
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
    /// Delays and table of the real laboratory.
    pub delay: DelaySettings,
}

/// Ranges of the plant's deviation from the nominal model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct MismatchSettings {
    /// Range of the factor on each link's mass and inertia.
    pub mass: [f64; 2],
    /// Range of the factor on each joint's gains.
    pub gains: [f64; 2],
    /// Range of the factor on each joint's damping and dry friction.
    pub friction: [f64; 2],
    /// Accepted range of the largest static end-effector error over the workspace, in metres.
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
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
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
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
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
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(default, deny_unknown_fields)]
pub struct TrackingLossSettings {
    /// Probability per control step, while tracked.
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

/// Delays and table of the real laboratory. Observations and actions are always one control step late.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
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

/// A magnitude outside its valid range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field}: expected {expected}, got {got}")]
pub struct InvalidPerturbation {
    /// Factor and magnitude under their JSON names.
    pub field: &'static str,
    pub expected: String,
    /// The value as it was given.
    pub got: String,
}

impl PerturbationSettings {
    /// Checks that all magnitudes are in range.
    ///
    /// # Errors
    /// The first magnitude that is out of range.
    pub fn check(&self) -> Result<(), InvalidPerturbation> {
        let Self {
            model_mismatch: mismatch,
            observation_noise: noise,
            disturbance,
            tracking_loss: loss,
            delay,
        } = self;
        for (field, range) in [
            ("model_mismatch.mass", mismatch.mass),
            ("model_mismatch.gains", mismatch.gains),
            ("model_mismatch.friction", mismatch.friction),
        ] {
            check_range(field, range, 0.1, 10.0)?;
        }
        check_range(
            "model_mismatch.static_error_m",
            mismatch.static_error_m,
            0.0,
            1.0,
        )?;
        check_range(
            "delay.puck_damping_per_s",
            delay.puck_damping_per_s,
            0.0,
            100.0,
        )?;
        for (field, value, most) in [
            (
                "observation_noise.puck_position_m",
                noise.puck_position_m,
                1.0,
            ),
            ("observation_noise.puck_yaw_rad", noise.puck_yaw_rad, 10.0),
            (
                "observation_noise.puck_velocity_m_s",
                noise.puck_velocity_m_s,
                10.0,
            ),
            (
                "observation_noise.puck_yaw_rate_rad_s",
                noise.puck_yaw_rate_rad_s,
                100.0,
            ),
            (
                "observation_noise.joint_position_rad",
                noise.joint_position_rad,
                1.0,
            ),
            (
                "observation_noise.joint_velocity_rad_s",
                noise.joint_velocity_rad_s,
                10.0,
            ),
            (
                "disturbance.sigma_n_per_m_s",
                disturbance.sigma_n_per_m_s,
                1.0,
            ),
            ("tracking_loss.probability", loss.probability, 1.0),
            (
                "delay.second_step_probability",
                delay.second_step_probability,
                1.0,
            ),
            ("delay.tilt_m_s2", delay.tilt_m_s2, 10.0),
        ] {
            check_number(field, value, 0.0, most)?;
        }
        // The noise process is advanced every millisecond.
        check_number(
            "disturbance.correlation_time_s",
            disturbance.correlation_time_s,
            0.001,
            1000.0,
        )?;
        let [shortest, longest] = loss.steps;
        if shortest < 1 || longest < shortest || longest > 500 {
            return Err(InvalidPerturbation {
                field: "tracking_loss.steps",
                expected: "two numbers from 1 to 500, the smaller one first".to_owned(),
                got: format!("[{shortest}, {longest}]"),
            });
        }
        Ok(())
    }
}

fn check_number(
    field: &'static str,
    value: f64,
    least: f64,
    most: f64,
) -> Result<(), InvalidPerturbation> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(InvalidPerturbation {
        field,
        expected: format!("a number from {least} to {most}"),
        got: value.to_string(),
    })
}

fn check_range(
    field: &'static str,
    [low, high]: [f64; 2],
    least: f64,
    most: f64,
) -> Result<(), InvalidPerturbation> {
    if least <= low && low <= high && high <= most {
        return Ok(());
    }
    Err(InvalidPerturbation {
        field,
        expected: format!("two numbers from {least} to {most}, the smaller one first"),
        got: format!("[{low}, {high}]"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn magnitude_out_of_range_is_refused_by_name() {
        assert_eq!(PerturbationSettings::default().check(), Ok(()));
        for (json, words) in [
            (
                r#"{"model_mismatch":{"mass":[1.2,0.8]}}"#,
                "model_mismatch.mass: expected two numbers from 0.1 to 10",
            ),
            (
                r#"{"model_mismatch":{"gains":[0.0,1.0]}}"#,
                "model_mismatch.gains",
            ),
            (
                r#"{"model_mismatch":{"static_error_m":[0.0,2.0]}}"#,
                "static_error_m",
            ),
            (
                r#"{"observation_noise":{"puck_position_m":-0.1}}"#,
                "puck_position_m: expected a number from 0 to 1, got -0.1",
            ),
            (
                r#"{"disturbance":{"correlation_time_s":0.0}}"#,
                "correlation_time_s",
            ),
            (
                r#"{"tracking_loss":{"probability":1.5}}"#,
                "tracking_loss.probability",
            ),
            (
                r#"{"tracking_loss":{"steps":[9,3]}}"#,
                "tracking_loss.steps",
            ),
            (
                r#"{"tracking_loss":{"steps":[0,3]}}"#,
                "tracking_loss.steps",
            ),
            (
                r#"{"delay":{"puck_damping_per_s":[0.0,1000.0]}}"#,
                "delay.puck_damping_per_s",
            ),
        ] {
            let settings: PerturbationSettings = serde_json::from_str(json).unwrap();
            let error = settings.check().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        let mut not_a_number = PerturbationSettings::default();
        not_a_number.delay.tilt_m_s2 = f64::NAN;
        assert!(not_a_number.check().is_err());
        let unknown = r#"{"tracking_loss":{"chance":0.5}}"#;
        assert!(serde_json::from_str::<PerturbationSettings>(unknown).is_err());
    }
}
