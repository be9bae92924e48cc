//! The perturbation `disturbance`: an air flow that pushes a moving puck.

use crate::DisturbanceSettings;
use crate::{model::SUBSTEP_S, stream::RandomStream, table::puck::Puck};

/// The air flow. Its force on the puck along each axis is the puck's speed times an Ornstein–Uhlenbeck process, which is noise with a
/// correlation time.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    stream: RandomStream,
    /// Current values of the process along x and y, N per m/s.
    state: [f64; 2],
    /// Share of the process that a substep keeps.
    decay: f64,
    /// Standard deviation of the noise that a substep adds, N per m/s.
    innovation: f64,
}

impl Disturbance {
    /// An air flow whose process starts in its stationary distribution.
    #[must_use]
    pub fn new(settings: &DisturbanceSettings, mut stream: RandomStream) -> Self {
        let sigma = settings.sigma_n_per_m_s;
        let decay = libm::exp(-SUBSTEP_S / settings.correlation_time_s);
        // The exact discretisation keeps the standard deviation at any step length.
        let innovation = sigma * (1.0 - decay * decay).sqrt();
        let state = stream.normal_pair().map(|n| sigma * n);
        Self {
            stream,
            state,
            decay,
            innovation,
        }
    }

    /// Advances the process by a substep and returns the force in it, N.
    pub fn force(&mut self, puck: &Puck) -> [f64; 2] {
        let noise = self.stream.normal_pair();
        for (state, noise) in self.state.iter_mut().zip(noise) {
            *state = self.decay * *state + self.innovation * noise;
        }
        self.state.map(|state| state * puck.speed())
    }
}
