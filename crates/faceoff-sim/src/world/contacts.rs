//! The contact forces of one substep, solved jointly for all bodies.

use super::{
    cone::{DIRECTIONS, solve_cone},
    impacts::ContactBody,
};
use crate::{
    model::DOFS,
    table::{
        contact_finder::Touch,
        contact_law::{MALLET_INVERSE_INERTIA, Material},
        puck::INVERSE_INERTIA,
    },
};

/// Two rims, two mallets on the puck, mallet on mallet.
pub const MAX_CONTACTS: usize = 5;
const MAX_ROWS: usize = DIRECTIONS * MAX_CONTACTS;

/// How the motion of a mallet's cylinder depends on its arm's joints, table frame: rows for x, y and
/// z.
pub type MalletJacobian = [[f64; DOFS]; 3];

/// Motion of a mallet at a contact point.
#[derive(Debug, Clone, Copy)]
pub struct MalletMotion {
    /// The arm's Jacobian; `None` if the mallet's motion is imposed.
    pub jacobian: Option<MalletJacobian>,
    /// m/s, table frame.
    pub velocity: [f64; 3],
}

impl MalletMotion {
    /// Inverse inertia of an imposed mallet in the contact's equations, 1/kg: the reference solves them with the arm,
    /// although it overwrites the arm's motion.
    fn inverse_inertia(&self) -> f64 {
        if self.jacobian.is_some() {
            0.0
        } else {
            MALLET_INVERSE_INERTIA
        }
    }
}

/// One scalar constraint: along a contact's normal or tangent.
#[derive(Debug, Clone, Copy)]
struct Row {
    puck: [f64; 3],
    arms: [Option<[f64; DOFS]>; 2],
    /// Desired relative acceleration, m/s².
    target: f64,
    regularisation: f64,
}

/// The contacts of one substep.
#[derive(Debug, Clone)]
pub struct Contacts {
    count: usize,
    rows: [Row; MAX_ROWS],
    friction: [f64; MAX_CONTACTS],
    /// The bodies that touch the puck, as bits of [`ContactBody`].
    touching: u8,
}

