//! Substeps (1 ms) of the puck in a world without arms, or in one with an *imposed* mallet, whose motion the caller gives.

use super::{
    World,
    contact_detection::add_rims,
    contacts::{Contacts, MalletMotion, Pair},
};
use crate::table::{contact_finder, contact_law::MALLET, mallet_cylinder::MalletCylinder};

impl World {
    /// One substep of the puck of a world without arms.
    pub(super) fn advance_puck_alone(&mut self) {
        let mut contacts = Contacts::none();
        add_rims(&mut contacts, &self.puck);
        self.impacts
            .record_touching(contacts.touching(), self.substep, &self.puck);
        let force = (!contacts.is_empty()).then(|| {
            contacts.solve_puck(&self.puck.free_acceleration(&self.puck_damping, self.air_n))
        });
        self.advance_puck(force);
    }

    /// One substep of the puck with an imposed mallet.
    pub(super) fn advance_puck_with_imposed_mallet(&mut self) {
        let mut contacts = Contacts::none();
        add_rims(&mut contacts, &self.puck);
        if let Some(mallet) = self.imposed_mallet {
            let cylinder = MalletCylinder::upright(mallet.position);
            let puck = [self.puck.pose[0], self.puck.pose[1]];
            if let Some(touch) = contact_finder::mallet_and_puck(&cylinder, puck) {
                let motion = MalletMotion {
                    jacobian: None,
                    velocity: [mallet.velocity[0], mallet.velocity[1], 0.0],
                };
                contacts.add(
                    touch,
                    &MALLET,
                    Pair::Mallet {
                        robot: 0,
                        mallet: &motion,
                        puck_velocity: &self.puck.velocity,
                    },
                );
            }
        }
        self.impacts
            .record_touching(contacts.touching(), self.substep, &self.puck);
        let force = (!contacts.is_empty()).then(|| {
            contacts.solve_puck(&self.puck.free_acceleration(&self.puck_damping, self.air_n))
        });
        self.advance_puck(force);
    }

    /// Moves the puck by one substep under the air's force, damping and the force of contacts (N, N, N m).
    #[inline(always)]
    pub(super) fn advance_puck(&mut self, contact_force: Option<[f64; 3]>) {
        let mut force = [self.air_n[0], self.air_n[1], 0.0];
        if let Some(contact_force) = contact_force {
            for i in 0..3 {
                force[i] += contact_force[i];
            }
        }
        self.puck.advance(&self.puck_damping, force);
    }
}
