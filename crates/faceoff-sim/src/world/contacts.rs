//! The contact forces of one substep, solved together through the bodies that they share.

use crate::{
    robot::model::DOFS,
    table::{contact_finder::Touch, contact_law::Material, geometry::PUCK, puck::INVERSE_INERTIA},
};

/// Two rims, two mallets on the puck, mallet on mallet.
pub const MAX_CONTACTS: usize = 5;
const MAX_ROWS: usize = 2 * MAX_CONTACTS;

/// Rounds of the active-set search before falling back to Gauss–Seidel.
const ACTIVE_SET_ROUNDS: usize = 30;
/// Sweeps of the fallback, and the relative change at which it stops.
const SWEEPS: usize = 20_000;
const SWEEP_TOLERANCE: f64 = 1e-13;

/// How the plane motion of a mallet's cylinder depends on its arm's joints, table frame:
/// rows for x and y.
pub type MalletJacobian = [[f64; DOFS]; 2];

/// A mallet as a contact sees it.
#[derive(Debug, Clone, Copy)]
pub struct MalletMotion {
    /// Of the arm; `None` if the mallet's motion is imposed.
    pub jacobian: Option<MalletJacobian>,
    /// m/s, table frame.
    pub velocity: [f64; 2],
    /// Imposed acceleration, m/s², table frame; zero for an arm's mallet.
    pub acceleration: [f64; 2],
}

/// One scalar constraint: along a contact's normal or tangent.
#[derive(Debug, Clone, Copy)]
struct Row {
    puck: [f64; 3],
    arms: [Option<[f64; DOFS]>; 2],
    /// Desired relative acceleration, less the imposed one, m/s².
    target: f64,
    regularisation: f64,
}

/// The contacts of one substep.
#[derive(Debug, Clone)]
pub struct Contacts {
    count: usize,
    rows: [Row; MAX_ROWS],
    friction: [f64; MAX_CONTACTS],
}

/// Who moves on the two sides of a contact.
#[derive(Debug, Clone, Copy)]
pub enum Pair<'a> {
    /// A rim and the puck.
    Rim {
        /// Puck's velocity.
        puck: &'a [f64; 3],
    },
    /// A mallet and the puck.
    Mallet {
        /// The mallet's robot, 0 or 1.
        robot: usize,
        /// The mallet.
        mallet: &'a MalletMotion,
        /// Puck's velocity.
        puck: &'a [f64; 3],
    },
    /// Robot 1's mallet and robot 2's.
    Mallets {
        /// Both mallets.
        mallets: [&'a MalletMotion; 2],
    },
}

impl Contacts {
    /// No contact.
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
        }
    }

    /// Is nothing in contact?
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Does a contact push an arm?
    pub fn move_arms(&self) -> bool {
        self.rows[..2 * self.count]
            .iter()
            .any(|row| row.arms.iter().any(Option::is_some))
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
        let t = [-n[1], n[0]];
        let impedance = material.impedance(touch.depth_m);
        let regularisation = Material::softness(impedance) * material.inverse_inertia;
        let push = material.stiffness_per_s2 * impedance * touch.depth_m;
        for (k, (direction, spin_arm, push)) in [(n, 0.0, push), (t, -PUCK.radius_m, 0.0)]
            .into_iter()
            .enumerate()
        {
            let along = |v: [f64; 2]| direction[0] * v[0] + direction[1] * v[1];
            let along_joints = |sign: f64, mallet: &MalletMotion| {
                mallet
                    .jacobian
                    .map(|j| std::array::from_fn(|i| sign * along([j[0][i], j[1][i]])))
            };
            let mut row = Row {
                puck: [0.0; 3],
                arms: [None; 2],
                target: 0.0,
                regularisation,
            };
            let mut velocity = 0.0;
            let mut imposed = 0.0;
            if let Pair::Rim { puck } | Pair::Mallet { puck, .. } = pair {
                row.puck = [direction[0], direction[1], spin_arm];
                velocity += along([puck[0], puck[1]]) + spin_arm * puck[2];
            }
            match pair {
                Pair::Rim { .. } => {}
                Pair::Mallet { robot, mallet, .. } => {
                    row.arms[robot] = along_joints(-1.0, mallet);
                    velocity -= along(mallet.velocity);
                    imposed -= along(mallet.acceleration);
                }
                Pair::Mallets { mallets } => {
                    for (robot, (mallet, sign)) in mallets.into_iter().zip([-1.0, 1.0]).enumerate()
                    {
                        row.arms[robot] = along_joints(sign, mallet);
                        velocity += sign * along(mallet.velocity);
                        imposed += sign * along(mallet.acceleration);
                    }
                }
            }
            row.target = push - material.damping_per_s * velocity - imposed;
            self.rows[2 * self.count + k] = row;
        }
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
        let n = 2 * self.count;
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

/// What the contacts do to puck and arms.
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

#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    Open,
    Sticks,
    /// With the sign of the tangential force.
    Slips(f64),
}

