//! The puck's motion.

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

/// Inverse inertia along x, y and yaw, 1/kg and 1/(kg m²).
pub const INVERSE_INERTIA: [f64; 3] = [
    1.0 / PUCK.mass_kg,
    1.0 / PUCK.mass_kg,
    1.0 / PUCK.inertia_kg_m2,
];

/// Viscous damping along x, y and yaw, N s/m and N m s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping([f64; 3]);

impl Damping {
    pub const NOMINAL: Self = Self([PUCK.damping, PUCK.damping, PUCK.yaw_damping]);

    /// Damping with a given decay rate of the velocity, 1/s.
    #[must_use]
    pub fn per_s(rate: f64) -> Self {
        let linear = rate * PUCK.mass_kg;
        Self([linear, linear, PUCK.yaw_damping])
    }
}

impl Puck {
    /// From [x, y, yaw, vx, vy, yaw rate].
    #[must_use]
    pub fn from_state(s: [f64; 6]) -> Self {
        Self {
            pose: [s[0], s[1], s[2]],
            velocity: [s[3], s[4], s[5]],
        }
    }

    /// As [x, y, yaw, vx, vy, yaw rate].
    #[must_use]
    pub fn state(&self) -> [f64; 6] {
        let ([x, y, yaw], [vx, vy, w]) = (self.pose, self.velocity);
        [x, y, yaw, vx, vy, w]
    }

    /// m/s.
    #[must_use]
    pub fn speed(&self) -> f64 {
        (self.velocity[0] * self.velocity[0] + self.velocity[1] * self.velocity[1]).sqrt()
    }

    /// Acceleration without contacts, under an air flow's force in N.
    #[inline(always)]
    pub fn free_acceleration(&self, damping: &Damping, air_n: [f64; 2]) -> [f64; 3] {
        let force = [air_n[0], air_n[1], 0.0];
        std::array::from_fn(|i| (force[i] - damping.0[i] * self.velocity[i]) * INVERSE_INERTIA[i])
    }

    /// One substep under a force (N, N, N m): semi-implicit Euler, damping implicit.
    #[inline(always)]
    pub fn advance(&mut self, damping: &Damping, force: [f64; 3]) {
        for i in 0..3 {
            let h = SUBSTEP_S * INVERSE_INERTIA[i];
            self.velocity[i] = (self.velocity[i] + h * force[i]) / (1.0 + h * damping.0[i]);
            self.pose[i] += SUBSTEP_S * self.velocity[i];
        }
    }
}
