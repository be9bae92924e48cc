//! The perturbation `observation_noise`: Gaussian noise on the agent's observations.

use crate::NoiseSettings;
use crate::{model::JOINTS, stream::RandomStream};

/// Draws the noise of successive observations.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservationNoise {
    stream: RandomStream,
    settings: NoiseSettings,
}

impl ObservationNoise {
    #[must_use]
    pub fn new(settings: &NoiseSettings, stream: RandomStream) -> Self {
        Self {
            stream,
            settings: settings.clone(),
        }
    }

    /// Adds noise to puck pose and velocity, joint positions and velocities, the first 20 numbers
    /// of an observation. It always makes 20 normal draws. The yaw may leave [−π, π).
    pub fn add(&mut self, observation: &mut [f64]) {
        let s = &self.settings;
        let standard_deviations = [
            s.puck_position_m,
            s.puck_position_m,
            s.puck_yaw_rad,
            s.puck_velocity_m_s,
            s.puck_velocity_m_s,
            s.puck_yaw_rate_rad_s,
        ]
        .into_iter()
        .chain([s.joint_position_rad; JOINTS])
        .chain([s.joint_velocity_rad_s; JOINTS]);
        // Normal numbers are drawn in pairs; this is the second one of a pair.
        let mut spare = None;
        for (value, deviation) in observation.iter_mut().zip(standard_deviations) {
            let normal = spare.take().unwrap_or_else(|| {
                let [first, second] = self.stream.normal_pair();
                spare = Some(second);
                first
            });
            *value += deviation * normal;
        }
    }
}
