//! The magnitudes of air hockey's perturbations: their ranges and meaning. The *plant* is the robot in the evaluator's simulator, and the
//! *nominal model* is the one that teams have.

use Magnitude::{Counts, Number, Range};
use faceoff_sim::{MismatchSettings, PerturbationSettings, Plant};
use faceoff_types::{Magnitude, MagnitudeInfo, Magnitudes, Seed};

/// The descriptions, group by group.
pub(crate) fn magnitudes() -> Vec<MagnitudeInfo> {
    let PerturbationSettings {
        model_mismatch: mismatch,
        observation_noise: noise,
        disturbance,
        tracking_loss: loss,
        delay,
    } = PerturbationSettings::default();
    // The deviation of the plant, which is drawn once per season.
    let model_mismatch = describe("model_mismatch");
    let observation_noise = describe("observation_noise");
    let air_flow = describe("disturbance");
    let tracking_loss = describe("tracking_loss");
    let laboratory = describe("delay");
    vec![
        model_mismatch(
            "mass",
            "Range of the factor on each link's mass and inertia.",
            Range(mismatch.mass),
            [0.1, 10.0],
        ),
        model_mismatch(
            "gains",
            "Range of the factor on each joint's gains.",
            Range(mismatch.gains),
            [0.1, 10.0],
        ),
        model_mismatch(
            "friction",
            "Range of the factor on each joint's damping and dry friction.",
            Range(mismatch.friction),
            [0.1, 10.0],
        ),
        model_mismatch(
            "static_error_m",
            "Accepted range of the largest static end-effector error over the workspace, in metres.",
            Range(mismatch.static_error_m),
            [0.0, 1.0],
        ),
        observation_noise(
            "puck_position_m",
            "Standard deviation of the puck's x and y, m.",
            Number(noise.puck_position_m),
            [0.0, 1.0],
        ),
        observation_noise(
            "puck_yaw_rad",
            "Standard deviation of the puck's yaw, rad.",
            Number(noise.puck_yaw_rad),
            [0.0, 10.0],
        ),
        observation_noise(
            "puck_velocity_m_s",
            "Standard deviation of the puck's velocity, m/s.",
            Number(noise.puck_velocity_m_s),
            [0.0, 10.0],
        ),
        observation_noise(
            "puck_yaw_rate_rad_s",
            "Standard deviation of the puck's yaw rate, rad/s.",
            Number(noise.puck_yaw_rate_rad_s),
            [0.0, 100.0],
        ),
        observation_noise(
            "joint_position_rad",
            "Standard deviation of the joint positions, rad.",
            Number(noise.joint_position_rad),
            [0.0, 1.0],
        ),
        observation_noise(
            "joint_velocity_rad_s",
            "Standard deviation of the joint velocities, rad/s.",
            Number(noise.joint_velocity_rad_s),
            [0.0, 10.0],
        ),
        air_flow(
            "sigma_n_per_m_s",
            "Standard deviation of the air flow's force on the puck per axis, in N per m/s of the puck's speed.",
            Number(disturbance.sigma_n_per_m_s),
            [0.0, 1.0],
        ),
        // The force changes once a millisecond, so a shorter time constant would make no difference.
        air_flow(
            "correlation_time_s",
            "Time constant with which the force changes, s.",
            Number(disturbance.correlation_time_s),
            [0.001, 1000.0],
        ),
        tracking_loss(
            "probability",
            "Probability per control step, while the puck is tracked.",
            Number(loss.probability),
            [0.0, 1.0],
        ),
        tracking_loss(
            "steps",
            "Shortest and longest loss, in control steps.",
            Counts(loss.steps),
            [1.0, 500.0],
        ),
        laboratory(
            "second_step_probability",
            "Probability that the puck is observed two control steps late instead of one.",
            Number(delay.second_step_probability),
            [0.0, 1.0],
        ),
        laboratory(
            "tilt_m_s2",
            "Standard deviation per axis of the puck's acceleration due to the table's tilt, m/s².",
            Number(delay.tilt_m_s2),
            [0.0, 10.0],
        ),
        laboratory(
            "puck_damping_per_s",
            "Range of the decay rate of the puck's velocity, 1/s.",
            Range(delay.puck_damping_per_s),
            [0.0, 100.0],
        ),
    ]
}

/// Describes the magnitudes of a group.
fn describe(group: &'static str) -> impl Fn(&str, &str, Magnitude, [f64; 2]) -> MagnitudeInfo {
    move |name, description, default, bounds| MagnitudeInfo {
        group: group.to_owned(),
        name: name.to_owned(),
        description: description.to_owned(),
        default,
        bounds,
    }
}

/// Converts magnitudes to settings of the simulator. Magnitudes that are left out have the ruleset's values.
///
/// # Errors
/// If the simulator does not have one of the magnitudes; the text names it.
pub(crate) fn perturbation_settings(
    magnitudes: &Magnitudes,
) -> Result<PerturbationSettings, String> {
    magnitudes.to_settings().map_err(|error| error.to_string())
}

