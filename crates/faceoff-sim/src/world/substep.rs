//! One millisecond of arms and puck.

use super::{
    Divergence, Runaway, World,
    bounds::{is_ordinary, is_ordinary_puck, is_runaway},
    contacts::{Contacts, MalletMotion, Pair},
    solver::{accelerations_in_contact, add, joint_accelerations},
};
use crate::{
    dynamics::{
        arm::{Bodies, Kinematics, controller_torques, damped, mass_matrix, plant_bias},
        lanes::Lanes,
        ldlt::Ldlt,
        spatial::Vec3,
    },
    model::{DOFS, JOINTS, SUBSTEP_S, SUBSTEPS},
    robot::controller::{filter_velocity, torque},
    table::{
        contact_finder::{self, Touch},
        contact_law::{MALLET, MALLETS, RIM},
        frames::{robot_from_table, side, table_from_robot},
        mallet_cylinder::MalletCylinder,
        puck::Puck,
    },
};
use wide::f64x2;

impl World {
    /// Advances by a control step, 20 substeps. `air` is called before each of them.
    pub fn control_step(&mut self, mut air: impl FnMut(&Puck) -> [f64; 2]) {
        for _ in 0..SUBSTEPS {
            self.air_n = air(&self.puck);
            self.substep();
        }
    }

    /// Advances by one substep, 1 ms. After 20 of them a new action is due; without one the last
    /// trajectory would be repeated, so [`World::command`] or [`World::hold`] first. A world that has come
    /// to the end of its bounds stands still.
    pub fn substep(&mut self) {
        if self.divergence.is_some() {
            return;
        }
        if self.imposed.is_some() {
            self.substep_imposed();
        } else {
            match self.arms.len() {
                0 => self.advance_puck_alone(),
                1 => self.substep_lanes::<f64>(),
                _ => self.substep_lanes::<f64x2>(),
            }
        }
        self.substep = (self.substep + 1) % SUBSTEPS;
    }

