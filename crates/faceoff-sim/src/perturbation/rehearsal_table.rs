//! The table of the perturbation `delay`, which is for rehearsals on a real robot: as in a laboratory, the table is not quite level, and
//! its air cushion damps the puck more or less than designed.

use crate::DelaySettings;
use crate::stream::RandomStream;

/// The properties of the table, drawn once per episode or rally.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RehearsalTable {
    /// Acceleration of the puck by the table's tilt, m/s², table frame.
    pub tilt_m_s2: [f64; 2],
    /// Decay rate of the puck's velocity, 1/s.
    pub puck_damping_per_s: f64,
}

impl RehearsalTable {
    /// Draws a table.
    #[must_use]
    pub fn draw(settings: &DelaySettings, mut stream: RandomStream) -> Self {
        let [low, high] = settings.puck_damping_per_s;
        Self {
            tilt_m_s2: stream.normal_pair().map(|n| settings.tilt_m_s2 * n),
            puck_damping_per_s: stream.uniform(low, high),
        }
    }
}
