//! The puck's motion on the table, in substeps of 1 ms.

use super::geometry::PUCK;
use crate::model::SUBSTEP_S;

/// The puck in the table frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Puck {
    /// x, y in m, yaw in rad (not wrapped).
    pub pose: [f64; 3],
    /// m/s, m/s, rad/s.
    pub velocity: [f64; 3],
}

/// Inverse inertia of the puck along x, y and yaw, 1/kg and 1/(kg m²).
pub const INVERSE_INERTIA: [f64; 3] = [
    1.0 / PUCK.mass_kg,
    1.0 / PUCK.mass_kg,
    1.0 / PUCK.inertia_kg_m2,
];

/// Viscous damping along x, y and yaw, N s/m and N m s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping([f64; 3]);

impl Damping {
    /// The puck's own damping.
    pub const NOMINAL: Self = Self([PUCK.damping, PUCK.damping, PUCK.yaw_damping]);

    /// Damping with a given decay rate of the linear velocity, 1/s, and the nominal damping of the yaw.
    #[must_use]
    pub fn with_decay_rate(rate_per_s: f64) -> Self {
        let linear = rate_per_s * PUCK.mass_kg;
        Self([linear, linear, PUCK.yaw_damping])
    }
}

impl Puck {
    /// From [x, y, yaw, vx, vy, yaw rate].
    #[must_use]
    pub fn from_state([x, y, yaw, vx, vy, yaw_rate]: [f64; 6]) -> Self {
        Self {
            pose: [x, y, yaw],
            velocity: [vx, vy, yaw_rate],
        }
    }

    /// As [x, y, yaw, vx, vy, yaw rate].
    #[must_use]
    pub fn state(&self) -> [f64; 6] {
        let ([x, y, yaw], [vx, vy, yaw_rate]) = (self.pose, self.velocity);
        [x, y, yaw, vx, vy, yaw_rate]
    }

    /// Linear speed, m/s.
    #[must_use]
    pub fn speed(&self) -> f64 {
        (self.velocity[0] * self.velocity[0] + self.velocity[1] * self.velocity[1]).sqrt()
    }

    /// Acceleration without contacts (m/s², m/s², rad/s²), under damping and the force of an air flow (N).
    #[inline(always)]
    pub fn free_acceleration(&self, damping: &Damping, air_n: [f64; 2]) -> [f64; 3] {
        let force = [air_n[0], air_n[1], 0.0];
        std::array::from_fn(|i| (force[i] - damping.0[i] * self.velocity[i]) * INVERSE_INERTIA[i])
    }

    /// One substep under a force (N, N, N m): a semi-implicit Euler step with implicit damping.
    #[inline(always)]
    pub fn advance(&mut self, damping: &Damping, force: [f64; 3]) {
        for i in 0..3 {
            let step_per_inertia = SUBSTEP_S * INVERSE_INERTIA[i];
            self.velocity[i] = (self.velocity[i] + step_per_inertia * force[i])
                / (1.0 + step_per_inertia * damping.0[i]);
            self.pose[i] += SUBSTEP_S * self.velocity[i];
        }
    }
}
