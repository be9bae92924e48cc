//! What physically moves: nominal, or off by the season's model mismatch.

use crate::{
    dynamics::{
        arm::{Bodies, Kinematics, mass_matrix},
        lanes::{Lanes, gather},
        ldlt::Ldlt,
    },
    model::{DOFS, JOINTS, LINKS},
};

/// The robot as it really is: masses, gains, damping and dry friction. Made once per season and
/// shared by all episodes; every arm on the table is alike. The controller's feed-forward and the
/// agent's model stay nominal, whatever the plant.
#[derive(Debug, Clone, PartialEq)]
pub struct Plant {
    /// Factor on the masses and inertias of links 1…7, end effector and mallet.
    pub(crate) mass_scale: [f64; 9],
    /// Proportional gains, N m/rad.
    pub(crate) kp: [f64; JOINTS],
    /// Derivative gains, N m s/rad.
    pub(crate) kd: [f64; JOINTS],
    /// Viscous joint damping, N m s/rad.
    pub(crate) damping: [f64; JOINTS],
    /// Dry friction, N m.
    pub(crate) friction: [f64; JOINTS],
    /// Diagonal of the inverse joint-space inertia at q = 0, 1/(kg m²): scales the regularisation of
    /// the soft joint constraints.
    pub(crate) inverse_inertia: [f64; DOFS],
}

impl Plant {
    /// The plant of MODEL's tables.
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
        let factor = Ldlt::new(&mass_matrix(&kinematics, &bodies));
        let inverse_inertia = std::array::from_fn(|i| {
            let mut unit = [0.0; DOFS];
            unit[i] = 1.0;
            factor.solve(&unit)[i]
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

/// What moves several arms, which may be different ones.
#[derive(Debug, Clone, Copy)]
pub struct PlantLanes<T> {
    pub(crate) mass_scale: [T; 9],
    pub(crate) kp: [T; JOINTS],
    pub(crate) kd: [T; JOINTS],
    pub(crate) damping: [T; JOINTS],
}

impl<T: Lanes> PlantLanes<T> {
    /// Of the plant of each arm.
    #[inline(always)]
    pub fn gather<'a>(of: impl Fn(usize) -> &'a Plant) -> Self {
        Self {
            mass_scale: gather(|lane| &of(lane).mass_scale),
            kp: gather(|lane| &of(lane).kp),
            kd: gather(|lane| &of(lane).kd),
            damping: gather(|lane| &of(lane).damping),
        }
    }
}