    /// One substep of all arms, `T::COUNT` of them, and the puck.
    fn substep_lanes<T: Lanes>(&mut self) {
        let arms = &mut self.arms;
        let plant = &self.plant;
        let q: [T; DOFS] = std::array::from_fn(|i| T::from_fn(|a| arms[a].q[i]));
        let dq: [T; DOFS] = std::array::from_fn(|i| T::from_fn(|a| arms[a].dq[i]));
        let dq_filtered: [T; JOINTS] =
            std::array::from_fn(|i| T::from_fn(|a| arms[a].dq_filtered[i]));
        let ddq: [T; JOINTS] = std::array::from_fn(|i| {
            T::from_fn(|a| arms[a].trajectory[self.substep].acceleration[i])
        });

        // One forward pass serves controller and plant.
        let kinematics = Kinematics::new(&q);
        let bodies = Bodies::new(&kinematics);
        let feed_forward =
            controller_torques(&kinematics, &bodies.controller(), &dq_filtered, &ddq);
        let bodies = bodies.plant(&plant.mass_scale);
        let bias = plant_bias(&kinematics, &bodies, &dq);
        let mass = mass_matrix(&kinematics, &bodies);

        // Torques of the controllers, less bias and damping.
        let mut load = [[0.0; DOFS]; 2];
        for (a, arm) in arms.iter_mut().enumerate() {
            let command = arm.limiter.limit(&arm.trajectory[self.substep]);
            let feed_forward = std::array::from_fn(|i| feed_forward[i].lane(a));
            arm.torque = torque(plant, &command, &arm.q, &arm.dq_filtered, &feed_forward);
            let ee = &kinematics.end_effector;
            let universal = arm.universal.torque(
                ee.x.lane(a),
                ee.y.lane(a),
                [arm.q[7], arm.q[8]],
                [arm.dq[7], arm.dq[8]],
            );
            for i in 0..JOINTS {
                load[a][i] = arm.torque[i] - bias[i].lane(a) - plant.damping[i] * arm.dq[i];
            }
            for i in 0..2 {
                load[a][7 + i] = universal[i] - bias[7 + i].lane(a);
            }
            arm.constraints.prepare(plant, &arm.q, &arm.dq);
            arm.ee_before = ee.origin.lane(a);
        }

        // Friction, stops and contacts.
        let contacts = find_contacts(&kinematics, &dq, &self.puck);
        let pushed = contacts.as_ref().map_or([false; 2], Contacts::pushed);
        if pushed != [false; 2] {
            self.pushed = pushed;
        }
        let free = || self.puck.free_acceleration(&self.puck_damping, self.air_n);
        let puck_force;
        let accelerations = match &contacts {
            Some(contacts) if pushed != [false; 2] => {
                let (accelerations, forces) =
                    accelerations_in_contact(arms, &mass, &load, contacts, &free());
                for (load, force) in load.iter_mut().zip(&forces.arms) {
                    add(load, force);
                }
                puck_force = Some(forces.puck);
                accelerations
            }
            contacts => {
                puck_force = contacts
                    .as_ref()
                    .map(|contacts| contacts.solve_puck(&free()));
                joint_accelerations(arms, &mass, &load)
            }
        };
        for (a, arm) in arms.iter().enumerate() {
            add(&mut load[a], &arm.constraints.torques(&accelerations[a]));
        }

        // Semi-implicit Euler, joint damping implicit.
        let load: [T; DOFS] = std::array::from_fn(|i| T::from_fn(|a| load[a][i]));
        let acceleration = Ldlt::new(&damped(&mass, &plant.damping)).solve(&load);
        for (a, arm) in arms.iter_mut().enumerate() {
            for i in 0..DOFS {
                arm.dq[i] += SUBSTEP_S * acceleration[i].lane(a);
                arm.q[i] += SUBSTEP_S * arm.dq[i];
            }
            filter_velocity(&mut arm.dq_filtered, &arm.dq);
        }
        let puck = self.puck;
        self.advance_puck(puck_force);
        let ordinary = self.arms.iter().all(is_ordinary) && is_ordinary_puck(&self.puck);
        if !ordinary && let Some(what) = self.extraordinary() {
            // Back to where all were inside.
            self.puck = puck;
            for (a, arm) in self.arms.iter_mut().enumerate() {
                arm.q = std::array::from_fn(|i| q[i].lane(a));
                arm.dq = std::array::from_fn(|i| dq[i].lane(a));
                arm.dq_filtered = std::array::from_fn(|i| dq_filtered[i].lane(a));
            }
            self.diverge(what);
        }
    }

    /// Looks closer at a state that is not an ordinary one: who is to blame if it gets worse, and whether
    /// it is out of bounds.
    #[cold]
    fn extraordinary(&mut self) -> Option<Runaway> {
        self.note_runaway(|_, arm| is_runaway(arm));
        let beyond = |(robot, arm)| {
            let joint = self.bounds.joint_beyond(arm)?;
            Some(Runaway::Joint { robot, joint })
        };
        let joint = self.arms.iter().enumerate().find_map(beyond);
        joint.or_else(|| self.bounds.puck_beyond(&self.puck).then_some(Runaway::Puck))
    }

    fn diverge(&mut self, what: Runaway) {
        let by = self.runaway.unwrap_or_else(|| match what {
            Runaway::Joint { robot, .. } => [0, 1].map(|a| a == robot),
            Runaway::Puck => self.pushed,
        });
        self.divergence = Some(Divergence { by, what });
    }

    fn advance_puck_alone(&mut self) {
        let mut contacts = Contacts::none();
        self.add_rims(&mut contacts);
        let force = (!contacts.is_empty()).then(|| {
            contacts.solve_puck(&self.puck.free_acceleration(&self.puck_damping, self.air_n))
        });
        self.advance_puck(force);
    }

