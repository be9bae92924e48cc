//! A table as in the laboratory: not quite level, its air cushion not quite as designed (RULES, factor
//! `delay`).

use crate::stream::Stream;
use faceoff_types::DelaySettings;

/// Drawn once per episode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RehearsalTable {
    /// Acceleration of the puck by the table's tilt, m/s², table frame.
    pub tilt_m_s2: [f64; 2],
    /// Decay rate of the puck's velocity, 1/s.
    pub puck_damping_per_s: f64,
}

impl RehearsalTable {
    #[must_use]
    pub fn draw(settings: &DelaySettings, mut stream: Stream) -> Self {
        let [low, high] = settings.puck_damping_per_s;
        Self {
            tilt_m_s2: stream.normal_pair().map(|n| settings.tilt_m_s2 * n),
            puck_damping_per_s: stream.uniform(low, high),
        }
    }
}
