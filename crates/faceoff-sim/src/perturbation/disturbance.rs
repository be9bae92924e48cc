//! Air flow that pushes a moving puck.

use crate::{model::SUBSTEP_S, stream::Stream, table::puck::Puck};
use faceoff_types::DisturbanceSettings;

/// A force on the puck of its speed times an Ornstein–Uhlenbeck process per axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    stream: Stream,
    /// N per m/s.
    state: [f64; 2],
    decay: f64,
    innovation: f64,
}

impl Disturbance {
    /// Starts from the stationary distribution.
    #[must_use]
    pub fn new(settings: &DisturbanceSettings, mut stream: Stream) -> Self {
        let sigma = settings.sigma_n_per_m_s;
        let decay = libm::exp(-SUBSTEP_S / settings.correlation_time_s);
        // The exact discretisation keeps the stationary deviation at any step length.
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
