//! The *plant*: the physical properties of the simulated arm. They are nominal (the model that agents know) or changed by the season's
//! *model mismatch*, a perturbation that is drawn once per season.

use crate::{
    dynamics::{
        arm::{Bodies, Kinematics, mass_matrix},
        lanes::{Lanes, gather},
        ldlt::Ldlt,
    },
    model::{DOFS, JOINTS, LINKS},
};

/// The true robot: masses, gains, damping and dry friction. Created once per season and shared by all
/// episodes and by both arms. The controller's feed-forward and the agent's model are always nominal.
#[derive(Debug, Clone, PartialEq)]
pub struct Plant {
    /// Factors on mass and inertia of links 1…7, end effector and mallet.
    pub(crate) mass_scale: [f64; 9],
    /// Proportional gains of the joints' position controllers, N m/rad.
    pub(crate) kp: [f64; JOINTS],
    /// Derivative gains of the same controllers, N m s/rad.
    pub(crate) kd: [f64; JOINTS],
    /// Viscous joint damping, N m s/rad.
    pub(crate) damping: [f64; JOINTS],
    /// Largest torque ± of the joints' dry friction, N m.
    pub(crate) friction: [f64; JOINTS],
    /// Diagonal of the inverse joint-space inertia at joint positions 0, 1/(kg m²). It scales the regularisation of
    /// the soft joint constraints (dry friction and stops).
    pub(crate) inverse_inertia: [f64; DOFS],
}

impl Plant {
    /// The plant without model mismatch: the numbers of [`LINKS`].
    #[must_use]
    pub fn nominal() -> Self {
        Self::new(
            [1.0; 9],
            LINKS.map(|link| link.kp),
            LINKS.map(|link| link.kd),
            LINKS.map(|link| link.damping),
            LINKS.map(|link| link.friction_n_m),
        )
    }

    pub(crate) fn new(
        mass_scale: [f64; 9],
        kp: [f64; JOINTS],
        kd: [f64; JOINTS],
        damping: [f64; JOINTS],
        friction: [f64; JOINTS],
    ) -> Self {
        let kinematics = Kinematics::new(&[0.0; DOFS]);
        let bodies = Bodies::new(&kinematics).plant(&mass_scale);
        let factorised_mass = Ldlt::new(&mass_matrix(&kinematics, &bodies));
        let inverse_inertia = std::array::from_fn(|i| {
            let mut unit_torque = [0.0; DOFS];
            unit_torque[i] = 1.0;
            factorised_mass.solve(&unit_torque)[i]
        });
        Self {
            mass_scale,
            kp,
            kd,
            damping,
            friction,
            inverse_inertia,
        }
    }
}

/// The plants of several arms, which may differ, one per SIMD lane; fields as in [`Plant`].
#[derive(Debug, Clone, Copy)]
pub struct PlantLanes<T> {
    pub(crate) mass_scale: [T; 9],
    pub(crate) kp: [T; JOINTS],
    pub(crate) kd: [T; JOINTS],
    pub(crate) damping: [T; JOINTS],
}

impl<T: Lanes> PlantLanes<T> {
    /// Collects the plants of several arms.
    #[inline(always)]
    pub fn gather<'a>(plant: impl Fn(usize) -> &'a Plant) -> Self {
        Self {
            mass_scale: gather(|lane| &plant(lane).mass_scale),
            kp: gather(|lane| &plant(lane).kp),
            kd: gather(|lane| &plant(lane).kd),
            damping: gather(|lane| &plant(lane).damping),
        }
    }
}