/// Checks that a plant with its accepted deviations can be drawn for the season, which takes up to a second. It is skipped for the
/// ruleset's magnitudes, which are known to be possible.
pub(crate) fn check_plant_can_be_drawn(
    magnitudes: &Magnitudes,
    mismatch_seed: Seed,
) -> Result<(), String> {
    let settings = perturbation_settings(magnitudes)?;
    if settings.model_mismatch == MismatchSettings::default()
        || Plant::can_be_drawn(&settings, mismatch_seed)
    {
        return Ok(());
    }
    let [min_error_m, max_error_m] = settings.model_mismatch.static_error_m;
    Err(format!(
        "model_mismatch: none of 300 robots drawn from these ranges of mass and gains has a largest static error of \
         {min_error_m} to {max_error_m} m (static_error_m); widen one of the ranges"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{checked_magnitudes, competition};

    #[test]
    fn magnitudes_cover_all_simulator_settings_and_defaults() {
        let mut all = Magnitudes::default();
        for info in magnitudes() {
            all.set(&info.group, &info.name, info.default);
        }
        let defaults = PerturbationSettings::default();
        assert_eq!(
            serde_json::to_string(&all).unwrap(),
            serde_json::to_string(&defaults).unwrap(),
            "the same fields, in the same order, with the same defaults"
        );
        assert_eq!(perturbation_settings(&all).unwrap(), defaults);
        assert!(checked_magnitudes(&defaults).unwrap().is_empty());
    }

    #[test]
    fn settings_round_trip_through_magnitudes_bit_for_bit() {
        let mut changed = PerturbationSettings::default();
        changed.disturbance.sigma_n_per_m_s = 1.0 / 3.0;
        changed.tracking_loss.steps = [1, 2];
        let magnitudes = checked_magnitudes(&changed).unwrap();
        assert_eq!(
            serde_json::to_string(&magnitudes).unwrap(),
            serde_json::to_string(&changed).unwrap(),
            "files of earlier versions have the same bytes"
        );
        assert_eq!(perturbation_settings(&magnitudes).unwrap(), changed);
    }

    /// All ranges, and a value beyond each end of them.
    #[test]
    fn magnitudes_out_of_range_are_refused_by_name() {
        let refused = |group: &str, name: &str, value| {
            let mut magnitudes = Magnitudes::default();
            magnitudes.set(group, name, value);
            let checked = competition().check_magnitudes(&mut magnitudes);
            checked.err().map(|error| error.to_string())
        };
        for (group, name, [least, most]) in [
            ("model_mismatch", "mass", [0.1, 10.0]),
            ("model_mismatch", "gains", [0.1, 10.0]),
            ("model_mismatch", "friction", [0.1, 10.0]),
            ("model_mismatch", "static_error_m", [0.0, 1.0]),
            ("observation_noise", "puck_position_m", [0.0, 1.0]),
            ("observation_noise", "puck_yaw_rad", [0.0, 10.0]),
            ("observation_noise", "puck_velocity_m_s", [0.0, 10.0]),
            ("observation_noise", "puck_yaw_rate_rad_s", [0.0, 100.0]),
            ("observation_noise", "joint_position_rad", [0.0, 1.0]),
            ("observation_noise", "joint_velocity_rad_s", [0.0, 10.0]),
            ("disturbance", "sigma_n_per_m_s", [0.0, 1.0]),
            ("disturbance", "correlation_time_s", [0.001, 1000.0]),
            ("tracking_loss", "probability", [0.0, 1.0]),
            ("tracking_loss", "steps", [1.0, 500.0]),
            ("delay", "second_step_probability", [0.0, 1.0]),
            ("delay", "tilt_m_s2", [0.0, 10.0]),
            ("delay", "puck_damping_per_s", [0.0, 100.0]),
        ] {
            let value = |number: f64| match (name, group) {
                ("steps", _) => Counts([number as u32; 2]),
                ("mass" | "gains" | "friction" | "static_error_m" | "puck_damping_per_s", _) => {
                    Range([number; 2])
                }
                _ => Number(number),
            };
            for valid in [least, most] {
                assert_eq!(refused(group, name, value(valid)), None, "{group}.{name}");
            }
            for invalid in [least - 1.0, most + 1.0, f64::NAN] {
                let error = refused(group, name, value(invalid)).unwrap();
                let expected = format!("{group}.{name}: expected ");
                assert!(error.starts_with(&expected), "{error}");
                assert!(
                    error.contains(&format!("from {least} to {most}")),
                    "{error}"
                );
            }
        }
        let descending = refused("model_mismatch", "mass", Range([1.2, 0.8])).unwrap();
        assert!(descending.contains("the smaller one first"), "{descending}");
        let unknown = refused("tracking_loss", "chance", Number(0.5)).unwrap();
        assert!(
            unknown.contains("tracking_loss.chance: unknown"),
            "{unknown}"
        );
        let mut not_a_number = PerturbationSettings::default();
        not_a_number.delay.tilt_m_s2 = f64::NAN;
        assert!(checked_magnitudes(&not_a_number).is_err());
    }
}
