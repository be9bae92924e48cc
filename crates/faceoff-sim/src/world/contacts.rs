//! The contact forces of one substep, solved jointly for all bodies: puck, mallets and *rims* (the walls around the table).
//!
//! Contacts are soft, as in MuJoCo: each wants a relative acceleration that pushes the overlapping bodies apart (*target*), and its
//! *regularisation* (1/kg) lets it miss that acceleration in proportion to the force. Each contact has three scalar constraints (*rows*):
//! along its normal and along two tangents. Vectors are in the table frame.

use super::{
    cone::{DIRECTIONS, solve_cone},
    impacts::ContactBody,
};
use crate::{
    model::DOFS,
    table::{
        contact_finder::ContactPoint,
        contact_law::{MALLET_INVERSE_INERTIA, Material},
        puck::INVERSE_INERTIA,
    },
};

/// Largest number of contacts: two rims and two mallets with the puck, and mallet with mallet.
pub const MAX_CONTACTS: usize = 5;
/// Largest number of rows: three for each contact.
const MAX_ROWS: usize = DIRECTIONS * MAX_CONTACTS;

/// Velocity of a point of the mallet's cylinder per velocity of each joint of its arm, m/rad: rows for x, y and z.
pub type MalletJacobian = [[f64; DOFS]; 3];

/// Motion of a mallet at a contact point.
#[derive(Debug, Clone, Copy)]
pub struct MalletMotion {
    /// The arm's Jacobian; `None` if the mallet's motion is imposed.
    pub jacobian: Option<MalletJacobian>,
    /// Velocity of the contact point, m/s.
    pub velocity: [f64; 3],
}

impl MalletMotion {
    /// Inverse inertia of an imposed mallet in the contact's equations, 1/kg. The challenge's own simulator solves them with the arm,
    /// although it overwrites the arm's motion.
    fn inverse_inertia(&self) -> f64 {
        if self.jacobian.is_some() {
            0.0
        } else {
            MALLET_INVERSE_INERTIA
        }
    }
}

/// One scalar constraint of a contact: along its normal or a tangent.
#[derive(Debug, Clone, Copy)]
struct Row {
    /// Relative velocity per velocity of the puck along x, y and yaw; without unit, and for yaw m/rad.
    puck_jacobian: [f64; 3],
    /// Relative velocity per joint velocity of each arm that takes part, m/rad.
    arm_jacobians: [Option<[f64; DOFS]>; 2],
    /// Desired relative acceleration, m/s².
    target: f64,
    /// 1/kg.
    regularisation: f64,
}

/// The contacts of one substep.
#[derive(Debug, Clone)]
pub struct Contacts {
    count: usize,
    rows: [Row; MAX_ROWS],
    /// Friction coefficient of each contact.
    friction: [f64; MAX_CONTACTS],
    /// The bodies that touch the puck, as bits of [`ContactBody`].
    touching: u8,
}