/// The two bodies of a contact.
#[derive(Debug, Clone, Copy)]
pub enum Pair<'a> {
    /// A rim and the puck.
    Rim { puck: &'a [f64; 3] },
    /// A mallet and the puck.
    Mallet {
        /// The mallet's robot, 0 or 1.
        robot: usize,
        mallet: &'a MalletMotion,
        puck: &'a [f64; 3],
    },
    /// Robot 1's mallet and robot 2's.
    Mallets {
        /// Both mallets.
        mallets: [&'a MalletMotion; 2],
    },
}

impl Contacts {
    pub fn none() -> Self {
        let row = Row {
            puck: [0.0; 3],
            arms: [None; 2],
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

    /// The arms in contact.
    pub fn pushed(&self) -> [bool; 2] {
        let rows = &self.rows[..DIRECTIONS * self.count];
        [0, 1].map(|arm| rows.iter().any(|row| row.arms[arm].is_some()))
    }

    /// Force on the puck (N, N, N m) of contacts that push no arm, at a given acceleration without
    /// contact.
    pub fn solve_puck(&self, puck_acceleration: &[f64; 3]) -> [f64; 3] {
        self.solve(puck_acceleration, &[[0.0; DOFS]; 2], |_, torque| *torque)
            .puck
    }

    /// Adds a contact, the touch's normal pointing into the pair's second body.
    pub fn add(&mut self, touch: Touch, material: &Material, pair: Pair<'_>) {
        let n = touch.normal;
        let impedance = material.impedance(touch.depth_m);
        let regularisation = Material::softness(impedance) * material.inverse_inertia;
        let push = material.stiffness_per_s2 * impedance * touch.depth_m;
        // MODEL leaves two choices open; these match the recordings. The force acts inside the overlap, which is
        // millimetres deep. And there is an upright tangent: the puck does not move along z, but its friction
        // brakes a mallet that does, and shares the cone with the horizontal tangent.
        let across = 1.0 / (n[0] * n[0] + n[1] * n[1]).sqrt();
        let horizontal = [-n[1] * across, n[0] * across, 0.0];
        let upward = [
            -n[2] * horizontal[1],
            n[2] * horizontal[0],
            n[0] * horizontal[1] - n[1] * horizontal[0],
        ];
        let spin_arm = -touch.lever_m;
        for (k, (direction, spin_arm, push)) in [
            (n, 0.0, push),
            (horizontal, spin_arm, 0.0),
            (upward, 0.0, 0.0),
        ]
        .into_iter()
        .enumerate()
        {
            let along_joints = |sign: f64, mallet: &MalletMotion| {
                mallet.jacobian.map(|j| {
                    std::array::from_fn(|i| sign * dot(&direction, &[j[0][i], j[1][i], j[2][i]]))
                })
            };
            let mut row = Row {
                puck: [0.0; 3],
                arms: [None; 2],
                target: 0.0,
                regularisation,
            };
            let mut velocity = 0.0;
            if let Pair::Rim { puck } | Pair::Mallet { puck, .. } = pair {
                row.puck = [direction[0], direction[1], spin_arm];
                velocity += dot(&row.puck, puck);
            }
            match pair {
                Pair::Rim { .. } => {}
                Pair::Mallet { robot, mallet, .. } => {
                    row.arms[robot] = along_joints(-1.0, mallet);
                    row.regularisation += mallet.inverse_inertia();
                    velocity -= dot(&direction, &mallet.velocity);
                }
                Pair::Mallets { mallets } => {
                    for (robot, (mallet, sign)) in mallets.into_iter().zip([-1.0, 1.0]).enumerate()
                    {
                        row.arms[robot] = along_joints(sign, mallet);
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

    /// Contact forces at given accelerations without contact. `respond` solves an arm's equations of
    /// motion for a joint torque. Returns the torques on the arms and the force on the puck.
    pub fn solve(
        &self,
        puck_acceleration: &[f64; 3],
        arm_acceleration: &[[f64; DOFS]; 2],
        respond: impl Fn(usize, &[f64; DOFS]) -> [f64; DOFS],
    ) -> ContactForces {
        let n = DIRECTIONS * self.count;
        let rows = &self.rows[..n];
        let mut matrix = [[0.0; MAX_ROWS]; MAX_ROWS];
        let mut target = [0.0; MAX_ROWS];
        for (r, row) in rows.iter().enumerate() {
            let responses: [Option<[f64; DOFS]>; 2] =
                std::array::from_fn(|arm| row.arms[arm].map(|j| respond(arm, &j)));
            target[r] = row.target - dot(&row.puck, puck_acceleration);
            for arm in 0..2 {
                if let Some(jacobian) = &row.arms[arm] {
                    target[r] -= dot(jacobian, &arm_acceleration[arm]);
                }
            }
            for (s, other) in rows.iter().enumerate() {
                let mut a: f64 = (0..3)
                    .map(|i| row.puck[i] * INVERSE_INERTIA[i] * other.puck[i])
                    .sum();
                for arm in 0..2 {
                    if let (Some(response), Some(jacobian)) = (&responses[arm], &other.arms[arm]) {
                        a += dot(response, jacobian);
                    }
                }
                matrix[s][r] = a;
            }
            matrix[r][r] += row.regularisation;
        }
        let force = solve_cone(&matrix, &target, &self.friction[..self.count]);
        let mut forces = ContactForces {
            puck: [0.0; 3],
            arms: [[0.0; DOFS]; 2],
        };
        for (r, row) in rows.iter().enumerate() {
            for i in 0..3 {
                forces.puck[i] += row.puck[i] * force[r];
            }
            for arm in 0..2 {
                if let Some(jacobian) = &row.arms[arm] {
                    for i in 0..DOFS {
                        forces.arms[arm][i] += jacobian[i] * force[r];
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
    /// N, N, N m, table frame.
    pub puck: [f64; 3],
    /// Joint torques, N m.
    pub arms: [[f64; DOFS]; 2],
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
