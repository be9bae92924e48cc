//! The law of soft contacts, as in MuJoCo, with the constants of the simulator of the 2023 Robot Air Hockey Challenge.
//!
//! A *constraint* wants the acceleration `stiffness · impedance · depth − damping · velocity`, where the *depth* of the overlap is the
//! constraint's error. The *impedance*, between 0 and 1, rises with the depth; the nearer it is to 1, the less the *regularisation* lets
//! the constraint miss that acceleration.

/// The constants of a pair of materials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Impedance at zero depth.
    pub impedance_0: f64,
    /// Impedance from a depth of 1 mm on.
    pub impedance_1: f64,
    /// Damping of the error, 1/s.
    pub damping_per_s: f64,
    /// Stiffness of the error, 1/s².
    pub stiffness_per_s2: f64,
    /// Inverse inertia that scales the regularisation, 1/kg.
    pub inverse_inertia: f64,
    /// Friction coefficient: largest tangential force over normal force.
    pub friction: f64,
}

/// Depth from which the impedance is constant, m; MuJoCo calls it the width.
pub(crate) const FULL_IMPEDANCE_DEPTH_M: f64 = 0.001;

/// Inverse inertia of the puck in the regularisation, 1/kg: one over its mass, averaged over three axes, along one
/// of which the puck cannot move (MuJoCo's estimate).
const PUCK_INVERSE_INERTIA: f64 = 200.0 / 3.0;

/// Inverse inertia of a mallet at the end of its arm, 1/kg.
pub const MALLET_INVERSE_INERTIA: f64 = 1.07;

/// Puck and rims (walls of the table): hard, and so rough that the puck never slips.
pub const RIM: Material = Material {
    impedance_0: 0.99,
    impedance_1: 0.999,
    damping_per_s: 2.0 / (0.999 * 0.0075),
    stiffness_per_s2: 1.0 / (0.999 * 0.999 * 0.0075 * 0.0075 * 0.1 * 0.1),
    inverse_inertia: PUCK_INVERSE_INERTIA,
    friction: 1e4,
};

/// Puck and mallet: soft.
pub const MALLET: Material = Material {
    impedance_0: 0.9,
    impedance_1: 0.95,
    damping_per_s: 2.0 / (0.95 * 0.02),
    stiffness_per_s2: 1.0 / (0.95 * 0.95 * 0.02 * 0.02 * 0.3 * 0.3),
    inverse_inertia: PUCK_INVERSE_INERTIA + MALLET_INVERSE_INERTIA,
    friction: 1.0,
};

/// Mallet and mallet: as puck and mallet, with the arms' inertia.
pub const MALLETS: Material = Material {
    inverse_inertia: 2.0 * MALLET_INVERSE_INERTIA,
    ..MALLET
};

/// Stops (ends of the range) and dry friction of the joints: MuJoCo's defaults.
pub const JOINT: Material = Material {
    impedance_0: 0.9,
    impedance_1: 0.95,
    damping_per_s: 2.0 / (0.95 * 0.02),
    stiffness_per_s2: 1.0 / (0.95 * 0.95 * 0.02 * 0.02),
    inverse_inertia: 1.0,
    friction: 0.0,
};

impl Material {
    /// The impedance at a depth (m).
    #[must_use]
    pub fn impedance(&self, depth_m: f64) -> f64 {
        // Share of the rise: two parabolas, which meet in the middle.
        let x = depth_m / FULL_IMPEDANCE_DEPTH_M;
        let share = if x >= 1.0 {
            1.0
        } else if x <= 0.5 {
            2.0 * x * x
        } else {
            1.0 - 2.0 * (1.0 - x) * (1.0 - x)
        };
        self.impedance_0 + (self.impedance_1 - self.impedance_0) * share
    }

    /// The regularisation for an inverse inertia of 1, at an impedance.
    #[must_use]
    pub fn regularisation_per_inverse_inertia(impedance: f64) -> f64 {
        (1.0 - impedance) / impedance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impedance_rises_from_first_to_second_value() {
        assert_eq!(RIM.impedance(0.0), 0.99);
        assert!((RIM.impedance(0.0005) - 0.9945).abs() < 1e-12);
        assert_eq!(RIM.impedance(0.002), 0.999);
        assert!((MALLET.impedance(0.00025) - (0.9 + 0.05 * 0.125)).abs() < 1e-12);
    }
}