type Matrix = [[f64; MAX_ROWS]; MAX_ROWS];

/// Solves `matrix · f = target` where each contact's normal force is not negative and its tangential
/// force within friction times the normal force; rows alternate normal, tangent.
fn solve_cone(matrix: &Matrix, target: &[f64; MAX_ROWS], friction: &[f64]) -> [f64; MAX_ROWS] {
    let mut states = [State::Sticks; MAX_CONTACTS];
    let mut force = [0.0; MAX_ROWS];
    for _ in 0..ACTIVE_SET_ROUNDS {
        force = solve_states(matrix, target, friction, &states);
        let mut changed = false;
        for (c, &mu) in friction.iter().enumerate() {
            let (n, t) = (2 * c, 2 * c + 1);
            let missing = |r: usize| target[r] - dot(&matrix[r], &force);
            let limit = mu * force[n];
            let next = match states[c] {
                State::Open if missing(n) > 0.0 => State::Sticks,
                State::Open => State::Open,
                _ if force[n] < 0.0 => State::Open,
                State::Sticks if force[t].abs() > limit => State::Slips(force[t].signum()),
                State::Slips(sign) if missing(t) * sign < 0.0 => State::Sticks,
                state => state,
            };
            changed |= next != states[c];
            states[c] = next;
        }
        if !changed {
            return force;
        }
    }
    sweep(matrix, target, friction, force)
}

/// Solves the linear system that a set of states leaves, by elimination with pivoting.
fn solve_states(
    matrix: &Matrix,
    target: &[f64; MAX_ROWS],
    friction: &[f64],
    states: &[State; MAX_CONTACTS],
) -> [f64; MAX_ROWS] {
    let n = 2 * friction.len();
    let mut a = *matrix;
    let mut x = *target;
    for (c, &mu) in friction.iter().enumerate() {
        let (i, j) = (2 * c, 2 * c + 1);
        let fixed = |row: &mut [f64; MAX_ROWS], rhs: &mut f64, k: usize| {
            *row = [0.0; MAX_ROWS];
            row[k] = 1.0;
            *rhs = 0.0;
        };
        match states[c] {
            State::Open => {
                fixed(&mut a[i], &mut x[i], i);
                fixed(&mut a[j], &mut x[j], j);
            }
            State::Sticks => {}
            State::Slips(sign) => {
                fixed(&mut a[j], &mut x[j], j);
                a[j][i] = -sign * mu;
            }
        }
    }
    for k in 0..n {
        let mut pivot = k;
        for r in k + 1..n {
            if a[r][k].abs() > a[pivot][k].abs() {
                pivot = r;
            }
        }
        a.swap(k, pivot);
        x.swap(k, pivot);
        for r in k + 1..n {
            let factor = a[r][k] / a[k][k];
            for c in k..n {
                a[r][c] -= factor * a[k][c];
            }
            x[r] -= factor * x[k];
        }
    }
    for k in (0..n).rev() {
        for c in k + 1..n {
            x[k] -= a[k][c] * x[c];
        }
        x[k] /= a[k][k];
    }
    x
}

/// Projected Gauss–Seidel, which always converges, if slowly.
#[cold]
fn sweep(
    matrix: &Matrix,
    target: &[f64; MAX_ROWS],
    friction: &[f64],
    start: [f64; MAX_ROWS],
) -> [f64; MAX_ROWS] {
    let mut force = start;
    for _ in 0..SWEEPS {
        let mut change: f64 = 0.0;
        let mut size: f64 = 0.0;
        for (c, &mu) in friction.iter().enumerate() {
            for r in [2 * c, 2 * c + 1] {
                let solved = force[r] + (target[r] - dot(&matrix[r], &force)) / matrix[r][r];
                let next = if r % 2 == 0 {
                    solved.max(0.0)
                } else {
                    let limit = mu * force[2 * c];
                    solved.clamp(-limit, limit)
                };
                change = change.max((next - force[r]).abs());
                size = size.max(next.abs());
                force[r] = next;
            }
        }
        if change <= SWEEP_TOLERANCE * size {
            break;
        }
    }
    force
}