    fn substep_imposed(&mut self) {
        let mut contacts = Contacts::none();
        self.add_rims(&mut contacts);
        if let Some(mallet) = self.imposed {
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
                        puck: &self.puck.velocity,
                    },
                );
            }
        }
        let force = (!contacts.is_empty()).then(|| {
            contacts.solve_puck(&self.puck.free_acceleration(&self.puck_damping, self.air_n))
        });
        self.advance_puck(force);
    }

    fn add_rims(&self, contacts: &mut Contacts) {
        contact_finder::rims([self.puck.pose[0], self.puck.pose[1]], |touch| {
            contacts.add(
                touch,
                &RIM,
                Pair::Rim {
                    puck: &self.puck.velocity,
                },
            );
        });
    }

    fn advance_puck(&mut self, contact: Option<[f64; 3]>) {
        let mut force = [self.air_n[0], self.air_n[1], 0.0];
        if let Some(contact) = contact {
            for i in 0..3 {
                force[i] += contact[i];
            }
        }
        self.puck.advance(&self.puck_damping, force);
    }
}

/// Contacts of this substep, `None` where nothing touches.
#[inline(always)]
fn find_contacts<T: Lanes>(
    kinematics: &Kinematics<T>,
    dq: &[T; DOFS],
    puck: &Puck,
) -> Option<Contacts> {
    let centre = kinematics.cylinder_centre();
    let puck_xy = [puck.pose[0], puck.pose[1]];
    let axis = kinematics.mallet_axis;
    let cylinders: [MalletCylinder; 2] = std::array::from_fn(|robot| {
        let lane = robot.min(T::COUNT - 1);
        let ([x, y, z], side) = (axis.lane(lane), side(lane));
        let centre = table_from_robot(lane, centre.lane(lane));
        MalletCylinder::along(centre, [side * x, side * y, z])
    });
    let touches: [Option<_>; 2] = std::array::from_fn(|robot| {
        (robot < T::COUNT)
            .then(|| contact_finder::mallet_and_puck(&cylinders[robot], puck_xy))
            .flatten()
    });
    let between_mallets = (T::COUNT == 2)
        .then(|| contact_finder::mallets(&cylinders[0], &cylinders[1]))
        .flatten();
    let mallets_touch = between_mallets.is_some() || touches != [None, None];
    if !mallets_touch && !contact_finder::near_rims(puck_xy) {
        return None;
    }
    let mut contacts = Contacts::none();
    contact_finder::rims(puck_xy, |touch| {
        contacts.add(
            touch,
            &RIM,
            Pair::Rim {
                puck: &puck.velocity,
            },
        );
    });
    if !mallets_touch {
        return (!contacts.is_empty()).then_some(contacts);
    }
    let mallet = |a: usize, touch: &Touch| {
        let lane = a.min(T::COUNT - 1);
        let side = side(lane);
        let [x, y, z] = robot_from_table(lane, touch.point);
        let jacobian = kinematics.jacobian_at(Vec3::splat([x, y, z]));
        let rows: [[f64; DOFS]; 3] = [
            std::array::from_fn(|i| side * jacobian[i].x.lane(lane)),
            std::array::from_fn(|i| side * jacobian[i].y.lane(lane)),
            std::array::from_fn(|i| jacobian[i].z.lane(lane)),
        ];
        let velocity = rows.map(|row| (0..DOFS).map(|i| row[i] * dq[i].lane(lane)).sum());
        MalletMotion {
            jacobian: Some(rows),
            velocity,
        }
    };
    for (robot, touch) in touches.into_iter().enumerate() {
        if let Some(touch) = touch {
            let pair = Pair::Mallet {
                robot,
                mallet: &mallet(robot, &touch),
                puck: &puck.velocity,
            };
            contacts.add(touch, &MALLET, pair);
        }
    }
    if let Some(touch) = between_mallets {
        let mallets = [&mallet(0, &touch), &mallet(1, &touch)];
        contacts.add(touch, &MALLETS, Pair::Mallets { mallets });
    }
    Some(contacts)
}