/// The two bodies of a contact. The puck's velocity is in m/s, m/s, rad/s.
#[derive(Debug, Clone, Copy)]
pub enum Pair<'a> {
    /// A rim and the puck.
    Rim { puck_velocity: &'a [f64; 3] },
    /// A mallet and the puck.
    Mallet {
        /// The mallet's robot, 0 or 1.
        robot: usize,
        mallet: &'a MalletMotion,
        puck_velocity: &'a [f64; 3],
    },
    /// The mallets of robots 0 and 1.
    Mallets {
        /// Both mallets.
        mallets: [&'a MalletMotion; 2],
    },
}

impl Contacts {
    pub fn none() -> Self {
        let row = Row {
            puck_jacobian: [0.0; 3],
            arm_jacobians: [None; 2],
            target: 0.0,
            regularisation: 0.0,
        };
        Self {
            count: 0,
            rows: [row; MAX_ROWS],
            friction: [0.0; MAX_CONTACTS],
            touching: 0,
        }
    }

    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The bodies that touch the puck, as bits of [`ContactBody`].
    pub fn touching(&self) -> u8 {
        self.touching
    }

    /// For each robot: does its arm take part in a contact?
    pub fn arms_in_contact(&self) -> [bool; 2] {
        let rows = &self.rows[..DIRECTIONS * self.count];
        [0, 1].map(|arm| rows.iter().any(|row| row.arm_jacobians[arm].is_some()))
    }

    /// Force on the puck (N, N, N m) of contacts in which no arm takes part, given the puck's acceleration without
    /// contact (m/s², m/s², rad/s²).
    pub fn solve_puck(&self, puck_acceleration: &[f64; 3]) -> [f64; 3] {
        self.solve(puck_acceleration, &[[0.0; DOFS]; 2], |_, torque| *torque)
            .puck
    }

    /// Adds a contact. The normal of `contact` points into the second body of `pair`.
    pub fn add(&mut self, contact: ContactPoint, material: &Material, pair: Pair<'_>) {
        let n = contact.normal;
        let impedance = material.impedance(contact.depth_m);
        let regularisation =
            Material::regularisation_per_inverse_inertia(impedance) * material.inverse_inertia;
        // Part of the target that comes from the depth, m/s².
        let push = material.stiffness_per_s2 * impedance * contact.depth_m;
        // Two choices match the recordings of the simulator of the 2023 Robot Air Hockey Challenge. The force acts inside the overlap,
        // which is millimetres deep. And there is an upright tangent: the puck does not move along z, but its friction
        // brakes a mallet that does, and shares the friction cone with the horizontal tangent.
        let scale = 1.0 / (n[0] * n[0] + n[1] * n[1]).sqrt();
        let horizontal = [-n[1] * scale, n[0] * scale, 0.0];
        let upward = [
            -n[2] * horizontal[1],
            n[2] * horizontal[0],
            n[0] * horizontal[1] - n[1] * horizontal[0],
        ];
        // Tangential velocity per yaw rate of the second body, m/rad.
        let spin_lever = -contact.lever_m;
        for (k, (direction, spin_lever, push)) in [
            (n, 0.0, push),
            (horizontal, spin_lever, 0.0),
            (upward, 0.0, 0.0),
        ]
        .into_iter()
        .enumerate()
        {
            let arm_jacobian = |sign: f64, mallet: &MalletMotion| {
                mallet.jacobian.map(|j| {
                    std::array::from_fn(|i| sign * dot(&direction, &[j[0][i], j[1][i], j[2][i]]))
                })
            };
            let mut row = Row {
                puck_jacobian: [0.0; 3],
                arm_jacobians: [None; 2],
                target: 0.0,
                regularisation,
            };
            let mut velocity = 0.0;
            if let Pair::Rim { puck_velocity } | Pair::Mallet { puck_velocity, .. } = pair {
                row.puck_jacobian = [direction[0], direction[1], spin_lever];
                velocity += dot(&row.puck_jacobian, puck_velocity);
            }
            match pair {
                Pair::Rim { .. } => {}
                Pair::Mallet { robot, mallet, .. } => {
                    row.arm_jacobians[robot] = arm_jacobian(-1.0, mallet);
                    row.regularisation += mallet.inverse_inertia();
                    velocity -= dot(&direction, &mallet.velocity);
                }
                Pair::Mallets { mallets } => {
                    for (robot, (mallet, sign)) in mallets.into_iter().zip([-1.0, 1.0]).enumerate()
                    {
                        row.arm_jacobians[robot] = arm_jacobian(sign, mallet);
                        velocity += sign * dot(&direction, &mallet.velocity);
                    }
                }
            }
            row.target = push - material.damping_per_s * velocity;
            self.rows[DIRECTIONS * self.count + k] = row;
        }
        self.touching |= match pair {
            Pair::Rim { .. } if n[1].abs() > n[0].abs() => ContactBody::LongRim.bit(),
            Pair::Rim { .. } => ContactBody::ShortRim.bit(),
            Pair::Mallet { robot: 0, .. } => ContactBody::Mallet(0).bit(),
            Pair::Mallet { .. } => ContactBody::Mallet(1).bit(),
            Pair::Mallets { .. } => 0,
        };
        self.friction[self.count] = material.friction;
        self.count += 1;
    }

    /// The contact forces, given the accelerations without contact. `respond` returns the joint accelerations that joint torques give to
    /// an arm (0 or 1).
    pub fn solve(
        &self,
        puck_acceleration: &[f64; 3],
        arm_acceleration: &[[f64; DOFS]; 2],
        respond: impl Fn(usize, &[f64; DOFS]) -> [f64; DOFS],
    ) -> ContactForces {
        let n = DIRECTIONS * self.count;
        let rows = &self.rows[..n];
        // Relative acceleration along each row per force along each row, 1/kg.
        let mut matrix = [[0.0; MAX_ROWS]; MAX_ROWS];
        let mut target = [0.0; MAX_ROWS];
        for (r, row) in rows.iter().enumerate() {
            let responses: [Option<[f64; DOFS]>; 2] =
                std::array::from_fn(|arm| row.arm_jacobians[arm].map(|j| respond(arm, &j)));
            target[r] = row.target - dot(&row.puck_jacobian, puck_acceleration);
            for arm in 0..2 {
                if let Some(jacobian) = &row.arm_jacobians[arm] {
                    target[r] -= dot(jacobian, &arm_acceleration[arm]);
                }
            }
            for (s, other) in rows.iter().enumerate() {
                let mut response_to_force: f64 = (0..3)
                    .map(|i| row.puck_jacobian[i] * INVERSE_INERTIA[i] * other.puck_jacobian[i])
                    .sum();
                for arm in 0..2 {
                    if let (Some(response), Some(jacobian)) =
                        (&responses[arm], &other.arm_jacobians[arm])
                    {
                        response_to_force += dot(response, jacobian);
                    }
                }
                matrix[s][r] = response_to_force;
            }
            matrix[r][r] += row.regularisation;
        }
        let force = solve_cone(&matrix, &target, &self.friction[..self.count]);
        let mut forces = ContactForces {
            puck: [0.0; 3],
            arm_torques: [[0.0; DOFS]; 2],
        };
        for (r, row) in rows.iter().enumerate() {
            for i in 0..3 {
                forces.puck[i] += row.puck_jacobian[i] * force[r];
            }
            for arm in 0..2 {
                if let Some(jacobian) = &row.arm_jacobians[arm] {
                    for i in 0..DOFS {
                        forces.arm_torques[arm][i] += jacobian[i] * force[r];
                    }
                }
            }
        }
        forces
    }
}

/// Forces of the contacts on puck and arms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactForces {
    /// Force and torque on the puck: N, N, N m.
    pub puck: [f64; 3],
    /// Joint torques on each arm, N m.
    pub arm_torques: [[f64; DOFS]; 2],
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
